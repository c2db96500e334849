#include "worker/render.h"

#include <stdlib.h>

#include "common/clock.h"
#include "common/message.h"
#include "worker/eye_media.h"
#include "worker/inlined.h"
#include "worker/packet.h"
#include "worker/renderer.h"

/* A ray whose coarse bound exceeds this many cutoffs is traced almost certainly, so its bound is not
 * tightened. */
#define COARSE_CUTOFFS 4

/*
 * The most rays that are traced for a sample, shadow rays excluded. A ray of weight tau = cutoff / R
 * (worker/radiance.h) can change the sample by at most the cutoff. Where reflection + transmission <= 1, the
 * weights of one level of the tree add up to at most 1, so that at most 1 / tau of its rays have a larger
 * weight, and max_depth / tau of the whole tree. Rays beyond this budget have smaller weights each, but where
 * surfaces lose no light there may be 2^depth of them; what they could have added counts as truncation.
 */
static uint64_t ray_budget_of(const struct renderer *renderer)
{
    const struct view *view = &renderer->scene->view;
    double most = radiance_primary_bound(&renderer->radiance);
    double budget = ((double)view->max_depth + 1) * fmax(1, most / view->cutoff);
    return budget < 0x1p62 ? (uint64_t)budget : UINT64_C(1) << 62;
}

/* Forgets all stacks of media, then determines the one that the eye is in. */
static void begin_media(struct renderer *renderer)
{
    const struct scene *scene = renderer->scene;
    media_clear(renderer->media);
    bool refracts = (scene_features(scene) & FEATURE_REFRACTION) != 0;
    if (!refracts || scene->view.formulas == FORMULAS_PAPER) return;
    const struct camera *camera = &scene->view.camera;
    renderer->eye_media = media_at(renderer->media, renderer->bvh, camera->eye, camera->forward);
    renderer->eye_on_surface = media_meet_at(renderer->media, renderer->bvh, camera->eye);
}

/* Whether every sample is one ray. */
static bool is_primary_only(const struct scene *scene)
{
    unsigned spawning = FEATURE_REFLECTION | FEATURE_REFRACTION;
    return scene->view.variant == VARIANT_AUTO && !(scene_features(scene) & spawning);
}

struct renderer *renderer_prepare(const struct scene *scene)
{
    struct renderer *renderer = allocate_zeroed(1, sizeof *renderer);
    renderer->scene = scene;
    renderer->primary_only = is_primary_only(scene);
    if (!renderer->primary_only) {
        radiance_init(&renderer->radiance, scene);
        renderer->ray_budget = ray_budget_of(renderer);
    }
    renderer->media = media_create(scene);
    return renderer;
}

void renderer_begin(struct renderer *renderer, const struct bvh *bvh)
{
    renderer->bvh = bvh;
    begin_media(renderer);
}

void renderer_destroy(struct renderer *renderer)
{
    if (!renderer) return;
    for (uint32_t i = 0; i < WAVE; i++) {
        tree_free(&renderer->pending[i].tree);
        omission_free(&renderer->pending[i].omission);
    }
    media_destroy(renderer->media);
    radiance_free(&renderer->radiance);
    free(renderer->refinements);
    free(renderer->numbers);
    free(renderer);
}

const struct scene *renderer_scene(const struct renderer *renderer)
{
    return renderer->scene;
}

/*
 * Takes the next ray that contributes to the picture. A ray's bound is tightened only when its turn comes:
 * most rays that are never traced do not need it.
 */
static bool next_in_picture(const struct renderer *renderer, struct tree *tree,
                            struct branch *branch)
{
    double cutoff = renderer->scene->view.cutoff;
    struct branch *next;
    if (tree->count == 0) return false;
    while ((next = tree_next(tree, cutoff)) != NULL) {
        if (!next->coarse || next->bound > COARSE_CUTOFFS * cutoff) break;
        tree_rate(tree, next,
                  radiance_bound(&renderer->radiance, &next->ray, next->weight, next->depth, true));
    }
    if (next) tree_remove(tree, next, branch);
    return next;
}

/* Takes the next ray of a sample; false: the sample is complete. */
static bool next_branch(struct renderer *renderer, uint32_t p, struct branch *branch)
{
    struct sample_state *state = &renderer->states[p];
    struct pending_rays *pending = &renderer->pending[p];
    if (!state->branched) return false;
    if (!state->bounding) {
        if (state->picture_rays < renderer->ray_budget &&
            next_in_picture(renderer, &pending->tree, branch)) {
            state->picture_rays++;
            state->cost_rays++;
            renderer->counts.rays[branch->kind]++;
            return true;
        }
        state->bounding = true;
        omission_take(&pending->omission, &renderer->radiance, &pending->tree);
    }
    /* A survey needs no bound on what it leaves out. */
    if (renderer->progress.task.survey ||
        !omission_next(&pending->omission, &renderer->radiance, branch))
        return false;
    state->cost_rays++;
    renderer->counts.bound_rays++;
    renderer->bounding++;
    return true;
}

