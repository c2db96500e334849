/* Ray and plane, ray and disc. */
#ifndef FARM_WORKER_PLANAR_H
#define FARM_WORKER_PLANAR_H

#include "worker/shape.h"

/*
 * Where the ray crosses the plane, with an error of at most 2 u + 2^-54, also when it runs along
 * the plane but for 1e-15; NOT_CROSSED when it is parallel, whether in the plane or not.
 */
double plane_distance(struct vec3 point, struct vec3 normal, const struct ray *ray);

/* The same before it is rounded. */
struct dd plane_parameter(struct vec3 point, struct vec3 normal, const struct ray *ray);

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

/* The rim belongs to the disc, and whether the ray meets it is decided without error. */
struct crossings disc_crossings(const struct disc *disc, const struct ray *ray, uint64_t *exact);

/* Where the ray crosses a plane, seen from its point. */
struct dd3 plane_point(struct vec3 point, struct vec3 normal, const struct ray *ray);

#endif
