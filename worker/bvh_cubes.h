/* Where boxes are crowded, counted by the cubes that their middles are in. */
#ifndef FARM_WORKER_BVH_CUBES_H
#define FARM_WORKER_BVH_CUBES_H

#include <stdbool.h>
#include <stdint.h>

#include "worker/shape.h"

/* So many boxes in one cube are a crowd. */
#define CROWD 16

struct cubes {
    uint8_t *counts; /* owned; up to CROWD */
    uint32_t mask;
};

/* A box's middle, from a centre, is in a cube with edges of 2^exponent, one of a grid. */
struct cube {
    const struct bounds *box;
    const double *center; /* [3] */
    int exponent;
};

/* For so many boxes. Two cubes may be taken for one: there are four counters for each box. */
struct cubes cubes_for(uint32_t boxes);
void cubes_count(struct cubes *cubes, struct cube cube);
bool cubes_are_crowded(const struct cubes *cubes, struct cube cube);
void cubes_free(struct cubes *cubes);

#endif
