/* Crossings of a ray with primitives of any kind: what they are, and which of them count. */
#ifndef FARM_WORKER_SHAPE_H
#define FARM_WORKER_SHAPE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "worker/bounds.h"
#include "worker/exact.h"
#include "worker/ray.h"

/* Infinity as a double; INFINITY is a float. */
#define INFINITE HUGE_VAL

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

/* Whether a crossing is one of the ray, not of its line alone. */
static inline bool crossing_counts(const struct ray *ray, double t)
{
    return t > 0 && t < ray->t_max;
}

static inline unsigned crossings_that_count(const struct ray *ray, const struct crossings *found)
{
    return (unsigned)crossing_counts(ray, found->t[0]) + crossing_counts(ray, found->t[1]);
}

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

#endif
