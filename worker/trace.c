/* Processing of the rays of a wave: colour, shadow rays and secondary rays. */
#include <float.h>

#include "common/clock.h"
#include "worker/inlined.h"
#include "worker/order.h"
#include "worker/renderer.h"
#include "worker/shade.h"

/* ---- further rays ---- */

/* The pending rays of a sample; made empty at the first use. */
static struct pending_rays *pending_of(struct renderer *renderer, uint32_t p)
{
    struct pending_rays *pending = &renderer->pending[p];
    if (renderer->states[p].branched) return pending;
    renderer->states[p].branched = true;
    tree_clear(&pending->tree);
    omission_clear(&pending->omission);
    return pending;
}

/* Whether a ray has hit, right at its start, a surface in the plane of the one that it starts on. */
static INLINED bool is_met_at_start(const struct renderer *renderer, uint32_t slot)
{
    const struct ray *ray = &renderer->rays[slot];
    const struct hit *hit = &renderer->hits[slot];
    const struct crossing crossing = {hit->primitive, hit->part, hit->t};
    return is_near_start(ray, hit->t) && renderer->scene->view.formulas == FORMULAS_EXACT &&
           is_at_start(renderer->scene, ray, &crossing);
}

/*
 * Sets where a secondary ray of a point starts. back: it goes to the side from which the point was hit, where
 * there may be surfaces in its plane that have been passed; see worker/order.h.
 */
static INLINED void start_at(const struct renderer *renderer, uint32_t point, bool back,
                             struct ray *ray)
{
    uint32_t slot = renderer->points.slot[point];
    const struct ray *before = &renderer->rays[slot];
    const struct hit *hit = &renderer->hits[slot];
    ray->origin = lane(&renderer->points.point, point);
    ray->from = hit->primitive;
    ray->from_part = hit->part;
    if (!is_met_at_start(renderer, slot)) return;
    ray->from_part |= before->from_part & FROM_REVERSED;
    if (!back) return;
    ray->from_part ^= FROM_REVERSED;
    ray->origin = surface_beyond(renderer->scene, before, hit);
}

/* Adds a child ray to the tree and returns it; NULL if its weight is 0. */
static struct ray *spawn(struct renderer *renderer, uint32_t point, struct vec3 direction,
                         struct vec3 share, enum ray_kind kind, uint32_t media)
{
    uint32_t slot = renderer->points.slot[point];
    const struct branch *parent = &renderer->branches[slot];
    uint32_t p = renderer->owner[slot];
    struct vec3 weight = vec_mul(parent->weight, share);
    if (!(vec_max(weight) > 0)) return NULL;
    uint32_t depth = parent->depth + 1;
    bool beyond = renderer->states[p].bounding || depth > renderer->scene->view.max_depth;
    double bound = radiance_coarse_bound(&renderer->radiance, weight, depth, !beyond);
    struct pending_rays *pending = pending_of(renderer, p);
    struct branch *child = beyond
                               ? omission_add(&pending->omission, &renderer->radiance, bound, depth)
                               : tree_add(&pending->tree, bound, depth);
    struct ray *ray = &child->ray;
    start_at(renderer, point, kind == RAY_REFLECTION, ray);
    ray->direction = direction;
    ray->t_max = HUGE_VAL;
    child->weight = weight;
    child->coarse = true;
    child->media = media;
    child->kind = kind;
    return ray;
}

/* Whether the ray starts on the solid that it has hit. Solids are convex, so it leaves it, also where the normal says
 * otherwise by rounding, because the ray runs along the surface. */
static bool is_way_out(const struct renderer *renderer, uint32_t slot)
{
    uint32_t primitive = renderer->hits[slot].primitive;
    return primitive == renderer->rays[slot].from &&
           renderer->scene->view.formulas == FORMULAS_EXACT &&
           primitive_is_solid(renderer->scene, primitive);
}

static bool is_entering(const struct renderer *renderer, uint32_t point)
{
    return renderer->points.entering[point] != 0 &&
           !is_way_out(renderer, renderer->points.slot[point]);
}