/* Fills the wave with the next ray of every sample that has one. */
static void continue_samples(struct renderer *renderer)
{
    uint32_t samples = renderer->count;
    renderer->count = renderer->bounding = 0;
    renderer->fresh = false;
    for (uint32_t i = 0; i < samples; i++) {
        uint32_t p = renderer->owner[i], slot = renderer->count;
        struct branch *branch = &renderer->branches[slot];
        if (!next_branch(renderer, p, branch)) continue;
        renderer->rays[slot] = branch->ray;
        renderer->owner[slot] = p;
        renderer->count++;
    }
}

/*
 * The order in which the pixels of a rectangle are rendered: in blocks of BLOCK_W x BLOCK_H, the rays of each
 * forming one bundle, and within them in parts of PART_W x PART_H, one packet each (worker/packet.h). Rays of
 * pixels that are near each other in both directions stay together longer than those of a row. A band is a
 * row of blocks. Pixels outside of whole blocks come row by row, as do all pixels of a tile with steps. If
 * only some pixels get samples, these come in the same order.
 */
#define BLOCK_W 8
#define BLOCK_H 4
#define PART_W  4
#define PART_H  2
_Static_assert(BLOCK_W *BLOCK_H == BUNDLE * LANES && PART_W * PART_H == LANES,
               "bundles and packets");

/* Position of the k-th pixel in rendering order, in a whole band whose first pixel is number `begin`. */
static inline void block_place(uint32_t w, uint32_t band, uint32_t begin, uint32_t k, uint32_t *x,
                               uint32_t *y)
{
    uint32_t i = k - begin, whole = w / BLOCK_W * BLOCK_W;
    if (i < whole * BLOCK_H) {
        uint32_t part = i / (PART_W * PART_H) % (BLOCK_W * BLOCK_H / (PART_W * PART_H));
        *x = i / (BLOCK_W * BLOCK_H) * BLOCK_W + part % (BLOCK_W / PART_W) * PART_W + i % PART_W;
        *y = band * BLOCK_H + part / (BLOCK_W / PART_W) * PART_H + i / PART_W % PART_H;
    } else {
        i -= whole * BLOCK_H;
        *x = whole + i % (w - whole);
        *y = band * BLOCK_H + i / (w - whole);
    }
}

/* Whether the k-th pixel is in a whole band. Advances progress->band as needed, so k must not decrease
 * between calls. */
static bool is_in_band(struct progress *progress, uint32_t k)
{
    const struct tile *tile = progress->task.tile;
    if (tile->step > 1) return false;
    while (k - progress->band_begin >= tile->w * BLOCK_H) {
        progress->band++;
        progress->band_begin += tile->w * BLOCK_H;
    }
    return (progress->band + 1) * BLOCK_H <= tile->h;
}

/* The number in the tile of the k-th pixel to be rendered; *x, *y: its position in the rendered region. */
static uint32_t kth_pixel(struct progress *progress, uint32_t k, uint32_t *x, uint32_t *y)
{
    const struct tile *tile = progress->task.tile;
    if (!is_in_band(progress, k)) {
        tile_pixel(tile, k, x, y);
        return k;
    }
    block_place(tile->w, progress->band, progress->band_begin, k, x, y);
    uint32_t place = *y * tile->w + *x;
    *x += tile->x;
    *y += tile->y;
    return place;
}

/* Locates the pixel whose samples come next. */
static void locate_pixel(struct renderer *renderer)
{
    struct progress *progress = &renderer->progress;
    uint32_t x, y;
    progress->place = kth_pixel(progress, progress->next.pixel, &x, &y);
    progress->x = x + renderer->scene->view.region_x;
    progress->y = y + renderer->scene->view.region_y;
}

/* Arranges the task's refinements in the order in which its pixels are rendered, for the cursors. */
static void arrange_refinements(struct renderer *renderer)
{
    struct progress order = renderer->progress; /* a copy, since its band advances */
    const struct refinement *given = order.task.refinements;
    uint32_t pixels = tile_pixels(order.task.tile), number = 0, x, y;
    if (pixels > renderer->refinements_room) {
        size_t room = renderer->refinements_room = pixels;
        renderer->refinements =
            reallocate(renderer->refinements, room, sizeof *renderer->refinements);
        renderer->numbers = reallocate(renderer->numbers, room, sizeof *renderer->numbers);
    }
    for (uint32_t k = 0; k < pixels; k++) {
        renderer->refinements[k] = given[kth_pixel(&order, k, &x, &y)];
        renderer->numbers[k] = number;
        number += given[k].to > given[k].from;
    }
    renderer->progress.task.refinements = renderer->refinements;
}

