#include "worker/render.h"

#include <float.h>
#include <stdlib.h>

#include "common/clock.h"
#include "common/message.h"
#include "worker/color_sum.h"
#include "worker/exact.h"
#include "worker/inlined.h"
#include "worker/medium.h"
#include "worker/omission.h"
#include "worker/points.h"
#include "worker/sample.h"
#include "worker/shade.h"
#include "worker/task.h"
#include "worker/tree.h"

/*
 * The functions below that take `flat` are compiled twice: true for a scene in which nothing
 * reflects or refracts. Every sample is one ray then, of weight 1, so that there are no trees, no
 * media and no waiting for other samples.
 */

/* A wave begins with so many new samples at least: neighbours, whose rays keep together. */
#define FRESH_MIN 64

/* Samples that wait for earlier ones of the tile before they are added to their pixel. */
#define WINDOW (4 * WAVE)

/* What may bring more cutoffs than this is traced in any case, or nearly so. */
#define COARSE_CUTOFFS 4

/* One sample on its way. */
struct path {
    struct tree tree;
    struct omission omission;
    struct color_sum color;
    bool bounding;   /* all that is shown is traced; the rest goes into the bound */
    uint64_t rays;   /* traced so far to be shown, without shadow rays */
    uint32_t traced; /* of all kinds, to be shown or not */
    uint64_t index;  /* of the tile's samples */
    uint32_t pixel;  /* of the tile */
    uint32_t sample; /* of the pixel */
    bool bad;        /* counted as not finite */
};

/* A sample that is done. */
struct finished {
    struct vec3 color;
    double truncation;
    uint32_t traced;
    bool waits;
};

/* A point of the wave, and a light on its lit side. */
struct facing {
    uint32_t point, light;
};

/* A task in work. */
struct progress {
    struct task task;
    uint64_t samples; /* of the task */
    uint64_t started, added;
    struct task_cursor next; /* to start, in the order of pixel_in_order() */
    uint32_t place;          /* which pixel of the tile that is */
    uint32_t x, y;           /* its place in the whole picture */
    struct task_cursor adds; /* to be added next */
    struct pixel_sum sum;    /* of that pixel */
    uint32_t put;            /* pixels handed over, where only some get samples */
    uint32_t halfway;        /* samples of it after which an error is told, too; 0: none */
};

struct renderer {
    const struct scene *scene;
    const struct bvh *bvh;
    struct radiance radiance;
    uint64_t ray_budget; /* of a sample */
    bool flat;           /* nothing reflects or refracts */
    struct media *media;
    uint32_t eye_media; /* the stack that the eye is in */
    struct progress progress;
    struct render_counts counts;
    renderer_interrupted *interrupted;
    void *context;

    struct path paths[WAVE];
    uint32_t idle[WAVE]; /* paths without a sample */
    uint32_t idle_count;
    struct finished finished[WINDOW]; /* by index modulo WINDOW */

    /* The current wave: slot i traces branches[i] for path owner[i]. */
    uint32_t count;
    uint32_t bounding; /* so many of them only count for the bound */
    uint32_t owner[WAVE];
    struct branch branches[WAVE];
    struct ray rays[WAVE];
    struct hit hits[WAVE];
    struct points points;
    struct sample_lanes samples;

    /* Points that face lights, and the shadow rays to those, light by light. */
    struct faced faced;
    struct facing facing[WAVE];
    uint32_t facing_count;
    struct lit lit;
    struct ray shadow_rays[WAVE];
    struct vec3 transmittance[WAVE];

    struct onward onward;
    uint32_t behind[WAVE];      /* the stacks of media that onward->point's refracted rays are in */
    struct vec3 mirrored[WAVE]; /* share of each point's mirror ray */
};

/*
 * A ray of weight tau = cutoff / R (worker/radiance.h) can change the sample by the cutoff at most. Where reflection
 * + transmission <= 1, the weights of a level of the tree add up to 1, so that at most 1 / tau of
 * its rays weigh more, and max_depth / tau of the tree's. No sample takes more rays: what rays
 * would be left then weighs less each, but where nothing is lost between surfaces there may be
 * 2^depth of them. What they could have added counts as truncation.
 */
