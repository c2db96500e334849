/* Functions for primitives of any kind. */
#ifndef FARM_WORKER_PRIMITIVE_H
#define FARM_WORKER_PRIMITIVE_H

#include "worker/triangle.h"

/* The ids of the planes, which are tested for every ray, are consecutive. */
static inline uint32_t plane_ids_end(const struct scene *scene)
{
    return primitive_id(PRIMITIVE_PLANE, (uint32_t)scene->primitives[PRIMITIVE_PLANE].count);
}

/* The box around a primitive; not for planes, which have none. */
struct bounds primitive_bounds(const struct scene *scene, uint32_t id);

/* The crossing of the ray's line with the triangle; primitive_crossings() says what is left out. */
struct crossings triangle_crossings_ahead(const struct scene *scene, uint32_t id,
                                          const uint32_t corner[3], const struct ray *ray,
                                          const struct shear *shear, const struct purpose *purpose,
                                          uint64_t *exact);

/* Whether primitive_crossings() certainly has none with the primitive that the ray starts on, as that is flat, or as
 * the ray goes outward from it. */
bool never_meets_its_start(const struct scene *scene, const struct ray *ray);

static inline bool is_left_behind(const struct scene *scene, uint32_t id, const struct ray *ray)
{
    return id == ray->from && never_meets_its_start(scene, ray);
}

/*
 * The crossings of the ray's line with the primitive, without the one at the ray's start if the ray starts on
 * it. What does not matter for the purpose may be left out. Adds to *exact the number of predicates that
 * needed exact arithmetic.
 */
struct crossings primitive_crossings(const struct scene *scene, uint32_t id, const struct ray *ray,
                                     const struct shear *shear, const struct purpose *purpose,
                                     uint64_t *exact);

#endif
