/* What all kinds of primitive have in common in the kernel. */
#ifndef FARM_WORKER_SHAPE_H
#define FARM_WORKER_SHAPE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "common/extremes.h"
#include "common/vec.h"
#include "worker/exact.h"
#include "worker/ray.h"

/* Infinity as a double; INFINITY is a float. */
#define INFINITE HUGE_VAL

/* A box around a primitive, tight up to some roundings; the BVH rounds it outward. */
struct bounds {
    double min[3], max[3];
};

/* The empty box. */
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

/* Half the surface. */
static inline double bounds_area(const struct bounds *box)
{
    double x = box->max[0] - box->min[0], y = box->max[1] - box->min[1];
    double z = box->max[2] - box->min[2];
    return x * y + y * z + z * x;
}

static inline double bounds_middle(const struct bounds *box, unsigned axis)
{
    return box->min[axis] / 2 + box->max[axis] / 2;
}

/*
 * Crossings of a ray's line with a primitive: at most one for a surface, at most two for a convex solid
 * (entry, then exit). t = NOT_CROSSED for one that does not count. The caller checks 0 < t < t_max.
 */
struct crossings {
    double t[2];
    uint32_t part[2];
    double u, v; /* triangle, patch: barycentric weights of vertex 1 and 2 */
};

#define NOT_CROSSED  (-INFINITE)
#define NO_CROSSINGS ((struct crossings){.t = {NOT_CROSSED, NOT_CROSSED}})

/*
 * Relative error of an exit: the ray's origin is rounded, so the exit may differ by this much from where the
 * ray leaves the solid. A larger difference is taken at face value.
 */
#define WAY_OUT_ERROR 0x1p-20

/* What a caller needs to know of a ray's crossings. */
struct purpose {
    bool any;        /* only how many lie between 0 and t_max, not where */
    double farthest; /* crossings beyond this distance do not matter; at most t_max */
};

#define ALL_CROSSINGS ((struct purpose){false, INFINITE})

static inline struct crossings one_crossing(double t)
{
    return (struct crossings){.t = {t, NOT_CROSSED}};
}

/*
 * Near its start a ray may find surfaces that it has already passed (worker/order.h); only up to this
 * distance, in units of its coordinates. A ray that meets a flat surface at less than 2^-33 may cross it
 * farther away; the other side of a round surface may be as close.
 */
#define START_REACH 0x1p-20

static inline bool is_near_start(const struct ray *ray, double t)
{
    return ray->from != PRIMITIVE_NONE && t > 0 &&
           t * vec_largest(ray->direction) < START_REACH * vec_largest(ray->origin);
}

/* A distance beyond which is_near_start() is false. */
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