static uint64_t ray_budget_of(const struct renderer *renderer)
{
    const struct view *view = &renderer->scene->view;
    double most = radiance_most(&renderer->radiance);
    double budget = ((double)view->max_depth + 1) * fmax(1, most / view->cutoff);
    return budget < 0x1p62 ? (uint64_t)budget : UINT64_C(1) << 62;
}

/* Forgets all stacks of media, and finds out which one the eye is in. */
static void begin_media(struct renderer *renderer)
{
    const struct scene *scene = renderer->scene;
    media_clear(renderer->media);
    bool refracts = (scene_features(scene) & FEATURE_REFRACTION) != 0;
    if (!refracts || scene->view.formulas == FORMULAS_PAPER) return;
    renderer->eye_media = media_at(renderer->media, renderer->bvh, scene->view.camera.eye);
}

/* Whether every sample is one ray. */
static bool is_flat(const struct scene *scene)
{
    unsigned spawning = FEATURE_REFLECTION | FEATURE_REFRACTION;
    return scene->view.variant == VARIANT_AUTO && !(scene_features(scene) & spawning);
}

struct renderer *renderer_create(const struct scene *scene, const struct bvh *bvh)
{
    struct renderer *renderer = allocate_zeroed(1, sizeof *renderer);
    renderer->scene = scene;
    renderer->bvh = bvh;
    renderer->flat = is_flat(scene);
    if (!renderer->flat) {
        radiance_init(&renderer->radiance, scene);
        renderer->ray_budget = ray_budget_of(renderer);
    }
    renderer->media = media_create(scene);
    begin_media(renderer);
    return renderer;
}

void renderer_destroy(struct renderer *renderer)
{
    if (!renderer) return;
    for (uint32_t i = 0; i < WAVE; i++) {
        tree_free(&renderer->paths[i].tree);
        omission_free(&renderer->paths[i].omission);
    }
    media_destroy(renderer->media);
    radiance_free(&renderer->radiance);
    free(renderer);
}

const struct scene *renderer_scene(const struct renderer *renderer)
{
    return renderer->scene;
}

/* ---- further rays ---- */

/* Whether the ray in a slot of the wave only counts for the bound. */
static inline bool is_bounding(const struct renderer *renderer, uint32_t slot)
{
    return renderer->paths[renderer->owner[slot]].bounding;
}

/* Adds the next ray of the tree, unless it carries nothing. */
static void spawn(struct renderer *renderer, uint32_t point, struct vec3 direction,
                  struct vec3 share, enum ray_kind kind, uint32_t media)
{
    uint32_t slot = renderer->points.slot[point];
    const struct branch *parent = &renderer->branches[slot];
    struct path *path = &renderer->paths[renderer->owner[slot]];
    struct vec3 weight = vec_mul(parent->weight, share);
    if (!(vec_max(weight) > 0)) return;
    uint32_t depth = parent->depth + 1;
    bool beyond = path->bounding || depth > renderer->scene->view.max_depth;
    struct branch *child = beyond ? omission_add(&path->omission) : tree_add(&path->tree);
    child->ray = (struct ray){.origin = lane(&renderer->points.point, point),
                              .direction = direction,
                              .t_max = HUGE_VAL,
                              .from = renderer->hits[slot].primitive,
                              .from_part = renderer->hits[slot].part};
    child->weight = weight;
    child->bound = radiance_roughly(&renderer->radiance, weight, depth, !beyond);
    child->rough = true;
    child->depth = depth;
    child->media = media;
    child->kind = kind;
}

static struct crossing_media cross_surface(struct renderer *renderer, uint32_t point)
{
    uint32_t slot = renderer->points.slot[point];
    uint32_t primitive = renderer->hits[slot].primitive;
    bool entering = renderer->points.entering[point] != 0;
    if (renderer->scene->view.formulas == FORMULAS_PAPER)
        return media_by_side(renderer->scene, primitive, entering);
    return media_cross(renderer->media, renderer->branches[slot].media, primitive, entering);
}

