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

/* While a ray is inside something convex; empty when !(enter <= leave). */
struct interval {
    double enter, leave;
};

#define INTERVAL_NONE ((struct interval){INFINITE, -INFINITE})
#define INTERVAL_ALL  ((struct interval){-INFINITE, INFINITE})

/* The quantities of the file's head. */
struct cone_line {
    struct vec3 F, D;
    double W, DD, rho0, rho1;
    double A, B;
};

static inline struct cone_line cone_line(const struct cone *cone, const struct ray *ray)
{
    struct cone_line line;
    struct vec3 w = vec_sub(cone->apex, cone->base);
    struct vec3 f = vec_sub(ray->origin, cone->base);
    double widening = cone->apex_radius - cone->base_radius;
    line.W = vec_dot(w, w);
    line.F = vec_cross(f, w);
    line.D = vec_cross(ray->direction, w);
    line.DD = vec_dot(line.D, line.D);
    line.rho0 = cone->base_radius + widening * (vec_dot(f, w) / line.W);
    line.rho1 = widening * (vec_dot(ray->direction, w) / line.W);
    line.A = line.DD - line.W * line.rho1 * line.rho1;
    line.B = line.W * line.rho0 * line.rho1 - vec_dot(line.F, line.D);
    return line;
}

/*
 * The square root of B^2 - A C. With G = F + t D where the ray passes closest to the axis (G.D = 0)
 * and the radius rho there, the discriminant is W D.D rho^2 - A G.G, which, unlike B^2 - A C, does
 * not cancel for a distant cone; the difference of squares is factored. Negative: the line misses.
 */
static inline double cone_root(const struct cone_line *line)
{
    double t = line->DD > 0 ? -vec_dot(line->F, line->D) / line->DD : 0;
    struct vec3 G = vec_add_scaled(line->F, line->D, t);
    double rho = line->rho0 + t * line->rho1;
    double GG = vec_dot(G, G);
    if (line->A <= 0) return sqrt(line->W * line->DD * rho * rho - line->A * GG);
    double x = sqrt(line->W * line->DD) * fabs(rho);
    double y = sqrt(line->A * GG);
    return x >= y ? sqrt((x - y) * (x + y)) : -1;
}

/* A = 0: the ray is parallel to a generator, or to the axis of a cylinder. */
static inline struct interval cone_linear(double B, double C, double rho1)
{
    if (B == 0) return C <= 0 ? INTERVAL_ALL : INTERVAL_NONE;
    if (B > 0) return rho1 > 0 ? (struct interval){C / (2 * B), INFINITE} : INTERVAL_NONE;
    return rho1 < 0 ? (struct interval){-INFINITE, C / (2 * B)} : INTERVAL_NONE;
}

/*
 * Between the roots when the ray is flatter than the generators: then it meets one nappe, and if
 * that is the other one, the slab cuts all of it off. A steeper ray meets both: of its two
 * half-lines the one that runs towards greater radii.
 */
static inline struct interval cone_nappe(double A, double first, double second, double rho1)
{
    double low = fmin(first, second), high = fmax(first, second);
    if (A > 0) return (struct interval){low, high};
    return rho1 > 0 ? (struct interval){high, INFINITE} : (struct interval){-INFINITE, low};
}

static inline struct interval cone_side(const struct cone_line *line)
{
    double C = vec_dot(line->F, line->F) - line->W * line->rho0 * line->rho0;
    if (line->A == 0) return cone_linear(line->B, C, line->rho1);
    double root = cone_root(line);
    if (!(root >= 0)) return INTERVAL_NONE;
    double q = line->B + copysign(root, line->B);
    if (q == 0) return cone_nappe(line->A, 0, 0, line->rho1);
    return cone_nappe(line->A, C / q, q / line->A, line->rho1);
}

/* The same for a ray that starts on the side and goes inward: C = 0, one root is 0. */
static inline struct interval cone_side_from(const struct cone_line *line)
{
    return (struct interval){0, line->A > 0 ? 2 * line->B / line->A : INFINITE};
}

