/*
 * Intersection of a line with a cone in double-double, and in exact arithmetic where that does not decide.
 *
 * As with the sphere, the line's parameter is counted from t, where the line passes closest to the axis (G = F + t D,
 * G.D about 0). So B^2 - A C keeps its digits for a distant or a very long cone.
 */
#include "worker/cone.h"

#include <float.h>

#include "worker/cone_exact.h"
#include "worker/cone_line.h"
#include "worker/inlined.h"

static struct scaled_cone scaled_of(const struct cone *cone, const struct ray *ray)
{
    struct scaled_cone it = {*cone, ray->origin, ray->direction, 0, 0};
    if (cone_is_ordinary(cone, ray->origin, ray->direction)) return it;
    (void)frexp(cone_reach(cone, ray->origin), &it.length);
    (void)frexp(vec_largest(ray->direction), &it.speed);
    it.cone.base = vec_scale_exactly(cone->base, -it.length);
    it.cone.apex = vec_scale_exactly(cone->apex, -it.length);
    it.cone.base_radius = ldexp(cone->base_radius, -it.length);
    it.cone.apex_radius = ldexp(cone->apex_radius, -it.length);
    it.origin = vec_scale_exactly(ray->origin, -it.length);
    it.direction = vec_scale_exactly(ray->direction, -it.speed);
    return it;
}

/* D is no more than its own error up to this share of |d| |w|, and gives no closest approach. */
#define PARALLEL 0x1p-98

static double closest_approach(const struct scaled_cone *it, struct dd3 w, struct dd3 F,
                               struct dd3 D)
{
    double size = sum_of_sizes(it->direction) * dd3_size(w);
    if (!(dd3_size(D) > PARALLEL * size)) return 0;
    return cone_closest_approach(F, D);
}

/* d x w */
static struct dd3 across_axis(const struct scaled_cone *it, struct dd3 w)
{
    struct vec3 d = it->direction;
    struct dd3 D = dd3_cross(dd3_of(d), w);
    if (dd3_size(D) > CONE_STEEP * sum_of_sizes(d) * dd3_size(w)) return D;
    return (struct dd3){cone_exact_minor(d.y, w.z, d.z, w.y), cone_exact_minor(d.z, w.x, d.x, w.z),
                        cone_exact_minor(d.x, w.y, d.y, w.x)};
}

NOINLINE static struct cone_line line_of(const struct scaled_cone *it, bool from_origin)
{
    struct dd3 w = exact_difference3(it->cone.apex, it->cone.base);
    struct dd3 f = exact_difference3(it->origin, it->cone.base);
    struct dd3 F = dd3_cross(f, w), D = across_axis(it, w);
    double t = from_origin ? 0 : closest_approach(it, w, F, D);
    return cone_line_from(&it->cone, it->direction, w, f, F, D, t);
}

/* ---- the side ---- */

/* The interval of t in which a ray is inside a convex set; empty if enter is after leave. */
struct interval {
    struct dd enter, leave;
};

#define INTERVAL_NONE ((struct interval){{INFINITE, 0}, {-INFINITE, 0}})
#define INTERVAL_ALL  ((struct interval){{-INFINITE, 0}, {INFINITE, 0}})

static bool dd_less(struct dd a, struct dd b)
{
    return a.high < b.high || (a.high == b.high && a.low < b.low);
}

/* A = 0: the ray is parallel to a generator, or to the axis of a cylinder. */
static struct interval linear_side(const struct cone_line *line)
{
    if (line->B.high == 0) return line->C.high <= 0 ? INTERVAL_ALL : INTERVAL_NONE;
    struct dd root = dd_add(dd(line->t), dd_scale(dd_div(line->C, line->B), 0.5));
    if (line->B.high > 0 && line->rho1.high > 0) return (struct interval){root, {INFINITE, 0}};
    if (line->B.high < 0 && line->rho1.high < 0) return (struct interval){{-INFINITE, 0}, root};
    return INTERVAL_NONE;
}

/*
 * Inside the nappe where rho >= 0. If A > 0 the angle between line and axis is larger than that of the generators, and
 * the line meets one nappe: it is inside between the roots, and if that is the other nappe the slab cuts all of it off.
 * If A < 0 the line meets both: of its two half-lines the one that runs towards greater radii is inside.
 */
static struct interval nappe(const struct cone_line *line, const struct dd roots[2])
{
    bool ordered = dd_less(roots[0], roots[1]);
    struct dd low = roots[ordered ? 0 : 1], high = roots[ordered ? 1 : 0];
    if (line->A.high > 0) return (struct interval){low, high};
    if (line->rho1.high > 0) return (struct interval){high, {INFINITE, 0}};
    return (struct interval){{-INFINITE, 0}, low};
}

