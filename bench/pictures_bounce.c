/* Rows 51-55: long chains of reflections, pruned ray trees, and media. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

#include <mpfr.h>

#include "bench/oracle.h"
#include "bench/pictures.h"
#include "common/message.h"
#include "test/renderer_fixture.h"
#include "worker/radiance.h"
#include "worker/shade.h"

/* One step along the path of a mirrored ray with the kernel's own functions; false: it left the scene. */
static bool bounce(const struct scene *scene, const struct bvh *bvh, struct ray *ray,
                   struct surface *surface)
{
    struct hit hit;
    uint64_t exact = 0;
    stage_hits(scene, bvh, ray, 1, &hit, &exact);
    if (hit.primitive == PRIMITIVE_NONE) return false;
    surface_at(scene, ray, &hit, surface);
    struct shading_point at = shading_point(scene, ray, surface);
    *ray = stage_going_on(surface, &hit, reflect(&at));
    return true;
}

/* ---- 51 ---- */

/* Facing mirrors at z = 0 and z = 8 with ambient light 0.1 and reflection kr. */
static struct scene *facing_mirrors(double kr, uint32_t depth, enum formulas formulas)
{
    struct builder *builder = builder_create();
    struct material silvered = {.color = {1, 1, 1}, .ambient = 0.1, .reflection = kr, .ior = 1.5};
    struct plane low = {.point = {0, 0, 0}, .normal = {0, 0, 1}};
    struct plane high = {.point = {0, 0, 8}, .normal = {0, 0, -1}};
    expect_added(builder_add_material(builder, &silvered, &low.material));
    high.material = low.material;
    expect_added(builder_add_plane(builder, &low));
    expect_added(builder_add_plane(builder, &high));
    struct view view = stage_view(vec3(0.3, 0.2, 5), vec3(0.1, 0, 0), 30, 4, 4);
    view.max_depth = depth;
    view.formulas = formulas;
    struct scene *scene = builder_finish(builder, &view);
    builder_destroy(builder);
    return scene;
}

struct small_stack {
    struct renderer *renderer;
    struct picture picture;
};

static void *render_tile(void *argument)
{
    struct small_stack *job = argument;
    struct tile tile = {.w = job->picture.width, .h = job->picture.height, .step = 1};
    renderer_tile(job->renderer, &tile, job->picture.rgb, &job->picture.counts);
    return NULL;
}

/* Renders on a thread with a stack of 128 kB: there is room for a bundle of rays (50 kB with the sanitizers),
 * but for nothing that grows with the depth. */
static struct picture render_on_small_stack(const struct scene *scene)
{
    struct bvh *bvh = scene_tree(scene);
    struct small_stack job = {.renderer = renderer_create(scene, bvh),
                              .picture = {.width = 4, .height = 4}};
    pthread_attr_t attributes;
    pthread_t thread;
    job.picture.rgb = allocate(4 * 4 * 3, sizeof *job.picture.rgb);
    pthread_attr_init(&attributes);
    if (pthread_attr_setstacksize(&attributes, 128 * 1024) != 0 ||
        pthread_create(&thread, &attributes, render_tile, &job) != 0)
        fatal("cannot start a thread with a small stack");
    pthread_join(thread, NULL);
    pthread_attr_destroy(&attributes);
    renderer_destroy(job.renderer);
    free(bvh);
    return job.picture;
}

/* The number of values of the picture that differ from 0.1 (1 + kr + ... + kr^depth) by more than the rounding
 * to float. */
static uint64_t wrong_series(double kr, uint32_t depth, enum formulas formulas)
{
    struct scene *scene = facing_mirrors(kr, depth, formulas);
    struct picture picture = render_on_small_stack(scene);
    double sum = 0;
    uint64_t wrong = 0;
    for (uint32_t d = 0; d <= depth; d++)
        sum = sum * kr + 0.1;
    for (size_t i = 0; i < 4 * 4 * 3; i++)
        wrong += !(fabs((double)picture.rgb[i] - sum) <= 0x1p-24 * sum);
    wrong += picture.counts.rays[RAY_REFLECTION] != 16ull * depth;
    picture_free(&picture);
    free(scene);
    return wrong;
}

/*
 * The largest error of a direction after `depth` mirrors, in u: plane mirrors whose normal is along z leave x
 * and y unchanged and reverse z.
 */
