/* What the kinds of primitive have in common for the kernel. */
#ifndef FARM_WORKER_SHAPE_H
#define FARM_WORKER_SHAPE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "common/extremes.h"
#include "common/vec.h"
#include "worker/exact.h"
#include "worker/ray.h"

/* INFINITY is a float. */
#define INFINITE HUGE_VAL

/* A box around a primitive; some roundings tight, the BVH rounds it outward. */
struct bounds {
    double min[3], max[3];
};

/* Around nothing. */
#define BOUNDS_NONE                                                                                \
    ((struct bounds){{INFINITE, INFINITE, INFINITE}, {-INFINITE, -INFINITE, -INFINITE}})

static inline void bounds_add(struct bounds *all, const struct bounds *more)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        all->min[axis] = smaller_number(all->min[axis], more->min[axis]);
        all->max[axis] = larger_number(all->max[axis], more->max[axis]);
    }
}

/* The largest extent. */
static inline double bounds_size(const struct bounds *box)
{
    double size = 0;
    for (unsigned axis = 0; axis < 3; axis++)
        size = larger_number(size, box->max[axis] - box->min[axis]);
    return size;
}

static inline double bounds_middle(const struct bounds *box, unsigned axis)
{
    return box->min[axis] / 2 + box->max[axis] / 2;
}

/*
 * Where a ray's line crosses a primitive: a surface at most once, a convex solid at most twice (in,
 * then out). A place that does not count has t = NOT_CROSSED; the caller applies 0 < t < t_max.
 */
struct crossings {
    double t[2];
    uint32_t part[2];
    double u, v; /* triangle, patch: weights of vertex 1 and 2 */
};

#define NOT_CROSSED  (-INFINITE)
#define NO_CROSSINGS ((struct crossings){.t = {NOT_CROSSED, NOT_CROSSED}})

/* By this share of it a way out may differ from where the ray, whose origin is rounded, leaves the
 * solid; what differs more is taken for what it says. */
#define WAY_OUT_ERROR 0x1p-20

/* What of a ray's crossings matters. */
struct purpose {
    bool any;        /* not where between 0 and t_max they are, but how many */
    double farthest; /* nothing beyond; t_max at most */
};

#define ALL_CROSSINGS ((struct purpose){false, INFINITE})

static inline struct crossings one_crossing(double t)
{
    return (struct crossings){.t = {t, NOT_CROSSED}};
}

/* Where a ray starts, surfaces may be found that it has passed (worker/order.h): only so close, in units of its
 * coordinates. Rays that meet a flat surface at less than 2^-33 may cross it farther away; of a round one the other
 * side may be as close. */
#define START_REACH 0x1p-20

static inline bool is_near_start(const struct ray *ray, double t)
{
    return ray->from != PRIMITIVE_NONE && t > 0 &&
           t * vec_largest(ray->direction) < START_REACH * vec_largest(ray->origin);
}

/* No nearer than any crossing for which that is so. */
static inline double start_reach(const struct ray *ray)
{
    if (ray->from == PRIMITIVE_NONE) return 0;
    return 2 * START_REACH * vec_largest(ray->origin) / vec_largest(ray->direction);
}

_Static_assert(sizeof(struct vec3) == 3 * sizeof(double), "vec_component() steps over doubles");

/* x, y or z for axis 0, 1 or 2. */
static inline double vec_component(const struct vec3 *v, unsigned axis)
{
    return *(const double *)(const void *)((const char *)v + axis * sizeof(double));
}

#endif