static struct crossing_media cross_surface(struct renderer *renderer, uint32_t point)
{
    uint32_t slot = renderer->points.slot[point];
    uint32_t primitive = renderer->hits[slot].primitive;
    bool entering = is_entering(renderer, point);
    if (renderer->scene->view.formulas == FORMULAS_PAPER)
        return media_by_side(renderer->scene, primitive, entering);
    return media_cross(renderer->media, renderer->branches[slot].media, primitive, entering);
}

/* The share of light that passes the surface. */
static struct vec3 passed_share(const struct points *points, uint32_t point)
{
    const struct material *material = points->material[point];
    return vec_scale(material->color, material->transmission);
}

/*
 * Whether the ray only touches a solid, in one point: it has neither entered nor left it, though it may seem to do
 * either. A ray from outside that seems to leave a solid meets its edge, or an apex, or a tangent. Where light refracts
 * on its way in there is no need to know: it goes deep into the solid.
 */
static bool is_touch(struct renderer *renderer, uint32_t point,
                     const struct crossing_media *crossing)
{
    const struct points *points = &renderer->points;
    uint32_t slot = points->slot[point], primitive = renderer->hits[slot].primitive;
    if (!primitive_is_solid(renderer->scene, primitive)) return false;
    if (!is_entering(renderer, point))
        return crossing->unmatched &&
               (is_way_out(renderer, slot) ||
                is_entry_ahead(renderer->scene, &renderer->rays[slot], primitive,
                               &renderer->counts.exact_fallbacks));
    return (crossing->unmatched || crossing->from == crossing->to) &&
           is_grazing(vec_dot(lane(&points->view, point), lane(&points->geometric, point)));
}

/* The hit of nearest(), for a point that needs more of it than most. */
static struct hit hit_at(struct renderer *renderer, uint32_t slot)
{
    return settled_hit(renderer->scene, &renderer->rays[slot], &renderer->hits[slot],
                       &renderer->counts.exact_fallbacks);
}

/* Where several surfaces meet, points are moved away from edges by some 2^-47 of their coordinates (EDGE_OFF, and
 * CORNER_OFF), which may be many times as far along a ray. */
#define REPEATED_REACH 0x1p-42

/* Whether a crossing that cannot be is right where the ray starts: where several surfaces meet, it has crossed them all
 * there, but names only the last one. */
static bool is_repeated(struct renderer *renderer, uint32_t slot,
                        const struct crossing_media *crossing)
{
    const struct ray *ray = &renderer->rays[slot];
    if (!crossing->unmatched || ray->from == PRIMITIVE_NONE) return false;
    double way = hit_at(renderer, slot).t * vec_largest(ray->direction);
    return way <= REPEATED_REACH * vec_largest(ray->origin);
}

/* Moves a point where the ray seemed to leave something to the other side. */
static void move_outside(struct renderer *renderer, uint32_t point)
{
    uint32_t slot = renderer->points.slot[point];
    if (renderer->points.entering[point] != 0) return;
    struct hit hit = hit_at(renderer, slot);
    set_lane(&renderer->points.point, point,
             surface_beyond(renderer->scene, &renderer->rays[slot], &hit));
}

/* Where two surfaces meet, the point on each may be before the other one. They would be crossed in turn for ever, also
 * by a ray that gets away from them too slowly: therefore it moves along the normal of the surface, too, by more than
 * points are rounded. */
static void move_on(struct ray *ray, struct vec3 normal)
{
    double distance = ORDER_ERROR * vec_largest(ray->origin);
    double away = copysign(distance, vec_dot(ray->direction, normal));
    ray->origin = vec_add_scaled(ray->origin, ray->direction, distance);
    ray->origin = vec_add_scaled(ray->origin, normal, away);
}

/* A ray that has not crossed the surface goes straight on, and so does one that leaves a solid along its surface. The
 * former takes no light from the surface, as it keeps its weight: it would bring more than the bound of such a ray. */
