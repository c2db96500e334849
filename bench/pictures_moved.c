/* Rows 30-32: the same scene at another place and in another size. */
#include <stdio.h>
#include <stdlib.h>

#include "bench/pictures.h"
#include "test/reference.h"
#include "test/sample_fixture.h"

static const char *const quick_size[] = {"image.width=24", "image.height=18", "sampling.samples=1",
                                         "render.max_depth=6", NULL};
static const char *const full_size[] = {"image.width=96", "image.height=72", "sampling.samples=1",
                                        NULL};

static void note_first(struct case_result *result, const char *file, double where)
{
    if (!result->note[0]) snprintf(result->note, sizeof result->note, "%s at %g", file, where);
}

/* The formulas, and the pictures of the scene in its own size. */
enum { OURS, PAPER, FORMULAS };
static const uint32_t formulas[FORMULAS] = {FORMULAS_EXACT, FORMULAS_PAPER};

/* Factors 2^-60 to 2^60. */
#define LARGEST_SCALE 60

/* One scene in all sizes. */
struct scalings {
    struct scene *scene;
    int step, paper_step; /* distances of exponents; paper_step is a multiple of step */
    struct picture plain[FORMULAS];
    uint64_t different[2 * LARGEST_SCALE + 1][FORMULAS]; /* pixels, by item */
};

static int exponent_of_item(const struct scalings *it, uint64_t item)
{
    return (int)item * it->step - LARGEST_SCALE;
}

/* Compares one size, with its own tree; the paper's formulas only for some sizes. */
static void compare_scaling(uint64_t item, void *context)
{
    struct scalings *it = context;
    int k = exponent_of_item(it, item);
    struct scene *scaled = picture_scaled(it->scene, ldexp(1, k));
    struct bvh *bvh = scene_tree(scaled);
    for (int f = OURS; f <= ((k + LARGEST_SCALE) % it->paper_step == 0 ? PAPER : OURS); f++) {
        scaled->view.formulas = formulas[f];
        struct picture picture = picture_render_with(scaled, bvh);
        it->different[item][f] = picture_differences(&it->plain[f], &picture);
        picture_free(&picture);
    }
    free(bvh);
    free(scaled);
}

/* Adds the number of pixels of a scene whose bits change under scaling by 2^k to wrong[]; returns the number of
 * pixels compared for our formulas. */
static uint64_t scale_scene(const struct budget *budget, struct scene *scene, const char *file,
                            struct case_result *result, uint64_t wrong[FORMULAS])
{
    struct scalings it = {
        .scene = scene, .step = budget->quick ? 40 : 1, .paper_step = budget->quick ? 40 : 10};
    for (int f = OURS; f < FORMULAS; f++) {
        scene->view.formulas = formulas[f];
        it.plain[f] = picture_render(scene);
    }
    uint64_t items = 2 * LARGEST_SCALE / (uint64_t)it.step + 1;
    share_out(budget, items, compare_scaling, &it);
    for (uint64_t item = 0; item < items; item++) {
        if (it.different[item][OURS]) note_first(result, file, exponent_of_item(&it, item));
        for (int f = OURS; f < FORMULAS; f++)
            wrong[f] += it.different[item][f];
    }
    uint64_t pixels = (uint64_t)it.plain[OURS].width * it.plain[OURS].height;
    for (int f = OURS; f < FORMULAS; f++)
        picture_free(&it.plain[f]);
    return items * pixels;
}

static void run_scaling(const struct budget *budget, struct case_result *result)
{
    uint64_t pixels = 0, wrong[FORMULAS] = {0};
    char **files = picture_files(budget->quick);
    for (char **file = files; *file; file++) {
        struct scene *scene = picture_load(*file, budget->quick ? quick_size : full_size);
        pixels += scale_scene(budget, scene, *file, result, wrong);
        free(scene);
    }
    picture_files_free(files);
    snprintf(result->paper, sizeof result->paper, "%llu pixels differ",
             (unsigned long long)wrong[PAPER]);
    snprintf(result->ours, sizeof result->ours, "%llu pixels differ",
             (unsigned long long)wrong[OURS]);
    picture_verdict(result, pixels, wrong[OURS]);
}

/* ---- 31 ---- */

/* What the first ray of a pixel hits. */
struct sight {
    struct hit hit;
    struct surface surface;
};

/* A scene in one size, with all that is compared. */
struct sized {
    struct scene *scene;
    struct bvh *bvh;
    struct picture picture;
    double factor;
};

static struct sized sized(const struct scene *scene, double factor)
{
    struct sized it = {.scene = picture_scaled(scene, factor), .factor = factor};
    it.bvh = scene_tree(it.scene);
    return it;
}

/* Renders again, with other formulas. */
static void sized_render(struct sized *it, uint32_t with)
{
    picture_free(&it->picture);
    it->scene->view.formulas = with;
    it->picture = picture_render_with(it->scene, it->bvh);
}

