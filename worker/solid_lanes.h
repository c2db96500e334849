/*
 * Eight pairs of a ray and a sphere, cylinder, cone or frustum, in plain arithmetic: between which
 * distances the ray comes in and goes out, or that it does not. Where rounding leaves that open, and
 * for the distances themselves, the functions for one pair are asked.
 *
 * Both kinds look at the line from its point closest to the solid, o + t0 d, where t0 is a double
 * like any other and not rounded any more: what is left to be computed is of the size of the solid.
 * L, in lanes `reach`, is the sum of absolute values of f = o - c (o - base) and the solid's own
 * lengths, and so not less than any of the vectors below.
 */
#ifndef FARM_WORKER_SOLID_LANES_H
#define FARM_WORKER_SOLID_LANES_H

#include "worker/bvh.h"
#include "worker/lanes_dd.h"
#include "worker/shape.h"

struct ray_lanes {
    struct lanes3 o, d;
    struct lanes speed;    /* sum of absolute values: |d| at least */
    struct lanes inverse2; /* 1 / d.d */
};

/* Eight times the same ray. */
static INLINED struct ray_lanes ray_lanes_of(const struct ray *ray)
{
    struct vec3 o = ray->origin, d = ray->direction;
    return (struct ray_lanes){{lanes_of(o.x), lanes_of(o.y), lanes_of(o.z)},
                              {lanes_of(d.x), lanes_of(d.y), lanes_of(d.z)},
                              lanes_of(sum_of_sizes(d)),
                              lanes_of(1 / vec_dot(d, d))};
}

static INLINED struct ray_lanes rays_in_lanes(const struct lanes o[3], const struct lanes d[3])
{
    struct ray_lanes rays = {.o = {o[0], o[1], o[2]}, .d = {d[0], d[1], d[2]}};
    rays.speed = lanes3_sum_of_sizes(rays.d);
    rays.inverse2 = lanes_div(lanes_of(1), lanes3_dot(rays.d, rays.d));
    return rays;
}

struct sphere_lanes {
    struct lanes3 center;
    struct lanes radius;
};

struct cone_lanes {
    struct lanes3 base, apex;
    struct lanes base_radius, apex_radius;
};

/*
 * What is known of the line's passage through the solid. Of one that is not missed, nothing is
 * before enter_low or behind leave_high; where that is told, the line certainly comes in between
 * the first two, which includes what rounding does to that distance, and goes out between the
 * others.
 */
struct solid_spans {
    lane_set missed, told;
    lane_set enter_side,
        leave_side; /* of those told: where a cone's side, or a sphere, is crossed */
    struct lanes enter_low, enter_high, leave_low, leave_high;
};

/* Products of four lengths, directions and their errors are in range. */
static INLINED lane_set are_ordinary(struct lanes largest, struct lanes smallest)
{
    return lanes_less(largest, lanes_of(0x1p200)) & lanes_less(lanes_of(0x1p-200), smallest);
}

static INLINED struct lanes lanes_fma_dot(struct lanes3 a, struct lanes3 b)
{
    return lanes_fma(a.z, b.z, lanes_fma(a.y, b.y, lanes_mul(a.x, b.x)));
}

/* a + b s */
static INLINED struct lanes3 lanes_advance(struct lanes3 a, struct lanes3 b, struct lanes s)
{
    return (struct lanes3){lanes_fma(b.x, s, a.x), lanes_fma(b.y, s, a.y), lanes_fma(b.z, s, a.z)};
}

static INLINED struct lanes lanes_square(struct lanes a)
{
    return lanes_mul(a, a);
}

static INLINED struct lanes lanes_times(double factor, struct lanes a)
{
    return lanes_mul(lanes_of(factor), a);
}

/*
 * l = f + t0 d errs by 3 u L (f by u of itself, the sum by u of its own), and t0 differs from the
 * closest approach by 9 u L / |d|: the distance |l| from the line to the centre by less than 13 u L,
 * less than half of E = 32 u L. So r^2 - l.l errs, where it is positive, by less than 2 (r + E) E,
 * with its own roundings; its root h, divided by |d|, by that over 2 h; t0 by E / 2 |d|, with the
 * roundings of t0 +- h.
 */
#define SPHERE_SPAN_ERROR (32 * UNIT_ROUNDOFF)