/* Refraction; what cannot leave a denser medium is mirrored. */
static void spawn_refracted(struct renderer *renderer)
{
    const struct points *points = &renderer->points;
    struct onward *onward = &renderer->onward;
    onward->count = 0;
    for (uint32_t i = 0; i < points->count; i++) {
        if (!(points->material[i]->transmission > 0)) continue;
        struct crossing_media crossing = cross_surface(renderer, i);
        if (crossing.unmatched && !is_bounding(renderer, points->slot[i]))
            renderer->counts.unmatched_media++;
        uint32_t k = onward->count++;
        onward->point[k] = i;
        onward->from[k] = crossing.from;
        onward->to[k] = crossing.to;
        renderer->behind[k] = crossing.stack;
    }
    points_refract(points, onward);
    for (uint32_t k = 0; k < onward->count; k++) {
        uint32_t i = onward->point[k];
        const struct material *material = points->material[i];
        struct vec3 passed = vec_scale(material->color, material->transmission);
        if (onward->passes[k] != 0)
            spawn(renderer, i, lane(&onward->direction, k), passed, RAY_REFRACTION,
                  renderer->behind[k]);
        else
            renderer->mirrored[i] = vec_add(renderer->mirrored[i], passed);
    }
}

static void spawn_mirrored(struct renderer *renderer)
{
    struct onward *onward = &renderer->onward;
    onward->count = 0;
    for (uint32_t i = 0; i < renderer->points.count; i++)
        if (vec_max(renderer->mirrored[i]) > 0) onward->point[onward->count++] = i;
    points_reflect(&renderer->points, onward);
    for (uint32_t k = 0; k < onward->count; k++) {
        uint32_t i = onward->point[k];
        spawn(renderer, i, lane(&onward->direction, k), renderer->mirrored[i], RAY_REFLECTION,
              renderer->branches[renderer->points.slot[i]].media);
    }
}

static void spawn_children(struct renderer *renderer)
{
    const struct points *points = &renderer->points;
    bool refracts = false, reflects = false;
    for (uint32_t i = 0; i < points->count; i++) {
        double kr = points->material[i]->reflection;
        renderer->mirrored[i] = vec3(kr, kr, kr);
        reflects |= kr > 0;
        refracts |= points->material[i]->transmission > 0;
    }
    if (refracts) spawn_refracted(renderer);
    if (refracts || reflects) spawn_mirrored(renderer);
}

/* ---- light ---- */

static INLINED void add_color(struct renderer *renderer, uint32_t slot, struct vec3 color,
                              bool flat)
{
    uint32_t p = flat ? slot : renderer->owner[slot];
    if (!flat) color = vec_mul(color, renderer->branches[slot].weight);
    color_sum_add(&renderer->paths[p].color, color);
}

/* What bound rays have found, in place of add_color(). */
static void add_found(struct renderer *renderer)
{
    const struct points *points = &renderer->points;
    for (uint32_t i = 0; i < points->count; i++) {
        uint32_t slot = points->slot[i];
        if (!is_bounding(renderer, slot)) continue;
        struct shading_point at = points_get(points, i);
        omission_found_point(&renderer->paths[renderer->owner[slot]].omission, &renderer->radiance,
                             renderer->branches[slot].weight, &at);
    }
}

/* The points that some light gets through to, of those that were gathered. */
static void gather_reached(struct renderer *renderer)
{
    const struct light *lights = scene_lights(renderer->scene);
    bool shadows = renderer->scene->view.shadows;
    struct lit *lit = &renderer->lit;
    lit->count = 0;
    for (uint32_t i = 0; i < renderer->facing_count; i++) {
        struct vec3 through = shadows ? renderer->transmittance[i] : vec3(1, 1, 1);
        if (vec_is_zero(through)) continue;
        lit->point[lit->count] = renderer->facing[i].point;
        set_lane(&lit->to_light, lit->count, renderer->shadow_rays[i].direction);
        set_lane(&lit->strength, lit->count,
                 vec_mul(lights[renderer->facing[i].light].color, through));
        lit->count++;
    }
}

