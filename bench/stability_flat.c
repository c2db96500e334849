/* Rows 13-16, 24 and 25: planes, discs, boxes and single triangles, against exact arithmetic. */
#include <float.h>
#include <stdlib.h>
#include <string.h>

#include <gmp.h>

#include "bench/oracle.h"
#include "bench/stability.h"
#include "common/message.h"

#define RAYS_PER_SCENE 32

static double component(struct vec3 v, unsigned axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static void set_component(struct vec3 *v, unsigned axis, double value)
{
    *(axis == 0 ? &v->x : axis == 1 ? &v->y : &v->z) = value;
}

static struct vec3 random_point(struct random *random, double reach)
{
    double x = random_between(random, -reach, reach), y = random_between(random, -reach, reach);
    return vec3(x, y, random_between(random, -reach, reach));
}

static struct vec3 integer_point(struct random *random, int reach)
{
    uint64_t span = 2 * (uint64_t)reach + 1;
    double x = (double)random_below(random, span) - reach;
    double y = (double)random_below(random, span) - reach;
    return vec3(x, y, (double)random_below(random, span) - reach);
}

/* ---- rows 13 and 14: planes and discs ---- */

enum { F, D = F + 3, N = D + 3, DN = N + 3, FN, T, P, PP = P + 3, RR, FLAT_REALS };

/* t = -(f.n) / (d.n) for the normal as the scene block has it; whether that is ahead. */
static bool solve_plane(mpfr_t *real, struct vec3 point, struct vec3 normal, const struct ray *ray)
{
    oracle_exact_begin();
    real_difference(&real[F], ray->origin, point);
    real_set(&real[D], ray->direction);
    real_set(&real[N], normal);
    real_dot(real[DN], &real[D], &real[N]);
    real_dot(real[FN], &real[F], &real[N]);
    oracle_exact_end();
    if (mpfr_zero_p(real[DN])) return false;
    mpfr_div(real[T], real[FN], real[DN], MPFR_RNDN);
    mpfr_neg(real[T], real[T], MPFR_RNDN);
    return mpfr_sgn(real[T]) > 0;
}

/* |f (d.n) - d (f.n)|^2 <= r^2 (d.n)^2: the plane's point is on the closed disc. */
static bool solve_disc(mpfr_t *real, const struct disc *disc, const struct ray *ray)
{
    if (!solve_plane(real, disc->center, disc->normal, ray)) return false;
    oracle_exact_begin();
    for (int axis = 0; axis < 3; axis++)
        mpfr_fmms(real[P + axis], real[F + axis], real[DN], real[D + axis], real[FN], MPFR_RNDN);
    real_dot(real[PP], &real[P], &real[P]);
    mpfr_mul_d(real[RR], real[DN], disc->radius, MPFR_RNDN);
    mpfr_sqr(real[RR], real[RR], MPFR_RNDN);
    oracle_exact_end();
    return mpfr_cmp(real[PP], real[RR]) <= 0;
}

static void compare(struct score *score, const struct hit *hit, bool expected, mpfr_t t,
                    double (*error)(double, mpfr_t), uint64_t sample)
{
    if ((hit->primitive != PRIMITIVE_NONE) != expected)
        score_wrong(score, sample);
    else if (expected)
        score_error(score, error(hit->t, t), sample);
}

static struct stage plane_stage(struct random *random)
{
    struct builder *builder = builder_create();
    struct plane plane = {.point = random_point(random, 10), .material = stage_material(builder)};
    plane.normal = random_unit(random);
    if (random_below(random, 4) == 0) plane.normal.z = 0;
    expect_added(builder_add_plane(builder, &plane));
    return stage_finish(builder, NULL);
}

/* n.d down to 1e-15; every eighth ray is parallel to the plane without any rounding, when the
 * normal lets it. */
static struct ray aim_along(struct random *random, const struct plane *plane)
{
    struct vec3 u, v, n = plane->normal;
    random_frame(random, n, &u, &v);
    double slope = random_sign(random) * random_log(random, 1e-15, 1);
    struct ray ray = stage_ray(random_point(random, 10), vec_add_scaled(u, n, slope));
    if (n.z == 0 && random_below(random, 8) == 0) ray.direction = vec3(n.y, -n.x, 0);
    ray.direction = vec_normalize(ray.direction);
    return ray;
}

static void plane_block(struct block *block, const void *context)
{
    (void)context;
    struct tally *tally = block->tally;
    struct stage stage = {NULL, NULL, NULL};
    mpfr_t real[FLAT_REALS];
    reals_init(real, FLAT_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            stage = plane_stage(&block->random);
        }
        const struct plane *plane = scene_planes(stage.ours);
        struct ray ray = aim_along(&block->random, plane);
        bool expected = solve_plane(real, plane->point, plane->normal, &ray);
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        compare(&tally->ours, &ours, expected, real[T], roundoffs, block->first + i);
        compare(&tally->paper, &paper, expected, real[T], roundoffs, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
    reals_clear(real, FLAT_REALS);
}

static void run_13(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 13, budget->rays, plane_block, NULL, &tally);
    conclude(result, &tally, "u", 4);
}

/* Random; or about an integer centre across an axis, with a rim through integer points. */
static struct disc any_disc(struct random *random, bool integers)
{
    struct disc disc = {.center = random_point(random, 10),
                        .normal = random_unit(random),
                        .radius = random_log(random, 0.1, 10)};
    if (!integers) return disc;
    disc.center = integer_point(random, 1000);
    disc.radius = 5 * (1 + (double)random_below(random, 1000));
    disc.normal = vec3(0, 0, 0);
    set_component(&disc.normal, (unsigned)random_below(random, 3), random_sign(random));
    return disc;
}

/* value, or a neighbour of it; 0 stays, its neighbours are of another size. */
static double ulp_step(struct random *random, double value)
{
    if (value == 0) return value;
    switch (random_below(random, 3)) {
    case 0:
        return nextafter(value, -HUGE_VAL);
    case 1:
        return nextafter(value, HUGE_VAL);
    default:
        return value;
    }
}

static struct ray aim_at_rim(struct random *random, const struct disc *disc)
{
    struct vec3 u, v;
    random_frame(random, disc->normal, &u, &v);
    struct vec3 rim = vec_add_scaled(disc->center, u, disc->radius);
    struct vec3 origin = vec_add_scaled(rim, random_unit(random), random_log(random, 0.1, 1e4));
    struct vec3 direction = vec_sub(rim, origin);
    for (unsigned axis = 0; axis < 3; axis++)
        set_component(&direction, axis, ulp_step(random, component(direction, axis)));
    return stage_ray(origin, direction);
}

/* Along the normal or obliquely by integers through (3, 4) r/5 from the centre, or one ulp beside
 * it. */
static struct ray aim_at_integer_rim(struct random *random, const struct disc *disc)
{
    unsigned z = component(disc->normal, 0) != 0 ? 0 : component(disc->normal, 1) != 0 ? 1 : 2;
    unsigned x = (z + 1) % 3, y = (z + 2) % 3;
    struct vec3 p = disc->center, step = integer_point(random, 50);
    set_component(&p, x, component(p, x) + random_sign(random) * 0.6 * disc->radius);
    set_component(&p, y, component(p, y) + random_sign(random) * 0.8 * disc->radius);
    if (component(step, z) == 0) set_component(&step, z, 1);
    struct vec3 origin = vec_add_scaled(p, step, -(1 + (double)random_below(random, 100)));
    if (random_bits(random) >> 63) {
        set_component(&step, x, 0);
        set_component(&step, y, 0);
        set_component(&origin, x, ulp_step(random, component(p, x)));
        set_component(&origin, y, ulp_step(random, component(p, y)));
    }
    return stage_ray(origin, step);
}

static void disc_block(struct block *block, const void *context)
{
    (void)context;
    struct tally *tally = block->tally;
    struct stage stage = {NULL, NULL, NULL};
    mpfr_t real[FLAT_REALS];
    reals_init(real, FLAT_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        bool integers = i / RAYS_PER_SCENE % 2;
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            struct builder *builder = builder_create();
            struct disc disc = any_disc(&block->random, integers);
            disc.material = stage_material(builder);
            expect_added(builder_add_disc(builder, &disc));
            stage = stage_finish(builder, NULL);
        }
        const struct disc *disc = scene_discs(stage.ours);
        struct ray ray =
            integers ? aim_at_integer_rim(&block->random, disc) : aim_at_rim(&block->random, disc);
        bool expected = solve_disc(real, disc, &ray);
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        compare(&tally->ours, &ours, expected, real[T], roundoffs, block->first + i);
        compare(&tally->paper, &paper, expected, real[T], roundoffs, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
    reals_clear(real, FLAT_REALS);
}

static void run_14(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 14, budget->rays, disc_block, NULL, &tally);
    conclude(result, &tally, "u", 4);
}

/* ---- rows 15 and 16: boxes ---- */

/* The closed interval in which a line is in a box, in rationals. */
struct box_truth {
    mpq_t enter, leave, in, out, part;
    mpfr_t t;
    bool hit;
};

static void box_truth_init(struct box_truth *truth)
{
    mpq_inits(truth->enter, truth->leave, truth->in, truth->out, truth->part, NULL);
    mpfr_init2(truth->t, ORACLE_BITS);
}

static void box_truth_clear(struct box_truth *truth)
{
    mpq_clears(truth->enter, truth->leave, truth->in, truth->out, truth->part, NULL);
    mpfr_clear(truth->t);
}

/* t = (face - origin) / speed */
static void face_distance(mpq_t t, mpq_t part, double face, double origin, double speed)
{
    mpq_set_d(t, face);
    mpq_set_d(part, origin);
    mpq_sub(t, t, part);
    mpq_set_d(part, speed);
    mpq_div(t, t, part);
}

/* The part of the line between all pairs of faces; false when there is none. */
static bool line_in_box(struct box_truth *truth, const struct box *box, const struct ray *ray)
{
    bool bounded = false;
    for (unsigned axis = 0; axis < 3; axis++) {
        double min = component(box->min, axis), max = component(box->max, axis);
        double origin = component(ray->origin, axis), speed = component(ray->direction, axis);
        if (speed == 0) {
            if (origin < min || origin > max) return false;
            continue;
        }
        face_distance(truth->in, truth->part, speed > 0 ? min : max, origin, speed);
        face_distance(truth->out, truth->part, speed > 0 ? max : min, origin, speed);
        if (!bounded || mpq_cmp(truth->in, truth->enter) > 0) mpq_set(truth->enter, truth->in);
        if (!bounded || mpq_cmp(truth->out, truth->leave) < 0) mpq_set(truth->leave, truth->out);
        bounded = true;
    }
    return mpq_cmp(truth->enter, truth->leave) <= 0;
}

/* The first t > 0 that a double can hold. */
static void solve_box(struct box_truth *truth, const struct box *box, const struct ray *ray)
{
    truth->hit = false;
    if (!line_in_box(truth, box, ray)) return;
    mpq_t *first = mpq_sgn(truth->enter) > 0 ? &truth->enter : &truth->leave;
    if (mpq_sgn(*first) <= 0) return;
    mpfr_set_q(truth->t, *first, MPFR_RNDN);
    truth->hit = mpfr_cmp_d(truth->t, DBL_MAX) <= 0;
}

static struct box any_box(struct random *random)
{
    struct vec3 a = integer_point(random, 8), b = integer_point(random, 8);
    if (random_bits(random) >> 63) {
        a = random_point(random, 8);
        b = random_point(random, 8);
    }
    struct box box = {.min = {fmin(a.x, b.x), fmin(a.y, b.y), fmin(a.z, b.z)},
                      .max = {fmax(a.x, b.x), fmax(a.y, b.y), fmax(a.z, b.z)}};
    for (unsigned axis = 0; axis < 3; axis++) {
        double min = component(box.min, axis);
        if (min == component(box.max, axis)) set_component(&box.max, axis, min + 1);
    }
    return box;
}

/* A point on a face, an edge or a corner, or inside: every coordinate is min, max or between. */
static struct vec3 point_of_box(struct random *random, const struct box *box)
{
    struct vec3 p;
    for (unsigned axis = 0; axis < 3; axis++) {
        double min = component(box->min, axis), max = component(box->max, axis);
        double between[3] = {min, max, random_between(random, min, max)};
        if (random_bits(random) >> 63) between[2] = floor(between[2]) < min ? min : between[2];
        set_component(&p, axis, between[random_below(random, 3)]);
    }
    return p;
}

/* Components of a direction that are hard on a box. */
static struct vec3 hard_direction(struct random *random)
{
    static const double hard[] = {0.0, -0.0, 1, -1, 1e-310, -1e-310, 2, -3, 0x1p-40, -0x1p-40};
    struct vec3 d;
    do {
        for (unsigned axis = 0; axis < 3; axis++)
            set_component(&d, axis, hard[random_below(random, sizeof hard / sizeof *hard)]);
        if (random_below(random, 4) == 0) d.x = random_between(random, -1, 1);
    } while (vec_is_zero(d));
    return d;
}

static struct ray aim_at_box(struct random *random, const struct box *box)
{
    struct vec3 on = point_of_box(random, box), direction = hard_direction(random);
    switch (random_below(random, 4)) {
    case 0: /* from the surface */
        return stage_ray(on, direction);
    case 1: /* towards it, in steps that are exact for integers */
        return stage_ray(vec_add_scaled(on, direction, -(double)random_below(random, 9)),
                         direction);
    case 2: { /* towards it from anywhere, rounded */
        struct vec3 origin = random_point(random, 30);
        return stage_ray(origin, vec_sub(on, origin));
    }
    default: { /* towards it from integers: exact for integer boxes */
        struct vec3 origin = integer_point(random, 30);
        direction = vec_sub(on, origin);
        return stage_ray(origin, vec_is_zero(direction) ? vec3(1, 0, 0) : direction);
    }
    }
}

static void compare_box(struct score *score, const struct hit *hit, struct box_truth *truth,
                        uint64_t sample)
{
    compare(score, hit, truth->hit, truth->t, ulps, sample);
}

static struct stage box_stage(const struct box *box)
{
    struct builder *builder = builder_create();
    struct box solid = *box;
    solid.material = stage_material(builder);
    expect_added(builder_add_box(builder, &solid));
    return stage_finish(builder, NULL);
}

static void box_block(struct block *block, const void *context)
{
    (void)context;
    struct tally *tally = block->tally;
    struct stage stage = {NULL, NULL, NULL};
    struct box_truth truth;
    box_truth_init(&truth);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            struct box box = any_box(&block->random);
            stage = box_stage(&box);
        }
        const struct box *box = scene_boxes(stage.ours);
        struct ray ray = aim_at_box(&block->random, box);
        solve_box(&truth, box, &ray);
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        compare_box(&tally->ours, &ours, &truth, block->first + i);
        compare_box(&tally->paper, &paper, &truth, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
    box_truth_clear(&truth);
}

static void run_15(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 15, budget->rays, box_block, NULL, &tally);
    conclude(result, &tally, "ulp", 2);
}