static double direction_error(uint32_t depth, enum formulas formulas)
{
    struct scene *scene = facing_mirrors(1, depth, formulas);
    struct bvh *bvh = scene_tree(scene);
    struct vec3 d = vec_normalize(vec3(0.01, -0.02, 1));
    struct ray ray = stage_ray(vec3(0.3, 0.2, 5), d);
    struct surface surface;
    double worst = 0;
    for (uint32_t i = 0; i < depth; i++) {
        if (!bounce(scene, bvh, &ray, &surface)) return HUGE_VAL;
        struct vec3 error =
            vec3(ray.direction.x - d.x, ray.direction.y - d.y, fabs(ray.direction.z) - fabs(d.z));
        worst = worse_of(worst, vec_length(error) * 0x1p53);
    }
    free(bvh);
    free(scene);
    return worst;
}

static void run_mirrors(const struct budget *budget, struct case_result *result)
{
    (void)budget;
    const uint32_t depths[] = {1000, 10000};
    uint64_t wrong = 0, paper = 0;
    double worst = 0, paper_worst = 0; /* of D 2 u */
    for (int i = 0; i < 2; i++) {
        uint32_t depth = depths[i];
        wrong +=
            wrong_series(1, depth, FORMULAS_EXACT) + wrong_series(0.999, depth, FORMULAS_EXACT);
        paper +=
            wrong_series(1, depth, FORMULAS_PAPER) + wrong_series(0.999, depth, FORMULAS_PAPER);
        worst = worse_of(worst, direction_error(depth, FORMULAS_EXACT) / (2.0 * depth));
        paper_worst = worse_of(paper_worst, direction_error(depth, FORMULAS_PAPER) / (2.0 * depth));
    }
    snprintf(result->paper, sizeof result->paper, "%llu wrong, direction %.2g of D 2 u",
             (unsigned long long)paper, paper_worst);
    snprintf(result->ours, sizeof result->ours, "%llu wrong, direction %.2g of D 2 u",
             (unsigned long long)wrong, worst);
    result->worst = worst;
    picture_verdict(result, 2 * (1000 + 10000), wrong + (worst > 1));
}

/* ---- 52 ---- */

/*
 * Unit balls, one radius apart. An error e of a ray (relative to the unit radius) is e (1 + 2 L /
 * (r cos)) after a bounce from a distance L; every bounce adds one of its own. For a bounce of ours
 * that is 8 u: 4 u of the point and 4 u of the normal and the direction, as the rows for single
 * hits measure them.
 */
#define BOUNCE_ERROR (8 * 0x1p-53)

static struct scene *two_balls(enum formulas formulas)
{
    struct builder *builder = builder_create();
    stage_sphere(builder, vec3(-1.5, 0, 0), 1);
    stage_sphere(builder, vec3(1.5, 0, 0), 1);
    struct view view = stage_view(vec3(0, 0, 0), vec3(1, 0, 0), 40, 1, 1);
    view.formulas = formulas;
    struct scene *scene = builder_finish(builder, &view);
    builder_destroy(builder);
    return scene;
}

#define PATH_NUMBERS 16

struct exact_path {
    mpfr_t *o, *d, *f, *n; /* three components each */
    mpfr_ptr a, b, c, t;
};

static struct exact_path exact_path(mpfr_t all[PATH_NUMBERS])
{
    return (struct exact_path){all, all + 3, all + 6, all + 9, all[12], all[13], all[14], all[15]};
}

/* The nearest hit with the ball at x = center, into t; false: none ahead. f, b as a side effect. */
static bool exact_hit(struct exact_path *x, double center)
{
    for (int i = 0; i < 3; i++)
        mpfr_set(x->f[i], x->o[i], MPFR_RNDN);
    mpfr_sub_d(x->f[0], x->f[0], center, MPFR_RNDN);
    real_dot(x->a, x->d, x->d);
    real_dot(x->b, x->f, x->d);
    real_dot(x->c, x->f, x->f);
    mpfr_sub_ui(x->c, x->c, 1, MPFR_RNDN);
    mpfr_mul(x->c, x->c, x->a, MPFR_RNDN);
    mpfr_sqr(x->t, x->b, MPFR_RNDN);
    mpfr_sub(x->t, x->t, x->c, MPFR_RNDN);
    if (mpfr_sgn(x->t) < 0) return false;
    mpfr_sqrt(x->t, x->t, MPFR_RNDN);
    mpfr_add(x->t, x->t, x->b, MPFR_RNDN);
    mpfr_neg(x->t, x->t, MPFR_RNDN);
    mpfr_div(x->t, x->t, x->a, MPFR_RNDN);
    return mpfr_sgn(x->t) > 0;
}

/* Moves the ray to the ball at x = center and reflects it; false: it misses. *amplification is that of the
 * bounce. */
