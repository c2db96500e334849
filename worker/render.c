#include "worker/render.h"

#include <float.h>
#include <stdlib.h>

#include "common/clock.h"
#include "common/message.h"
#include "worker/color_sum.h"
#include "worker/exact.h"
#include "worker/medium.h"
#include "worker/sample.h"
#include "worker/shade.h"
#include "worker/tree.h"

/* Samples that advance together: enough for large batches, few enough that their rays, hits and
 * trees (about 400 bytes each) stay in a core's second-level cache. */
#define WAVE 256

/* One sample on its way. */
struct path {
    struct tree tree;
    struct color_sum color;
    double cut;      /* what pruning has left out, at most */
    double too_deep; /* what max_depth and ray_budget have left out, at most; may be infinite */
    uint64_t rays;   /* traced so far, without shadow rays */
    uint32_t pixel;  /* of the tile */
    uint32_t sample; /* of the pixel */
    bool bad;        /* counted as not finite */
};

/* One shadow ray's place: which hit of the wave it lights, and from which light. */
struct lit {
    uint32_t slot;
    uint32_t light;
    struct vec3 to_light;
};

struct renderer {
    const struct scene *scene;
    const struct bvh *bvh;
    double *bound;         /* [depth]: largest component a ray of that depth can bring */
    double bound_infinite; /* the same for a tree of unlimited depth */
    uint64_t ray_budget;   /* of a sample */
    struct media *media;
    uint32_t eye_media; /* the stack that the eye is in */
    const struct tile *tile;
    struct render_counts counts;
    renderer_interrupted *interrupted;
    void *context;

    struct path paths[WAVE];

    /* The current wave: slot i traces branches[i] for path owner[i]. */
    uint32_t owner[WAVE];
    struct branch branches[WAVE];
    struct ray rays[WAVE];
    struct hit hits[WAVE];
    struct shading_point points[WAVE];

    /* Shadow rays, `lights` of them per hit at most, in chunks of WAVE. */
    struct lit lit[WAVE];
    struct ray shadow_rays[WAVE];
    struct vec3 transmittance[WAVE];
    uint32_t shadow_count;
};

/*
 * A bound is computed from a few numbers, and so is what it bounds: the weight of a branch, its
 * share of its parent's, the colour of a surface or of the background, their sum. 32 roundings hold
 * all that is added in one level of the tree, for both.
 */
#define BOUND_SLACK (1 + 32 * UNIT_ROUNDOFF)

/*
 * What a ray can bring is at most the background, or what its surface shows of the lights plus the
 * share of what the next rays bring: B(D) = max(background, S), B(d) = max(background, S + r
 * B(d+1)).
 */
static void bound_radiance(struct renderer *renderer)
{
    const struct view *view = &renderer->scene->view;
    double sky = fmax(vec_max(view->background_bottom), vec_max(view->background_top));
    double surface = shade_bound(renderer->scene);
    double spawn = spawn_bound(renderer->scene);
    uint32_t deepest = view->max_depth;
    renderer->bound = allocate((size_t)deepest + 1, sizeof *renderer->bound);
    renderer->bound[deepest] = fmax(sky, surface) * BOUND_SLACK;
    for (uint32_t d = deepest; d-- > 0;)
        renderer->bound[d] = fmax(sky, surface + spawn * renderer->bound[d + 1]) * BOUND_SLACK;
    /* The fixed point of the same recurrence, or no bound where surfaces lose nothing. */
    double kept = spawn * BOUND_SLACK;
    renderer->bound_infinite = HUGE_VAL;
    if (kept < 1) renderer->bound_infinite = fmax(sky, surface / (1 - kept) * BOUND_SLACK);
    if (spawn == 1 && surface == 0) renderer->bound_infinite = sky;
    renderer->bound_infinite *= BOUND_SLACK;
}

/*
 * A ray of weight tau = cutoff / B(0) can change the sample by the cutoff at most. Where reflection
 * + transmission <= 1, the weights of a level of the tree add up to 1, so that at most 1 / tau of
 * its rays weigh more, and max_depth / tau of the tree's. No sample takes more rays: what rays
 * would be left then weighs less each, but where nothing is lost between surfaces there may be
 * 2^depth of them. What they could have added counts as truncation.
 */