/* The loaders refuse a box without volume, so the scene block is changed by hand: such a block is
 * valid. */
static void flatten(struct stage *stage, unsigned axis)
{
    struct scene *scenes[2] = {stage->ours, stage->paper};
    for (int i = 0; i < 2; i++) {
        char *block = (char *)scenes[i];
        struct box *box =
            (struct box *)(void *)(block + scenes[i]->primitives[PRIMITIVE_BOX].offset);
        set_component(&box->max, axis, component(box->min, axis));
    }
    free(stage->bvh);
    stage->bvh = stage_tree(stage->ours);
}

static bool in_sheets_plane(const struct box *box, const struct ray *ray)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        if (component(box->min, axis) == component(box->max, axis))
            return component(ray->direction, axis) == 0;
    }
    return false;
}

/* Crossed exactly once when the oracle says so, and not again by going on from there. */
static void cross_sheet(const struct stage *stage, const struct scene *scene, struct ray ray,
                        bool expected, struct score *score, uint64_t sample)
{
    unsigned crossings;
    uint64_t fallbacks = 0;
    stage_crossings(stage, scene, &ray, 1, &crossings, &fallbacks);
    struct hit hit = stage_nearest(stage, scene, &ray, &fallbacks);
    bool good = crossings == expected && (hit.primitive != PRIMITIVE_NONE) == expected;
    if (good && expected) {
        struct surface surface;
        surface_at(scene, &ray, &hit, &surface);
        ray.origin = surface.point;
        ray.from = hit.primitive;
        ray.from_part = hit.part;
        good = stage_nearest(stage, scene, &ray, &fallbacks).primitive == PRIMITIVE_NONE;
    }
    if (!good) score_wrong(score, sample);
}

