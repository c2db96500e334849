#include "worker/planar.h"

struct dd plane_parameter(struct vec3 point, struct vec3 normal, const struct ray *ray)
{
    int above, below;
    struct dd3 n = dd3_of(normal);
    struct dd speed = exact_dot3(dd3_of(ray->direction), n, &below);
    if (speed.high == 0) return dd(NOT_CROSSED);
    struct dd height = exact_dot3(exact_difference3(point, ray->origin), n, &above);
    return dd_ldexp(dd_div(height, speed), above - below);
}

/* A plane orthogonal to an axis: the normal cancels out, and two roundings remain. */
static inline double axis_distance(double point, double origin, double direction)
{
    if (direction == 0) return NOT_CROSSED;
    return (point - origin) / direction;
}

FLATTENED double plane_distance(struct vec3 point, struct vec3 normal, const struct ray *ray)
{
    struct vec3 o = ray->origin, d = ray->direction;
    if (normal.x == 0 && normal.z == 0) return axis_distance(point.y, o.y, d.y);
    if (normal.x == 0 && normal.y == 0) return axis_distance(point.z, o.z, d.z);
    if (normal.y == 0 && normal.z == 0) return axis_distance(point.x, o.x, d.x);
    return plane_parameter(point, normal, ray).high;
}

FLATTENED struct dd3 plane_point(struct vec3 point, struct vec3 normal, const struct ray *ray)
{
    struct dd3 step = dd3_scale(ray->direction, plane_parameter(point, normal, ray));
    return dd3_add(exact_difference3(ray->origin, point), step);
}

/*
 * In plain arithmetic n.f errs by 4.1 u |f| and n.d by 3 u |d| (n is unit). With k = |d| / |n.d|, the
 * parameter's error displaces p = f + t d by k (4.1 u |f| + 3 u |t d|), and the components of p add 3 u (|f|
 * + |t d|). Sums of absolute values are bounds on the lengths; the rest of 8 covers the roundings of the
 * bound itself and, while k u < 1/64, the terms of second order.
 */
#define DISC_FILTER (8 * UNIT_ROUNDOFF)

enum side { SIDE_OPEN, SIDE_IN, SIDE_OUT };

/* Compares |p| with the radius if p errs by `error`; the squares must be in range. */
static enum side rim_side(double pp, double radius, double error)
{
    double inner = radius - error, outer = radius + error;
    /* Four roundings in pp and in the squares: 2 u of the lengths each. */
    inner -= 8 * UNIT_ROUNDOFF * radius;
    outer += 8 * UNIT_ROUNDOFF * radius;
    if (!(radius > 0x1p-400 && pp < 0x1p1000)) return SIDE_OPEN;
    if (pp > outer * outer) return SIDE_OUT;
    return inner > 0 && pp < inner * inner ? SIDE_IN : SIDE_OPEN;
}

/* *from, *to: the interval of the parameter t, whose error is as above; valid unless SIDE_OPEN is returned. 2^-900 is
 * more than products lose that underflow. */
static enum side disc_side_filtered(const struct disc *disc, const struct ray *ray, double *from,
                                    double *to)
{
    struct vec3 f = vec_sub(ray->origin, disc->center), d = ray->direction;
    double speed = vec_dot(d, disc->normal), size = sum_of_sizes(d);
    double k = size / fabs(speed);
    if (!(k < 0x1p46 && size > 0x1p-400 && size < 0x1p400)) return SIDE_OPEN;
    double t = -vec_dot(f, disc->normal) / speed;
    struct vec3 p = vec_add_scaled(f, d, t);
    double reach = sum_of_sizes(f) + fabs(t) * size + 0x1p-900,
           slack = DISC_FILTER * reach / fabs(speed);
    double error = DISC_FILTER * (k + 1) * reach;
    *from = t - slack;
    *to = t + slack;
    return rim_side(vec_dot(p, p), disc->radius, error);
}

/*
 * The same in double-double, with the same bound for its 2^50 times smaller roundings: u^2 instead of u, and
 * error factors of up to 10 instead of 1 in 8 operations.
 */
static enum side disc_side_in_dd(const struct disc *disc, const struct ray *ray)
{
    struct vec3 d = ray->direction;
    double size = sum_of_sizes(d);
    double k = size / fabs(vec_dot(d, disc->normal));
    struct vec3 p = dd3_round(plane_point(disc->center, disc->normal, ray));
    double error = DISC_FILTER * 0x1p-49 * (k + 1);
    error *= sum_of_sizes(vec_sub(ray->origin, disc->center)) + sum_of_sizes(p);
    if (!(k < 0x1p40)) return SIDE_OPEN;
    return rim_side(vec_dot(p, p), disc->radius, error);
}

/*
 * Decides |p|^2 <= r^2, multiplied by (n.d)^2, exactly. With p = f - d (n.f) / (n.d), the vector v = p n.d
 * has the components sum over j of n_j (f_i d_j - d_i f_j).
 */
static enum side disc_side_exact(const struct disc *disc, const struct ray *ray)
{
    struct dd3 f3 = exact_difference3(ray->origin, disc->center);
    const struct dd f[3] = {f3.x, f3.y, f3.z};
    const struct vec3 *d = &ray->direction, *n = &disc->normal;
    struct accumulator sum, speed, v; /* speed: r n.d */
    accumulator_clear(&sum);
    accumulator_clear(&speed);
    for (unsigned i = 0; i < 3; i++) {
        accumulator_clear(&v);
        for (unsigned step = 1; step < 3; step++) {
            unsigned j = (i + step) % 3;
            struct dd nj = dd(vec_component(n, j));
            accumulator_add_dd(&v, 1, nj, f[i], dd(vec_component(d, j)));
            accumulator_add_dd(&v, -1, nj, f[j], dd(vec_component(d, i)));
        }
        accumulator_add_product(&sum, &v, &v, NULL, false);
        accumulator_add_dd(&speed, 1, dd(disc->radius), dd(vec_component(n, i)),
                           dd(vec_component(d, i)));
    }
    accumulator_add_product(&sum, &speed, &speed, NULL, true);
    return accumulator_sign(&sum) <= 0 ? SIDE_IN : SIDE_OUT;
}

FLATTENED struct crossings disc_crossings(const struct disc *disc, const struct ray *ray,
                                          const struct purpose *purpose, uint64_t *exact)
{
    double from, to;
    enum side side = disc_side_filtered(disc, ray, &from, &to);
    if (side == SIDE_IN) {
        if (to < 0 || from > purpose->farthest) return NO_CROSSINGS;
        if (purpose->any && from > start_reach(ray) && to < purpose->farthest)
            return one_crossing(to);
    }
    if (side == SIDE_OPEN) {
        ++*exact;
        side = disc_side_in_dd(disc, ray);
    }
    if (side == SIDE_OUT) return NO_CROSSINGS;
    double t = plane_distance(disc->center, disc->normal, ray);
    if (t == NOT_CROSSED) return NO_CROSSINGS;
    if (side == SIDE_OPEN) side = disc_side_exact(disc, ray);
    return side == SIDE_IN ? one_crossing(t) : NO_CROSSINGS;
}