/* Traces the gathered shadow rays as one batch and adds what comes through. */
static INLINED void flush_lit(struct renderer *renderer, bool flat)
{
    struct lit *lit = &renderer->lit;
    uint32_t count = renderer->facing_count;
    if (count > 0 && renderer->scene->view.shadows) {
        double start = clock_wall();
        occluded(renderer->scene, renderer->bvh, renderer->shadow_rays, count,
                 renderer->transmittance, &renderer->counts.exact_fallbacks);
        renderer->counts.intersect_s += clock_wall() - start;
        renderer->counts.rays[RAY_SHADOW] += count;
    }
    gather_reached(renderer);
    points_light(&renderer->points, lit);
    for (uint32_t i = 0; i < lit->count; i++)
        add_color(renderer, renderer->points.slot[lit->point[i]], lane(&lit->color, i), flat);
    renderer->facing_count = 0;
}

static INLINED void add_facing(struct renderer *renderer, uint32_t point, uint32_t light, bool flat)
{
    uint32_t slot = renderer->points.slot[point], i = renderer->facing_count++;
    renderer->paths[flat ? slot : renderer->owner[slot]].traced++;
    renderer->facing[i] = (struct facing){point, light};
    renderer->shadow_rays[i] = (struct ray){.origin = lane(&renderer->points.point, point),
                                            .direction = lane(&renderer->faced.to_light, point),
                                            .t_max = renderer->faced.end[point],
                                            .from = renderer->hits[slot].primitive,
                                            .from_part = renderer->hits[slot].part};
}

/* Whether light matters at a point. */
static INLINED bool is_shown(const struct renderer *renderer, uint32_t point, bool flat)
{
    const struct points *points = &renderer->points;
    if (!material_shows_light(points->material[point])) return false;
    return flat || !is_bounding(renderer, points->slot[point]);
}

/* Light by light, so that the shadow rays of a batch keep together. A surface that shows no light
 * needs none. */
static INLINED void light_points(struct renderer *renderer, bool flat)
{
    const struct light *lights = scene_lights(renderer->scene);
    const struct points *points = &renderer->points;
    if (points->count == 0) return;
    for (uint32_t k = 0; k < renderer->scene->lights.count; k++) {
        if (renderer->facing_count + points->count > WAVE) flush_lit(renderer, flat);
        points_face(points, &lights[k], &renderer->faced);
        for (uint32_t i = 0; i < points->count; i++)
            if (renderer->faced.faces[i] != 0 && is_shown(renderer, i, flat))
                add_facing(renderer, i, k, flat);
    }
    flush_lit(renderer, flat);
}

/* ---- the wave ---- */

/* A number that a picture of floats can hold. */
static bool is_good(double value)
{
    return value <= (double)FLT_MAX && value >= -(double)FLT_MAX;
}

/* The first ray that spoils its sample is told. A miss from a place that is not finite is no sky.
 */
static void tell_bad(struct renderer *renderer, struct path *path, const struct ray *ray,
                     uint32_t depth)
{
    path->bad = true;
    struct bad_sample bad = {
        .sample = path->sample, .depth = depth, .origin = ray->origin, .direction = ray->direction};
    tile_pixel(renderer->progress.task.tile, path->pixel, &bad.x, &bad.y);
    bad.x += renderer->scene->view.region_x;
    bad.y += renderer->scene->view.region_y;
    render_counts_bad(&renderer->counts, &bad);
}