static void sheet_block(struct block *block, const void *context)
{
    (void)context;
    struct tally *tally = block->tally;
    struct stage stage = {NULL, NULL, NULL};
    struct box_truth truth;
    box_truth_init(&truth);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            struct box box = any_box(&block->random);
            stage = box_stage(&box);
            flatten(&stage, (unsigned)random_below(&block->random, 3));
        }
        const struct box *box = scene_boxes(stage.ours);
        struct ray ray = aim_at_box(&block->random, box);
        solve_box(&truth, box, &ray);
        if (in_sheets_plane(box, &ray)) continue; /* nothing is crossed */
        cross_sheet(&stage, stage.ours, ray, truth.hit, &tally->ours, block->first + i);
        cross_sheet(&stage, stage.paper, ray, truth.hit, &tally->paper, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
    box_truth_clear(&truth);
}

static void run_16(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 16, budget->rays, sheet_block, NULL, &tally);
    conclude(result, &tally, NULL, 0);
}

/* ---- rows 24 and 25: single triangles ---- */

/* The corners from the origin, cross products, and E_i = d . (corner j x corner k), whose signs
 * tell on which side of the edges the line passes. */
enum { C0, CROSS = C0 + 9, DIR = CROSS + 3, E = DIR + 3, DET = E + 3, TIME, SIZE, TERM, TRI_REALS };