static INLINED struct solid_spans sphere_spans(const struct sphere_lanes *sphere,
                                               const struct ray_lanes *ray)
{
    struct lanes3 f = lanes3_sub(ray->o, sphere->center);
    struct lanes r = sphere->radius, reach = lanes_add(lanes3_sum_of_sizes(f), r);
    struct lanes t0 = lanes_negate(lanes_mul(lanes_fma_dot(f, ray->d), ray->inverse2));
    struct lanes3 l = lanes_advance(f, ray->d, t0);
    struct lanes ll = lanes_fma_dot(l, l), error = lanes_times(SPHERE_SPAN_ERROR, reach);
    struct lanes outer = lanes_add(r, error);
    struct lanes square = lanes_fma(r, r, lanes_negate(ll));
    struct lanes square_error = lanes_times(2, lanes_mul(outer, error));
    struct lanes half = lanes_sqrt(lanes_mul(square, ray->inverse2));
    struct lanes per_speed = lanes_mul(ray->speed, ray->inverse2); /* 1 / |d| at least */
    struct lanes slack = lanes_div(lanes_mul(square_error, ray->inverse2), half);
    slack = lanes_fma(error, per_speed, slack);
    struct lanes whole = lanes_mul(lanes_add(outer, error), per_speed);

    lane_set ordinary =
        are_ordinary(lanes_larger(reach, ray->speed), lanes_smaller(reach, ray->speed));
    struct solid_spans spans;
    spans.missed = ordinary & lanes_less(lanes_square(outer), ll);
    spans.told = ordinary & lanes_less(lanes_times(4, square_error), square);
    spans.enter_side = spans.leave_side = ALL_LANES;
    spans.enter_high = lanes_add(lanes_sub(t0, half), slack);
    spans.leave_low = lanes_sub(lanes_add(t0, half), slack);
    struct lanes most = lanes_choose(spans.told, lanes_add(half, slack), whole);
    spans.enter_low = lanes_choose(ordinary, lanes_sub(t0, most), lanes_of(-INFINITE));
    spans.leave_high = lanes_choose(ordinary, lanes_add(t0, most), lanes_of(INFINITE));
    return spans;
}

/*
 * The cone as in worker/cone.h, with its axis w as the unit of heights: a point p is at s = p.w / W,
 * and p - s w away from the axis. At g = f + t0 d and along d these are s_g, s_d, P = g - s_g w, Q =
 * d - s_d w, the radii rho_g = r0 + (r1 - r0) s_g and rho_d = (r1 - r0) s_d; the line is inside while
 *
 *   A x^2 - 2 B x + C <= 0,   A = Q.Q - rho_d^2,  B = rho_g rho_d - P.Q,  C = P.P - rho_g^2
 *
 * and between the caps at x = -g.w / d.w and (W - g.w) / d.w, x being counted from t0.
 *
 * Let k = R / |w| with the larger radius R, and K2 = 2 (1 + k^2) >= (1 + k)^2. g errs by 4 u L, s_g
 * by 16 u L / |w| and s_d by 12 u |d| / |w|; P by 24 u L, Q by 16 u |d|, rho_g by 20 u (1 + k) L,
 * rho_d by 16 u k |d|; these are at most L, |d|, (1 + k) L and k |d|. So A, B and C err by less
 * than E |d|^2, E L |d| and E L^2, E = 64 u K2, with their own roundings; each of them is at most
 * E / (64 u) times the same. B^2 - A C then errs by less than 8 K2 E (L |d|)^2.
 */
#define CONE_SPAN_ERROR (64 * UNIT_ROUNDOFF)

/* An interval of x whose ends are told up to an error; open is infinite. */
struct part_span {
    lane_set told;
    struct lanes low, high, error;
};

struct cone_line_lanes {
    struct lanes3 w, g;
    struct lanes reach, t0;
    struct lanes g_w, d_w, W;
};

static INLINED struct cone_line_lanes cone_line_lanes(const struct cone_lanes *cone,
                                                      const struct ray_lanes *ray)
{
    struct cone_line_lanes line;
    struct lanes3 f = lanes3_sub(ray->o, cone->base);
    line.w = lanes3_sub(cone->apex, cone->base);
    struct lanes3 to_middle = lanes_advance(f, line.w, lanes_of(-0.5));
    line.t0 = lanes_negate(lanes_mul(lanes_fma_dot(to_middle, ray->d), ray->inverse2));
    line.g = lanes_advance(f, ray->d, line.t0);
    line.W = lanes_fma_dot(line.w, line.w);
    line.g_w = lanes_fma_dot(line.g, line.w);
    line.d_w = lanes_fma_dot(ray->d, line.w);
    line.reach = lanes_add(lanes3_sum_of_sizes(f), lanes3_sum_of_sizes(line.w));
    line.reach = lanes_add(line.reach, lanes_larger(cone->base_radius, cone->apex_radius));
    return line;
}