/* Between the base and the apex plane; *enter_part and *leave_part are the caps crossed. */
static inline struct interval cone_slab(const struct cone *cone, const struct ray *ray,
                                        uint32_t *enter_part, uint32_t *leave_part)
{
    struct vec3 w = vec_sub(cone->apex, cone->base);
    double speed = vec_dot(ray->direction, w);
    double to_base = vec_dot(vec_sub(cone->base, ray->origin), w);
    double to_apex = vec_dot(vec_sub(cone->apex, ray->origin), w);
    *enter_part = speed < 0 ? CONE_APEX_CAP : CONE_BASE_CAP;
    *leave_part = speed < 0 ? CONE_BASE_CAP : CONE_APEX_CAP;
    if (speed == 0) return to_base <= 0 && to_apex >= 0 ? INTERVAL_ALL : INTERVAL_NONE;
    if (speed < 0) return (struct interval){to_apex / speed, to_base / speed};
    return (struct interval){to_base / speed, to_apex / speed};
}

/* Whether a ray that starts on a part goes into the cone. Along the surface is outside. */
static inline bool cone_goes_inside(const struct cone *cone, const struct cone_line *line,
                                    const struct ray *ray)
{
    if (ray->from_part == CONE_SIDE) return line->B > 0;
    double speed = vec_dot(ray->direction, vec_sub(cone->apex, cone->base));
    return ray->from_part == CONE_BASE_CAP ? speed > 0 : speed < 0;
}

static inline struct crossings cone_solid(struct interval side, struct interval slab,
                                          uint32_t enter_cap, uint32_t leave_cap)
{
    struct crossings found = NO_CROSSINGS;
    bool through_enter_cap = slab.enter >= side.enter;
    bool through_leave_cap = slab.leave <= side.leave;
    double enter = through_enter_cap ? slab.enter : side.enter;
    double leave = through_leave_cap ? slab.leave : side.leave;
    if (!(enter <= leave)) return found;
    found.t[0] = enter;
    found.t[1] = leave;
    found.part[0] = through_enter_cap ? enter_cap : CONE_SIDE;
    found.part[1] = through_leave_cap ? leave_cap : CONE_SIDE;
    return found;
}

static inline struct crossings cone_open(struct interval side, struct interval slab)
{
    struct crossings found = NO_CROSSINGS;
    if (!(side.enter <= side.leave)) return found;
    if (side.enter >= slab.enter && side.enter <= slab.leave) found.t[0] = side.enter;
    if (side.leave >= slab.enter && side.leave <= slab.leave) found.t[1] = side.leave;
    return found;
}

/*
 * In and out. leaving: the ray starts on the part from_part of this cone. Outward of a convex
 * solid, and of a convex open surface, nothing can be met again; inward only the way out.
 */
static inline struct crossings cone_crossings(const struct cone *cone, const struct ray *ray,
                                              bool leaving)
{
    struct cone_line line = cone_line(cone, ray);
    uint32_t enter_cap, leave_cap;
    struct interval slab = cone_slab(cone, ray, &enter_cap, &leave_cap);
    if (!leaving) {
        struct interval side = cone_side(&line);
        return cone->capped ? cone_solid(side, slab, enter_cap, leave_cap) : cone_open(side, slab);
    }
    if (!cone_goes_inside(cone, &line, ray)) return NO_CROSSINGS;
    struct interval side = ray->from_part == CONE_SIDE ? cone_side_from(&line) : cone_side(&line);
    side.enter = slab.enter = -INFINITE;
    struct crossings found =
        cone->capped ? cone_solid(side, slab, enter_cap, leave_cap) : cone_open(side, slab);
    found.t[0] = NOT_CROSSED;
    return found;
}

/*
 * Outward unit normal at the point p = o + t d, seen from the base. On the side it is the gradient
 * of the file head's quadric; at the tip, where that is 0, it is the axis.
 */
static inline struct vec3 cone_normal(const struct cone *cone, struct vec3 p, uint32_t part)
{
    struct vec3 w = vec_sub(cone->apex, cone->base);
    if (part == CONE_APEX_CAP) return vec_normalize(w);
    if (part == CONE_BASE_CAP) return vec_normalize(vec_neg(w));
    double W = vec_dot(w, w);
    double widening = cone->apex_radius - cone->base_radius;
    struct vec3 radial = vec_add_scaled(p, w, -(vec_dot(p, w) / W));
    double rho = sqrt(vec_dot(radial, radial));
    struct vec3 gradient = vec_add_scaled(radial, w, -(rho * widening / W));
    if (vec_is_zero(gradient)) return vec_normalize(widening < 0 ? w : vec_neg(w));
    return vec_normalize(gradient);
}

#endif