static void solve_edges(mpfr_t *real, const struct vec3 corner[3], const struct ray *ray)
{
    oracle_exact_begin();
    real_set(&real[DIR], ray->direction);
    for (int i = 0; i < 3; i++)
        real_difference(&real[C0 + 3 * i], corner[i], ray->origin);
    for (int i = 0; i < 3; i++) {
        real_cross(&real[CROSS], &real[C0 + 3 * ((i + 1) % 3)], &real[C0 + 3 * ((i + 2) % 3)]);
        real_dot(real[E + i], &real[DIR], &real[CROSS]);
    }
    mpfr_add(real[DET], real[E], real[E + 1], MPFR_RNDN);
    mpfr_add(real[DET], real[DET], real[E + 2], MPFR_RNDN);
    oracle_exact_end();
}

static unsigned largest_axis(struct vec3 d)
{
    double x = fabs(d.x), y = fabs(d.y), z = fabs(d.z);
    return z >= x && z >= y ? 2 : y >= x ? 1 : 0;
}

/* TIME = sum E_i z_i / det / d_z, and SIZE = sum |E_i z_i| / |det| / |d_z|, z along the largest
 * component of the direction. */
static void solve_time(mpfr_t *real, const struct ray *ray)
{
    unsigned z = largest_axis(ray->direction);
    mpfr_set_ui(real[TIME], 0, MPFR_RNDN);
    mpfr_set_ui(real[SIZE], 0, MPFR_RNDN);
    for (unsigned i = 0; i < 3; i++) {
        mpfr_mul(real[TERM], real[E + i], real[C0 + 3 * i + z], MPFR_RNDN);
        mpfr_add(real[TIME], real[TIME], real[TERM], MPFR_RNDN);
        mpfr_abs(real[TERM], real[TERM], MPFR_RNDN);
        mpfr_add(real[SIZE], real[SIZE], real[TERM], MPFR_RNDN);
    }
    mpfr_mul(real[TERM], real[DET], real[DIR + z], MPFR_RNDN);
    mpfr_div(real[TIME], real[TIME], real[TERM], MPFR_RNDN);
    mpfr_div(real[SIZE], real[SIZE], real[TERM], MPFR_RNDN);
    mpfr_abs(real[SIZE], real[SIZE], MPFR_RNDN);
}