/* Looks at every sample after one of its rays. */
static INLINED void check_paths(struct renderer *renderer, bool flat)
{
    for (uint32_t i = 0; i < renderer->count; i++) {
        struct path *path = &renderer->paths[flat ? i : renderer->owner[i]];
        const struct ray *ray = &renderer->rays[i];
        struct vec3 sum = path->color.plain;
        if (!flat && path->bounding) continue;
        bool good = is_good(sum.x) && is_good(sum.y) && is_good(sum.z);
        if (good && vec_is_finite(ray->origin)) continue;
        if (!path->bad) tell_bad(renderer, path, ray, flat ? 0 : renderer->branches[i].depth);
    }
}

static INLINED void add_background(struct renderer *renderer, uint32_t slot, bool flat)
{
    struct vec3 color = background(&renderer->scene->view, renderer->rays[slot].direction);
    if (!flat && is_bounding(renderer, slot)) {
        omission_found(&renderer->paths[renderer->owner[slot]].omission,
                       renderer->branches[slot].weight, color);
        return;
    }
    if (!flat && renderer->branches[slot].media != MEDIUM_OUTSIDE) renderer->counts.open_media++;
    add_color(renderer, slot, color, flat);
}

/* What is there without any light: the background, and ambient. */
static INLINED void add_unlit(struct renderer *renderer, bool flat)
{
    const struct points *points = &renderer->points;
    for (uint32_t i = 0; i < renderer->count; i++)
        if (renderer->hits[i].primitive == PRIMITIVE_NONE) add_background(renderer, i, flat);
    for (uint32_t i = 0; i < points->count; i++)
        if (points->material[i]->ambient > 0 && (flat || !is_bounding(renderer, points->slot[i])))
            add_color(renderer, points->slot[i], shade_ambient(points->material[i]), flat);
}

/* The hits of a wave become colour and further rays. */
static INLINED void trace_wave(struct renderer *renderer, bool flat)
{
    double start = clock_wall();
    nearest(renderer->scene, renderer->bvh, renderer->rays, renderer->count, renderer->hits,
            &renderer->counts.exact_fallbacks);
    renderer->counts.intersect_s += clock_wall() - start;
    points_find(renderer->scene, renderer->rays, renderer->hits, renderer->count,
                &renderer->points);
    add_unlit(renderer, flat);
    light_points(renderer, flat);
    if (!flat && renderer->bounding > 0) add_found(renderer);
    check_paths(renderer, flat);
    if (!flat) spawn_children(renderer);
}

static inline struct vec3 finished_sum(const struct renderer *renderer, const struct color_sum *sum)
{
    return renderer->scene->view.formulas == FORMULAS_PAPER ? sum->plain : color_sum_value(sum);
}

static void finish_path(struct renderer *renderer, uint32_t p)
{
    const struct path *path = &renderer->paths[p];
    renderer->finished[path->index % WINDOW] = (struct finished){
        finished_sum(renderer, &path->color), omission_bound(&path->omission), path->traced, true};
    renderer->idle[renderer->idle_count++] = p;
}

/*
 * The next ray that is shown. How bright it can be is looked at more closely when its turn comes,
 * not before: most of those that are never traced need not be.
 */
static bool next_shown(const struct renderer *renderer, struct tree *tree, struct branch *branch)
{
    double cutoff = renderer->scene->view.cutoff;
    struct branch *next;
    if (tree->count == 0) return false;
    while ((next = tree_next(tree, cutoff)) != NULL) {
        if (!next->rough || next->bound > COARSE_CUTOFFS * cutoff) break;
        tree_rate(tree, next,
                  radiance_of(&renderer->radiance, &next->ray, next->weight, next->depth, true));
    }
    if (next) tree_remove(tree, next, branch);
    return next;
}

/* The next ray of a sample; false: it is done. */
static bool next_branch(struct renderer *renderer, struct path *path, struct branch *branch)
{
    if (!path->bounding) {
        if (path->rays < renderer->ray_budget && next_shown(renderer, &path->tree, branch)) {
            path->rays++;
            path->traced++;
            renderer->counts.rays[branch->kind]++;
            return true;
        }
        path->bounding = true;
        omission_take(&path->omission, &renderer->radiance, &path->tree);
    }
    /* What a survey leaves out is nobody's business: it is no part of the picture. */
    if (renderer->progress.task.first > 0 ||
        !omission_next(&path->omission, &renderer->radiance, branch))
        return false;
    path->traced++;
    renderer->counts.bound_rays++;
    renderer->bounding++;
    return true;
}