static void sized_free(struct sized *it)
{
    picture_free(&it->picture);
    free(it->bvh);
    free(it->scene);
}

static struct sight sight_of(const struct sized *it, uint32_t x, uint32_t y)
{
    struct sight sight = {.hit = {.t = 0}};
    struct ray ray = sample_ray(&it->scene->view, x, y, 0, NULL);
    uint64_t exact = 0;
    stage_hits(it->scene, it->bvh, &ray, 1, &sight.hit, &exact);
    if (sight.hit.primitive != PRIMITIVE_NONE)
        surface_at(it->scene, &ray, &sight.hit, &sight.surface);
    return sight;
}

static bool same_part(const struct sight *a, const struct sight *b)
{
    return a->hit.primitive == b->hit.primitive && a->hit.part == b->hit.part;
}

static double sight_error(const struct sight *plain, const struct sight *other, double factor)
{
    if (plain->hit.primitive == PRIMITIVE_NONE) return 0;
    double t = fabs(other->hit.t / factor - plain->hit.t) / plain->hit.t;
    return worse_of(t, vec_length(vec_sub(other->surface.shading, plain->surface.shading)));
}

/* Colours are floats: what is left of 1e-12 in them is their own rounding, 2^-24 each. */
static bool colors_agree(const struct sized *a, const struct sized *b, uint32_t x, uint32_t y)
{
    size_t at = 3 * ((size_t)y * a->picture.width + x);
    for (size_t c = at; c < at + 3; c++) {
        double p = (double)a->picture.rgb[c], q = (double)b->picture.rgb[c];
        if (!(fabs(p - q) <= 0x1p-23 * fmax(fabs(p), fabs(q)))) return false;
    }
    return true;
}

/*
 * Multiplying by 10^+-9 rounds every coordinate. Pixels are masked that such a rounding changes by more than
 * 1e-12 even at ordinary sizes: their results depend on the last bits of the input. An absolute tolerance
 * anywhere would show at 10^+-9 and not at ordinary sizes.
 */
static const double factors[] = {1, 1.1, 1 / 1.1, 1.3, 0.7, 1e9, 1e-9};
#define SIZES    (sizeof factors / sizeof *factors)
#define ORDINARY 5 /* the first so many are ordinary sizes */

static bool masked(const struct sized sizes[ORDINARY], const struct sight sights[ORDINARY],
                   uint32_t x, uint32_t y)
{
    for (size_t i = 1; i < ORDINARY; i++) {
        if (!same_part(&sights[0], &sights[i])) return true;
        if (sight_error(&sights[0], &sights[i], sizes[i].factor) > 1e-12) return true;
        if (!colors_agree(&sizes[0], &sizes[i], x, y)) return true;
    }
    return false;
}

/* A NaN is not excused by rounding of the input. Light without shadows may well exceed the range of a float. */
static bool any_nan(const struct sized *it, const struct sight *sight, uint32_t x, uint32_t y)
{
    const float *rgb = &it->picture.rgb[3 * ((size_t)y * it->picture.width + x)];
    if (isnan(rgb[0]) || isnan(rgb[1]) || isnan(rgb[2])) return true;
    if (sight->hit.primitive == PRIMITIVE_NONE) return false;
    return isnan(sight->hit.t) || isnan(vec_length(sight->surface.shading));
}

struct comparison {
    uint64_t pixels, masked, wrong_ids, wrong_colors;
    double worst;
};

static void compare_pixel(const struct sized sizes[SIZES], uint32_t x, uint32_t y,
                          struct comparison *sum)
{
    struct sight sights[SIZES];
    for (size_t i = 0; i < SIZES; i++) {
        sights[i] = sight_of(&sizes[i], x, y);
        if (any_nan(&sizes[i], &sights[i], x, y)) sum->worst = HUGE_VAL;
    }
    bool is_masked = masked(sizes, sights, x, y);
    for (size_t i = ORDINARY; i < SIZES; i++) {
        sum->pixels++;
        sum->masked += is_masked;
        if (is_masked) continue;
        bool same = same_part(&sights[0], &sights[i]);
        double error = same ? sight_error(&sights[0], &sights[i], sizes[i].factor) : 0;
        if (!same) sum->wrong_ids++;
        sum->worst = worse_of(sum->worst, error);
        if (!colors_agree(&sizes[0], &sizes[i], x, y)) sum->wrong_colors++;
    }
}