/* The error of t in units of u SIZE. */
static double grazing_error(mpfr_t *real, double t)
{
    mpfr_d_sub(real[TERM], t, real[TIME], MPFR_RNDN);
    mpfr_div(real[TERM], real[TERM], real[SIZE], MPFR_RNDN);
    return fabs(mpfr_get_d(real[TERM], MPFR_RNDA)) * 0x1p53;
}

/* Whether the line passes all edges on the same side, or -1 when it goes through one. */
static int passes_inside(mpfr_t *real)
{
    int signs = 0;
    for (int i = 0; i < 3; i++) {
        if (mpfr_zero_p(real[E + i])) return -1;
        signs += mpfr_sgn(real[E + i]);
    }
    return signs == 3 || signs == -3;
}

static void grazing_hit(const struct stage *stage, const struct scene *scene, const struct ray *ray,
                        mpfr_t *real, struct tally *tally, uint64_t sample)
{
    struct hit hit = stage_nearest(stage, scene, ray, &tally->fallbacks);
    struct score *score = scene == stage->ours ? &tally->ours : &tally->paper;
    bool met = hit.primitive != PRIMITIVE_NONE;
    int inside = passes_inside(real);
    bool expected = inside == 1 && mpfr_sgn(real[TIME]) > 0;
    if (inside >= 0 && met != expected)
        score_wrong(score, sample);
    else if (met)
        score_error(score, grazing_error(real, hit.t), sample);
}

