/* Rows 40-44: cylinders and cones, against exact arithmetic. */
#include <stdlib.h>
#include <string.h>

#include "bench/oracle.h"
#include "bench/stability.h"

/* ---- the oracle ---- */

/*
 * With f = o - base, w = apex - base, W = w.w: a point of the ray lies at height (H0 + t H1) / W,
 * where the radius is (R0 + t R1) / W, at the squared distance |F + t D|^2 / W from the axis, F =
 * f x w, D = d x w. It is in the cone where A t^2 - 2 B t + C <= 0, with A = W D.D - R1^2, B =
 * R0 R1 - W F.D, C = W F.F - R0^2. Between the end planes both radii are >= 0, so that the other
 * nappe needs no care.
 */
enum {
    FROM,
    DIR = FROM + 3,
    AXIS = DIR + 3,
    F = AXIS + 3,
    D = F + 3,
    W = D + 3,
    H0,
    H1,
    R0,
    R1,
    FF,
    FD,
    DD,
    A,
    B,
    C,
    DISC,
    ROOT,
    TEMP,
    CANDIDATE,
    CONE_REALS = CANDIDATE + 4
};

struct cone_truth {
    mpfr_t real[CONE_REALS];
    unsigned candidates; /* crossings of the line and the surface, in CANDIDATE .. */
    uint32_t part[4];    /* of each crossing */
    bool along;          /* the line lies in the side, so all its points are crossings */
    int first;           /* the first candidate with t > 0, or -1 */
    bool tie;            /* a crossing of another part has the same t: either part is right */
};

/* Roots of polynomials in the inputs that agree in this many bits are equal: distinct ones differ by far more, which
 * the 2048 bits of the numbers resolve. */
#define SAME_BITS 1500

static bool same(mpfr_t a, mpfr_t b)
{
    return mpfr_equal_p(a, b) || mpfr_eq(a, b, SAME_BITS);
}

static void solve_coefficients(mpfr_t *real, const struct cone *cone, const struct ray *ray)
{
    oracle_exact_begin();
    real_difference(&real[FROM], ray->origin, cone->base);
    real_difference(&real[AXIS], cone->apex, cone->base);
    real_set(&real[DIR], ray->direction);
    real_cross(&real[F], &real[FROM], &real[AXIS]);
    real_cross(&real[D], &real[DIR], &real[AXIS]);
    real_dot(real[W], &real[AXIS], &real[AXIS]);
    real_dot(real[H0], &real[FROM], &real[AXIS]);
    real_dot(real[H1], &real[DIR], &real[AXIS]);
    real_dot(real[FF], &real[F], &real[F]);
    real_dot(real[FD], &real[F], &real[D]);
    real_dot(real[DD], &real[D], &real[D]);
    mpfr_set_d(real[TEMP], cone->apex_radius, MPFR_RNDN);
    mpfr_sub_d(real[TEMP], real[TEMP], cone->base_radius, MPFR_RNDN);
    mpfr_mul(real[R1], real[TEMP], real[H1], MPFR_RNDN);
    mpfr_mul(real[R0], real[TEMP], real[H0], MPFR_RNDN);
    mpfr_mul_d(real[TEMP], real[W], cone->base_radius, MPFR_RNDN);
    mpfr_add(real[R0], real[R0], real[TEMP], MPFR_RNDN);
    mpfr_fmms(real[A], real[W], real[DD], real[R1], real[R1], MPFR_RNDN);
    mpfr_fmms(real[B], real[R0], real[R1], real[W], real[FD], MPFR_RNDN);
    mpfr_fmms(real[C], real[W], real[FF], real[R0], real[R0], MPFR_RNDN);
    mpfr_fmms(real[DISC], real[B], real[B], real[A], real[C], MPFR_RNDN);
    oracle_exact_end();
}

/* Counts the crossing that has been stored at CANDIDATE + candidates if it is between the end planes or on one. */
static void add_if_between(struct cone_truth *truth)
{
    mpfr_t *real = truth->real;
    mpfr_fma(real[TEMP], real[CANDIDATE + truth->candidates], real[H1], real[H0], MPFR_RNDN);
    bool below = mpfr_sgn(real[TEMP])<0, above = mpfr_cmp(real[TEMP], real[W])> 0;
    if (above && mpfr_eq(real[TEMP], real[W], SAME_BITS)) above = false;
    if (below) { /* -0.0...01: compare t H1 with -H0 */
        mpfr_mul(real[TEMP], real[CANDIDATE + truth->candidates], real[H1], MPFR_RNDN);
        mpfr_neg(real[TEMP], real[TEMP], MPFR_RNDN);
        below = !mpfr_eq(real[TEMP], real[H0], SAME_BITS);
    }
    if (!below && !above) truth->part[truth->candidates++] = CONE_SIDE;
}