static bool goes_straight_on(struct renderer *renderer, uint32_t point,
                             const struct crossing_media *crossing)
{
    uint32_t slot = renderer->points.slot[point];
    if (renderer->scene->view.formulas != FORMULAS_EXACT) return false;
    bool repeated = is_repeated(renderer, slot, crossing);
    bool touches = !repeated && is_touch(renderer, point, crossing);
    bool along = renderer->points.entering[point] != 0 && is_way_out(renderer, slot);
    if (!repeated && !touches && !along) return false;
    bool uncrossed = repeated || touches;
    struct vec3 share =
        uncrossed ? vec3(1, 1, 1)
                  : vec_add(passed_share(&renderer->points, point), renderer->mirrored[point]);
    uint32_t media = uncrossed ? renderer->branches[slot].media : crossing->stack;
    renderer->uncrossed[point] = uncrossed;
    if (touches) move_outside(renderer, point);
    struct ray *ray =
        spawn(renderer, point, lane(&renderer->points.view, point), share, RAY_REFRACTION, media);
    if (repeated && ray) move_on(ray, lane(&renderer->points.geometric, point));
    renderer->mirrored[point] = vec3(0, 0, 0);
    return true;
}

/* Refracted rays; with total internal reflection their share goes to the mirror ray. */
static void spawn_refracted(struct renderer *renderer)
{
    const struct points *points = &renderer->points;
    struct secondary_rays *secondary = &renderer->secondary;
    secondary->count = 0;
    for (uint32_t i = 0; i < points->count; i++) {
        if (!(points->material[i]->transmission > 0)) continue;
        struct crossing_media crossing = cross_surface(renderer, i);
        if (goes_straight_on(renderer, i, &crossing)) continue;
        if (crossing.unmatched && !is_bounding(renderer, points->slot[i]))
            renderer->counts.unmatched_media++;
        uint32_t k = secondary->count++;
        secondary->point[k] = i;
        secondary->from[k] = crossing.from;
        secondary->to[k] = crossing.to;
        renderer->behind[k] = crossing.stack;
    }
    points_refract(points, secondary);
    for (uint32_t k = 0; k < secondary->count; k++) {
        uint32_t i = secondary->point[k];
        struct vec3 passed = passed_share(points, i);
        if (secondary->passes[k] != 0)
            spawn(renderer, i, lane(&secondary->direction, k), passed, RAY_REFRACTION,
                  renderer->behind[k]);
        else
            renderer->mirrored[i] = vec_add(renderer->mirrored[i], passed);
    }
}