static uint64_t ray_budget_of(const struct renderer *renderer)
{
    const struct view *view = &renderer->scene->view;
    double budget = ((double)view->max_depth + 1) * fmax(1, renderer->bound[0] / view->cutoff);
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

struct renderer *renderer_create(const struct scene *scene, const struct bvh *bvh)
{
    struct renderer *renderer = allocate_zeroed(1, sizeof *renderer);
    renderer->scene = scene;
    renderer->bvh = bvh;
    bound_radiance(renderer);
    renderer->ray_budget = ray_budget_of(renderer);
    renderer->media = media_create(scene);
    begin_media(renderer);
    return renderer;
}

void renderer_destroy(struct renderer *renderer)
{
    if (!renderer) return;
    for (uint32_t i = 0; i < WAVE; i++)
        tree_free(&renderer->paths[i].tree);
    media_destroy(renderer->media);
    free(renderer->bound);
    free(renderer);
}

const struct scene *renderer_scene(const struct renderer *renderer)
{
    return renderer->scene;
}

/* Adds the next ray of the tree, unless it is too deep or carries nothing. */
static void spawn(struct renderer *renderer, struct path *path, const struct branch *parent,
                  const struct shading_point *at, struct vec3 direction, struct vec3 share,
                  enum ray_kind kind, const struct hit *hit, uint32_t media)
{
    struct vec3 weight = vec_mul(parent->weight, share);
    double largest = vec_max(weight);
    if (!(largest > 0)) return;
    uint32_t depth = parent->depth + 1;
    if (depth > renderer->scene->view.max_depth) {
        /* Rounded up, so that the sum of many stays a bound. */
        double more = path->too_deep + largest * renderer->bound_infinite;
        path->too_deep = nextafter(more, HUGE_VAL);
        return;
    }
    struct branch child = {
        .ray = {.origin = at->point,
                .direction = direction,
                .t_max = HUGE_VAL,
                .from = hit->primitive,
                .from_part = hit->part},
        .weight = weight,
        .bound = largest * renderer->bound[depth],
        .depth = depth,
        .media = media,
        .kind = kind,
    };
    tree_push(&path->tree, &child);
}

static struct crossing_media cross_surface(struct renderer *renderer, uint32_t slot)
{
    uint32_t primitive = renderer->hits[slot].primitive;
    bool entering = renderer->points[slot].entering;
    if (renderer->scene->view.formulas == FORMULAS_PAPER)
        return media_by_side(renderer->scene, primitive, entering);
    return media_cross(renderer->media, renderer->branches[slot].media, primitive, entering);
}

/* Mirror reflection and refraction; what cannot leave a denser medium is reflected too. */
static void spawn_children(struct renderer *renderer, uint32_t slot)
{
    const struct shading_point *at = &renderer->points[slot];
    const struct material *material = at->material;
    const struct branch *parent = &renderer->branches[slot];
    struct path *path = &renderer->paths[renderer->owner[slot]];
    const struct hit *hit = &renderer->hits[slot];
    double kr = material->reflection;
    struct vec3 mirrored = vec3(kr, kr, kr);
    if (material->transmission > 0) {
        struct vec3 passed = vec_scale(material->color, material->transmission);
        struct crossing_media crossing = cross_surface(renderer, slot);
        struct vec3 direction;
        if (crossing.unmatched) renderer->counts.unmatched_media++;
        if (refract(at, crossing.from, crossing.to, &direction))
            spawn(renderer, path, parent, at, direction, passed, RAY_REFRACTION, hit,
                  crossing.stack);
        else
            mirrored = vec_add(mirrored, passed);
    }
    if (vec_max(mirrored) > 0)
        spawn(renderer, path, parent, at, reflect(at), mirrored, RAY_REFLECTION, hit,
              parent->media);
}

static void add_light(struct renderer *renderer, const struct lit *lit, struct vec3 through)
{
    if (vec_is_zero(through)) return;
    const struct light *light = &scene_lights(renderer->scene)[lit->light];
    struct vec3 strength = vec_mul(light->color, through);
    struct vec3 color = shade_light(&renderer->points[lit->slot], lit->to_light, strength);
    struct path *path = &renderer->paths[renderer->owner[lit->slot]];
    color_sum_add(&path->color, vec_mul(color, renderer->branches[lit->slot].weight));
}

/* Traces the gathered shadow rays as one batch and adds what comes through. */
static void flush_shadows(struct renderer *renderer)
{
    uint32_t count = renderer->shadow_count;
    if (count == 0) return;
    double start = clock_wall();
    occluded(renderer->scene, renderer->bvh, renderer->shadow_rays, count, renderer->transmittance,
             &renderer->counts.exact_fallbacks);
    renderer->counts.intersect_s += clock_wall() - start;
    renderer->counts.rays[RAY_SHADOW] += count;
    for (uint32_t i = 0; i < count; i++)
        add_light(renderer, &renderer->lit[i], renderer->transmittance[i]);
    renderer->shadow_count = 0;
}

/*
 * Where the shadow ray from p to a light at l ends: short of 1 by what the light's own place and
 * the ray's direction are uncertain by. l - p is rounded by u |l - p|; p lies within some 4 u |p|
 * of its surface, and l within as much as its coordinates' u of a surface that is meant to carry
 * it. Without this, a light on a lamp's surface would be shaded by it or not as rounding falls; so
 * it shines on its own side. A light as close as that to the point is not shaded at all.
 */
#define SHADOW_ROUNDOFF (8 * UNIT_ROUNDOFF)

static double shadow_end(const struct renderer *renderer, struct vec3 point, struct vec3 light,
                         struct vec3 to_light)
{
    if (renderer->scene->view.formulas == FORMULAS_PAPER) return 1;
    double reach = largest_component(point) + largest_component(light);
    double end = 1 - SHADOW_ROUNDOFF * (reach / largest_component(to_light));
    return end > 0 ? end : 0;
}

static void light_slot(struct renderer *renderer, uint32_t slot)
{
    const struct shading_point *at = &renderer->points[slot];
    const struct light *lights = scene_lights(renderer->scene);
    uint32_t count = (uint32_t)renderer->scene->lights.count;
    for (uint32_t i = 0; i < count; i++) {
        struct lit lit = {.slot = slot, .light = i};
        if (!light_faces(at, &lights[i], &lit.to_light)) continue;
        if (!renderer->scene->view.shadows) {
            add_light(renderer, &lit, vec3(1, 1, 1));
            continue;
        }
        const struct hit *hit = &renderer->hits[slot];
        renderer->shadow_rays[renderer->shadow_count] =
            (struct ray){.origin = at->point,
                         .direction = lit.to_light,
                         .t_max = shadow_end(renderer, at->point, lights[i].position, lit.to_light),
                         .from = hit->primitive,
                         .from_part = hit->part};
        renderer->lit[renderer->shadow_count++] = lit;
        if (renderer->shadow_count == WAVE) flush_shadows(renderer);
    }
}

/* A number that a picture of floats can hold. */
static bool is_good(double value)
{
    return value <= (double)FLT_MAX && value >= -(double)FLT_MAX;
}

/*
 * Looks at a sample after one of its rays: the first that spoils it is told. A miss from a place
 * that is not finite is no sky.
 */
static void check_path(struct renderer *renderer, uint32_t slot)
{
    struct path *path = &renderer->paths[renderer->owner[slot]];
    const struct branch *branch = &renderer->branches[slot];
    struct vec3 sum = path->color.plain;
    bool good = is_good(sum.x) && is_good(sum.y) && is_good(sum.z);
    if ((good && vec_is_finite(branch->ray.origin)) || path->bad) return;
    path->bad = true;
    struct bad_sample bad = {.sample = path->sample,
                             .depth = branch->depth,
                             .origin = branch->ray.origin,
                             .direction = branch->ray.direction};
    tile_pixel(renderer->tile, path->pixel, &bad.x, &bad.y);
    bad.x += renderer->scene->view.region_x;
    bad.y += renderer->scene->view.region_y;
    render_counts_bad(&renderer->counts, &bad);
}

/* The hits of a wave become colour and further rays. */
static void shade_wave(struct renderer *renderer, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const struct branch *branch = &renderer->branches[i];
        struct path *path = &renderer->paths[renderer->owner[i]];
        struct vec3 color;
        if (renderer->hits[i].primitive == PRIMITIVE_NONE) {
            color = background(&renderer->scene->view, branch->ray.direction);
            if (branch->media != MEDIUM_OUTSIDE) renderer->counts.open_media++;
        } else {
            struct surface surface;
            surface_at(renderer->scene, &branch->ray, &renderer->hits[i], &surface);
            renderer->points[i] = shading_point(renderer->scene, &branch->ray, &surface);
            color = shade_ambient(renderer->points[i].material);
        }
        color_sum_add(&path->color, vec_mul(color, branch->weight));
    }
    for (uint32_t i = 0; i < count; i++) {
        if (renderer->hits[i].primitive != PRIMITIVE_NONE) light_slot(renderer, i);
    }
    flush_shadows(renderer);
    for (uint32_t i = 0; i < count; i++) {
        check_path(renderer, i);
        if (renderer->hits[i].primitive != PRIMITIVE_NONE) spawn_children(renderer, i);
    }
}

