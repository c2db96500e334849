/*
 * The intersection of a line with the side of a cone in double-double: what is common to worker/cone.c, which explains
 * the method, and worker/points_solids.c, for many lines at once.
 */
#ifndef FARM_WORKER_CONE_LINE_H
#define FARM_WORKER_CONE_LINE_H

#include "common/scene.h"
#include "worker/exact.h"
#include "worker/shape.h"

/* The quantities in the header of worker/cone.h, with the parameter of the line counted from t. */
struct cone_line {
    double t;
    struct dd3 w, f;
    struct dd3 D, G;
    struct dd W, widening;
    struct dd rho, rho1;
    struct dd A, B, C;
    /* Bounds on |G| + sqrt(W) |rho| and |D| + sqrt(W) |rho1|, and on the errors of these. */
    double radial, radial_error;
    double speed, speed_error;
};

/* Products of six lengths or directions between these stay in range. */
#define CONE_ORDINARY_MIN 0x1p-100
#define CONE_ORDINARY_MAX 0x1p100

static inline bool is_ordinary_for_cone(double size)
{
    bool ordinary = size > CONE_ORDINARY_MIN;
    ordinary &= size < CONE_ORDINARY_MAX;
    return ordinary;
}

/* The largest coordinate or radius of a cone and of the origin of a ray. */
static inline double cone_reach(const struct cone *cone, struct vec3 origin)
{
    double radius = larger_number(cone->base_radius, cone->apex_radius);
    double reach = larger_number(vec_largest(cone->base), vec_largest(cone->apex));
    return larger_number(vec_largest(origin), larger_number(reach, radius));
}

/* Whether a cone and a ray need no scaling. */
static inline bool cone_is_ordinary(const struct cone *cone, struct vec3 origin,
                                    struct vec3 direction)
{
    double radius = larger_number(cone->base_radius, cone->apex_radius);
    double height = vec_largest(vec_sub(cone->apex, cone->base));
    bool ordinary = is_ordinary_for_cone(radius);
    ordinary &= is_ordinary_for_cone(height);
    ordinary &= is_ordinary_for_cone(vec_largest(direction));
    ordinary &= cone_reach(cone, origin) < CONE_ORDINARY_MAX;
    return ordinary;
}

/* Where |d x w| is at most this share of |d| |w|, its double-double value has too few correct digits. */
#define CONE_STEEP 0x1p-30

/* The t where |F + t D| is least, closest to the axis; F = f x w, D = d x w. */
static inline double cone_closest_approach(struct dd3 F, struct dd3 D)
{
    return -dd3_dot(F, D).high / dd3_dot(D, D).high;
}

/*
 * A component of a cross product of double-double numbers has an error of 2 (5 + 3) u^2 of the product of the lengths.
 * Three components, and the advance by t D with 5 u^2 of each term, have less than 64 u^2 in all. rho sqrt(W) has an
 * error of at most 40 u^2 (3 products, 1 division, 2 sums) of its terms, the largest of which are r0 |w| and (r1 - r0)
 * |f|.
 */
static inline void cone_line_bound(struct cone_line *line, double base_radius,
                                   struct vec3 direction)
{
    double f = dd3_size(line->f), w = dd3_size(line->w), d = sum_of_sizes(direction);
    double widening = fabs(line->widening.high), t = fabs(line->t), root_W = sqrt(line->W.high);
    line->speed = dd3_size(line->D) + root_W * fabs(line->rho1.high);
    line->speed_error = 64 * DD_ROUNDOFF * d * (w + widening);
    line->radial = dd3_size(line->G) + root_W * fabs(line->rho.high);
    line->radial_error =
        64 * DD_ROUNDOFF * (f * (w + widening) + base_radius * w + t * line->speed);
    line->radial_error += t * line->speed_error;
}

static inline struct cone_line cone_line_from(const struct cone *cone, struct vec3 direction,
                                              struct dd3 w, struct dd3 f, struct dd3 F,
                                              struct dd3 D, double t)
{
    struct cone_line line = {.t = t, .w = w, .f = f, .D = D};
    line.W = dd3_dot(w, w);
    line.widening = exact_difference(cone->apex_radius, cone->base_radius);
    line.G = dd3_add(F, (struct dd3){dd_scale(D.x, t), dd_scale(D.y, t), dd_scale(D.z, t)});
    struct dd slope = dd_div(line.widening, line.W);
    line.rho1 = dd_mul(slope, dd3_dot(dd3_of(direction), w));
    line.rho = dd_add(dd(cone->base_radius), dd_mul(slope, dd3_dot(f, w)));
    line.rho = dd_add(line.rho, dd_scale(line.rho1, t));
    struct dd W_rho1 = dd_mul(line.W, line.rho1);
    line.A = dd_sub(dd3_dot(D, D), dd_mul(W_rho1, line.rho1));
    line.B = dd_sub(dd_mul(W_rho1, line.rho), dd3_dot(line.G, D));
    line.C = dd_sub(dd3_dot(line.G, line.G), dd_mul(line.W, dd_mul(line.rho, line.rho)));
    cone_line_bound(&line, cone->base_radius, direction);
    return line;
}