/* The next ray of every sample that has one. */
static void continue_paths(struct renderer *renderer)
{
    uint32_t paths = renderer->count;
    renderer->count = renderer->bounding = 0;
    for (uint32_t i = 0; i < paths; i++) {
        uint32_t p = renderer->owner[i], slot = renderer->count;
        struct branch *branch = &renderer->branches[slot];
        if (!next_branch(renderer, &renderer->paths[p], branch)) {
            finish_path(renderer, p);
            continue;
        }
        renderer->rays[slot] = branch->ray;
        renderer->owner[slot] = p;
        renderer->count++;
    }
}

/*
 * Which pixel of a tile is rendered k-th. Of a rectangle they are taken in blocks of BLOCK_W x
 * BLOCK_H, one packet of rays each (worker/packet.h): what is near in both directions stays
 * together longer than what is in a row. What does not fill a block comes row by row.
 */
#define BLOCK_W 4
#define BLOCK_H 2

static inline uint32_t pixel_in_order(const struct tile *tile, uint32_t k)
{
    uint32_t w = tile->w, band = k / (BLOCK_H * w), i = k % (BLOCK_H * w);
    uint32_t blocks = w / BLOCK_W, block = i / (BLOCK_W * BLOCK_H), rest = w % BLOCK_W;
    if (tile->step > 1 || (band + 1) * BLOCK_H > tile->h) return k;
    uint32_t x = block * BLOCK_W + i % BLOCK_W, y = i / BLOCK_W % BLOCK_H;
    if (block == blocks) {
        i -= blocks * BLOCK_W * BLOCK_H;
        x = blocks * BLOCK_W + i % rest;
        y = i / rest;
    }
    return (band * BLOCK_H + y) * w + x;
}

/* The same in a task. Where only some pixels get samples, they come in the tile's order. */
static inline uint32_t place_of(const struct task *task, uint32_t k)
{
    return task->refinements ? k : pixel_in_order(task->tile, k);
}

static INLINED void start_path(struct renderer *renderer, uint32_t slot, bool flat)
{
    struct progress *progress = &renderer->progress;
    uint32_t p = flat ? slot : renderer->idle[--renderer->idle_count];
    struct path *path = &renderer->paths[p];
    path->color = (struct color_sum){{0, 0, 0}, {0, 0, 0}};
    path->pixel = progress->place;
    path->sample = progress->next.sample;
    path->bad = false;
    path->traced = 1;
    progress->started++;
    if (flat) return;
    tree_clear(&path->tree);
    omission_clear(&path->omission);
    path->bounding = false;
    path->rays = 1;
    path->index = progress->started - 1;
    struct branch *primary = &renderer->branches[slot];
    primary->weight = vec3(1, 1, 1);
    primary->depth = 0;
    primary->media = renderer->eye_media;
    primary->kind = RAY_PRIMARY;
    renderer->owner[slot] = p;
}

/* The place of the pixel whose samples come next. */
static void locate_pixel(struct renderer *renderer)
{
    struct progress *progress = &renderer->progress;
    const struct tile *tile = progress->task.tile;
    progress->place = place_of(&progress->task, progress->next.pixel);
    tile_pixel(tile, progress->place, &progress->x, &progress->y);
    progress->x += renderer->scene->view.region_x;
    progress->y += renderer->scene->view.region_y;
}

/* So many new samples join the wave. */
static INLINED void start_paths(struct renderer *renderer, uint32_t fresh, bool flat)
{
    const struct view *view = &renderer->scene->view;
    struct progress *progress = &renderer->progress;
    uint32_t first = renderer->count;
    for (uint32_t i = 0; i < fresh; i++) {
        if (progress->next.sample == progress->next.begin) locate_pixel(renderer);
        sample_place(view, progress->x, progress->y, progress->next.sample, &renderer->samples, i);
        start_path(renderer, first + i, flat);
        cursor_advance(&progress->next, &progress->task, view);
    }
    sample_rays(view, &renderer->samples, fresh, renderer->rays + first);
    renderer->counts.rays[RAY_PRIMARY] += fresh;
    renderer->count += fresh;
}