static bool exact_bounce(struct exact_path *x, double center, double *amplification)
{
    if (!exact_hit(x, center)) return false;
    for (int i = 0; i < 3; i++) {
        mpfr_mul(x->f[i], x->d[i], x->t, MPFR_RNDN);
        mpfr_add(x->o[i], x->o[i], x->f[i], MPFR_RNDN);
        mpfr_set(x->n[i], x->o[i], MPFR_RNDN);
    }
    mpfr_sub_d(x->n[0], x->n[0], center, MPFR_RNDN);
    real_dot(x->b, x->d, x->n);
    double length = sqrt(mpfr_get_d(x->a, MPFR_RNDN)), t = mpfr_get_d(x->t, MPFR_RNDN);
    double cosine = -mpfr_get_d(x->b, MPFR_RNDN) / length;
    *amplification = 1 + 2 * t * length / cosine;
    mpfr_mul_ui(x->b, x->b, 2, MPFR_RNDN);
    for (int i = 0; i < 3; i++) {
        mpfr_mul(x->f[i], x->n[i], x->b, MPFR_RNDN);
        mpfr_sub(x->d[i], x->d[i], x->f[i], MPFR_RNDN);
    }
    return true;
}

static double distance_to(struct exact_path *x, struct vec3 p)
{
    const double at[] = {p.x, p.y, p.z};
    for (int i = 0; i < 3; i++)
        mpfr_sub_d(x->f[i], x->o[i], at[i], MPFR_RNDN);
    real_dot(x->c, x->f, x->f);
    return sqrt(mpfr_get_d(x->c, MPFR_RNDN));
}

/* The largest error of a hit along a path, in units of its bound; bounces are counted. */
static double path_error(struct exact_path *x, const struct scene *scene, const struct bvh *bvh,
                         struct ray ray, uint64_t *bounces)
{
    double worst = 0, bound = 0, center = 1.5;
    struct surface surface;
    real_set(x->o, ray.origin);
    real_set(x->d, ray.direction);
    for (int depth = 0; depth < 20; depth++, center = -center) {
        double amplification;
        if (!exact_bounce(x, center, &amplification)) break;
        bound = (bound + BOUNCE_ERROR) * amplification;
        if (bound > 1e-3) break; /* beyond that the linear bound means nothing */
        if (!bounce(scene, bvh, &ray, &surface)) return HUGE_VAL;
        worst = worse_of(worst, distance_to(x, surface.point) / bound);
        ++*bounces;
    }
    return worst;
}

static void run_mirror_balls(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    struct random random = random_seeded(52, 0);
    struct scene *ours = two_balls(FORMULAS_EXACT), *paper = two_balls(FORMULAS_PAPER);
    struct bvh *bvh = scene_tree(ours);
    mpfr_t numbers[PATH_NUMBERS];
    for (size_t i = 0; i < PATH_NUMBERS; i++)
        mpfr_init2(numbers[i], 512);
    struct exact_path x = exact_path(numbers);
    uint64_t paths = budget->rays / 50 + 200, deepest = 0;
    for (uint64_t i = 0; i < paths; i++) {
        /* Most rays leave after a few bounces; close to the axis they stay longer. */
        double off = random_log(&random, 1e-12, 1e-1);
        struct vec3 d = {1, off * random_between(&random, -1, 1), 0};
        d.z = off * random_between(&random, -1, 1);
        uint64_t bounces = 0, ignored = 0;
        struct ray ray = stage_ray(vec3(0, 0, 0), vec_normalize(d));
        score_error(&tally.ours, path_error(&x, ours, bvh, ray, &bounces), i);
        score_error(&tally.paper, path_error(&x, paper, bvh, ray, &ignored), i);
        tally.samples += bounces;
        deepest = bounces > deepest ? bounces : deepest;
    }
    for (size_t i = 0; i < PATH_NUMBERS; i++)
        mpfr_clear(numbers[i]);
    free(bvh);
    free(ours);
    free(paper);
    conclude(result, &tally, "of the bound", 1);
    if (!result->note[0])
        snprintf(result->note, sizeof result->note, "up to %llu bounces",
                 (unsigned long long)deepest);
}

/* ---- 53 and 54 ---- */