/* One ray of every unfinished sample; returns how many there are. */
static uint32_t gather_wave(struct renderer *renderer, uint32_t paths)
{
    double cutoff = renderer->scene->view.cutoff;
    uint32_t count = 0;
    for (uint32_t i = 0; i < paths; i++) {
        struct path *path = &renderer->paths[i];
        struct branch *branch = &renderer->branches[count];
        if (path->rays == renderer->ray_budget) path->too_deep += tree_drop(&path->tree);
        if (!tree_pop(&path->tree, cutoff, branch, &path->cut)) continue;
        path->rays++;
        renderer->counts.rays[branch->kind]++;
        renderer->rays[count] = branch->ray;
        renderer->owner[count++] = i;
    }
    return count;
}

/* false: interrupted */
static bool trace_paths(struct renderer *renderer, uint32_t paths)
{
    uint32_t count;
    while ((count = gather_wave(renderer, paths)) > 0) {
        if (renderer->interrupted && renderer->interrupted(renderer->context)) return false;
        double start = clock_wall();
        nearest(renderer->scene, renderer->bvh, renderer->rays, count, renderer->hits,
                &renderer->counts.exact_fallbacks);
        renderer->counts.intersect_s += clock_wall() - start;
        shade_wave(renderer, count);
    }
    return true;
}

