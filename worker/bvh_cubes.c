#include "worker/bvh_cubes.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"

struct cubes cubes_for(uint32_t boxes)
{
    uint32_t mask = 1;
    while (mask < 4 * (uint64_t)boxes && mask < UINT32_MAX / 2)
        mask = 2 * mask + 1;
    return (struct cubes){allocate_zeroed((size_t)mask + 1, sizeof(uint32_t)), mask};
}

/* The number of a cube along an axis; 0, the middle one, if it is too far away to be numbered. */
static int64_t place_of(double distance, int exponent)
{
    double place = floor(ldexp(distance, -exponent) + 0.5);
    return fabs(place) < 0x1p62 ? (int64_t)place : 0;
}

/* The counter of a cube: a hash of its position in its grid, and of its size. */
static uint32_t *counter_of(const struct cubes *cubes, struct cube cube)
{
    uint64_t hash = (uint64_t)(int64_t)cube.exponent;
    for (unsigned axis = 0; axis < 3; axis++) {
        double distance = bounds_middle(cube.box, axis) - cube.center[axis];
        /* An odd factor near 2^64 divided by the golden ratio: D. Knuth, TAOCP 3, 6.4. */
        hash = (hash ^ (uint64_t)place_of(distance, cube.exponent)) * UINT64_C(0x9e3779b97f4a7c15);
        hash ^= hash >> 32;
    }
    return &cubes->counts[hash & cubes->mask];
}

void cubes_count(struct cubes *cubes, struct cube cube)
{
    ++*counter_of(cubes, cube);
}

uint32_t cubes_crowd(const struct cubes *cubes, struct cube cube)
{
    return *counter_of(cubes, cube);
}

void cubes_free(struct cubes *cubes)
{
    free(cubes->counts);
}