/* A bound on the error of A; 64 u^2 covers its own products and sums. */
static inline double cone_A_error(const struct cone_line *line)
{
    double V = line->speed, error = line->speed_error;
    return 64 * DD_ROUNDOFF * V * V + 2 * V * error + error * error;
}

/* If the discriminant is at most this many times its error bound, it is computed in exact arithmetic. At the limit
 * its square root has lost half of the digits, so the roots are correct to 2^-56. */
#define CONE_LINE_FILTER 0x1p12

static inline struct dd cone_discriminant(const struct cone_line *line, double *bound)
{
    double S = line->radial, V = line->speed;
    double error = V * line->radial_error + S * line->speed_error;
    *bound = 64 * DD_ROUNDOFF * S * V * (S * V) + 4 * S * V * error + error * error;
    return dd_sub(dd_mul(line->B, line->B), dd_mul(line->A, line->C));
}

/* q = B + sign(B) root, which does not cancel. The roots are C / q, which is the smaller in size, and q / A. */
static inline struct dd cone_larger_sum(struct dd B, struct dd root)
{
    struct dd addend = {B.high < 0 ? -root.high : root.high, B.high < 0 ? -root.low : root.low};
    return dd_add(B, addend);
}

/* A distance along the ray, as a t, beyond which there is no point of the cone. */
static inline double cone_distances(const struct cone *cone, struct vec3 origin,
                                    struct vec3 direction)
{
    struct vec3 f = vec_sub(origin, cone->base), w = vec_sub(cone->apex, cone->base);
    double reach = vec_largest(f) + vec_largest(w);
    return (reach + cone->base_radius) / vec_largest(direction);
}

/*
 * At rims and tips two crossings coincide. Roots are irrational; deciding whether two of them are equal would take some
 * 16 times the digits of the input. So crossings that differ by at most 2^-88 of the distances involved, 2^-35 of the
 * last place of t, count as equal, and the ray meets the rim. Errors of double-double are far smaller.
 */
#define CONE_SAME_CROSSING 0x1p-88

/* The sum of the closest approach and a root relative to it has an error of 2^-70 of both for a ray close to the
 * axis' direction. A root smaller than this share of them is computed without the sum. */
#define CONE_ROOT_CANCELLED 0x1p-10

/* The roots as they are found from the closest approach. */
struct cone_line_roots {
    struct dd3 w, f, F, D;
    struct dd A, root; /* root: of the discriminant */
    struct dd first, second;
    double reach;   /* all distances are smaller */
    bool cancelled; /* the smaller root is computed without the sum */
};

/* Valid if *sure stays true: the cone is ordinary, A is positive, and the roots are well apart from each other. */
static inline struct cone_line_roots cone_roots_of(const struct cone *cone, struct vec3 o,
                                                   struct vec3 d, bool *sure)
{
    struct cone_line_roots it;
    double bound;
    it.w = exact_difference3(cone->apex, cone->base);
    it.f = exact_difference3(o, cone->base);
    it.F = dd3_cross(it.f, it.w);
    it.D = dd3_cross(dd3_of(d), it.w);
    *sure &= cone_is_ordinary(cone, o, d);
    *sure &= dd3_size(it.D) > CONE_STEEP * sum_of_sizes(d) * dd3_size(it.w);
    struct cone_line line =
        cone_line_from(cone, d, it.w, it.f, it.F, it.D, cone_closest_approach(it.F, it.D));
    *sure &= line.A.high > cone_A_error(&line);
    struct dd square = cone_discriminant(&line, &bound);
    *sure &= square.high > CONE_LINE_FILTER * bound;
    it.A = line.A;
    it.root = dd_root(square);
    struct dd q = cone_larger_sum(line.B, it.root);
    it.first = dd_add(dd(line.t), dd_div(line.C, q));
    it.second = dd_add(dd(line.t), dd_div(q, line.A));
    it.reach = cone_distances(cone, o, d) + fabs(line.t);
    double small = smaller_number(fabs(it.first.high), fabs(it.second.high));
    it.cancelled = small < CONE_ROOT_CANCELLED * it.reach;
    return it;
}

/* Whether the planes of the caps are certainly not within `off` of t; the distances to them have an error of at most
 * 2^-30 of the reach. */