static void solve_side(struct cone_truth *truth)
{
    mpfr_t *real = truth->real;
    if (mpfr_zero_p(real[A])) {
        truth->along = mpfr_zero_p(real[B]) && mpfr_zero_p(real[C]);
        if (mpfr_zero_p(real[B])) return;
        mpfr_div(real[CANDIDATE], real[C], real[B], MPFR_RNDN);
        mpfr_div_2ui(real[CANDIDATE], real[CANDIDATE], 1, MPFR_RNDN);
        add_if_between(truth);
        return;
    }
    if (mpfr_sgn(real[DISC]) < 0) return;
    mpfr_sqrt(real[ROOT], real[DISC], MPFR_RNDN);
    for (int i = 0; i < 2; i++) {
        mpfr_t *t = &real[CANDIDATE + truth->candidates];
        (i ? mpfr_add : mpfr_sub)(*t, real[B], real[ROOT], MPFR_RNDN);
        mpfr_div(*t, *t, real[A], MPFR_RNDN);
        add_if_between(truth);
    }
}

/* Counts the crossing with an end plane if the point is not outside the cone. With t = n / H1 this is decided by the
 * sign of A n^2 - 2 B n H1 + C H1^2. */
static void solve_cap(struct cone_truth *truth, bool apex)
{
    mpfr_t *real = truth->real;
    mpfr_t *n = &real[CANDIDATE + truth->candidates];
    if (mpfr_zero_p(real[H1])) return;
    oracle_exact_begin();
    mpfr_neg(*n, real[H0], MPFR_RNDN);
    if (apex) mpfr_add(*n, *n, real[W], MPFR_RNDN);
    mpfr_mul(real[TEMP], real[A], *n, MPFR_RNDN);
    mpfr_mul(real[ROOT], real[B], real[H1], MPFR_RNDN);
    mpfr_mul_2ui(real[ROOT], real[ROOT], 1, MPFR_RNDN);
    mpfr_sub(real[TEMP], real[TEMP], real[ROOT], MPFR_RNDN);
    mpfr_mul(real[ROOT], real[H1], real[H1], MPFR_RNDN);
    mpfr_fmma(real[TEMP], real[TEMP], *n, real[C], real[ROOT], MPFR_RNDN);
    oracle_exact_end();
    if (mpfr_sgn(real[TEMP]) > 0) return;
    mpfr_div(*n, *n, real[H1], MPFR_RNDN);
    truth->part[truth->candidates++] = apex ? CONE_APEX_CAP : CONE_BASE_CAP;
}

static void solve_cone(struct cone_truth *truth, const struct cone *cone, const struct ray *ray)
{
    mpfr_t *real = truth->real;
    solve_coefficients(real, cone, ray);
    truth->candidates = 0;
    truth->along = false;
    truth->first = -1;
    truth->tie = false;
    bool beside =
        mpfr_zero_p(real[H1]) && (mpfr_sgn(real[H0]) < 0 || mpfr_cmp(real[H0], real[W]) > 0);
    if (beside) return;
    solve_side(truth);
    if (cone->capped) {
        solve_cap(truth, false);
        solve_cap(truth, true);
    }
    for (unsigned i = 0; i < truth->candidates; i++) {
        mpfr_t *t = &real[CANDIDATE + i];
        if (mpfr_sgn(*t) <= 0) continue;
        mpfr_t *best = truth->first < 0 ? NULL : &real[CANDIDATE + (unsigned)truth->first];
        if (best && same(*t, *best)) {
            truth->tie |= truth->part[i] != truth->part[truth->first];
        } else if (!best || mpfr_less_p(*t, *best)) {
            truth->first = (int)i;
            truth->tie = false;
        }
    }
}

/* ---- a case ---- */

struct cone_row {
    struct cone (*draw)(struct random *random);
    struct ray (*aim)(struct random *random, const struct cone *cone);
};

