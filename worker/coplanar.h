/* Surfaces without rounding: whether two lie in one plane or other surface, and which of two flat ones a ray meets
 * first. */
#ifndef FARM_WORKER_COPLANAR_H
#define FARM_WORKER_COPLANAR_H

#include <stdbool.h>
#include <stdint.h>

#include "worker/ray.h"

/* Of two primitives, or of their parts (as in struct hit), without rounding: flat ones in one plane. What is round lies
 * in the same sphere, in a cylinder of the same axis and radius, or in a cone with the same ends. */
bool are_in_one_surface(const struct scene *scene, uint32_t a, uint32_t part_of_a, uint32_t b,
                        uint32_t part_of_b);

/* Tells in *order by its sign, or 0, which of the two planes the ray's line crosses first; false: one of
 * them is round, or along the ray. */
bool compare_flats(const struct scene *scene, const struct ray *ray, uint32_t a, uint32_t part_of_a,
                   uint32_t b, uint32_t part_of_b, int *order);

#endif
