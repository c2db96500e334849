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
 * How far plain double arithmetic can misjudge the distance between line and centre, as a multiple
 * of u |f|, f = o - c. b = -f.d errs by 4.1 u |f| |d| (f by u, the dot product by 3 u), so t = b /
 * d.d, with 3 u from d.d and 1 u from the division, by 8.2 u |f| / |d|: that displaces the point
 * f + t d along the line. Its components add roundings of u |f_i|, u |t d_i| and u |l_i|: 3 u |f|.
 * Together 11.2; comparing squares costs a relative 3 u of l.l and 2 u of the other side, less than
 * the rest of 16, because a missed sphere's radius is at most |f|.
 */
#define SPHERE_FILTER (16 * UNIT_ROUNDOFF)

/* Squares outside of this lose digits or overflow: the filter decides nothing. */
#define SQUARE_MIN 0x1p-900
#define SQUARE_MAX 0x1p1000

/* Between what a crossing lies. */
struct sphere_span {
    double low, high;
};

/* Whether a ray that starts on the sphere certainly leaves it: f.d errs by 4.1 u |f| |d|. */
static inline bool sphere_is_left(const struct sphere *sphere, const struct ray *ray)
{
    struct vec3 f = vec_sub(ray->origin, sphere->center);
    double size = sum_of_sizes(f) * sum_of_sizes(ray->direction);
    return size > SQUARE_MIN && vec_dot(f, ray->direction) > SPHERE_FILTER * size;
}

/*
 * Where a ray that starts on the sphere certainly goes out; false: it may go outward. In 2 b / a, b
 * errs by 4.1 u |f| |d|, the rest and the rounded crossing by 5 u of the quotient, which is |f| |d|
 * / a at most, twice.
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

/* The way out for a ray that starts on the sphere. */
struct crossings sphere_way_out(const struct sphere *sphere, const struct ray *ray);

/*
 * In and out; a tangent touches twice at the same t. Whether the line meets the (closed) sphere is
 * decided without error, and the roots are rounded from double-double. leaving: the ray starts on
 * this sphere, so that one root is 0 and is left out; the other one, 2 b / a, lies ahead when the
 * ray goes inward. What does not matter is left out; where only the number does, both may be told
 * to be half-way.
 */
static inline struct crossings sphere_crossings(const struct sphere *sphere, const struct ray *ray,
                                                bool leaving, const struct purpose *purpose,
                                                uint64_t *exact)
{
    struct sphere_span span;
    if (leaving) {
        if (sphere_is_left(sphere, ray)) return NO_CROSSINGS;
        if (purpose->any && sphere_way_out_span(sphere, ray, &span) &&
            span.high < purpose->farthest)
            return (struct crossings){.t = {NOT_CROSSED, span.high}};
        return sphere_way_out(sphere, ray);
    }
    return sphere_roots(sphere, ray, exact);
}

/*
 * The crossing that sphere_crossings() has rounded to t, to be compared with those of other
 * primitives. A way out, 2 b / a, is that of a sphere through the ray's origin; where this sphere
 * itself is left, its roots tell, is as near as WAY_OUT_ERROR, unless the ray only grazes it.
 */
struct dd sphere_parameter(const struct sphere *sphere, const struct ray *ray, double t,
                           bool leaving);

/* Where that is, seen from the centre. */
struct dd3 sphere_point(const struct sphere *sphere, const struct ray *ray, double t);

#endif