/* A ray that runs almost in the triangle's plane towards a point inside it. */
static struct ray graze(struct random *random, const struct vec3 corner[3])
{
    double u = random_between(random, 0, 1), v = random_between(random, 0, 1);
    if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
    }
    struct vec3 e1 = vec_sub(corner[1], corner[0]), e2 = vec_sub(corner[2], corner[0]);
    struct vec3 n = vec_normalize(vec_cross(e1, e2)), across, along;
    struct vec3 target = vec_add_scaled(vec_add_scaled(corner[0], e1, u), e2, v);
    random_frame(random, n, &along, &across);
    double slope = random_sign(random) * random_log(random, 1e-15, 0.1);
    struct vec3 direction = vec_add_scaled(along, n, slope);
    double distance = random_log(random, 0.01, 1000);
    return stage_ray(vec_add_scaled(target, direction, -distance), vec_normalize(direction));
}

static void grazing_block(struct block *block, const void *context)
{
    (void)context;
    struct vec3 corner[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    struct stage stage = {NULL, NULL, NULL};
    mpfr_t real[TRI_REALS];
    reals_init(real, TRI_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            struct vec3 middle = random_point(&block->random, 100);
            struct builder *builder = builder_create();
            for (int k = 0; k < 3; k++)
                corner[k] = vec_add(middle, random_point(&block->random, 5));
            stage_triangle(builder, corner[0], corner[1], corner[2]);
            stage = stage_finish(builder, NULL);
        }
        struct ray ray = graze(&block->random, corner);
        solve_edges(real, corner, &ray);
        if (mpfr_zero_p(real[DET])) continue; /* in the plane, or far from it and parallel */
        solve_time(real, &ray);
        grazing_hit(&stage, stage.ours, &ray, real, block->tally, block->first + i);
        grazing_hit(&stage, stage.paper, &ray, real, block->tally, block->first + i);
        block->tally->samples++;
    }
    stage_free(&stage);
    reals_clear(real, TRI_REALS);
}

static void run_24(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 24, budget->rays, grazing_block, NULL, &tally);
    conclude(result, &tally, "u sum|ez|/|det|", 8);
}

/* Three triangles: one has the whole edge p r, the two beyond it meet at a point t of that edge. */
struct junction {
    struct vec3 corner[3][3];
    struct vec3 p, r;
};

