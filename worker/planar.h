/* Ray and plane, ray and disc. */
#ifndef FARM_WORKER_PLANAR_H
#define FARM_WORKER_PLANAR_H

#include "worker/shape.h"

/* The plane that a plane or a disc lies in. */
struct supporting_plane {
    struct vec3 point, normal; /* normal: unit length */
};

static inline struct supporting_plane supporting_plane(const struct scene *scene, uint32_t id)
{
    uint32_t index = primitive_index(id);
    if (primitive_kind(id) == PRIMITIVE_DISC) {
        const struct disc *disc = &scene_discs(scene)[index];
        return (struct supporting_plane){disc->center, disc->normal};
    }
    const struct plane *plane = &scene_planes(scene)[index];
    return (struct supporting_plane){plane->point, plane->normal};
}

/*
 * The parameter at which the ray crosses the plane, with an error of at most 2 u + 2^-54, also if it is
 * within 1e-15 of being parallel; NOT_CROSSED if it is parallel, in the plane or not.
 */
double plane_distance(struct vec3 point, struct vec3 normal, const struct ray *ray);

/* The same before it is rounded. */
struct dd plane_parameter(struct vec3 point, struct vec3 normal, const struct ray *ray);

static inline struct crossings plane_crossings(const struct plane *plane, const struct ray *ray)
{
    return one_crossing(plane_distance(plane->point, plane->normal, ray));
}

/*
 * Half extents of a circle. Along an axis it is the radius times the sine of the angle between normal and
 * axis, computed from the other two components: 1 - n^2 would cancel.
 */
static inline void circle_extent(struct vec3 unit_normal, double radius, double extent[3])
{
    struct vec3 n = unit_normal;
    extent[0] = radius * sqrt(n.y * n.y + n.z * n.z);
    extent[1] = radius * sqrt(n.x * n.x + n.z * n.z);
    extent[2] = radius * sqrt(n.x * n.x + n.y * n.y);
}

static inline struct bounds disc_bounds(const struct disc *disc)
{
    double extent[3];
    struct bounds bounds;
    circle_extent(disc->normal, disc->radius, extent);
    for (unsigned axis = 0; axis < 3; axis++) {
        double center = vec_component(&disc->center, axis);
        bounds.min[axis] = center - extent[axis];
        bounds.max[axis] = center + extent[axis];
    }
    return bounds;
}

/*
 * The crossing with a disc, whose rim belongs to it. Whether the ray meets it is decided exactly. One that does not
 * matter for the purpose may be left out; if only the number matters, t may be inexact, but not near the ray's start.
 */
struct crossings disc_crossings(const struct disc *disc, const struct ray *ray,
                                const struct purpose *purpose, uint64_t *exact);

/* The point at which the ray crosses a plane, relative to the plane's point. */
struct dd3 plane_point(struct vec3 point, struct vec3 normal, const struct ray *ray);

#endif
