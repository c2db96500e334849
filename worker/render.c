#include "worker/render.h"

#include <stdlib.h>

#include "common/clock.h"
#include "common/message.h"
#include "worker/sample.h"
#include "worker/shade.h"
#include "worker/tree.h"

/* Samples that advance together: enough for large batches, few enough that their rays, hits and
 * trees (about 400 bytes each) stay in a core's second-level cache. */
#define WAVE 256

/* One sample on its way. */
struct path {
    struct tree tree;
    struct vec3 color;
    double cut;      /* what pruning has left out, at most */
    double too_deep; /* what max_depth has left out, at most; may be infinite */
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
    struct render_counts counts;
    renderer_interrupted *interrupted;
    void *context;

    struct path paths[WAVE];
    uint32_t pixel[WAVE]; /* of the tile, per path */

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
    renderer->bound[deepest] = fmax(sky, surface);
    for (uint32_t d = deepest; d-- > 0;)
        renderer->bound[d] = fmax(sky, surface + spawn * renderer->bound[d + 1]);
    /* The fixed point of the same recurrence, or no bound where surfaces lose nothing. */
    renderer->bound_infinite = INFINITY;
    if (spawn < 1) renderer->bound_infinite = fmax(sky, surface / (1 - spawn));
    if (spawn == 1 && surface == 0) renderer->bound_infinite = sky;
}

struct renderer *renderer_create(const struct scene *scene, const struct bvh *bvh)
{
    struct renderer *renderer = allocate_zeroed(1, sizeof *renderer);
    renderer->scene = scene;
    renderer->bvh = bvh;
    bound_radiance(renderer);
    return renderer;
}

void renderer_destroy(struct renderer *renderer)
{
    if (!renderer) return;
    for (uint32_t i = 0; i < WAVE; i++)
        tree_free(&renderer->paths[i].tree);
    free(renderer->bound);
    free(renderer);
}

/* Adds the next ray of the tree, unless it is too deep or carries nothing. */
static void spawn(struct renderer *renderer, struct path *path, const struct branch *parent,
                  const struct shading_point *at, struct vec3 direction, struct vec3 share,
                  enum ray_kind kind, const struct hit *hit)
{
    struct vec3 weight = vec_mul(parent->weight, share);
    double largest = vec_max(weight);
    if (!(largest > 0)) return;
    uint32_t depth = parent->depth + 1;
    if (depth > renderer->scene->view.max_depth) {
        path->too_deep += largest * renderer->bound_infinite;
        return;
    }
    struct branch child = {
        .ray = {.origin = at->point,
                .direction = direction,
                .t_max = INFINITY,
                .from = hit->primitive,
                .from_part = hit->part},
        .weight = weight,
        .bound = largest * renderer->bound[depth],
        .depth = depth,
        .kind = kind,
    };
    tree_push(&path->tree, &child);
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
        struct vec3 direction;
        if (refract(at, &direction))
            spawn(renderer, path, parent, at, direction, passed, RAY_REFRACTION, hit);
        else
            mirrored = vec_add(mirrored, passed);
    }
    if (vec_max(mirrored) > 0)
        spawn(renderer, path, parent, at, reflect(at), mirrored, RAY_REFLECTION, hit);
}

static void add_light(struct renderer *renderer, const struct lit *lit, struct vec3 through)
{
    if (vec_is_zero(through)) return;
    const struct light *light = &scene_lights(renderer->scene)[lit->light];
    struct vec3 strength = vec_mul(light->color, through);
    struct vec3 color = shade_light(&renderer->points[lit->slot], lit->to_light, strength);
    struct path *path = &renderer->paths[renderer->owner[lit->slot]];
    path->color = vec_add(path->color, vec_mul(color, renderer->branches[lit->slot].weight));
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
        renderer->shadow_rays[renderer->shadow_count] = (struct ray){.origin = at->point,
                                                                     .direction = lit.to_light,
                                                                     .t_max = 1,
                                                                     .from = hit->primitive,
                                                                     .from_part = hit->part};
        renderer->lit[renderer->shadow_count++] = lit;
        if (renderer->shadow_count == WAVE) flush_shadows(renderer);
    }
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
        } else {
            struct surface surface;
            surface_at(renderer->scene, &branch->ray, &renderer->hits[i], &surface);
            renderer->points[i] = shading_point(renderer->scene, &branch->ray, &surface);
            color = shade_ambient(renderer->points[i].material);
        }
        path->color = vec_add(path->color, vec_mul(color, branch->weight));
    }
    for (uint32_t i = 0; i < count; i++) {
        if (renderer->hits[i].primitive != PRIMITIVE_NONE) light_slot(renderer, i);
    }
    flush_shadows(renderer);
    for (uint32_t i = 0; i < count; i++) {
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
        if (!tree_pop(&path->tree, cutoff, branch, &path->cut)) continue;
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
    path->color = vec3(0, 0, 0);
    path->cut = path->too_deep = 0;
    tree_clear(&path->tree);
    struct branch primary = {
        .ray = sample_ray(view, view->region_x + x, view->region_y + y,
                          (uint32_t)(index % view->samples)),
        .weight = vec3(1, 1, 1),
        .bound = INFINITY, /* traced whatever the cutoff */
        .kind = RAY_PRIMARY,
    };
    tree_push(&path->tree, &primary);
    renderer->pixel[slot] = pixel;
}

/* Sums of the samples of one pixel, in the order of the samples. */
struct pixel_sum {
    uint32_t pixel;
    struct vec3 color;
    double truncation;
};

static void finish_pixel(struct renderer *renderer, const struct pixel_sum *sum, float *rgb)
{
    double samples = renderer->scene->view.samples;
    float *out = rgb + (size_t)sum->pixel * 3;
    out[0] = (float)(sum->color.x / samples);
    out[1] = (float)(sum->color.y / samples);
    out[2] = (float)(sum->color.z / samples);
    double truncation = sum->truncation / samples;
    renderer->counts.truncation = fmax(renderer->counts.truncation, truncation);
}

static void add_sample(struct renderer *renderer, const struct path *path, struct pixel_sum *sum)
{
    if (!vec_is_finite(path->color)) renderer->counts.nonfinite++;
    sum->color = vec_add(sum->color, path->color);
    sum->truncation += path->cut + path->too_deep;
}

void renderer_on_wave(struct renderer *renderer, renderer_interrupted *interrupted, void *context)
{
    renderer->interrupted = interrupted;
    renderer->context = context;
}

bool renderer_tile(struct renderer *renderer, const struct tile *tile, float *rgb,
                   struct render_counts *counts)
{
    double start = clock_wall();
    uint32_t per_pixel = renderer->scene->view.samples;
    uint64_t samples = (uint64_t)tile_pixels(tile) * per_pixel;
    renderer->counts = (struct render_counts){0};
    struct pixel_sum sum = {0};
    for (uint64_t first = 0; first < samples; first += WAVE) {
        uint32_t paths = (uint32_t)(samples - first < WAVE ? samples - first : WAVE);
        for (uint32_t i = 0; i < paths; i++)
            start_path(renderer, i, tile, first + i);
        if (!trace_paths(renderer, paths)) return false;
        for (uint32_t i = 0; i < paths; i++) {
            if ((first + i) % per_pixel == 0) sum = (struct pixel_sum){.pixel = renderer->pixel[i]};
            add_sample(renderer, &renderer->paths[i], &sum);
            if ((first + i + 1) % per_pixel == 0) finish_pixel(renderer, &sum, rgb);
        }
    }
    renderer->counts.shade_s = clock_wall() - start - renderer->counts.intersect_s;
    *counts = renderer->counts;
    return true;
}
