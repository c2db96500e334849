/* Rows 30-32: the same scene elsewhere and in another size. */
#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/pictures.h"
#include "common/message.h"
#include "test/reference.h"
#include "worker/sample.h"

static const char *const quick_size[] = {"image.width=24", "image.height=18", "sampling.samples=1",
                                         "render.max_depth=6", NULL};
static const char *const full_size[] = {"image.width=96", "image.height=72", "sampling.samples=1",
                                        NULL};

static void note_first(struct case_result *result, const char *file, double where)
{
    if (!result->note[0]) snprintf(result->note, sizeof result->note, "%s at %g", file, where);
}

/* Pixels of one scene whose bits change under x 2^k. */
static uint64_t scale_scene(const struct scene *scene, const char *file, int step,
                            struct case_result *result, uint64_t *pixels)
{
    uint64_t wrong = 0;
    struct picture plain = picture_render(scene);
    for (int k = -60; k <= 60; k += step) {
        struct scene *scaled = picture_scaled(scene, ldexp(1, k));
        struct picture picture = picture_render(scaled);
        uint64_t different = picture_differences(&plain, &picture);
        if (different && scene->view.formulas == FORMULAS_EXACT) note_first(result, file, k);
        wrong += different;
        *pixels += (uint64_t)plain.width * plain.height;
        picture_free(&picture);
        free(scaled);
    }
    picture_free(&plain);
    return wrong;
}

void run_scaling(const struct budget *budget, struct case_result *result)
{
    uint64_t pixels = 0, wrong = 0, paper = 0, unread = 0;
    char **files = picture_files(budget->quick);
    for (char **file = files; *file; file++) {
        struct scene *scene = picture_load(*file, budget->quick ? quick_size : full_size);
        if (!scene) {
            unread++;
            note_first(result, *file, 0);
            continue;
        }
        uint64_t ignored = 0;
        wrong += scale_scene(scene, *file, budget->quick ? 40 : 1, result, &pixels);
        scene->view.formulas = FORMULAS_PAPER;
        paper += scale_scene(scene, *file, budget->quick ? 60 : 10, result, &ignored);
        free(scene);
    }
    picture_files_free(files);
    snprintf(result->paper, sizeof result->paper, "%llu pixels differ", (unsigned long long)paper);
    snprintf(result->ours, sizeof result->ours, "%llu pixels differ", (unsigned long long)wrong);
    picture_verdict(result, pixels, wrong + unread);
}

/* ---- 31 ---- */

/* What one pixel's first ray meets. */
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
    it.bvh = stage_tree(it.scene);
    it.picture = picture_render(it.scene);
    return it;
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
    struct ray ray = sample_ray(&it->scene->view, x, y, 0);
    uint64_t exact = 0;
    nearest(it->scene, it->bvh, &ray, 1, &sight.hit, &exact);
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
    return fmax(t, vec_length(vec_sub(other->surface.shading, plain->surface.shading)));
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
 * Multiplying by 10^+-9 rounds every coordinate. Masked are the pixels that such a rounding changes
 * by more than 1e-12 although the size stays ordinary: those whose answer depends on the last bits
 * of the input. An absolute tolerance anywhere would show at 10^+-9 and not here.
 */
static const double ordinary[] = {1.1, 1 / 1.1, 1.3, 0.7};
#define ORDINARY (sizeof ordinary / sizeof *ordinary)

static bool masked(const struct sized *plain, const struct sized others[ORDINARY], uint32_t x,
                   uint32_t y)
{
    struct sight sight = sight_of(plain, x, y);
    for (size_t i = 0; i < ORDINARY; i++) {
        struct sight other = sight_of(&others[i], x, y);
        if (!same_part(&sight, &other)) return true;
        if (sight_error(&sight, &other, others[i].factor) > 1e-12) return true;
        if (!colors_agree(plain, &others[i], x, y)) return true;
    }
    return false;
}

struct comparison {
    uint64_t pixels, masked, wrong_ids, wrong_colors;
    double worst;
};

static void compare_scaled(const struct sized *plain, const struct sized others[ORDINARY],
                           double factor, struct comparison *sum)
{
    struct sized scaled = sized(plain->scene, factor);
    for (uint32_t y = 0; y < plain->picture.height; y++) {
        for (uint32_t x = 0; x < plain->picture.width; x++) {
            sum->pixels++;
            if (masked(plain, others, x, y)) {
                sum->masked++;
                continue;
            }
            struct sight sight = sight_of(plain, x, y), other = sight_of(&scaled, x, y);
            bool same = same_part(&sight, &other);
            if (!same) sum->wrong_ids++;
            if (same) sum->worst = fmax(sum->worst, sight_error(&sight, &other, factor));
            if (!colors_agree(plain, &scaled, x, y)) sum->wrong_colors++;
        }
    }
    sized_free(&scaled);
}

static void compare_sizes(const struct scene *scene, struct comparison *sum)
{
    struct sized plain = sized(scene, 1), others[ORDINARY];
    for (size_t i = 0; i < ORDINARY; i++)
        others[i] = sized(scene, ordinary[i]);
    compare_scaled(&plain, others, 1e9, sum);
    compare_scaled(&plain, others, 1e-9, sum);
    for (size_t i = 0; i < ORDINARY; i++)
        sized_free(&others[i]);
    sized_free(&plain);
}

void run_decimal_scaling(const struct budget *budget, struct case_result *result)
{
    /* Depth 0: later bounces multiply the rounding of the input (row 52 is about those). */
    const char *const quick[] = {"image.width=24",     "image.height=18",   "sampling.samples=1",
                                 "render.max_depth=0", "render.shadows=no", NULL};
    const char *const full[] = {"image.width=160",    "image.height=120",  "sampling.samples=1",
                                "render.max_depth=0", "render.shadows=no", NULL};
    struct comparison ours = {.pixels = 0}, paper = {.pixels = 0};
    char **files = picture_files(budget->quick);
    for (char **file = files; *file; file++) {
        struct scene *scene = picture_load(*file, budget->quick ? quick : full);
        if (!scene) continue;
        struct comparison before = ours;
        compare_sizes(scene, &ours);
        if (ours.wrong_ids != before.wrong_ids || ours.wrong_colors != before.wrong_colors)
            note_first(result, *file, (double)(ours.wrong_ids - before.wrong_ids));
        scene->view.formulas = FORMULAS_PAPER;
        compare_sizes(scene, &paper);
        free(scene);
    }
    picture_files_free(files);
    snprintf(result->paper, sizeof result->paper, "%llu ids, %llu colours differ",
             (unsigned long long)paper.wrong_ids, (unsigned long long)paper.wrong_colors);
    snprintf(result->ours, sizeof result->ours, "%llu ids, %llu colours differ, %.2g; %llu masked",
             (unsigned long long)ours.wrong_ids, (unsigned long long)ours.wrong_colors, ours.worst,
             (unsigned long long)ours.masked);
    result->worst = ours.worst;
    picture_verdict(result, ours.pixels, ours.wrong_ids + ours.wrong_colors + (ours.worst > 1e-12));
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
        struct vec3 origin = vec_add(picture_somewhere(&block->random, 20), moved->by);
        struct vec3 target = vec_add(picture_somewhere(&block->random, 10), moved->by);
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

void run_translation(const struct budget *budget, struct case_result *result)
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
        moved.stage.bvh = stage_tree(moved.stage.ours);
        share(budget, 32, budget->quick ? 64 : rays, translated_rays, &moved, &tally);
        stage_free(&moved.stage);
        stage_free(&at_home);
    }
    conclude(result, &tally, NULL, 0);
}
