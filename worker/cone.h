/*
 * Intersection of a ray with a cylinder, cone or frustum, open or capped.
 *
 * Let f = o - base, w = apex - base (the axis) and W = w.w. A point p, relative to the base, has the height
 * s = p.w / W: 0 in the base plane and 1 in the apex plane. There the radius is rho = r0 + (r1 - r0) s. The distance
 * of p from the axis is |p x w| / |w|.
 *
 * Along the ray o + t d the cross product is F + t D, with F = f x w and D = d x w, and the radius is rho0 + t rho1. So
 * the inside of the double, unlimited cone is A t^2 - 2 B t + C <= 0, with
 *
 *   A = D.D - W rho1^2,   B = W rho0 rho1 - F.D,   C = F.F - W rho0^2.
 *
 * The nappe where rho >= 0 and the slab 0 <= s <= 1 are both convex, so a ray is inside each during one interval. A
 * capped solid is the intersection of the two. The ray enters and leaves it exactly once, whatever is rounded near a
 * rim. In a tie a rim belongs to the cap.
 */
#ifndef FARM_WORKER_CONE_H
#define FARM_WORKER_CONE_H

#include "worker/planar.h"
#include "worker/shape.h"

/* The boxes of the two end circles. */
static inline void cone_end_bounds(const struct cone *cone, struct bounds *at_base,
                                   struct bounds *at_apex)
{
    struct vec3 axis = vec_normalize(vec_sub(cone->apex, cone->base));
    double base[3], apex[3];
    circle_extent(axis, cone->base_radius, base);
    circle_extent(axis, cone->apex_radius, apex);
    for (unsigned i = 0; i < 3; i++) {
        double b = vec_component(&cone->base, i), a = vec_component(&cone->apex, i);
        at_base->min[i] = b - base[i];
        at_base->max[i] = b + base[i];
        at_apex->min[i] = a - apex[i];
        at_apex->max[i] = a + apex[i];
    }
}

static inline struct bounds cone_bounds(const struct cone *cone)
{
    struct bounds bounds, apex;
    cone_end_bounds(cone, &bounds, &apex);
    bounds_add(&bounds, &apex);
    return bounds;
}

/*
 * The box of one of `count` pieces of equal length: the box around the boxes of its end circles. Along the axis each
 * side of a circle's box moves linearly, as centre and radius do, so the boxes of the circles in between lie inside.
 * Neighbours compute the box of their common circle from the same numbers, so rounding opens no gap. It moves sides by
 * at most 5 u of the largest coordinate, in addition to the error of the bounds; TEST_ERROR (worker/slabs.h) allows for
 * that.
 */
static inline struct bounds cone_piece_bounds(const struct cone *cone, uint32_t piece,
                                              uint32_t count)
{
    double low = (double)piece / count, high = (double)(piece + 1) / count;
    struct bounds base, apex, bounds;
    cone_end_bounds(cone, &base, &apex);
    for (unsigned i = 0; i < 3; i++) {
        double min = apex.min[i] - base.min[i], max = apex.max[i] - base.max[i];
        bounds.min[i] = smaller_number(base.min[i] + min * low, base.min[i] + min * high);
        bounds.max[i] = larger_number(base.max[i] + max * low, base.max[i] + max * high);
    }
    return bounds;
}

/*
 * In double a dot or cross product of components of the ray, the axis and the direction has an error of less than 10 u
 * of the product of their lengths. Sums of absolute values serve as bounds on lengths. The comparisons below allow for
 * 32 u of every product in them; the rest covers their own roundings.
 */
#define CONE_FILTER (32 * UNIT_ROUNDOFF)

/* The quantities of the file header in double arithmetic. */
struct cone_sketch {
    struct vec3 f, w, F, D;
    double reach, width, speed; /* sums of absolute values of f, w and the direction */
    double height, rise, W;     /* f.w, d.w, w.w */
    double radius;              /* the larger of the two radii */
};