/* New samples take the places of finished ones, many at a time. */
static void refill_wave(struct renderer *renderer)
{
    const struct progress *progress = &renderer->progress;
    uint64_t left = progress->samples - progress->started;
    uint64_t room = WINDOW - (progress->started - progress->added);
    uint64_t fresh = left < room ? left : room;
    if (fresh > renderer->idle_count) fresh = renderer->idle_count;
    if (fresh >= FRESH_MIN || fresh == left) start_paths(renderer, (uint32_t)fresh, false);
}

static void put_color(float *rgb, struct vec3 color)
{
    rgb[0] = (float)color.x;
    rgb[1] = (float)color.y;
    rgb[2] = (float)color.z;
}

static struct vec3 divided(struct vec3 v, double by)
{
    return vec3(v.x / by, v.y / by, v.z / by);
}

/* What the two halves of the pixel's sum differ by, each divided by its number of samples. */
static struct vec3 halves_difference(const struct renderer *renderer, double evens, double odds)
{
    if (evens == 0 || odds == 0) return vec3(0, 0, 0);
    const struct pixel_sum *sum = &renderer->progress.sum;
    struct vec3 even = divided(finished_sum(renderer, &sum->half[0]), evens);
    return vec_sub(even, divided(finished_sum(renderer, &sum->half[1]), odds));
}

/*
 * The pixel is p A + q B, p and q the halves' shares of its samples. With errors of the halves that
 * are as large as those of random samples would be, or with halves of equal size and whatever
 * errors, p q (A - B)^2 is on average the square of its own error.
 */
static void add_error(struct error_sum *sum, struct vec3 difference, double evens, double odds)
{
    double share = evens * odds / ((evens + odds) * (evens + odds));
    double square = vec_dot(difference, difference) / 3 * share;
    if (!(square < HUGE_VAL)) return; /* counted as not finite */
    sum->squares += square;
    sum->fourths += square * square;
}

/* The next pixel's mean of so many samples, and what its halves differ by. */
static void put_pixel(struct renderer *renderer, uint32_t pixel, uint32_t begin, uint32_t end)
{
    struct progress *progress = &renderer->progress;
    const struct task *task = &progress->task;
    /* Only pixels that get samples are handed over. */
    uint32_t place = task->refinements ? progress->put++ : pixel_in_order(task->tile, pixel);
    struct vec3 even = finished_sum(renderer, &progress->sum.half[0]);
    struct vec3 odd = finished_sum(renderer, &progress->sum.half[1]);
    double samples = end - begin, evens = (end + 1) / 2 - (begin + 1) / 2;
    struct vec3 difference = halves_difference(renderer, evens, samples - evens);
    put_color(task->mean + 3 * (size_t)place, divided(vec_add(even, odd), samples));
    add_error(&renderer->counts.sampling, difference, evens, samples - evens);
    if (task->difference) put_color(task->difference + 3 * (size_t)place, difference);
    if (task->rays) task->rays[place] = (float)((double)progress->sum.rays / samples);
}

static void finish_pixel(struct renderer *renderer, uint32_t pixel, uint32_t begin, uint32_t end)
{
    struct progress *progress = &renderer->progress;
    double samples = end - begin;
    put_pixel(renderer, pixel, begin, end);
    /* An upper bound, like its parts: so many sums, and a quotient. The means of several passes
     * lie between those of each, and so do their bounds. */
    double truncation = progress->sum.truncation;
    if (truncation != 0) truncation = truncation / samples * (1 + (samples + 2) * UNIT_ROUNDOFF);
    renderer->counts.truncation = max_number(renderer->counts.truncation, truncation);
    progress->sum = (struct pixel_sum){0};
}