/*
 * Between the caps: g.w and W err by 16 u L |w|, d.w by 6 u |d| |w|. Nothing is told of a ray that
 * runs across the axis but for rounding.
 */
static INLINED struct part_span slab_span(const struct cone_line_lanes *line,
                                          const struct ray_lanes *ray)
{
    struct lanes width = lanes3_sum_of_sizes(line->w), inverse = lanes_div(lanes_of(1), line->d_w);
    struct lanes to_base = lanes_negate(lanes_mul(line->g_w, inverse));
    struct lanes to_apex = lanes_mul(lanes_sub(line->W, line->g_w), inverse);
    struct lanes most = lanes_add(lanes_abs(to_base), lanes_abs(to_apex));
    struct lanes error = lanes_mul(lanes_fma(most, ray->speed, line->reach), width);
    error = lanes_times(32 * UNIT_ROUNDOFF, lanes_mul(error, lanes_abs(inverse)));
    struct lanes least = lanes_times(0x1p14 * UNIT_ROUNDOFF, lanes_mul(ray->speed, width));
    return (struct part_span){lanes_less(least, lanes_abs(line->d_w)),
                              lanes_smaller(to_base, to_apex), lanes_larger(to_base, to_apex),
                              error};
}

/*
 * Inside of the side, whose A is certainly positive: then the line meets one nappe alone, and if
 * that is the other one, the caps' planes leave nothing of it. The root of the discriminant D errs
 * by its error over its root if D is more than 4 times that error; a quotient N / A by (error of N
 * + |N| error of A / A) / A but for terms of second order. *missed: it has no roots.
 */
static INLINED struct part_span side_span(const struct cone_lanes *cone,
                                          const struct cone_line_lanes *line,
                                          const struct ray_lanes *ray, lane_set *missed)
{
    struct lanes inverse_W = lanes_div(lanes_of(1), line->W);
    struct lanes s_g = lanes_mul(line->g_w, inverse_W), s_d = lanes_mul(line->d_w, inverse_W);
    struct lanes3 P = lanes_advance(line->g, line->w, lanes_negate(s_g));
    struct lanes3 Q = lanes_advance(ray->d, line->w, lanes_negate(s_d));
    struct lanes widening = lanes_sub(cone->apex_radius, cone->base_radius);
    struct lanes rho_g = lanes_fma(widening, s_g, cone->base_radius);
    struct lanes rho_d = lanes_mul(widening, s_d);
    struct lanes A = lanes_sub(lanes_fma_dot(Q, Q), lanes_square(rho_d));
    struct lanes B = lanes_sub(lanes_mul(rho_g, rho_d), lanes_fma_dot(P, Q));
    struct lanes C = lanes_sub(lanes_fma_dot(P, P), lanes_square(rho_g));
    struct lanes D = lanes_sub(lanes_square(B), lanes_mul(A, C));

    struct lanes radius = lanes_larger(cone->base_radius, cone->apex_radius);
    struct lanes K2 = lanes_fma(lanes_square(radius), inverse_W, lanes_of(1));
    K2 = lanes_times(2, K2);
    struct lanes error = lanes_times(CONE_SPAN_ERROR, K2);
    struct lanes speed = ray->speed, size = lanes_mul(line->reach, speed);
    struct lanes A_error = lanes_mul(error, lanes_square(speed));
    struct lanes B_error = lanes_mul(error, size);
    struct lanes D_error = lanes_mul(lanes_mul(lanes_times(8, K2), B_error), size);

    lane_set narrow = lanes_less(lanes_times(0x1p6, A_error), A);
    *missed = narrow & lanes_less(D, lanes_negate(D_error));
    struct lanes root = lanes_sqrt(D), inverse_A = lanes_div(lanes_of(1), A);
    struct lanes slack = lanes_add(B_error, lanes_div(D_error, root));
    struct lanes most = lanes_mul(lanes_add(lanes_abs(B), root), lanes_mul(A_error, inverse_A));
    slack = lanes_mul(lanes_add(slack, lanes_times(2, most)), lanes_times(2, inverse_A));
    return (struct part_span){narrow & lanes_less(lanes_times(4, D_error), D),
                              lanes_mul(lanes_sub(B, root), inverse_A),
                              lanes_mul(lanes_add(B, root), inverse_A), slack};
}

/* Of a cone with caps; of an open one nothing else is true but what is missed, and that nothing is
 * before enter_low or behind leave_high. */
