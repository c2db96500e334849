/*
 * A line relative to a sphere, in double-double.
 *
 * The line's parameter is counted from t, a double near the closest approach. p = f + t d is then of the size
 * of the sphere, however far away the origin f = o - c is. The rest s of the parameter solves a s^2 + 2 (p.d)
 * s + p.p - r^2 = 0, in which nothing cancels any more.
 */
#ifndef FARM_WORKER_SPHERE_LINE_H
#define FARM_WORKER_SPHERE_LINE_H

#include "worker/exact.h"

struct sphere_line {
    double t;
    struct dd3 p;
    struct dd a;            /* d.d */
    struct dd along;        /* p.d, small */
    struct dd excess;       /* p.p - r^2 */
    struct dd discriminant; /* along^2 - a excess = a r^2 - |f x d|^2 */
    struct dd half;         /* root of the discriminant */
};

/* In this range products of four numbers are normal, and so are their rounding errors. */
#define ORDINARY_MIN 0x1p-200
#define ORDINARY_MAX 0x1p200

static inline bool is_ordinary(double size)
{
    return (size > ORDINARY_MIN) & (size < ORDINARY_MAX);
}

static inline double sphere_closest_approach(struct vec3 center, struct vec3 origin,
                                             struct vec3 direction)
{
    struct vec3 f = vec_sub(origin, center);
    return -vec_dot(f, direction) / vec_dot(direction, direction);
}

/* The line with its parameter counted from t; the root of the discriminant is not yet computed. */
static inline struct sphere_line sphere_line_from(struct vec3 center, double r, struct vec3 origin,
                                                  struct vec3 d, double t)
{
    struct dd3 f = exact_difference3(origin, center);
    struct sphere_line line = {.t = t, .a = exact_dot(d, d)};
    line.p =
        (struct dd3){dd_advance(f.x, t, d.x), dd_advance(f.y, t, d.y), dd_advance(f.z, t, d.z)};
    line.along = dd3_dot_vec(line.p, d);
    line.excess = dd_sub(dd3_dot(line.p, line.p), exact_product(r, r));
    line.discriminant = dd_sub(dd_mul(line.along, line.along), dd_mul(line.a, line.excess));
    return line;
}

/*
 * Error of the discriminant: p errs by 3 u^2 |p|, so p.p by some 17 u^2 of itself, p.d by 11 of |p| |d|, the
 * products by 5 and the differences by 3 of theirs: 61 of a (p.p + r^2) in all. What underflow takes from
 * scaled lengths is far below the last term.
 */
static inline double sphere_line_error(const struct sphere_line *line, double radius)
{
    double squares = fabs(line->excess.high) + 2 * radius * radius; /* >= p.p + r^2 */
    return 64 * DD_ROUNDOFF * line->a.high * squares + 0x1p-960;
}

/* If the discriminant is less than this many times its error, it is computed exactly. */
#define SPHERE_LINE_FILTER 0x1p12

/* (-along -+ half) / a: the roots relative to t; second: the far one. */
static inline struct dd sphere_line_root(const struct sphere_line *line, bool second)
{
    struct dd half = {second ? line->half.high : -line->half.high,
                      second ? line->half.low : -line->half.low};
    return dd_div(dd_sub(half, line->along), line->a);
}

/*
 * How far t lies behind the middle between the roots (< 0: before it), and how far it must lie for that to
 * tell which root it belongs to. The roots err by some 16 u of their terms |t d| and the radius, rounded or
 * not; that is 2^-49 of them, and the limit is 2^-40. A sphere that is visible from inside only is hit at the
 * far root, and t lies behind.
 */
#define SPHERE_SIDE_ERROR 0x1p-40

static inline double sphere_line_behind(const struct sphere_line *line, double t)
{
    return (t - line->t) + line->along.high / line->a.high;
}

static inline double sphere_line_behind_error(const struct sphere_line *line, struct vec3 direction,
                                              double radius)
{
    double speed = vec_largest(direction);
    return SPHERE_SIDE_ERROR * (fabs(line->t) + radius / speed);
}

#endif