static inline struct cone_sketch cone_sketch(const struct cone *cone, const struct ray *ray)
{
    struct cone_sketch s;
    s.w = vec_sub(cone->apex, cone->base);
    s.f = vec_sub(ray->origin, cone->base);
    s.F = vec_cross(s.f, s.w);
    s.D = vec_cross(ray->direction, s.w);
    s.reach = sum_of_sizes(s.f);
    s.width = sum_of_sizes(s.w);
    s.speed = sum_of_sizes(ray->direction);
    s.height = vec_dot(s.f, s.w);
    s.rise = vec_dot(ray->direction, s.w);
    s.W = vec_dot(s.w, s.w);
    s.radius = larger_number(cone->base_radius, cone->apex_radius);
    return s;
}

/* Whether the lengths and the direction are below the limit, and those that must not vanish are above its inverse. */
static inline bool cone_sketch_is_within(const struct cone_sketch *s, double limit)
{
    double most =
        larger_number(larger_number(s->reach, s->width), larger_number(s->speed, s->radius));
    double least = smaller_number(s->width, smaller_number(s->speed, s->radius));
    return most < limit && least > 1 / limit;
}

/* The radius at a point p relative to the base, where height = p.w. */
static inline double cone_radius(const struct cone *cone, const struct cone_sketch *s,
                                 double height)
{
    return cone->base_radius + (cone->apex_radius - cone->base_radius) * (height / s->W);
}

/* Half the derivative of A t^2 - 2 B t + C, at a point o + t d on the double, unlimited cone: positive where the ray
 * leaves the cone, negative where it enters it. */
static inline double cone_outward(const struct cone *cone, const struct cone_sketch *s, double t)
{
    double widening = cone->apex_radius - cone->base_radius;
    double radius = cone_radius(cone, s, s->height + t * s->rise);
    return vec_dot(s->F, s->D) + t * vec_dot(s->D, s->D) - radius * widening * s->rise;
}

/* B of the file header at the ray's origin, and a bound on its error. */
static inline double cone_inward(const struct cone *cone, const struct cone_sketch *s,
                                 double *error)
{
    double widening = cone->apex_radius - cone->base_radius, size = fabs(widening);
    double axial = cone_radius(cone, s, s->height) * widening * s->rise;
    double terms = s->width * s->width * s->reach + size * cone->base_radius * s->width;
    *error = CONE_FILTER * s->speed * (terms + size * size * s->reach);
    return axial - vec_dot(s->F, s->D);
}

/* Whether a ray that starts on the part from_part of the surface certainly goes outward. Products of four lengths or
 * directions have to stay in range. */
static inline bool ray_leaves_cone(const struct cone *cone, const struct cone_sketch *s,
                                   uint32_t from_part)
{
    double error = CONE_FILTER * s->speed * s->width;
    if (!cone_sketch_is_within(s, 0x1p200)) return false;
    if (from_part == CONE_BASE_CAP) return s->rise < -error;
    if (from_part == CONE_APEX_CAP) return s->rise > error;
    double inward = cone_inward(cone, s, &error);
    return inward < -error;
}

/* The interval of a crossing, and its part, if that is known. */
struct cone_span {
    double low, high;
    bool part_known;
    uint32_t part;
};

/*
 * The interval of the later root of the side, counted from the origin of a ray that starts on from_part; false: not
 * decided. On the side C counts as 0. With S a bound on |F| + |w| rho0 and V on |D| + |w| rho1, A, B and C are at most
 * V^2, S V and S^2, and err by less than e = 64 u times that: f and w err by u of themselves, F and D by 10 u, f.w by
 * 5 u, d.w by 4 u and W by 5 u of the product of the lengths, hence rho0 by 14 u of the sum of its terms, and C, the
 * worst, by 36 u. So B^2 - A C errs by less than 8 e (S V)^2, its root by that over the root, and a quotient N / A by
 * (error of N + |N / A| error of A) / A, except for terms of second order and roundings, for which everything counts
 * twice.
 */
static inline bool cone_side_exit(const struct cone *cone, const struct cone_sketch *s,
                                  uint32_t from_part, struct cone_span *exit)
{
    double widening = cone->apex_radius - cone->base_radius, size = fabs(widening), ignored;
    double S = s->width * (s->reach + s->radius) + size * s->reach;
    double V = s->speed * (s->width + size), e = 2 * CONE_FILTER, slope = widening * s->rise;
    double A = vec_dot(s->D, s->D) - slope * slope / s->W, A_error = e * V * V;
    double B = cone_inward(cone, s, &ignored), error = e * S * V, root = B;
    if (!(A > 64 * A_error)) return false;
    if (from_part == CONE_SIDE) {
        if (!(B > error)) return false;
        error *= 2;
    } else {
        double radius = cone_radius(cone, s, s->height);
        double C = vec_dot(s->F, s->F) - s->W * radius * radius;
        double square = B * B - A * C, square_error = 8 * e * S * S * (V * V);
        if (!(square > 4 * square_error)) return false;
        root = sqrt(square);
        error += square_error / root;
    }
    double t = (B + root) / A, slack = 2 * (error + fabs(t) * A_error) / A;
    *exit = (struct cone_span){t - slack, t + slack, true, CONE_SIDE};
    return true;
}