static INLINED struct solid_spans cone_spans(const struct cone_lanes *cone,
                                             const struct ray_lanes *ray)
{
    const struct lanes none = lanes_of(-INFINITE), all = lanes_of(INFINITE);
    struct cone_line_lanes line = cone_line_lanes(cone, ray);
    lane_set ordinary = are_ordinary(lanes_larger(line.reach, ray->speed),
                                     lanes_smaller(lanes3_sum_of_sizes(line.w), ray->speed));
    struct solid_spans spans;
    struct part_span slab = slab_span(&line, ray);
    struct part_span side = side_span(cone, &line, ray, &spans.missed);
    slab.told &= ordinary;
    side.told &= ordinary;
    struct lanes slab_low = lanes_choose(slab.told, lanes_sub(slab.low, slab.error), none);
    struct lanes slab_high = lanes_choose(slab.told, lanes_add(slab.high, slab.error), all);
    struct lanes side_low = lanes_choose(side.told, lanes_sub(side.low, side.error), none);
    struct lanes side_high = lanes_choose(side.told, lanes_add(side.high, side.error), all);
    spans.enter_low = lanes_add(line.t0, lanes_larger(slab_low, side_low));
    spans.leave_high = lanes_add(line.t0, lanes_smaller(slab_high, side_high));
    struct lanes entered =
        lanes_larger(lanes_add(slab.low, slab.error), lanes_add(side.low, side.error));
    struct lanes left =
        lanes_smaller(lanes_sub(slab.high, slab.error), lanes_sub(side.high, side.error));
    spans.enter_high = lanes_add(line.t0, entered);
    spans.leave_low = lanes_add(line.t0, left);
    spans.enter_side = lanes_less(lanes_add(slab.low, slab.error), lanes_sub(side.low, side.error));
    spans.leave_side =
        lanes_less(lanes_add(side.high, side.error), lanes_sub(slab.high, slab.error));
    spans.missed = ordinary & (spans.missed | lanes_less(spans.leave_high, spans.enter_low));
    spans.told = side.told & slab.told & lanes_less(spans.enter_high, spans.leave_low);
    return spans;
}

/* ---- what there is in a leaf ---- */

static INLINED struct lanes3 point_in_lanes(struct vec3 p)
{
    return (struct lanes3){lanes_of(p.x), lanes_of(p.y), lanes_of(p.z)};
}

/* Eight times the same. */
static INLINED struct sphere_lanes sphere_in_lanes(const struct scene *scene, uint32_t id)
{
    const struct sphere *it = &scene_spheres(scene)[primitive_index(id)];
    return (struct sphere_lanes){point_in_lanes(it->center), lanes_of(it->radius)};
}

static INLINED struct cone_lanes cone_in_lanes(const struct scene *scene, uint32_t id)
{
    const struct cone *it = &scene_cones(scene)[primitive_index(id)];
    return (struct cone_lanes){point_in_lanes(it->base), point_in_lanes(it->apex),
                               lanes_of(it->base_radius), lanes_of(it->apex_radius)};
}

static INLINED struct sphere_lanes spheres_in_lanes(const struct scene *scene,
                                                    const struct bvh_leaf *leaves, uint32_t count)
{
    const struct axis_order xyz = axis_order(0, 1, 2);
    const double *first[LANES], *last[LANES];
    struct lanes center[3], rest[3];
    UNROLLED
    for (uint32_t i = 0; i < LANES; i++) {
        uint32_t index = primitive_index(leaves[i < count ? i : 0].id);
        const struct sphere *sphere = &scene_spheres(scene)[index];
        first[i] = &sphere->center.x;
        last[i] = &sphere->center.z; /* z, radius, and no number */
    }
    lanes_transpose(first, &xyz, center);
    lanes_transpose(last, &xyz, rest);
    return (struct sphere_lanes){{center[0], center[1], center[2]}, rest[1]};
}

static INLINED struct cone_lanes cones_in_lanes(const struct scene *scene,
                                                const struct bvh_leaf *leaves, uint32_t count)
{
    const struct axis_order xyz = axis_order(0, 1, 2);
    const double *bases[LANES], *apexes[LANES], *radii[LANES];
    struct lanes base[3], apex[3], radius[3];
    UNROLLED
    for (uint32_t i = 0; i < LANES; i++) {
        uint32_t index = primitive_index(leaves[i < count ? i : 0].id);
        const struct cone *cone = &scene_cones(scene)[index];
        bases[i] = &cone->base.x;
        apexes[i] = &cone->apex.x;
        radii[i] = &cone->base_radius; /* both, and no number */
    }
    lanes_transpose(bases, &xyz, base);
    lanes_transpose(apexes, &xyz, apex);
    lanes_transpose(radii, &xyz, radius);
    return (struct cone_lanes){
        {base[0], base[1], base[2]}, {apex[0], apex[1], apex[2]}, radius[0], radius[1]};
}