static void start_path(struct renderer *renderer, uint32_t slot, const struct tile *tile,
                       uint64_t index)
{
    const struct view *view = &renderer->scene->view;
    uint32_t x, y;
    uint32_t pixel = (uint32_t)(index / view->samples);
    tile_pixel(tile, pixel, &x, &y);
    struct path *path = &renderer->paths[slot];
    path->color = (struct color_sum){{0, 0, 0}, {0, 0, 0}};
    path->cut = path->too_deep = 0;
    path->rays = 0;
    path->pixel = pixel;
    path->sample = (uint32_t)(index % view->samples);
    path->bad = false;
    tree_clear(&path->tree);
    struct branch primary = {
        .ray = sample_ray(view, view->region_x + x, view->region_y + y, path->sample),
        .weight = vec3(1, 1, 1),
        .bound = HUGE_VAL, /* traced whatever the cutoff */
        .media = renderer->eye_media,
        .kind = RAY_PRIMARY,
    };
    tree_push(&path->tree, &primary);
}

/* Sums of the samples of one pixel, in the order of the samples. */
struct pixel_sum {
    uint32_t pixel;
    struct color_sum color;
    double truncation;
};

static struct vec3 finished_sum(const struct renderer *renderer, const struct color_sum *sum)
{
    return renderer->scene->view.formulas == FORMULAS_PAPER ? sum->plain : color_sum_value(sum);
}

static void finish_pixel(struct renderer *renderer, const struct pixel_sum *sum, float *rgb)
{
    double samples = renderer->scene->view.samples;
    struct vec3 color = finished_sum(renderer, &sum->color);
    float *out = rgb + (size_t)sum->pixel * 3;
    out[0] = (float)(color.x / samples);
    out[1] = (float)(color.y / samples);
    out[2] = (float)(color.z / samples);
    /* An upper bound, like its parts: so many sums, and a quotient. */
    double truncation = sum->truncation / samples * (1 + (samples + 2) * UNIT_ROUNDOFF);
    renderer->counts.truncation = fmax(renderer->counts.truncation, truncation);
}

static void add_sample(const struct renderer *renderer, const struct path *path,
                       struct pixel_sum *sum)
{
    color_sum_add(&sum->color, finished_sum(renderer, &path->color));
    sum->truncation += path->cut + path->too_deep;
}

void renderer_on_wave(struct renderer *renderer, renderer_interrupted *interrupted, void *context)
{
    renderer->interrupted = interrupted;
    renderer->context = context;
}

/* Stacks kept from earlier tiles save nothing but time: many of them go. */
#define MEDIA_KEPT 65536u

bool renderer_tile(struct renderer *renderer, const struct tile *tile, float *rgb,
                   struct render_counts *counts)
{
    double start = clock_wall();
    uint32_t per_pixel = renderer->scene->view.samples;
    uint64_t samples = (uint64_t)tile_pixels(tile) * per_pixel;
    renderer->counts = (struct render_counts){0};
    renderer->tile = tile;
    if (media_count(renderer->media) > MEDIA_KEPT) begin_media(renderer);
    struct pixel_sum sum = {0};
    for (uint64_t first = 0; first < samples; first += WAVE) {
        uint32_t paths = (uint32_t)(samples - first < WAVE ? samples - first : WAVE);
        for (uint32_t i = 0; i < paths; i++)
            start_path(renderer, i, tile, first + i);
        if (!trace_paths(renderer, paths)) return false;
        for (uint32_t i = 0; i < paths; i++) {
            if ((first + i) % per_pixel == 0)
                sum = (struct pixel_sum){.pixel = renderer->paths[i].pixel};
            add_sample(renderer, &renderer->paths[i], &sum);
            if ((first + i + 1) % per_pixel == 0) finish_pixel(renderer, &sum, rgb);
        }
    }
    renderer->counts.shade_s = clock_wall() - start - renderer->counts.intersect_s;
    *counts = renderer->counts;
    return true;
}