static void compare_sizes(const struct scene *scene, struct comparison sums[FORMULAS])
{
    struct sized sizes[SIZES];
    for (size_t i = 0; i < SIZES; i++)
        sizes[i] = sized(scene, factors[i]);
    for (int f = OURS; f < FORMULAS; f++) {
        for (size_t i = 0; i < SIZES; i++)
            sized_render(&sizes[i], formulas[f]);
        for (uint32_t y = 0; y < sizes[0].picture.height; y++)
            for (uint32_t x = 0; x < sizes[0].picture.width; x++)
                compare_pixel(sizes, x, y, &sums[f]);
    }
    for (size_t i = 0; i < SIZES; i++)
        sized_free(&sizes[i]);
}

static void run_decimal_scaling(const struct budget *budget, struct case_result *result)
{
    /* Depth 0: later bounces multiply the rounding of the input (row 52 is about those). */
    const char *const quick[] = {"image.width=24",     "image.height=18",   "sampling.samples=1",
                                 "render.max_depth=0", "render.shadows=no", NULL};
    const char *const full[] = {"image.width=160",    "image.height=120",  "sampling.samples=1",
                                "render.max_depth=0", "render.shadows=no", NULL};
    struct comparison sums[FORMULAS] = {{.pixels = 0}};
    const struct comparison *ours = &sums[OURS], *paper = &sums[PAPER];
    char **files = picture_files(budget->quick);
    for (char **file = files; *file; file++) {
        struct scene *scene = picture_load(*file, budget->quick ? quick : full);
        struct comparison before = *ours;
        compare_sizes(scene, sums);
        if (ours->wrong_ids != before.wrong_ids || ours->wrong_colors != before.wrong_colors ||
            (ours->worst > 1e-12 && !(before.worst > 1e-12)))
            note_first(result, *file, (double)(ours->wrong_ids - before.wrong_ids));
        free(scene);
    }
    picture_files_free(files);
    snprintf(result->paper, sizeof result->paper, "%llu ids, %llu colours differ",
             (unsigned long long)paper->wrong_ids, (unsigned long long)paper->wrong_colors);
    snprintf(result->ours, sizeof result->ours, "%llu ids, %llu colours differ, %.2g; %llu masked",
             (unsigned long long)ours->wrong_ids, (unsigned long long)ours->wrong_colors,
             ours->worst, (unsigned long long)ours->masked);
    result->worst = ours->worst;
    picture_verdict(result, ours->pixels,
                    ours->wrong_ids + ours->wrong_colors + (ours->worst > 1e-12));
}

/* ---- 32 ---- */

struct moved_scene {
    struct stage stage;
    struct vec3 by;
};

/* Rays of one block: is the id the one that 2048 bits find on the rounded scene? */
static void translated_rays(struct block *block, const void *context)
{
    const struct moved_scene *moved = context;
    const struct stage *stage = &moved->stage;
    struct reference *reference = reference_create(stage->ours, 2048);
    for (uint64_t i = 0; i < block->count; i++) {
        struct vec3 origin = vec_add(random_point(&block->random, 20), moved->by);
        struct vec3 target = vec_add(random_point(&block->random, 10), moved->by);
        struct ray ray = stage_ray(origin, vec_sub(target, origin));
        uint32_t part, id = reference_nearest(reference, ray.origin, ray.direction, &part);
        struct hit ours = stage_nearest(stage, stage->ours, &ray, &block->tally->fallbacks);
        struct hit paper = stage_nearest(stage, stage->paper, &ray, NULL);
        if (ours.primitive != id) score_wrong(&block->tally->ours, block->first + i);
        if (paper.primitive != id) score_wrong(&block->tally->paper, block->first + i);
        block->tally->samples++;
    }
    reference_free(reference);
}

static void run_translation(const struct budget *budget, struct case_result *result)
{
    struct tally tally = {.samples = 0};
    uint64_t rays = budget->rays / 11 + 1;
    for (int k = 20; k <= 40; k += 2) {
        struct random random = random_seeded(32, (uint64_t)k);
        struct builder *builder = builder_create();
        picture_mixture(builder, &random, 12);
        struct stage at_home = stage_finish(builder, NULL);
        struct vec3 by = {ldexp(1, k), ldexp(-1, k), ldexp(1, k)};
        struct moved_scene moved = {
            {picture_moved(at_home.ours, by), picture_moved(at_home.paper, by), NULL}, by};
        moved.stage.bvh = scene_tree(moved.stage.ours);
        share(budget, 32, budget->quick ? 64 : rays, translated_rays, &moved, &tally);
        stage_free(&moved.stage);
        stage_free(&at_home);
    }
    conclude(result, &tally, NULL, 0);
}

const struct stability_case moved_cases[] = {
    {30, "whole scene x 2^k, |k| <= 60", "self", "pictures identical", .run = run_scaling,
     .files = true},
    {31, "scene x 10^+-9", "self", "same ids, <= 1e-12 outside the mask",
     .run = run_decimal_scaling, .files = true},
    {32, "scene moved by 2^20 .. 2^40", "MPFR", "ids as on the rounded input",
     .run = run_translation},
    {.number = 0},
};