/* The same for the plane of the cap ahead: W and f.w err by 7 u of (|f| + |w|) |w|, together with their difference. */
static inline bool cone_cap_exit(const struct cone_sketch *s, struct cone_span *exit)
{
    double rise = fabs(s->rise), error = CONE_FILTER * s->speed * s->width;
    if (!(rise > 64 * error)) return false;
    bool up = s->rise > 0;
    double t = (up ? s->W - s->height : s->height) / rise;
    double slack = 2 * (CONE_FILTER * s->width * (s->reach + s->width) + fabs(t) * error) / rise;
    *exit = (struct cone_span){t - slack, t + slack, true, up ? CONE_APEX_CAP : CONE_BASE_CAP};
    return true;
}

/*
 * The interval of the exit of a ray that starts on a capped cone and goes inward; false: it may go outward, or that is
 * not decided. Products of eight lengths or directions have to stay in range.
 */
static inline bool cone_way_out_span(const struct cone *cone, const struct cone_sketch *s,
                                     uint32_t from_part, struct cone_span *exit)
{
    struct cone_span side, cap;
    if (!cone->capped || !cone_sketch_is_within(s, 0x1p100)) return false;
    if (!cone_cap_exit(s, &cap) || cap.part == from_part) return false;
    if (!cone_side_exit(cone, s, from_part, &side)) return false;
    *exit = side.high < cap.low ? side : cap;
    exit->low = smaller_number(side.low, cap.low);
    exit->high = smaller_number(side.high, cap.high);
    exit->part_known = side.high < cap.low || cap.high < side.low;
    return exit->low > 0;
}

/* cone_crossings() in double-double and exact arithmetic, for when double does not decide. */
struct crossings cone_roots(const struct cone *cone, const struct ray *ray, bool leaving, bool any,
                            uint64_t *exact);

/*
 * The crossings where the ray enters and leaves. leaving: the ray starts on this cone. If it goes outward it cannot
 * meet the cone again, as solid and open surface are convex; if it goes inward it only has an exit. Crossings that do
 * not matter for the purpose are left out; if only their number matters, t may be inexact. Rays that certainly miss the
 * cone, or do not reach it, have been sorted out before: worker/solid_lanes.h. *exact counts uses of exact arithmetic.
 */
static inline struct crossings cone_crossings(const struct cone *cone, const struct ray *ray,
                                              bool leaving, const struct purpose *purpose,
                                              uint64_t *exact)
{
    struct cone_span exit;
    if (leaving) {
        struct cone_sketch s = cone_sketch(cone, ray);
        if (ray_leaves_cone(cone, &s, ray_from_part(ray))) return NO_CROSSINGS;
        if (purpose->any && cone_way_out_span(cone, &s, ray_from_part(ray), &exit) &&
            exit.high < purpose->farthest)
            return (struct crossings){.t = {NOT_CROSSED, exit.high}, .part = {0, exit.part}};
    }
    return cone_roots(cone, ray, leaving, purpose->any, exact);
}

/* The double-double value of the crossing that cone_crossings() rounded to t; see sphere_parameter(). */
struct dd cone_parameter(const struct cone *cone, const struct ray *ray, double t, uint32_t part,
                         bool leaving);

/* The point of this crossing, relative to the base. */
struct dd3 cone_point(const struct cone *cone, const struct ray *ray, double t, uint32_t part,
                      bool leaving);

/*
 * Outward unit normal at a point p relative to the base. On the side it is the gradient of the quadric in the file
 * header; at the tip, where the gradient is 0, it is along the axis.
 */
struct vec3 cone_normal(const struct cone *cone, struct dd3 p, uint32_t part);

#endif
