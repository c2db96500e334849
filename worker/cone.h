/*
 * Ray and cylinder, cone or frustum, open or capped.
 *
 * With f = o - base, the axis w = apex - base and W = w.w, a point p lies at height s = p.w / W (0
 * in the base, 1 in the apex plane), where the radius is rho = r0 + (r1 - r0) s, at the distance |p
 * x w| / |w| from the axis. Along the ray the cross product is F + t D and the radius rho0 + t
 * rho1, so that the inside of the (double, unlimited) cone is A t^2 - 2 B t + C <= 0,   A = D.D - W
 * rho1^2,  B = W rho0 rho1 - F.D,  C = F.F - W rho0^2. The nappe where rho >= 0, and the slab 0 <=
 * s <= 1, are both convex: a ray is inside each during one interval. A capped solid is their
 * intersection, entered and left exactly once whatever is rounded near a rim; at a tie the cap owns
 * the rim.
 */
#ifndef FARM_WORKER_CONE_H
#define FARM_WORKER_CONE_H

#include "worker/planar.h"
#include "worker/shape.h"

/* The boxes around its circles. */
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
 * Of one of so many pieces of equal length, between two circles around the axis: the box around theirs. Along the axis,
 * each side of a circle's box moves from the base's to the apex' in proportion, as centre and radius do, and so those
 * of the circles in between are between theirs. Neighbours have a circle in common, and the same numbers for it: what
 * is rounded opens no gap, but moves sides by 5 u of the largest coordinate at most, beside what the bounds err by;
 * TEST_ERROR (worker/slabs.h) allows for that.
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
 * A plain dot or cross product of the ray's, the axis' and the direction's components errs by less
 * than 10 u of the product of their lengths, for which sums of absolute values are taken. The
 * comparisons below allow for 32 u of every product in them; the rest covers their own roundings.
 */
#define CONE_FILTER (32 * UNIT_ROUNDOFF)

/* The ray in plain arithmetic, as in the head of the file. */
struct cone_sketch {
    struct vec3 f, w, F, D;
    double reach, width, speed; /* sums of absolute values of f, w and the direction */
    double height, rise, W;     /* f.w, d.w, w.w */
    double radius;              /* the larger one */
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

/* Whether products of four of these are in range. */
static inline bool cone_sketch_holds(const struct cone_sketch *s)
{
    double most =
        larger_number(larger_number(s->reach, s->width), larger_number(s->speed, s->radius));
    double least = smaller_number(s->width, smaller_number(s->speed, s->radius));
    return most < 0x1p200 && least > 0x1p-200;
}

/* More than 0 where the ray goes away from the double, unlimited cone at o + t d, less where it goes into it: half of
 * what A t^2 - 2 B t + C grows by. */
static inline double cone_outward(const struct cone *cone, const struct cone_sketch *s, double t)
{
    double widening = cone->apex_radius - cone->base_radius;
    double radius = cone->base_radius + widening * ((s->height + t * s->rise) / s->W);
    return vec_dot(s->F, s->D) + t * vec_dot(s->D, s->D) - radius * widening * s->rise;
}

/* Whether the ray certainly leaves its part of the surface outward. */
static inline bool cone_is_left(const struct cone *cone, const struct cone_sketch *s,
                                uint32_t from_part)
{
    double rise_error = CONE_FILTER * s->speed * s->width;
    if (from_part == CONE_BASE_CAP) return s->rise < -rise_error;
    if (from_part == CONE_APEX_CAP) return s->rise > rise_error;
    double widening = cone->apex_radius - cone->base_radius, size = fabs(widening);
    double axial = (cone->base_radius + widening * (s->height / s->W)) * widening * s->rise;
    double terms = s->width * s->width * s->reach + size * cone->base_radius * s->width;
    double error = CONE_FILTER * s->speed * (terms + size * size * s->reach);
    return axial - vec_dot(s->F, s->D) < -error;
}

/* The crossings when plain arithmetic is not sure. */
struct crossings cone_roots(const struct cone *cone, const struct ray *ray, bool leaving, bool any,
                            uint64_t *exact);

/*
 * In and out. leaving: the ray starts on the part from_part of this cone. Outward of a convex solid, and of a convex
 * open surface, nothing can be met again; inward only the way out. What does not matter is left out. Rays that are
 * certainly beside the cone, or before it, have been told before: worker/solid_lanes.h.
 */
static inline struct crossings cone_crossings(const struct cone *cone, const struct ray *ray,
                                              bool leaving, const struct purpose *purpose,
                                              uint64_t *exact)
{
    if (leaving) {
        struct cone_sketch s = cone_sketch(cone, ray);
        if (cone_sketch_holds(&s) && cone_is_left(cone, &s, ray_from_part(ray)))
            return NO_CROSSINGS;
    }
    return cone_roots(cone, ray, leaving, purpose->any, exact);
}

/* The crossing that cone_crossings() has rounded to t; for a way out see sphere_parameter(). */
struct dd cone_parameter(const struct cone *cone, const struct ray *ray, double t, uint32_t part,
                         bool leaving);

/* Where that is, seen from the base. */
struct dd3 cone_point(const struct cone *cone, const struct ray *ray, double t, uint32_t part,
                      bool leaving);

/*
 * Outward unit normal at the point p, seen from the base. On the side it is the gradient of the
 * file head's quadric; at the tip, where that is 0, it is the axis.
 */
struct vec3 cone_normal(const struct cone *cone, struct dd3 p, uint32_t part);

#endif