/* Nine balls of glass and mirror; kr + kt = 1 when lossless. */
static struct scene *cluster(bool lossless, uint32_t edge)
{
    struct builder *builder = builder_create();
    struct material glass = {.color = {0.9, 0.85, 0.8},
                             .ambient = 0.1,
                             .diffuse = 0.3,
                             .reflection = 0.2,
                             .transmission = 0.75,
                             .ior = 1.5};
    struct material silvered = {
        .color = {0.9, 0.9, 0.9}, .ambient = 0.1, .diffuse = 0.3, .reflection = 0.7, .ior = 1.5};
    uint32_t of_glass, of_mirror;
    if (lossless) {
        glass.color = vec3(1, 1, 1);
        glass.transmission = 0.8;
    }
    expect_added(builder_add_material(builder, &glass, &of_glass));
    expect_added(builder_add_material(builder, &silvered, &of_mirror));
    for (int i = 0; i < 9; i++) {
        struct sphere ball = {.center = {i % 3 - 1, i / 3 - 1, 0.3 * (i % 2)}, .radius = 0.45};
        ball.material = i % 2 && !lossless ? of_mirror : of_glass;
        expect_added(builder_add_sphere(builder, &ball));
    }
    struct light light = {.position = {3, 5, 6}, .color = {0.8, 0.8, 0.8}};
    expect_added(builder_add_light(builder, &light));
    struct view view = stage_view(vec3(0, 0, 6), vec3(0, 0, 0), 32, edge, edge);
    struct scene *scene = builder_finish(builder, &view);
    builder_destroy(builder);
    return scene;
}

/* Renders a single pixel, so that the counts are those of that pixel. */
static struct render_counts render_pixel(struct renderer *renderer, uint32_t x, uint32_t y,
                                         float rgb[3])
{
    struct tile tile = {.x = x, .y = y, .w = 1, .h = 1, .step = 1};
    struct render_counts counts;
    renderer_tile(renderer, &tile, rgb, &counts);
    return counts;
}

/* The number of pixels of a pruned picture whose difference from the deep one exceeds the bound that they claim. */
static uint64_t broken_bounds(struct scene *scene, const struct bvh *bvh,
                              const struct picture *deep, uint64_t *pixels, double *tightest)
{
    struct renderer *renderer = renderer_create(scene, bvh);
    uint64_t broken = 0;
    for (uint32_t y = 0; y < deep->height; y++) {
        for (uint32_t x = 0; x < deep->width; x++) {
            float rgb[3];
            const float *truth = &deep->rgb[3 * ((size_t)y * deep->width + x)];
            struct render_counts counts = render_pixel(renderer, x, y, rgb);
            double error = 0, rounding = 0;
            for (int c = 0; c < 3; c++) {
                error = worse_of(error, fabs((double)rgb[c] - (double)truth[c]));
                rounding = fmax(rounding, 0x1p-23 * (double)fmaxf(rgb[c], truth[c]));
            }
            ++*pixels;
            /* An error that is not finite violates an infinite bound, too. */
            broken += !(isfinite(error) && error <= counts.truncation + rounding);
            if (error > rounding) *tightest = worse_of(*tightest, error / counts.truncation);
        }
    }
    renderer_destroy(renderer);
    return broken;
}

static void run_cutoff(const struct budget *budget, struct case_result *result)
{
    struct scene *scene = cluster(false, budget->quick ? 16 : 64);
    struct bvh *bvh = scene_tree(scene);
    scene->view.max_depth = budget->quick ? 14 : 24;
    struct picture deep = picture_render(scene);
    uint64_t pixels = 0, broken = 0;
    double tightest = 0, deepest = deep.counts.truncation;
    for (double cutoff = 0x1p-16; cutoff < 2; cutoff *= budget->quick ? 64 : 4) {
        scene->view.cutoff = cutoff;
        broken += broken_bounds(scene, bvh, &deep, &pixels, &tightest);
    }
    scene->view.cutoff = 0;
    for (uint32_t depth = 0; depth < 8; depth += budget->quick ? 3 : 1) {
        scene->view.max_depth = depth;
        broken += broken_bounds(scene, bvh, &deep, &pixels, &tightest);
    }
    picture_free(&deep);
    free(bvh);
    free(scene);
    snprintf(result->paper, sizeof result->paper, "no bound");
    snprintf(result->ours, sizeof result->ours, "%llu broken, error <= %.2g of bound",
             (unsigned long long)broken, tightest);
    snprintf(result->note, sizeof result->note, "deep run itself: %.1g", deepest);
    result->worst = tightest;
    picture_verdict(result, pixels, broken);
}

/*
 * tau, the part of the picture below which a ray need not be traced, is the cutoff divided by the most that a
 * ray can contribute: D times a surface's colour (nothing is lost on the way) plus the sky.
 */