static bool is_undecided(double value, double error)
{
    return fabs(value) <= error;
}

static void decide_A(const struct scaled_cone *it, struct cone_line *line)
{
    if (is_undecided(line->A.high, cone_A_error(line))) line->A = cone_exact_A(it, line);
}

static struct dd decided_discriminant(const struct scaled_cone *it, const struct cone_line *line,
                                      uint64_t *exact)
{
    double bound;
    struct dd value = cone_discriminant(line, &bound);
    if (!is_undecided(value.high, CONE_LINE_FILTER * bound)) return value;
    ++*exact;
    return cone_exact_discriminant(it, line);
}

static double distances(const struct scaled_cone *it)
{
    return cone_distances(&it->cone, it->origin, it->direction);
}

/* The roots with the parameter counted from the origin; the discriminant is the same there. */
NOINLINE static void roots_from_origin(const struct scaled_cone *it, const struct cone_line *line,
                                       struct dd root, struct dd roots[2])
{
    struct cone_line from = line_of(it, true);
    double S = from.radial;
    double error = 64 * DD_ROUNDOFF * S * S + 2 * S * from.radial_error;
    /* Otherwise the double-double value is correct to 2^-56. */
    if (fabs(from.C.high) <= 0x1p56 * error) from.C = cone_exact_C(it, line);
    struct dd q = cone_larger_sum(from.B, root);
    roots[0] = q.high == 0 ? dd(0) : dd_div(from.C, q);
    roots[1] = dd_div(q, line->A);
}

FLATTENED NOINLINE static struct interval cone_side(const struct scaled_cone *it, uint64_t *exact)
{
    struct cone_line line = line_of(it, false);
    decide_A(it, &line);
    if (line.A.high == 0) return linear_side(&line);
    struct dd discriminant = decided_discriminant(it, &line, exact);
    if (discriminant.high < 0) return INTERVAL_NONE;
    struct dd root = dd_sqrt(discriminant), q = cone_larger_sum(line.B, root);
    struct dd roots[2] = {dd(line.t), dd(line.t)};
    if (q.high != 0) {
        roots[0] = dd_add(roots[0], dd_div(line.C, q));
        roots[1] = dd_add(roots[1], dd_div(q, line.A));
    }
    double size = distances(it), small = fmin(fabs(roots[0].high), fabs(roots[1].high));
    if (small < CONE_ROOT_CANCELLED * (size + fabs(line.t)))
        roots_from_origin(it, &line, root, roots);
    /* For a ray from the tip both roots are 0. */
    if (fabs(roots[1].high) < CONE_SAME_CROSSING * size) roots[1] = dd(0);
    return nappe(&line, roots);
}

/* The interval of a ray that starts on the side and goes inward: C = 0, so one root is 0, and there is no entry. */
static struct interval side_from(const struct scaled_cone *it, struct cone_line *line)
{
    decide_A(it, line);
    struct interval side = {{-INFINITE, 0}, {INFINITE, 0}};
    if (line->A.high > 0) side.leave = dd_scale(dd_div(line->B, line->A), 2);
    return side;
}

/* ---- the caps ---- */

/* The interval between the planes of base and apex, and the caps at its ends. */
struct slab {
    struct interval inside;
    uint32_t enter_part, leave_part;
};

static struct dd ratio(struct dd above, int exponent, struct dd below, int exponent_below)
{
    return dd_ldexp(dd_div(above, below), exponent - exponent_below);
}

FLATTENED NOINLINE static struct slab cone_slab(const struct scaled_cone *it)
{
    int e, e_base, e_apex;
    struct dd3 w = exact_difference3(it->cone.apex, it->cone.base);
    struct dd speed = exact_dot3(dd3_of(it->direction), w, &e);
    struct dd base = exact_dot3(exact_difference3(it->cone.base, it->origin), w, &e_base);
    struct dd apex = exact_dot3(exact_difference3(it->cone.apex, it->origin), w, &e_apex);
    struct slab slab = {.enter_part = speed.high < 0 ? CONE_APEX_CAP : CONE_BASE_CAP,
                        .leave_part = speed.high < 0 ? CONE_BASE_CAP : CONE_APEX_CAP};
    if (speed.high == 0) {
        slab.inside = base.high <= 0 && apex.high >= 0 ? INTERVAL_ALL : INTERVAL_NONE;
        return slab;
    }
    struct dd to_base = ratio(base, e_base, speed, e), to_apex = ratio(apex, e_apex, speed, e);
    slab.inside =
        speed.high < 0 ? (struct interval){to_apex, to_base} : (struct interval){to_base, to_apex};
    return slab;
}