/* In a plane of integers, t is exactly on the edge; turned at random, it is rounded off it. */
static struct junction any_junction(struct random *random)
{
    struct vec3 origin = integer_point(random, 50), u = {1, 0, 0}, v = {0, 1, 0};
    if (random_bits(random) >> 63) {
        random_frame(random, random_unit(random), &u, &v);
    } else {
        u = integer_point(random, 9);
        v = integer_point(random, 9);
        if (vec_is_zero(vec_cross(u, v))) {
            u = vec3(3, 1, 2);
            v = vec3(-1, 4, 1);
        }
    }
    double length = 2 * (1 + (double)random_below(random, 8));
    double split = 1 + (double)random_below(random, (uint64_t)length - 1);
    struct vec3 p = origin, r = vec_add_scaled(origin, u, length);
    struct vec3 t = vec_add_scaled(origin, u, split);
    struct vec3 above = vec_add_scaled(origin, v, 4), below = vec_add_scaled(origin, v, -4);
    return (struct junction){{{p, r, above}, {t, p, below}, {r, t, below}}, p, r};
}

static struct stage junction_stage(const struct junction *junction)
{
    struct builder *builder = builder_create();
    for (int i = 0; i < 3; i++)
        stage_triangle(builder, junction->corner[i][0], junction->corner[i][1],
                       junction->corner[i][2]);
    return stage_finish(builder, NULL);
}

/* The line meets the closed triangle at t > 0, which does not contain the line. */
static bool meets_closed(mpfr_t *real, const struct vec3 corner[3], const struct ray *ray)
{
    solve_edges(real, corner, ray);
    int low = 0, high = 0;
    for (int i = 0; i < 3; i++) {
        low |= mpfr_sgn(real[E + i]) < 0;
        high |= mpfr_sgn(real[E + i]) > 0;
    }
    if ((low && high) || mpfr_zero_p(real[DET])) return false;
    solve_time(real, ray);
    return mpfr_sgn(real[TIME]) > 0;
}

static void junction_block(struct block *block, const void *context)
{
    (void)context;
    struct random *random = &block->random;
    struct tally *tally = block->tally;
    struct junction junction = {.p = {0, 0, 0}};
    struct stage stage = {NULL, NULL, NULL};
    mpfr_t real[TRI_REALS];
    reals_init(real, TRI_REALS);
    for (uint64_t i = 0; i < block->count; i++) {
        if (i % RAYS_PER_SCENE == 0) {
            stage_free(&stage);
            junction = any_junction(random);
            stage = junction_stage(&junction);
        }
        double along = random_between(random, 0.01, 0.99);
        struct vec3 target = vec_add_scaled(junction.p, vec_sub(junction.r, junction.p), along);
        struct vec3 origin =
            random_bits(random) >> 63 ? random_point(random, 100) : integer_point(random, 100);
        struct ray ray = stage_ray(origin, vec_sub(target, origin));
        bool expected = false;
        for (int k = 0; k < 3 && !expected; k++)
            expected = meets_closed(real, junction.corner[k], &ray);
        struct hit ours = stage_nearest(&stage, stage.ours, &ray, &tally->fallbacks);
        struct hit paper = stage_nearest(&stage, stage.paper, &ray, NULL);
        if (expected && ours.primitive == PRIMITIVE_NONE)
            score_wrong(&tally->ours, block->first + i);
        if (expected && paper.primitive == PRIMITIVE_NONE)
            score_wrong(&tally->paper, block->first + i);
        tally->samples++;
    }
    stage_free(&stage);
    reals_clear(real, TRI_REALS);
}

static void run_25(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    share(budget, 25, budget->rays, junction_block, NULL, &tally);
    conclude(result, &tally, NULL, 0);
}

const struct stability_case flat_cases[] = {
    {13, "plane, |n.d| down to 1e-15", "MPFR", "t <= 4 u; parallel: miss", run_13},
    {14, "disc rim +-1 ulp", "rationals", "hit or miss exact, t <= 4 u", run_14},
    {15, "box: d = +-0, 1e-310, from faces and corners", "rationals",
     "hit or miss exact and closed, t <= 2 ulp", run_15},
    {16, "box without thickness", "rationals", "one hit", run_16},
    {24, "grazing triangle", "rationals", "hit or miss exact, t <= 8 u sum|ez|/|det|", run_24},
    {25, "T-junctions", "rationals", "misses only where the rationals miss", run_25},
    {0, NULL, NULL, NULL, NULL},
};