static void run_glass_cluster(const struct budget *budget, struct case_result *result)
{
    const double cutoff = 1.0 / 512;
    const uint32_t depth = 30;
    uint32_t edge = budget->quick ? 12 : 64;
    struct scene *scene = cluster(true, edge);
    struct bvh *bvh = scene_tree(scene);
    scene->view.max_depth = depth;
    scene->view.cutoff = cutoff;
    struct renderer *renderer = renderer_create(scene, bvh);
    struct radiance radiance;
    radiance_init(&radiance, scene);
    double brightest = radiance_primary_bound(&radiance);
    radiance_free(&radiance);
    uint64_t most = 0;
    for (uint32_t i = 0; i < edge * edge; i++) {
        float rgb[3];
        struct render_counts counts = render_pixel(renderer, i % edge, i / edge, rgb);
        uint64_t rays = render_counts_rays(&counts) - counts.rays[RAY_SHADOW];
        most = rays > most ? rays : most;
    }
    double limit = depth * brightest / cutoff;
    renderer_destroy(renderer);
    free(bvh);
    free(scene);
    snprintf(result->paper, sizeof result->paper, "2^30 without pruning");
    snprintf(result->ours, sizeof result->ours, "%llu rays of %.3g", (unsigned long long)most,
             limit);
    result->worst = (double)most / limit;
    picture_verdict(result, edge * edge, (double)most > limit);
}

/* ---- 55 ---- */

static uint32_t clear_glass(struct builder *builder, double ior)
{
    struct material glass = {.color = {1, 1, 1}, .transmission = 1, .ior = ior};
    uint32_t index;
    expect_added(builder_add_material(builder, &glass, &index));
    return index;
}

static void glass_ball(struct builder *builder, struct vec3 center, double radius, double ior)
{
    struct sphere ball = {center, radius, clear_glass(builder, ior), 0};
    expect_added(builder_add_sphere(builder, &ball));
}

static void nested(struct builder *builder)
{
    for (int i = 0; i < 6; i++)
        glass_ball(builder, vec3(0, 0, 0), 1 - 0.15 * i, i % 2 ? 1 : 1.2 + 0.1 * i);
}

static void overlapping(struct builder *builder)
{
    struct box box = {{-0.2, -0.9, -0.6}, {1.1, 0.1, 0.8}, clear_glass(builder, 1.7), 0};
    struct cone cone = {{-0.9, 0.1, 0}, {0.9, 0.5, 0}, 0.5, 0.2, clear_glass(builder, 1.1), 1};
    glass_ball(builder, vec3(-0.3, 0, 0), 0.8, 1.5);
    glass_ball(builder, vec3(0.4, 0.1, 0.2), 0.7, 1.3);
    expect_added(builder_add_box(builder, &box));
    expect_added(builder_add_cone(builder, &cone));
}

static void around_the_eye(struct builder *builder)
{
    glass_ball(builder, vec3(0, 0, 4), 2, 1.4);
    glass_ball(builder, vec3(0.1, 0, 4), 1, 1.2);
    nested(builder);
}

static void run_media(const struct budget *budget, struct case_result *result)
{
    void (*const scenes[])(struct builder *) = {nested, overlapping, around_the_eye};
    uint32_t edge = budget->quick ? 32 : 512;
    uint64_t unmatched = 0, open = 0;
    for (int i = 0; i < 3; i++) {
        struct builder *builder = builder_create();
        scenes[i](builder);
        struct view view = stage_view(vec3(0.2, 0.1, 4), vec3(0, 0, 0), 34, edge, edge);
        view.max_depth = 40;
        view.cutoff = 0.001;
        struct scene *scene = builder_finish(builder, &view);
        builder_destroy(builder);
        struct picture picture = picture_render(scene);
        unmatched += picture.counts.unmatched_media;
        open += picture.counts.open_media;
        if ((picture.counts.unmatched_media || picture.counts.open_media) && !result->note[0])
            snprintf(result->note, sizeof result->note, "scene %d", i);
        picture_free(&picture);
        free(scene);
    }
    snprintf(result->paper, sizeof result->paper, "no stack");
    snprintf(result->ours, sizeof result->ours, "%llu unmatched, %llu left open",
             (unsigned long long)unmatched, (unsigned long long)open);
    picture_verdict(result, 3ull * edge * edge, unmatched + open);
}

const struct stability_case bounce_cases[] = {
    {51, "1000 and 10000 plane mirrors", "closed form", "series <= D 2 u; 128 kB stack",
     .run = run_mirrors},
    {52, "mirror balls, depth 20", "MPFR", "<= u x amplification", .run = run_mirror_balls},
    {53, "cutoff sweep", "deep run", "error <= bound in every pixel", .run = run_cutoff},
    {54, "glass cluster, depth 30, kr + kt = 1", "-", "rays <= D / tau per pixel",
     .run = run_glass_cluster},
    {55, "media: nested, overlapping, eye inside", "closed form", "0 unmatched, 0 left open",
     .run = run_media},
    {.number = 0},
};