/*
 * Whether the ray certainly enters through a cap, ahead of its origin, so that the side need not be intersected. The
 * distance from the axis is |F + t D| / |w|; see CONE_FILTER for its error.
 */
static bool enters_by_cap(const struct scaled_cone *it, const struct slab *slab)
{
    double t = slab->inside.enter.high;
    bool base = slab->enter_part == CONE_BASE_CAP;
    double radius = base ? it->cone.base_radius : it->cone.apex_radius;
    struct vec3 w = vec_sub(it->cone.apex, it->cone.base);
    struct vec3 f = vec_sub(it->origin, it->cone.base);
    if (!it->cone.capped || !(t > 0 && t < HUGE_VAL)) return false;
    struct vec3 p = vec_cross(vec_add_scaled(f, it->direction, t), w);
    double error = CONE_FILTER * sum_of_sizes(w) *
                   (sum_of_sizes(f) + t * sum_of_sizes(it->direction) + radius);
    return sqrt(vec_dot(p, p)) + error < radius * sqrt(vec_dot(w, w));
}

/* ---- both together ---- */

/* Crossings of the scaled line, before they are rounded to double. */
struct spans {
    struct dd t[2];
    uint32_t part[2];
};

#define NO_SPANS ((struct spans){.t = {{NOT_CROSSED, 0}, {NOT_CROSSED, 0}}})

static bool clearly_less(struct dd a, struct dd b, double size)
{
    if (isinf(a.high) || isinf(b.high)) return a.high < b.high;
    return dd_sub(b, a).high > CONE_SAME_CROSSING * (size + fabs(a.high));
}

static struct spans solid_spans(struct interval side, const struct slab *slab, double size)
{
    struct spans found;
    bool enter_cap = !clearly_less(slab->inside.enter, side.enter, size);
    bool leave_cap = !clearly_less(side.leave, slab->inside.leave, size);
    found.t[0] = enter_cap ? slab->inside.enter : side.enter;
    found.t[1] = leave_cap ? slab->inside.leave : side.leave;
    found.part[0] = enter_cap ? slab->enter_part : CONE_SIDE;
    found.part[1] = leave_cap ? slab->leave_part : CONE_SIDE;
    if (clearly_less(found.t[1], found.t[0], size)) return NO_SPANS;
    if (dd_less(found.t[1], found.t[0])) found.t[1] = found.t[0];
    return found;
}

static bool is_in(struct dd t, struct interval interval, double size)
{
    return !clearly_less(t, interval.enter, size) && !clearly_less(interval.leave, t, size);
}

static struct spans open_spans(struct interval side, const struct slab *slab, double size)
{
    struct spans found = NO_SPANS;
    if (dd_less(side.leave, side.enter)) return found;
    if (is_in(side.enter, slab->inside, size)) found.t[0] = side.enter;
    if (is_in(side.leave, slab->inside, size)) found.t[1] = side.leave;
    return found;
}

static struct spans both_spans(const struct scaled_cone *it, struct interval side,
                               const struct slab *slab)
{
    double size = distances(it);
    return it->cone.capped ? solid_spans(side, slab, size) : open_spans(side, slab, size);
}

/* The exit of a ray that starts on from_part and goes into the cone; no crossing if the ray goes outward or along
 * the surface. If rounding has put the origin beside a solid, the ray leaves it at once. */
static struct spans way_out(const struct scaled_cone *it, uint32_t from_part)
{
    struct slab slab = cone_slab(it);
    struct interval side;
    uint64_t ignored = 0;
    if (from_part == CONE_SIDE) {
        struct cone_line line = line_of(it, true);
        if (!(line.B.high > 0)) return NO_SPANS;
        side = side_from(it, &line);
    } else {
        struct dd3 w = exact_difference3(it->cone.apex, it->cone.base);
        int exponent;
        double speed = exact_dot3(dd3_of(it->direction), w, &exponent).high;
        if (!(from_part == CONE_BASE_CAP ? speed > 0 : speed < 0)) return NO_SPANS;
        side = cone_side(it, &ignored);
    }
    side.enter = slab.inside.enter = dd(-INFINITE);
    struct spans found = both_spans(it, side, &slab);
    found.t[0] = dd(NOT_CROSSED);
    if (it->cone.capped && !(found.t[1].high > 0)) found.t[1] = dd(DBL_TRUE_MIN);
    return found;
}