/* Whether it is a solid of the kinds above, seen from both sides: whose spans may be told. */
static inline bool is_told_solid(const struct scene *scene, uint32_t id)
{
    if (primitive_kind(id) == PRIMITIVE_CONE) return scene_cones(scene)[primitive_index(id)].capped;
    return !scene_spheres(scene)[primitive_index(id)].inside_only;
}

static inline bool has_spans(uint32_t id)
{
    return primitive_kind(id) == PRIMITIVE_SPHERE || primitive_kind(id) == PRIMITIVE_CONE;
}

/* How many of one kind come first; 8 at most. */
static inline uint32_t run_of_kind(const struct bvh_leaf *leaves, uint32_t count)
{
    uint32_t run = 1;
    while (run < count && run < LANES &&
           primitive_kind(leaves[run].id) == primitive_kind(leaves->id))
        run++;
    return run;
}

/* `count` of one kind, 8 at most, and one ray. */
static INLINED struct solid_spans spans_of_leaf(const struct scene *scene,
                                                const struct bvh_leaf *leaves, uint32_t count,
                                                const struct ray *ray)
{
    struct ray_lanes rays = ray_lanes_of(ray);
    if (primitive_kind(leaves->id) == PRIMITIVE_CONE) {
        struct cone_lanes cones =
            count == 1 ? cone_in_lanes(scene, leaves->id) : cones_in_lanes(scene, leaves, count);
        return cone_spans(&cones, &rays);
    }
    struct sphere_lanes spheres =
        count == 1 ? sphere_in_lanes(scene, leaves->id) : spheres_in_lanes(scene, leaves, count);
    return sphere_spans(&spheres, &rays);
}

/* One of them and eight rays. */
static INLINED struct solid_spans spans_of_rays(const struct scene *scene, uint32_t id,
                                                const struct ray_lanes *rays)
{
    if (primitive_kind(id) == PRIMITIVE_CONE) {
        struct cone_lanes cone = cone_in_lanes(scene, id);
        return cone_spans(&cone, rays);
    }
    struct sphere_lanes sphere = sphere_in_lanes(scene, id);
    return sphere_spans(&sphere, rays);
}

/* ---- what of it counts ---- */

/* Where a ray meets the solid first, ahead of its origin, if that is told. */
struct first_crossing {
    lane_set told;
    lane_set on_side; /* of those told: certainly not on a cap */
    struct lanes from, to;
};

static INLINED struct first_crossing first_crossing(const struct solid_spans *spans)
{
    const struct lanes zero = lanes_of(0);
    lane_set outside = lanes_less(zero, spans->enter_low);
    lane_set inside = lanes_less(spans->enter_high, zero) & lanes_less(zero, spans->leave_low);
    return (struct first_crossing){
        spans->told & (outside | inside),
        (outside & spans->enter_side) | (inside & spans->leave_side),
        lanes_choose(outside, spans->enter_low, spans->leave_low),
        lanes_choose(outside, spans->enter_high, spans->leave_high),
    };
}

/* The rays that certainly cross the surface once, and twice, between 0 and t_max. */
struct crossing_sets {
    lane_set once, twice;
};

static INLINED struct crossing_sets crossing_sets(const struct solid_spans *spans,
                                                  struct lanes t_max)
{
    const struct lanes zero = lanes_of(0);
    lane_set outside = lanes_less(zero, spans->enter_low);
    lane_set inside = lanes_less(spans->enter_high, zero) & lanes_less(zero, spans->leave_low);
    lane_set through = lanes_less(spans->leave_high, t_max);
    lane_set ends_inside =
        lanes_less(spans->enter_high, t_max) & lanes_less(t_max, spans->leave_low);
    return (struct crossing_sets){spans->told & ((outside & ends_inside) | (inside & through)),
                                  spans->told & outside & through};
}

/* The lanes of which something may be at 0 <= t <= limit. */
static INLINED lane_set may_be_crossed(const struct solid_spans *spans, struct lanes limit)
{
    return ALL_LANES & ~(spans->missed | lanes_less(spans->leave_high, lanes_of(0)) |
                         lanes_less(limit, spans->enter_low));
}

/* Of `count` of a leaf the one that the ray starts on. Its spans say nothing: the ray's origin is
 * next to its surface, on either side. */
static INLINED lane_set lane_of_id(const struct bvh_leaf *leaves, uint32_t count, uint32_t id)
{
    lane_set set = 0;
    for (uint32_t i = 0; i < count; i++)
        set |= (lane_set)(leaves[i].id == id) << i;
    return set;
}

#endif