static INLINED void start_sample(struct renderer *renderer, uint32_t p, bool primary_only)
{
    const struct progress *progress = &renderer->progress;
    struct sample_state *state = &renderer->states[p];
    state->color = (struct color_sum){{0, 0, 0}, {0, 0, 0}};
    state->pixel = progress->place;
    state->sample = progress->next.sample;
    state->bad = state->bounding = state->branched = false;
    state->cost_rays = 1;
    if (primary_only) return;
    state->picture_rays = 1;
    struct branch *primary = &renderer->branches[p];
    primary->weight = vec3(1, 1, 1);
    primary->depth = 0;
    primary->media = renderer->eye_media;
    primary->kind = RAY_PRIMARY;
    renderer->owner[p] = p;
}

/*
 * The most shadow rays of a wave, unless a single ray needs more. At ten million a second they take a tenth
 * of a second, so that a renderer polls messages in time even with very many lights. Up to 4,000 lights do
 * not shorten the waves.
 */
#define WAVE_SHADOW_RAYS (1u << 20)

/* The number of samples to trace together. */
static INLINED uint32_t wave_of(const struct renderer *renderer)
{
    uint64_t left = renderer->progress.samples - renderer->progress.started;
    uint64_t most = WAVE_SHADOW_RAYS / (renderer->scene->lights.count + UINT64_C(1)) + 1;
    if (most > WAVE) most = WAVE;
    return (uint32_t)(left < most ? left : most);
}

/* The most stacks of media that are kept for later samples; they only save time. A wave may add as many as its rays
 * need. */
#define MEDIA_KEPT 65536u

/* For an eye on the surface of glass: each of the first rays is on the side that it goes to. */
static void find_first_media(struct renderer *renderer, uint32_t count)
{
    for (uint32_t p = 0; p < count; p++) {
        const struct ray *ray = &renderer->rays[p];
        renderer->branches[p].media =
            media_ahead(renderer->media, renderer->bvh, ray->origin, ray->direction);
    }
}

/*
 * Starts the first wave of the next samples. They are neighbours; their secondary rays stay together as well,
 * as long as no others join them.
 */
static INLINED void start_samples(struct renderer *renderer, bool primary_only)
{
    const struct view *view = &renderer->scene->view;
    struct progress *progress = &renderer->progress;
    uint32_t count = wave_of(renderer);
    if (!primary_only && media_count(renderer->media) > MEDIA_KEPT) begin_media(renderer);
    for (uint32_t p = 0; p < count; p++) {
        if (progress->next.sample == progress->next.begin) locate_pixel(renderer);
        sample_put(&renderer->samples, p, progress->x, progress->y, progress->next.sample);
        start_sample(renderer, p, primary_only);
        cursor_advance(&progress->next, &progress->task, view);
    }
    sample_rays(view, &renderer->samples, count, renderer->rays);
    if (!primary_only && renderer->eye_on_surface) find_first_media(renderer, count);
    progress->started += count;
    renderer->counts.rays[RAY_PRIMARY] += count;
    renderer->count = count;
    renderer->fresh = true;
    renderer->bounding = 0;
}

static bool is_interrupted(const struct renderer *renderer)
{
    return renderer->interrupted && renderer->interrupted(renderer->context);
}

/* Returns false if interrupted. */
static bool trace_trees(struct renderer *renderer)
{
    const struct progress *progress = &renderer->progress;
    while (progress->started < progress->samples) {
        start_samples(renderer, false);
        uint32_t samples = renderer->count;
        for (; renderer->count > 0; continue_samples(renderer)) {
            if (is_interrupted(renderer)) return false;
            trace_wave(renderer);
        }
        add_samples(renderer, samples);
    }
    return true;
}

static bool trace_primaries(struct renderer *renderer)
{
    const struct progress *progress = &renderer->progress;
    while (progress->started < progress->samples) {
        start_samples(renderer, true);
        if (is_interrupted(renderer)) return false;
        trace_primary_wave(renderer);
        add_samples(renderer, renderer->count);
    }
    return true;
}

void renderer_on_wave(struct renderer *renderer, renderer_interrupted *interrupted, void *context)
{
    renderer->interrupted = interrupted;
    renderer->context = context;
}

static void begin_task(struct renderer *renderer, const struct task *task)
{
    const struct view *view = &renderer->scene->view;
    struct progress *progress = &renderer->progress;
    *progress = (struct progress){.task = *task, .samples = task_samples(task, view)};
    progress->next.pixels = tile_pixels(task->tile);
    if (task->refinements) arrange_refinements(renderer);
    cursor_settle(&progress->next, &progress->task, view);
    progress->adds = progress->next;
    if (!task->survey) progress->halfway = samples_halfway(level_samples(view, 1));
    renderer->counts = (struct render_counts){0};
    renderer->count = renderer->shadow_count = 0;
}

bool renderer_task(struct renderer *renderer, const struct task *task, struct render_counts *counts)
{
    double start = clock_wall();
    begin_task(renderer, task);
    if (!(renderer->primary_only ? trace_primaries(renderer) : trace_trees(renderer))) return false;
    renderer->counts.shade_s = clock_wall() - start - renderer->counts.intersect_s;
    *counts = renderer->counts;
    return true;
}