static inline bool cone_caps_are_apart(const struct cone_line_roots *it, struct vec3 d, double t,
                                       double off)
{
    struct vec3 w = dd3_round(it->w), f = dd3_round(it->f);
    double rise = vec_dot(d, w), height = vec_dot(f, w), W = dd3_dot(it->w, it->w).high;
    double to_base = -height / rise, to_apex = (W - height) / rise;
    double near = 0x1p-20 * it->reach + off;
    return (fabs(rise) > 0x1p-20 * sum_of_sizes(d) * dd3_size(it->w)) & (fabs(to_base - t) > near) &
           (fabs(to_apex - t) > near);
}

/*
 * cone_parameter() of a hit on the side, at t with an error of up to `off`, for a ray that does not start on this cone.
 * Valid if *sure stays true: the cone is ordinary and its two roots are well apart, from each other and from the planes
 * of the caps.
 */
static inline struct dd cone_side_parameter(const struct cone *cone, struct vec3 o, struct vec3 d,
                                            double t, double off, bool *sure)
{
    struct cone_line_roots it = cone_roots_of(cone, o, d, sure);
    *sure &= !it.cancelled;
    bool is_first = fabs(it.first.high - t) <= off, is_second = fabs(it.second.high - t) <= off;
    *sure &= is_first != is_second;
    *sure &= cone_caps_are_apart(&it, d, t, off);
    return (struct dd){is_first ? it.first.high : it.second.high,
                       is_first ? it.first.low : it.second.low};
}

/*
 * The same for a ray that starts on this cone and leaves it through the side: the later root, if it certainly agrees
 * with the exit at t within WAY_OUT_ERROR. If the ray starts on the side, the earlier root is next to 0, has cancelled,
 * and the later one is q / A with the parameter counted from the origin. It is the later one if C / q < q / A; C, whose
 * own value is not needed, errs by less than 64 u^2 S^2 + 2 S S_error, with S = line.radial. The factors 4 and 0.5
 * have room for all roundings of the comparisons.
 */
static inline struct dd cone_exit_parameter(const struct cone *cone, struct vec3 o, struct vec3 d,
                                            double t, double off, bool *sure)
{
    struct cone_line_roots it = cone_roots_of(cone, o, d, sure);
    struct cone_line line = cone_line_from(cone, d, it.w, it.f, it.F, it.D, 0);
    struct dd q = cone_larger_sum(line.B, it.root), from_origin = dd_div(q, it.A);
    double S = line.radial, C_error = 64 * DD_ROUNDOFF * S * S + 2 * S * line.radial_error;
    bool later = 4 * (fabs(line.C.high) + C_error) * it.A.high < q.high * q.high;
    bool is_known = later & (q.high > 0);
    *sure &= is_known | (!it.cancelled);
    *sure &= it.first.high != it.second.high;
    bool is_first = it.first.high > it.second.high;
    double high = is_first ? it.first.high : it.second.high;
    double low = is_first ? it.first.low : it.second.low;
    struct dd root = {it.cancelled ? from_origin.high : high, it.cancelled ? from_origin.low : low};
    *sure &= fabs(root.high - t) + 2 * off <= 0.5 * WAY_OUT_ERROR * t;
    *sure &= root.high > CONE_SAME_CROSSING * it.reach;
    return root;
}

/* The part of p, relative to the base, that is across the axis w. W = w.w. */
static inline struct dd3 cone_radial(struct dd3 p, struct dd3 w, struct dd W)
{
    return dd3_sub(p, dd3_multiply(w, dd_div(dd3_dot(p, w), W)));
}

/* Half the gradient of |radial|^2 - rho^2, a multiple of that of the quadric, where rho = |radial|. widening:
 * apex_radius - base_radius. */
static inline struct vec3 cone_gradient(struct dd3 radial, struct dd rho, struct dd widening,
                                        struct dd3 w, struct dd W)
{
    return dd3_round(dd3_sub(radial, dd3_multiply(w, dd_div(dd_mul(rho, widening), W))));
}

/* The gradient at a point p of the side, which cone_normal() normalizes. On the axis *sure becomes false. */
static inline struct vec3 cone_side_gradient(const struct cone *cone, struct dd3 p, bool *sure)
{
    struct dd3 w = exact_difference3(cone->apex, cone->base);
    struct dd W = dd3_dot(w, w);
    struct dd widening = exact_difference(cone->apex_radius, cone->base_radius);
    struct dd3 radial = cone_radial(p, w, W);
    struct dd square = dd3_dot(radial, radial);
    *sure &= square.high > 0;
    return cone_gradient(radial, dd_root(square), widening, w, W);
}

#endif
