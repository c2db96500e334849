/* Surfaces without rounding: whether two lie in one plane or other surface, and which of two flat ones a ray meets
 * first. */
#ifndef FARM_WORKER_COPLANAR_H
#define FARM_WORKER_COPLANAR_H

#include <stdbool.h>
#include <stdint.h>

#include "worker/ray.h"

/* In what two primitives lie, or parts of them (as in struct hit). One that is round: the same sphere, a cylinder of
 * the same axis and radius, or a cone with the same ends. */
enum surfaces { SURFACES_TWO, SURFACES_ONE_PLANE, SURFACES_ONE_ROUND };

/* Without rounding. */
enum surfaces surfaces_of(const struct scene *scene, uint32_t a, uint32_t part_of_a, uint32_t b,
                          uint32_t part_of_b);

static inline bool are_in_one_surface(const struct scene *scene, uint32_t a, uint32_t part_of_a,
                                      uint32_t b, uint32_t part_of_b)
{
    return surfaces_of(scene, a, part_of_a, b, part_of_b) != SURFACES_TWO;
}

/* Tells in *order by its sign, or 0, which of the two planes the ray's line crosses first; false: one of
 * them is round, or along the ray. */
bool compare_flats(const struct scene *scene, const struct ray *ray, uint32_t a, uint32_t part_of_a,
                   uint32_t b, uint32_t part_of_b, int *order);

#endif