/* The next sample in their order. */
static inline void add_sample(struct renderer *renderer, struct vec3 color, double truncation,
                              uint32_t rays)
{
    struct progress *progress = &renderer->progress;
    struct task_cursor *adds = &progress->adds;
    color_sum_add(&progress->sum.half[adds->sample & 1], color);
    progress->sum.truncation += truncation;
    progress->sum.rays += rays;
    progress->added++;
    uint32_t pixel = adds->pixel, begin = adds->begin, end = adds->end,
             so_far = adds->sample + 1 - begin;
    if (so_far == progress->halfway)
        add_error(&renderer->counts.halfway, halves_difference(renderer, so_far / 2, so_far / 2),
                  so_far / 2, so_far / 2);
    if (cursor_advance(adds, &progress->task, &renderer->scene->view))
        finish_pixel(renderer, pixel, begin, end);
}

/* Adds the finished samples to their pixels, as far as none is missing before them. */
static void add_finished(struct renderer *renderer)
{
    const struct progress *progress = &renderer->progress;
    while (progress->added < progress->started) {
        struct finished *next = &renderer->finished[progress->added % WINDOW];
        if (!next->waits) break;
        next->waits = false;
        add_sample(renderer, next->color, next->truncation, next->traced);
    }
}

static bool is_interrupted(const struct renderer *renderer)
{
    return renderer->interrupted && renderer->interrupted(renderer->context);
}

/* false: interrupted */
static bool trace_trees(struct renderer *renderer)
{
    for (;;) {
        continue_paths(renderer);
        add_finished(renderer);
        refill_wave(renderer);
        if (renderer->count == 0) return true;
        if (is_interrupted(renderer)) return false;
        trace_wave(renderer, false);
    }
}

static bool trace_flat(struct renderer *renderer)
{
    const struct progress *progress = &renderer->progress;
    while (progress->started < progress->samples) {
        uint64_t left = progress->samples - progress->started;
        renderer->count = 0;
        start_paths(renderer, left < WAVE ? (uint32_t)left : WAVE, true);
        if (is_interrupted(renderer)) return false;
        trace_wave(renderer, true);
        for (uint32_t i = 0; i < renderer->count; i++) {
            const struct path *path = &renderer->paths[i];
            add_sample(renderer, finished_sum(renderer, &path->color), 0, path->traced);
        }
    }
    return true;
}

void renderer_on_wave(struct renderer *renderer, renderer_interrupted *interrupted, void *context)
{
    renderer->interrupted = interrupted;
    renderer->context = context;
}

/* Stacks kept from earlier tiles save nothing but time: many of them go. */
#define MEDIA_KEPT 65536u

static void begin_task(struct renderer *renderer, const struct task *task)
{
    const struct view *view = &renderer->scene->view;
    struct progress *progress = &renderer->progress;
    *progress = (struct progress){.task = *task, .samples = task_samples(task, view)};
    cursor_settle(&progress->next, task, view);
    progress->adds = progress->next;
    if (!task->refinements && !task->first)
        progress->halfway = samples_halfway(level_samples(view, 1));
    renderer->counts = (struct render_counts){0};
    renderer->count = renderer->facing_count = 0;
    renderer->idle_count = WAVE;
    for (uint32_t i = 0; i < WAVE; i++)
        renderer->idle[i] = WAVE - 1 - i;
    for (uint32_t i = 0; i < WINDOW; i++)
        renderer->finished[i].waits = false;
    if (media_count(renderer->media) > MEDIA_KEPT) begin_media(renderer);
}

bool renderer_task(struct renderer *renderer, const struct task *task, struct render_counts *counts)
{
    double start = clock_wall();
    begin_task(renderer, task);
    if (!(renderer->flat ? trace_flat(renderer) : trace_trees(renderer))) return false;
    renderer->counts.shade_s = clock_wall() - start - renderer->counts.intersect_s;
    *counts = renderer->counts;
    return true;
}
