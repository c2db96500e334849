/* One call for all kinds of primitive. */
#ifndef FARM_WORKER_PRIMITIVE_H
#define FARM_WORKER_PRIMITIVE_H

#include "worker/box.h"
#include "worker/cone.h"
#include "worker/planar.h"
#include "worker/sphere.h"
#include "worker/triangle.h"

/* The three vertex indices of a triangle or patch. */
static inline const uint32_t *corner_indices(const struct scene *scene, uint32_t id)
{
    uint32_t index = primitive_index(id);
    if (primitive_kind(id) == PRIMITIVE_PATCH) return scene_patches(scene)[index].vertex;
    return scene_triangles(scene)[index].vertex;
}

/* Not for planes, which have no bounds. */
static inline struct bounds primitive_bounds(const struct scene *scene, uint32_t id)
{
    uint32_t index = primitive_index(id);
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        return sphere_bounds(&scene_spheres(scene)[index]);
    case PRIMITIVE_BOX:
        return box_bounds(&scene_boxes(scene)[index]);
    case PRIMITIVE_CONE:
        return cone_bounds(&scene_cones(scene)[index]);
    case PRIMITIVE_DISC:
        return disc_bounds(&scene_discs(scene)[index]);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_PLANE:
    case PRIMITIVE_KINDS:
        break;
    }
    const uint32_t *corner = corner_indices(scene, id);
    const struct vec3 *vertices = scene_vertices(scene);
    return triangle_bounds(&vertices[corner[0]], &vertices[corner[1]], &vertices[corner[2]]);
}

/*
 * Where the ray's line crosses the primitive, less the place where the ray starts when it starts on
 * this one. *exact is increased by the number of predicates that needed exact arithmetic.
 */
static inline struct crossings primitive_crossings(const struct scene *scene, uint32_t id,
                                                   const struct ray *ray, const struct shear *shear,
                                                   uint64_t *exact)
{
    uint32_t index = primitive_index(id);
    bool leaving = id == ray->from;
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        return sphere_crossings(&scene_spheres(scene)[index], ray, leaving);
    case PRIMITIVE_BOX:
        return box_crossings(&scene_boxes(scene)[index], ray, leaving);
    case PRIMITIVE_CONE:
        return cone_crossings(&scene_cones(scene)[index], ray, leaving);
    case PRIMITIVE_DISC:
        return leaving ? NO_CROSSINGS : disc_crossings(&scene_discs(scene)[index], ray);
    case PRIMITIVE_PLANE:
        return leaving ? NO_CROSSINGS : plane_crossings(&scene_planes(scene)[index], ray);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    if (leaving) return NO_CROSSINGS;
    const uint32_t *corner = corner_indices(scene, id);
    const struct vec3 *vertices = scene_vertices(scene);
    return triangle_crossings(&vertices[corner[0]], &vertices[corner[1]], &vertices[corner[2]],
                              &ray->origin, shear, exact);
}

#endif
