/* Where boxes are crowded, counted by the cubes that their middles are in. */
#ifndef FARM_WORKER_BVH_CUBES_H
#define FARM_WORKER_BVH_CUBES_H

#include <math.h>
#include <stdint.h>

#include "worker/shape.h"

/* So many boxes in one cube are a crowd. */
#define CROWD 16

struct cubes {
    uint16_t *counts; /* owned; of more than it can hold, the most that it can */
    uint32_t mask;
};

/* A box's middle, from a centre, is in a cube with edges of 2^exponent, one of a grid. The centre is in the middle of
 * a cube: many scenes have theirs in the origin. */
struct cube {
    const struct bounds *box;
    const double *center; /* [3] */
    int exponent;
};

/* One that is as wide as the box, or up to twice that. */
static inline struct cube cube_around(const struct bounds *box, const double center[3])
{
    struct cube cube = {box, center, 0};
    frexp(bounds_size(box), &cube.exponent);
    return cube;
}

/* For so many boxes. Two cubes may be taken for one: there are four counters for each box. */
struct cubes cubes_for(uint32_t boxes);
void cubes_count(struct cubes *cubes, struct cube cube);
/* How many of those that were counted are in that one; UINT16_MAX at most. */
uint32_t cubes_crowd(const struct cubes *cubes, struct cube cube);
void cubes_free(struct cubes *cubes);

#endif