static void compare(struct score *score, const struct hit *hit, struct cone_truth *truth,
                    uint64_t sample)
{
    bool met = hit->primitive != PRIMITIVE_NONE;
    if (met != (truth->first >= 0) || isnan(hit->t))
        score_wrong(score, sample);
    else if (met && hit->part != truth->part[truth->first] && !truth->tie)
        score_wrong(score, sample);
    else if (met)
        score_error(score, ulps(hit->t, truth->real[CANDIDATE + truth->first]), sample);
}

static struct stage cone_stage(const struct cone *cone)
{
    struct builder *builder = builder_create();
    struct cone solid = *cone;
    solid.material = stage_material(builder);
    expect_added(builder_add_cone(builder, &solid));
    return stage_finish(builder, NULL);
}

static void cone_block(struct block *block, const void *context)
{
    const struct cone_row *row = context;
    struct tally *tally = block->tally;
    struct cone cone = {.capped = 0};
    struct stage stage = {NULL, NULL, NULL};
    struct cone_truth truth;
    reals_init(truth.real, CONE_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            cone = row->draw(&block->random);
            stage = cone_stage(&cone);
        }
        struct ray ray = row->aim(&block->random, &cone);
        solve_cone(&truth, &cone, &ray);
        if (truth.along) continue; /* in the side all the way: no single crossing is right */
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        compare(&tally->ours, &ours, &truth, block->first + i);
        compare(&tally->paper, &paper, &truth, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
    reals_clear(truth.real, CONE_REALS);
}

/* ---- rows 40, 41: cylinders ---- */

static struct cone cylinder(struct random *random, double radius, double length)
{
    struct vec3 base = random_away(random, random_between(random, 0, 10));
    struct vec3 apex = vec_add(base, random_away(random, length));
    return (struct cone){.base = base,
                         .apex = apex,
                         .base_radius = radius,
                         .apex_radius = radius,
                         .capped = (uint32_t)random_below(random, 2)};
}

static struct cone any_cylinder(struct random *random)
{
    double radius = random_log(random, 0.1, 10);
    return cylinder(random, radius, radius * random_log(random, 0.5, 100));
}

/* A point of the side at a random height; *out is the direction away from the axis there. */
static struct vec3 point_of_side(struct random *random, const struct cone *cone, struct vec3 *along,
                                 struct vec3 *out)
{
    struct vec3 w = vec_sub(cone->apex, cone->base), v;
    double height = random_between(random, 0, 1);
    double radius = cone->base_radius + height * (cone->apex_radius - cone->base_radius);
    *along = vec_normalize(w);
    random_frame(random, *along, out, &v);
    return vec_add_scaled(vec_add_scaled(cone->base, w, height), *out, radius);
}

/* A ray at an angle of 1e-1 to 1e-15 to the axis, towards a point of the side, from outside or inside. */
static struct ray aim_steep(struct random *random, const struct cone *cone)
{
    struct vec3 along, out, v;
    struct vec3 target = point_of_side(random, cone, &along, &out);
    double angle = random_log(random, 1e-15, 0.1);
    random_frame(random, along, &v, &out);
    struct vec3 axis = vec_scale(along, random_sign(random));
    struct vec3 direction = vec_normalize(vec_add_scaled(axis, v, angle));
    double distance = cone->base_radius * random_log(random, 0.1, 1000);
    return stage_ray(vec_add_scaled(target, direction, -distance), direction);
}

static struct cone thin_cylinder(struct random *random)
{
    double length = random_log(random, 1, 1e6);
    return cylinder(random, 1e-12 * length, length);
}

/* A ray across the thin cylinder or nearly along it, which may also miss it. */
static struct ray aim_at_wire(struct random *random, const struct cone *cone)
{
    struct vec3 along, out, target = point_of_side(random, cone, &along, &out);
    double aside = cone->base_radius * random_between(random, 0, 1.5);
    target = vec_add(target, random_away(random, aside));
    struct vec3 direction = random_unit(random);
    if (random_bits(random) >> 63)
        direction = vec_normalize(vec_add_scaled(along, direction, random_log(random, 1e-12, 1)));
    double length = vec_length(vec_sub(cone->apex, cone->base));
    double distance = length * random_log(random, 1e-9, 10);
    return stage_ray(vec_add_scaled(target, direction, -distance), direction);
}

/* ---- row 42: cones with rational generators ---- */

/* The axis is a coordinate axis or one of length 5 or 3; radius and height are integers. */
static struct cone integer_cone(struct random *random)
{
    static const struct vec3 axes[] = {{0, 0, 1}, {0, -1, 0}, {3, 4, 0}, {2, -1, 2}};
    struct vec3 base = integer_point(random, 100);
    struct vec3 axis = axes[random_below(random, sizeof axes / sizeof *axes)];
    struct vec3 apex = vec_add_scaled(base, axis, 1 + (double)random_below(random, 12));
    double radius = 1 + (double)random_below(random, 12);
    return (struct cone){.base = base,
                         .apex = apex,
                         .base_radius = radius,
                         .apex_radius = 0,
                         .capped = (uint32_t)random_below(random, 2)};
}

/* The direction from the tip along a generator: rational, unless the axis prevents that. */
static struct vec3 generator(struct random *random, const struct cone *cone)
{
    struct vec3 w = vec_sub(cone->apex, cone->base), across[2];
    if (w.x == 0) {
        across[0] = vec3(1, 0, 0);
        across[1] = w.y == 0 ? vec3(0, 1, 0) : vec3(0, 0, 1);
    } else {
        across[0] = w.z == 0 ? vec3(0.8, -0.6, 0) : vec3(1, 2, 0); /* along (3, 4, 0): rounded */
        across[1] = vec3(0, 0, 1);
    }
    struct vec3 out = across[random_below(random, 2)];
    return vec_sub(vec_scale(out, random_sign(random) * cone->base_radius), w);
}

static struct ray aim_at_cone(struct random *random, const struct cone *cone)
{
    double steps = 1 + (double)random_below(random, 64);
    struct vec3 d = integer_point(random, 9);
    if (vec_is_zero(d)) d.x = 1;
    struct vec3 w = vec_sub(cone->apex, cone->base);
    struct vec3 beyond = vec_add_scaled(cone->apex, w, 1 + (double)random_below(random, 4));
    struct vec3 beside = integer_point(random, 20);
    switch (random_below(random, 5)) {
    case 0: /* at the tip */
        return stage_ray(vec_add_scaled(cone->apex, d, -steps), d);
    case 1: /* parallel to a generator, from anywhere */
        return stage_ray(vec_add(cone->apex, beside), generator(random, cone));
    case 2: /* across the other nappe */
        return stage_ray(vec_add_scaled(beyond, d, -steps), d);
    case 3: /* from the tip itself, which the ray does not name */
        return stage_ray(cone->apex, d);
    default: /* anywhere near */
        return stage_ray(vec_add(cone->base, beside), d);
    }
}

/* ---- row 43: entries are exits ---- */

static struct cone any_solid(struct random *random)
{
    double radius = random_log(random, 0.1, 10);
    struct cone solid = cylinder(random, radius, radius * random_log(random, 0.01, 100));
    solid.capped = 1;
    uint64_t kind = random_below(random, 3);
    if (kind == 0) solid.apex_radius = 0;
    if (kind == 1) solid.base_radius = radius * random_between(random, 0, 2);
    return solid;
}

#define SOLID_RAYS 128

struct solid_rays {
    size_t count;
    struct ray ray[SOLID_RAYS];
    bool inside[SOLID_RAYS]; /* exactly one crossing; else none or two */
};

/* A point on a rim (for one ray in eight, as these need exact arithmetic), on the side, on the axis, or anywhere. */
static struct vec3 solid_target(struct random *random, const struct cone *solid)
{
    struct vec3 w = vec_sub(solid->apex, solid->base), along = vec_normalize(w), u, v;
    random_frame(random, along, &u, &v);
    switch (random_below(random, 16)) {
    case 0:
        return vec_add_scaled(solid->base, u, solid->base_radius);
    case 1:
        return vec_add_scaled(solid->apex, u, solid->apex_radius);
    case 2:
    case 3:
    case 4:
        return point_of_side(random, solid, &along, &u);
    case 5:
    case 6:
    case 7:
        return vec_add_scaled(solid->base, w, random_between(random, -0.1, 1.1));
    default:
        w = vec_add_scaled(solid->base, w, random_between(random, -0.1, 1.1));
        return vec_add_scaled(w, u, 1.1 * random_between(random, 0, solid->base_radius));
    }
}

/* A ray from far outside, sometimes along the axis or across it, or from the middle of the axis, which is inside. */
static void add_solid_ray(struct solid_rays *rays, struct random *random, const struct cone *solid)
{
    struct vec3 w = vec_sub(solid->apex, solid->base), along = vec_normalize(w), u, v;
    double size = vec_length(w) + solid->base_radius + solid->apex_radius;
    struct vec3 middle = vec_add_scaled(solid->base, w, 0.5);
    struct vec3 target = solid_target(random, solid), from;
    bool inside = false;
    random_frame(random, along, &u, &v);
    switch (random_below(random, 16)) {
    case 0:
        from = vec_add_scaled(target, along, random_sign(random) * 3 * size);
        break;
    case 1:
        from = vec_add_scaled(target, v, random_sign(random) * 3 * size);
        break;
    case 2:
    case 3:
    case 4:
    case 5:
        from = middle;
        inside = true;
        break;
    default:
        from = vec_add(middle, vec_scale(random_unit(random), 3 * size));
    }
    rays->ray[rays->count] = stage_ray(from, vec_sub(target, from));
    rays->inside[rays->count++] = inside;
}

static void check_solid(const struct stage *stage, const struct scene *scene,
                        const struct solid_rays *rays, uint64_t first, struct tally *tally)
{
    struct score *score = scene == stage->ours ? &tally->ours : &tally->paper;
    struct hit hits[SOLID_RAYS];
    unsigned crossings[SOLID_RAYS];
    uint64_t fallbacks = 0;
    stage_crossings(stage, scene, rays->ray, rays->count, crossings, &fallbacks);
    stage_hits(scene, stage->bvh, rays->ray, rays->count, hits, &fallbacks);
    for (size_t i = 0; i < rays->count; i++) {
        bool good = rays->inside[i] ? crossings[i] == 1 : crossings[i] == 0 || crossings[i] == 2;
        bool met = hits[i].primitive != PRIMITIVE_NONE;
        if (!good || met != (crossings[i] > 0)) score_wrong(score, first + i);
    }
    if (scene == stage->ours) tally->fallbacks += fallbacks;
}

static void solid_block(struct block *block, const void *context)
{
    (void)context;
    struct solid_rays rays = {.count = 0};
    for (uint64_t first = 0; first < block->count; first += SOLID_RAYS) {
        uint64_t left = block->count - first;
        uint64_t count = left < SOLID_RAYS ? left : SOLID_RAYS;
        struct cone solid = any_solid(&block->random);
        struct stage stage = cone_stage(&solid);
        rays.count = 0;
        while (rays.count < count)
            add_solid_ray(&rays, &block->random, &solid);
        check_solid(&stage, stage.ours, &rays, block->first + first, block->tally);
        check_solid(&stage, stage.paper, &rays, block->first + first, block->tally);
        block->tally->samples += count;
        stage_free(&stage);
    }
}

static void run_43(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 43, budget->many, solid_block, NULL, &tally);
    conclude(result, &tally, NULL, 0);
}

/* ---- row 44 ---- */

static void run_44(const struct budget *budget, struct case_result *result)
{
    (void)budget;
    strcpy(result->paper, "-");
    strcpy(result->ours, "-");
    strcpy(result->note, "the farm has no torus");
    result->verdict = VERDICT_MARKED;
}

const struct stability_case cone_cases[] = {
    {40, "cylinder, angle to the axis 1e-1-1e-15", "MPFR", "t <= 4 ulp, hit or miss exact",
     .work = cone_block, .context = &(const struct cone_row){any_cylinder, aim_steep},
     .unit = "ulp", .limit = 4},
    {41, "cylinder, length/radius 1e12", "MPFR", "t <= 4 ulp, hit or miss exact",
     .work = cone_block, .context = &(const struct cone_row){thin_cylinder, aim_at_wire},
     .unit = "ulp", .limit = 4},
    {42, "cone: tip, along a generator, other nappe", "rationals", "hit or miss exact, no NaN",
     .work = cone_block, .context = &(const struct cone_row){integer_cone, aim_at_cone},
     .unit = "ulp", .limit = 4},
    {43, "capped solids, rims", "parity", "entries = exits", .run = run_43},
    {44, "torus", "MPFR", "root count right", .run = run_44},
    {.number = 0},
};
