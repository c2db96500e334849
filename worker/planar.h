/* Ray and plane, ray and disc. */
#ifndef FARM_WORKER_PLANAR_H
#define FARM_WORKER_PLANAR_H

#include "worker/shape.h"

/* NOT_CROSSED when the ray is parallel to the plane, whether in it or not. */
static inline double plane_distance(struct vec3 point, struct vec3 normal, const struct ray *ray)
{
    double speed = vec_dot(ray->direction, normal);
    if (speed == 0) return NOT_CROSSED;
    return vec_dot(vec_sub(point, ray->origin), normal) / speed;
}

static inline struct crossings plane_crossings(const struct plane *plane, const struct ray *ray)
{
    return one_crossing(plane_distance(plane->point, plane->normal, ray));
}

/* A circle's extent along an axis is the radius times the sine of the normal's angle to that axis,
 * taken from the two other components: 1 - n^2 would cancel. */
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

/* The rim belongs to the disc. */
static inline struct crossings disc_crossings(const struct disc *disc, const struct ray *ray)
{
    double t = plane_distance(disc->center, disc->normal, ray);
    struct vec3 f = vec_sub(ray->origin, disc->center);
    struct vec3 p = vec_add_scaled(f, ray->direction, t);
    if (!(vec_dot(p, p) <= disc->radius * disc->radius)) return NO_CROSSINGS;
    return one_crossing(t);
}

#endif