static struct spans spans_of(const struct scaled_cone *it, const struct ray *ray, bool leaving,
                             bool any, uint64_t *exact)
{
    if (leaving) return way_out(it, ray_from_part(ray));
    struct slab slab = cone_slab(it);
    if (!any && enters_by_cap(it, &slab))
        return (struct spans){{slab.inside.enter, dd(NOT_CROSSED)}, {slab.enter_part, 0}};
    struct interval side = cone_side(it, exact);
    return both_spans(it, side, &slab);
}

FLATTENED struct crossings cone_roots(const struct cone *cone, const struct ray *ray, bool leaving,
                                      bool any, uint64_t *exact)
{
    struct scaled_cone it = scaled_of(cone, ray);
    struct spans spans = spans_of(&it, ray, leaving, any, exact);
    struct crossings found = NO_CROSSINGS;
    for (unsigned i = 0; i < 2; i++) {
        found.t[i] = ldexp(spans.t[i].high, it.length - it.speed);
        if (spans.t[i].high > 0)
            found.t[i] = fmax(found.t[i], DBL_TRUE_MIN); /* still ahead: see way_out() */
        found.part[i] = spans.part[i];
    }
    return found;
}

static struct dd span_at(const struct scaled_cone *it, const struct ray *ray, double rounded,
                         uint32_t part, bool leaving)
{
    uint64_t ignored = 0;
    if (part != CONE_SIDE) {
        struct slab slab = cone_slab(it);
        struct dd cap = part == slab.enter_part ? slab.inside.enter : slab.inside.leave;
        if (cap.high == rounded) return cap;
    }
    struct spans spans = spans_of(it, ray, leaving, true, &ignored);
    for (unsigned i = 0; i < 2; i++)
        if (spans.t[i].high == rounded) return spans.t[i];
    return dd(rounded);
}

/* The crossing that was rounded to t. An exit was computed as if the origin were exactly on the side. The later root
 * for the rounded origin replaces it, if the ray leaves through the side and both agree within WAY_OUT_ERROR. */
static struct dd parameter_at(const struct scaled_cone *it, const struct ray *ray, double t,
                              uint32_t part, bool leaving)
{
    double rounded = ldexp(t, it->speed - it->length);
    uint64_t ignored = 0;
    if (leaving && part == CONE_SIDE) {
        struct dd root = cone_side(it, &ignored).leave;
        if (fabs(root.high - rounded) <= WAY_OUT_ERROR * rounded) return root;
    }
    return span_at(it, ray, rounded, part, leaving);
}

FLATTENED struct dd cone_parameter(const struct cone *cone, const struct ray *ray, double t,
                                   uint32_t part, bool leaving)
{
    struct scaled_cone it = scaled_of(cone, ray);
    return dd_ldexp(parameter_at(&it, ray, t, part, leaving), it.length - it.speed);
}

FLATTENED struct dd3 cone_point(const struct cone *cone, const struct ray *ray, double t,
                                uint32_t part, bool leaving)
{
    struct scaled_cone it = scaled_of(cone, ray);
    struct dd3 step = dd3_scale(it.direction, parameter_at(&it, ray, t, part, leaving));
    struct dd3 p = dd3_add(exact_difference3(it.origin, it.cone.base), step);
    return dd3_ldexp(p, it.length);
}

FLATTENED struct vec3 cone_normal(const struct cone *cone, struct dd3 p, uint32_t part)
{
    struct dd3 w = exact_difference3(cone->apex, cone->base);
    struct dd widening = exact_difference(cone->apex_radius, cone->base_radius);
    double size = fmax(vec_largest(dd3_round(w)), fmax(cone->base_radius, cone->apex_radius));
    /* Six lengths are multiplied. Only the size of the cone matters here, not its position. */
    if (!is_ordinary_for_cone(size)) {
        int exponent;
        (void)frexp(size, &exponent);
        w = dd3_ldexp(w, -exponent);
        widening = dd_ldexp(widening, -exponent);
        p = dd3_ldexp(p, -exponent);
    }
    struct vec3 axis = dd3_round(w);
    if (part == CONE_APEX_CAP) return vec_normalize(axis);
    if (part == CONE_BASE_CAP) return vec_normalize(vec_neg(axis));
    struct dd W = dd3_dot(w, w);
    struct dd3 radial = cone_radial(p, w, W);
    struct dd rho = dd_sqrt(dd3_dot(radial, radial));
    struct vec3 gradient = cone_gradient(radial, rho, widening, w, W);
    if (vec_is_zero(gradient)) return vec_normalize(widening.high < 0 ? axis : vec_neg(axis));
    return vec_normalize(gradient);
}
