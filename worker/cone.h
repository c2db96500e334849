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

static inline struct bounds cone_bounds(const struct cone *cone)
{
    struct vec3 axis = vec_normalize(vec_sub(cone->apex, cone->base));
    double base[3], apex[3];
    struct bounds bounds;
    circle_extent(axis, cone->base_radius, base);
    circle_extent(axis, cone->apex_radius, apex);
    for (unsigned i = 0; i < 3; i++) {
        double b = vec_component(&cone->base, i), a = vec_component(&cone->apex, i);
        bounds.min[i] = fmin(b - base[i], a - apex[i]);
        bounds.max[i] = fmax(b + base[i], a + apex[i]);
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

/* Whether the line certainly passes the largest circle of the side outside: |f.(d x w)| / |d x w|
 * is its distance to the axis. */
static inline bool cone_is_beside(const struct cone_sketch *s)
{
    double error = CONE_FILTER * s->speed * s->width * (s->reach + s->radius);
    return fabs(vec_dot(s->f, s->D)) > s->radius * sqrt(vec_dot(s->D, s->D)) + error;
}

/*
 * Whether the ray certainly stays outside of the largest circle, or has the cone behind it or
 * beyond the farthest t, while it is between the planes of the caps. The squared distance to the
 * axis, times W, is convex along the ray, and so not less than its tangent at the start of that
 * piece.
 */
static inline bool cone_is_off(const struct cone_sketch *s, double farthest)
{
    double rise_error = CONE_FILTER * s->speed * s->width;
    if (!(fabs(s->rise) > 0x1p10 * rise_error)) return false;
    double to_base = -s->height / s->rise, to_apex = (s->W - s->height) / s->rise;
    double most = larger_number(fabs(to_base), fabs(to_apex));
    double slack = CONE_FILTER * s->width * (s->reach + s->width) + most * rise_error;
    slack = 2 * slack / fabs(s->rise);
    double start = larger_number(smaller_number(to_base, to_apex) - slack, 0);
    double length = larger_number(to_base, to_apex) + slack - start;
    if (length < 0 || start > farthest) return true;
    struct vec3 G = vec_add_scaled(s->F, s->D, start);
    double size = sum_of_sizes(G), error = CONE_FILTER * s->width * (s->reach + start * s->speed);
    double slope = 2 * vec_dot(G, s->D), spread = sum_of_sizes(s->D) + rise_error;
    double square = vec_dot(G, G) + smaller_number(slope, 0) * length;
    double limit = s->radius * s->radius * s->W * (1 + CONE_FILTER);
    limit += 4 * (size + error) * error + 4 * length * (size * rise_error + error * spread);
    return square - CONE_FILTER * (size * size + length * size * spread) > limit;
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

/*
 * Whether the ray is certainly outside of the largest circle up to the farthest t. Inside of it |F
 * + t D| <= radius |w|, and so F.D + t D.D >= -radius |w| |D|.
 */
static inline bool cone_is_beyond(const struct cone_sketch *s, double farthest)
{
    double spread = s->speed * s->width, DD = vec_dot(s->D, s->D);
    double error = CONE_FILTER * spread * s->width * (s->reach + s->radius);
    /* Roots of four lengths each; their product would be one of six, more than cone_sketch_holds(). */
    double way = -vec_dot(s->F, s->D) - s->radius * (sqrt(s->W) * sqrt(DD)) - error;
    return way > farthest * (DD + CONE_FILTER * spread * spread);
}

/* A point of the ray: its cross and dot products with the axis. */
struct cone_position {
    double beside, height;
    double error; /* of both, and of what they are compared with */
};

static inline struct cone_position cone_point_at(const struct cone_sketch *s, const struct ray *ray,
                                                 double t)
{
    struct vec3 p = vec_add_scaled(s->f, ray->direction, t), across = vec_cross(p, s->w);
    double size = s->reach + t * s->speed + s->width + s->radius;
    return (struct cone_position){sqrt(vec_dot(across, across)), vec_dot(p, s->w),
                                  CONE_FILTER * s->width * size};
}

static inline bool cone_is_outside_at(const struct cone_sketch *s, const struct ray *ray, double t)
{
    struct cone_position at = cone_point_at(s, ray, t);
    return at.height < -at.error || at.height > s->W + at.error ||
           at.beside > s->radius * sqrt(s->W) + at.error;
}

static inline bool cone_is_inside_at(const struct cone *cone, const struct cone_sketch *s,
                                     const struct ray *ray, double t)
{
    struct cone_position at = cone_point_at(s, ray, t);
    double radius = smaller_number(cone->base_radius, cone->apex_radius);
    return at.height > at.error && at.height < s->W - at.error &&
           at.beside < radius * sqrt(s->W) - at.error;
}

/* A guess at where the ray is well inside: closest to the axis, but between the caps. */
static inline double cone_middle(const struct cone_sketch *s)
{
    double t = -vec_dot(s->F, s->D) / vec_dot(s->D, s->D);
    double middle = (s->W / 2 - s->height) / s->rise, reach = fabs(0.375 * s->W / s->rise);
    return smaller_number(larger_number(t, middle - reach), middle + reach);
}

/* Whether a solid is certainly entered and left between 0 and t_max, and not close to where the ray
 * starts, where it may have been entered already; *t is where it is inside. */
static inline bool cone_is_pierced(const struct cone *cone, const struct cone_sketch *s,
                                   const struct ray *ray, double t_max, double *t)
{
    double start = start_reach(ray);
    *t = cone_middle(s);
    return cone->capped && *t > start && *t < t_max && t_max * s->speed < 0x1p200 &&
           cone_is_inside_at(cone, s, ray, *t) && cone_is_outside_at(s, ray, start) &&
           cone_is_outside_at(s, ray, t_max);
}

/* Whether nothing of the cone is certainly ahead. */
static inline bool cone_is_missed(const struct cone *cone, const struct cone_sketch *s,
                                  const struct ray *ray, bool leaving, double farthest)
{
    if (leaving) return cone_is_left(cone, s, ray_from_part(ray));
    return cone_is_beside(s) || cone_is_beyond(s, farthest) || cone_is_off(s, farthest);
}

/* The crossings when plain arithmetic is not sure. */
struct crossings cone_roots(const struct cone *cone, const struct ray *ray, bool leaving, bool any,
                            uint64_t *exact);

/*
 * In and out; nothing when all of it lies behind. leaving: the ray starts on the part from_part of
 * this cone. Outward of a convex solid, and of a convex open surface, nothing can be met again;
 * inward only the way out. What does not matter is left out; where only the number does, and the
 * farthest t is finite, both may be told to be half-way.
 */
static inline struct crossings cone_crossings(const struct cone *cone, const struct ray *ray,
                                              bool leaving, const struct purpose *purpose,
                                              uint64_t *exact)
{
    double t;
    struct cone_sketch s = cone_sketch(cone, ray);
    if (cone_sketch_holds(&s)) {
        if (cone_is_missed(cone, &s, ray, leaving, purpose->farthest)) return NO_CROSSINGS;
        if (purpose->any && !leaving && cone_is_pierced(cone, &s, ray, purpose->farthest, &t))
            return (struct crossings){.t = {t, t}};
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
