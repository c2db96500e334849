/* Ray and sphere. */
#ifndef FARM_WORKER_SPHERE_H
#define FARM_WORKER_SPHERE_H

#include "worker/shape.h"

static inline struct bounds sphere_bounds(const struct sphere *sphere)
{
    struct vec3 c = sphere->center;
    double r = sphere->radius;
    return (struct bounds){{c.x - r, c.y - r, c.z - r}, {c.x + r, c.y + r, c.z + r}};
}

/*
 * Error of the distance between line and centre in plain double arithmetic, as a multiple of u |f|, with f =
 * o - c. b = -f.d errs by 4.1 u |f| |d| (f by u, the dot product by 3 u). So t = b / d.d errs by 8.2 u |f| /
 * |d|, with 3 u from d.d and 1 u from the division; that displaces the point f + t d along the line. Its
 * components add roundings of u |f_i|, u |t d_i| and u |l_i|: 3 u |f|. Together 11.2. Comparing squares costs
 * a relative 3 u of l.l and 2 u of the other side, less than the rest of 16, because the radius of a missed
 * sphere is at most |f|.
 */
#define SPHERE_FILTER (16 * UNIT_ROUNDOFF)

/* Range of squares; outside of it they lose digits or overflow, and the filter decides nothing. */
#define SQUARE_MIN 0x1p-900
#define SQUARE_MAX 0x1p1000

/* The interval of a crossing. */
struct sphere_span {
    double low, high;
};

/* Whether a ray that starts on the sphere certainly goes outward: f.d errs by 4.1 u |f| |d|. */
static inline bool ray_leaves_sphere(const struct sphere *sphere, const struct ray *ray)
{
    struct vec3 f = vec_sub(ray->origin, sphere->center);
    double size = sum_of_sizes(f) * sum_of_sizes(ray->direction);
    return size > SQUARE_MIN && vec_dot(f, ray->direction) > SPHERE_FILTER * size;
}

/*
 * The interval of the exit of a ray that starts on the sphere; false: it may go outward. In 2 b / a, b errs
 * by 4.1 u |f| |d|; the other roundings, and that of the crossing, are 5 u of the quotient, which is at most
 * |f| |d| / a. All of this counts twice.
 */
static inline bool sphere_way_out_span(const struct sphere *sphere, const struct ray *ray,
                                       struct sphere_span *span)
{
    struct vec3 f = vec_sub(ray->origin, sphere->center);
    double size = sum_of_sizes(f) * sum_of_sizes(ray->direction);
    double a = vec_dot(ray->direction, ray->direction);
    if (!(size > SQUARE_MIN && size < SQUARE_MAX && a > SQUARE_MIN && a < SQUARE_MAX)) return false;
    double t = -2 * vec_dot(f, ray->direction) / a, slack = 2 * SPHERE_FILTER * size / a;
    *span = (struct sphere_span){t - slack, t + slack};
    return span->low > 0;
}

/* The crossings of a ray that does not start on the sphere. */
struct crossings sphere_roots(const struct sphere *sphere, const struct ray *ray, uint64_t *exact);

/* The exit of a ray that starts on the sphere. */
struct crossings sphere_way_out(const struct sphere *sphere, const struct ray *ray);

/*
 * Entry and exit; a tangent has both at the same t. Whether the line meets the (closed) sphere is decided
 * exactly, and the roots are rounded from double-double. leaving: the ray starts on this sphere, so one root
 * is 0 and is left out; the other, 2 b / a, lies ahead if the ray goes inward. What does not matter for the
 * purpose is left out; if only the number of crossings matters, t may be inexact.
 */
static inline struct crossings sphere_crossings(const struct sphere *sphere, const struct ray *ray,
                                                bool leaving, const struct purpose *purpose,
                                                uint64_t *exact)
{
    struct sphere_span span;
    if (leaving) {
        if (ray_leaves_sphere(sphere, ray)) return NO_CROSSINGS;
        if (purpose->any && sphere_way_out_span(sphere, ray, &span) &&
            span.high < purpose->farthest)
            return (struct crossings){.t = {NOT_CROSSED, span.high}};
        return sphere_way_out(sphere, ray);
    }
    return sphere_roots(sphere, ray, exact);
}

/*
 * The double-double value of the crossing that sphere_crossings() rounded to t, for comparison with those of
 * other primitives. An exit at 2 b / a is that of a sphere through the ray's origin; it differs from the root
 * of this sphere by at most WAY_OUT_ERROR, unless the ray only grazes it.
 */
struct dd sphere_parameter(const struct sphere *sphere, const struct ray *ray, double t,
                           bool leaving);

/* The point of that crossing, relative to the centre. */
struct dd3 sphere_point(const struct sphere *sphere, const struct ray *ray, double t);

#endif
