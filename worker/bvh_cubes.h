/* Counts boxes by the grid cubes that their centres lie in, to find where they are crowded. */
#ifndef FARM_WORKER_BVH_CUBES_H
#define FARM_WORKER_BVH_CUBES_H

#include <math.h>
#include <stdint.h>

#include "worker/bounds.h"

/* This many boxes in one cube are a crowd. */
#define CROWD 16

struct cubes {
    uint32_t *counts; /* hash table, owned */
    uint32_t mask;
};

/* The cube of a regular grid that the centre of a box lies in. Its edges are 2^exponent long. `center` is in the
 * middle of a cube, as many scenes are centred at the origin. */
struct cube {
    const struct bounds *box;
    const double *center; /* [3] */
    int exponent;
};

/* The cube with edges longer than the largest extent of the box, by a factor of up to 2. */
static inline struct cube cube_around(const struct bounds *box, const double center[3])
{
    struct cube cube = {box, center, 0};
    frexp(bounds_size(box), &cube.exponent);
    return cube;
}

/* Counters for this many boxes, at least four for each: two cubes may share one. */
struct cubes cubes_for(uint32_t boxes);

/* Counts one more box in the cube. */
void cubes_count(struct cubes *cubes, struct cube cube);

/* The number of boxes counted in this cube. */
uint32_t cubes_crowd(const struct cubes *cubes, struct cube cube);
void cubes_free(struct cubes *cubes);

#endif