static void spawn_mirrored(struct renderer *renderer)
{
    struct secondary_rays *secondary = &renderer->secondary;
    secondary->count = 0;
    for (uint32_t i = 0; i < renderer->points.count; i++)
        if (vec_max(renderer->mirrored[i]) > 0) secondary->point[secondary->count++] = i;
    points_reflect(&renderer->points, secondary);
    for (uint32_t k = 0; k < secondary->count; k++) {
        uint32_t i = secondary->point[k];
        spawn(renderer, i, lane(&secondary->direction, k), renderer->mirrored[i], RAY_REFLECTION,
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
        renderer->uncrossed[i] = false;
        reflects |= kr > 0;
        refracts |= points->material[i]->transmission > 0;
    }
    if (refracts) spawn_refracted(renderer);
    if (refracts || reflects) spawn_mirrored(renderer);
}

/* ---- light ---- */

static INLINED void add_color(struct renderer *renderer, uint32_t slot, struct vec3 color,
                              bool primary_only)
{
    uint32_t p = primary_only ? slot : renderer->owner[slot];
    if (!primary_only) color = vec_mul(color, renderer->branches[slot].weight);
    color_sum_add(&renderer->states[p].color, color);
}

/* The counterpart of add_color() for rays that only serve the bound. */
static void add_found(struct renderer *renderer)
{
    const struct points *points = &renderer->points;
    for (uint32_t i = 0; i < points->count; i++) {
        uint32_t slot = points->slot[i];
        if (!is_bounding(renderer, slot) || renderer->uncrossed[i]) continue;
        struct shading_point at = points_get(points, i);
        omission_found_point(&renderer->pending[renderer->owner[slot]].omission,
                             &renderer->radiance, renderer->branches[slot].weight, &at);
    }
}

/* Gathers the points that are lit, with what the shadow ray lets through. */
static void gather_reached(struct renderer *renderer)
{
    const struct light *lights = scene_lights(renderer->scene);
    bool shadows = renderer->scene->view.shadows;
    struct lit *lit = &renderer->lit;
    lit->count = 0;
    for (uint32_t i = 0; i < renderer->shadow_count; i++) {
        struct vec3 through = shadows ? renderer->transmittance[i] : vec3(1, 1, 1);
        if (vec_is_zero(through)) continue;
        lit->point[lit->count] = renderer->shadow_tests[i].point;
        set_lane(&lit->to_light, lit->count, renderer->shadow_rays[i].direction);
        set_lane(&lit->strength, lit->count,
                 vec_mul(lights[renderer->shadow_tests[i].light].color, through));
        lit->count++;
    }
}

/* Traces the gathered shadow rays as one batch and adds the light that they let through. */
static INLINED void flush_lit(struct renderer *renderer, bool primary_only)
{
    struct lit *lit = &renderer->lit;
    uint32_t count = renderer->shadow_count;
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
        add_color(renderer, renderer->points.slot[lit->point[i]], lane(&lit->color, i),
                  primary_only);
    renderer->shadow_count = 0;
}

static INLINED void add_shadow_test(struct renderer *renderer, uint32_t point, uint32_t light,
                                    uint32_t counts, bool primary_only)
{
    uint32_t slot = renderer->points.slot[point], i = renderer->shadow_count++;
    renderer->states[primary_only ? slot : renderer->owner[slot]].cost_rays += counts;
    renderer->shadow_tests[i] = (struct shadow_test){point, light};
    /* Field by field: a whole ray would be copied from memory that has just been written. */
    struct ray *ray = &renderer->shadow_rays[i];
    if (primary_only) {
        ray->origin = lane(&renderer->points.point, point);
        ray->from = renderer->hits[slot].primitive;
        ray->from_part = renderer->hits[slot].part;
    } else {
        start_at(renderer, point, true, ray);
    }
    ray->direction = lane(&renderer->faced.to_light, point);
    ray->t_max = renderer->faced.end[point];
}

/* Whether the sample takes the light of a point. */
static INLINED bool is_seen(const struct renderer *renderer, uint32_t point, bool primary_only)
{
    return primary_only ||
           (!renderer->uncrossed[point] && !is_bounding(renderer, renderer->points.slot[point]));
}

/* Whether lights contribute to the colour at a point. */
static INLINED bool is_shown(const struct renderer *renderer, uint32_t point, bool primary_only)
{
    return material_shows_light(renderer->points.material[point]) &&
           is_seen(renderer, point, primary_only);
}

/*
 * Lights the points, light by light, so that the shadow rays of a batch are coherent. A surface whose colour
 * does not depend on lights needs none.
 */
static INLINED void light_points(struct renderer *renderer, bool primary_only)
{
    const struct light *lights = scene_lights(renderer->scene);
    const struct points *points = &renderer->points;
    if (points->count == 0 || renderer->scene->lights.count == 0) return;
    for (uint32_t k = 0; k < renderer->scene->lights.count; k++) {
        if (renderer->shadow_count + points->count > WAVE) flush_lit(renderer, primary_only);
        /* A pixel's cost determines its samples, so rays to lights that could be left out are not counted. */
        uint32_t counts = !vec_is_zero(lights[k].color);
        points_face(points, &lights[k], &renderer->faced);
        for (uint32_t i = 0; i < points->count; i++)
            if (renderer->faced.faces[i] != 0 && is_shown(renderer, i, primary_only))
                add_shadow_test(renderer, i, k, counts, primary_only);
    }
    flush_lit(renderer, primary_only);
}

/* ---- the wave ---- */

/* Whether a picture of floats can represent the colour. */
static INLINED bool is_good(struct vec3 sum)
{
    const double most = (double)FLT_MAX;
    return (fabs(sum.x) <= most) & (fabs(sum.y) <= most) & (fabs(sum.z) <= most);
}

/* Records the first ray that makes its sample bad. A miss from an origin that is not finite is not taken for
 * background. */
static void record_bad(struct renderer *renderer, struct sample_state *state, const struct ray *ray,
                       uint32_t depth)
{
    state->bad = true;
    struct bad_sample bad = {.sample = state->sample,
                             .depth = depth,
                             .origin = ray->origin,
                             .direction = ray->direction};
    tile_pixel(renderer->progress.task.tile, state->pixel, &bad.x, &bad.y);
    bad.x += renderer->scene->view.region_x;
    bad.y += renderer->scene->view.region_y;
    render_counts_bad(&renderer->counts, &bad);
}

/* Checks every sample after one of its rays. Rays from the eye have a finite origin. */
static INLINED void check_samples(struct renderer *renderer, bool primary_only)
{
    for (uint32_t i = 0; i < renderer->count; i++) {
        struct sample_state *state = &renderer->states[primary_only ? i : renderer->owner[i]];
        const struct ray *ray = &renderer->rays[i];
        if (!primary_only && state->bounding) continue;
        if (is_good(state->color.plain) && (primary_only || vec_is_finite(ray->origin))) continue;
        if (!state->bad)
            record_bad(renderer, state, ray, primary_only ? 0 : renderer->branches[i].depth);
    }
}

static INLINED void add_background(struct renderer *renderer, uint32_t slot, bool primary_only)
{
    struct vec3 color = background(&renderer->scene->view, renderer->rays[slot].direction);
    if (!primary_only && is_bounding(renderer, slot)) {
        omission_found(&renderer->pending[renderer->owner[slot]].omission,
                       renderer->branches[slot].weight, color);
        return;
    }
    if (!primary_only && renderer->branches[slot].media != MEDIUM_OUTSIDE)
        renderer->counts.open_media++;
    add_color(renderer, slot, color, primary_only);
}

/* Adds what does not depend on lights: background and ambient. */
static INLINED void add_unlit(struct renderer *renderer, bool primary_only)
{
    const struct points *points = &renderer->points;
    for (uint32_t i = 0; i < renderer->count; i++)
        if (renderer->hits[i].primitive == PRIMITIVE_NONE)
            add_background(renderer, i, primary_only);
    for (uint32_t i = 0; i < points->count; i++)
        if (points->material[i]->ambient > 0 && is_seen(renderer, i, primary_only))
            add_color(renderer, points->slot[i], shade_ambient(points->material[i]), primary_only);
}

static INLINED void trace_rays(struct renderer *renderer, bool primary_only)
{
    double start = clock_wall();
    nearest_rough(renderer->scene, renderer->bvh, renderer->rays, renderer->count, renderer->hits,
                  &renderer->counts.exact_fallbacks);
    renderer->counts.intersect_s += clock_wall() - start;
    points_find(renderer->scene, renderer->bvh, renderer->rays, renderer->hits, renderer->count,
                &renderer->points, &renderer->counts.exact_fallbacks);
    if (renderer->fresh) renderer->counts.primary_hits += renderer->points.count;
    if (!primary_only) spawn_children(renderer); /* finds what is passed by, too */
    add_unlit(renderer, primary_only);
    light_points(renderer, primary_only);
    if (!primary_only && renderer->bounding > 0) add_found(renderer);
    check_samples(renderer, primary_only);
}

void trace_wave(struct renderer *renderer)
{
    trace_rays(renderer, false);
}

void trace_primary_wave(struct renderer *renderer)
{
    trace_rays(renderer, true);
}
