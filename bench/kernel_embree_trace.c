/* Whitted ray tracing with rtcIntersect1 and rtcOccluded1, pruned as in worker/render.c. */
#include <float.h>
#include <stdlib.h>

#include "bench/kernel_embree.h"
#include "common/message.h"

/*
 * A ray that leaves a surface starts at a distance of this times the largest coordinate of its origin, or times
 * the distance that led there: some hundred roundings. Single precision has no better way to keep a surface from
 * hitting itself.
 */
#define SELF_DISTANCE (128 * FLT_EPSILON)

/* Pending rays of a pixel: as in worker/tree.h, deepest first when there are many. */
#define BEST_FIRST_MAX 256
#define PENDING_MAX    1024

struct pending {
    struct f3 origin, direction, weight;
    float near, bound;
    uint32_t depth, kind;
};

struct tracer {
    const struct model *model;
    float *bound; /* [depth]: largest component that a ray of this depth can bring */
    uint32_t max_depth;
    float cutoff;
    uint64_t *rays;
    unsigned count;
    struct pending pending[PENDING_MAX];
};

/* The point that a ray hit, and its surface. */
struct place {
    struct f3 point, view, geometric, normal; /* normals on the side of the ray */
    const struct surface_material *material;
    float near; /* tnear of rays that start here */
    bool entering;
};

struct f3 sky_color(const struct view *view, struct f3 direction)
{
    float up = 0.5f * (1 + f3_dot(direction, f3_of(view->background_up)));
    struct f3 bottom = f3_scale(f3_of(view->background_bottom), 1 - up);
    return f3_add_scaled(bottom, f3_of(view->background_top), up);
}

/* ---- what a ray can bring at most: see worker/radiance.h ---- */

static double brightest_surface(const struct scene *scene)
{
    struct vec3 light = {0, 0, 0};
    double largest = 0;
    for (uint64_t i = 0; i < scene->lights.count; i++)
        light = vec_add(light, scene_lights(scene)[i].color);
    for (uint64_t i = 0; i < scene->materials.count; i++) {
        const struct material *m = &scene_materials(scene)[i];
        struct vec3 color = vec_mul(light, vec_scale(m->color, m->diffuse));
        color = vec_add(color, vec_scale(light, m->specular));
        largest = fmax(largest, vec_max(vec_add(color, vec_scale(m->color, m->ambient))));
    }
    return largest;
}

static float *bounds_by_depth(const struct scene *scene)
{
    const struct view *view = &scene->view;
    double sky = fmax(vec_max(view->background_bottom), vec_max(view->background_top));
    double surface = brightest_surface(scene), spawn = 0;
    for (uint64_t i = 0; i < scene->materials.count; i++) {
        const struct material *m = &scene_materials(scene)[i];
        spawn = fmax(spawn, m->reflection + m->transmission * vec_max(m->color));
    }
    float *bound = allocate((size_t)view->max_depth + 1, sizeof *bound);
    double deeper = fmax(sky, surface);
    for (uint32_t d = view->max_depth + 1; d-- > 0;) {
        bound[d] = (float)deeper;
        deeper = fmax(sky, surface + spawn * deeper);
    }
    return bound;
}

/* ---- the pending rays ---- */

static void add_pending(struct tracer *tracer, const struct pending *parent, const struct place *at,
                        struct f3 direction, struct f3 share, uint32_t kind)
{
    struct f3 weight = f3_mul(parent->weight, share);
    float largest = f3_max(weight);
    uint32_t depth = parent->depth + 1;
    if (!(largest > 0) || depth > tracer->max_depth || tracer->count == PENDING_MAX) return;
    tracer->pending[tracer->count++] = (struct pending){
        at->point, direction, weight, at->near, largest * tracer->bound[depth], depth, kind};
}

/* false when all that is left may be dropped */
static bool next_pending(struct tracer *tracer, struct pending *next)
{
    unsigned best = 0, count = tracer->count;
    float sum = 0;
    if (count == 0) return false;
    bool deepest = count > BEST_FIRST_MAX;
    for (unsigned i = 0; i < count; i++) {
        const struct pending *a = &tracer->pending[i], *b = &tracer->pending[best];
        sum += a->bound;
        bool deeper = deepest && a->depth != b->depth;
        if (deeper ? a->depth > b->depth : a->bound > b->bound) best = i;
    }
    if (sum <= tracer->cutoff) return false;
    *next = tracer->pending[best];
    tracer->pending[best] = tracer->pending[--tracer->count];
    return true;
}

/* ---- surfaces ---- */

static struct f3 patch_normal(const struct model *model, const struct part *part,
                              const struct RTCHit *hit, struct f3 geometric)
{
    const uint32_t *corner = &part->normal[3 * hit->primID];
    struct f3 sum = f3_scale(model->normals[corner[0]], 1 - hit->u - hit->v);
    sum = f3_add_scaled(sum, model->normals[corner[1]], hit->u);
    sum = f3_add_scaled(sum, model->normals[corner[2]], hit->v);
    return f3_dot(sum, sum) > 0 ? f3_normalize(sum) : geometric;
}

static struct place place_of(const struct model *model, const struct pending *ray,
                             const struct RTCRayHit *found)
{
    const struct RTCHit *hit = &found->hit;
    const struct part *part = &model->parts[hit->geomID];
    struct place at = {.view = ray->direction,
                       .material = &model->materials[part->material[hit->primID]]};
    at.point = f3_add_scaled(ray->origin, ray->direction, found->ray.tfar);
    if (part->kind == PRIMITIVE_SPHERE) {
        const float *sphere = &part->spheres[4 * hit->primID];
        at.geometric = f3_sub(at.point, f3(sphere[0], sphere[1], sphere[2]));
    } else {
        at.geometric = f3(hit->Ng_x, hit->Ng_y, hit->Ng_z);
    }
    at.geometric = f3_normalize(at.geometric);
    at.normal = at.geometric;
    if (part->kind == PRIMITIVE_PATCH) at.normal = patch_normal(model, part, hit, at.geometric);
    at.entering = f3_dot(at.view, at.geometric) <= 0;
    if (!at.entering) at.geometric = f3_scale(at.geometric, -1);
    if (f3_dot(at.normal, at.geometric) < 0) at.normal = f3_scale(at.normal, -1);
    struct f3 size = f3(fabsf(at.point.x), fabsf(at.point.y), fabsf(at.point.z));
    at.near = SELF_DISTANCE * fmaxf(f3_max(size), found->ray.tfar);
    return at;
}

/* ---- light ---- */

/* What the shadow ray lets through. */
static struct f3 light_through(const struct model *model, const struct place *at,
                               struct f3 direction, float distance)
{
    struct shadow_query query;
    struct RTCRay ray = {
        .org_x = at->point.x,
        .org_y = at->point.y,
        .org_z = at->point.z,
        .tnear = at->near,
        .dir_x = direction.x,
        .dir_y = direction.y,
        .dir_z = direction.z,
        .tfar = distance,
        .mask = UINT32_MAX,
    };
    context_init(&query.context);
    query.through = f3(1, 1, 1);
    query.seen = 0;
    trace_any(model, &query.context, &ray);
    return ray.tfar < 0 ? f3(0, 0, 0) : query.through;
}

static void add_lights(struct tracer *tracer, const struct place *at, struct f3 *color)
{
    const struct model *model = tracer->model;
    const struct surface_material *material = at->material;
    struct f3 mirrored = f3_add_scaled(at->view, at->normal, -2 * f3_dot(at->view, at->normal));
    for (unsigned i = 0; i < model->light_count; i++) {
        struct f3 to_light = f3_sub(model->lights[i].position, at->point);
        if (!(f3_dot(to_light, at->geometric) > 0)) continue;
        float cos_a = f3_dot(to_light, at->normal);
        if (!(cos_a > 0)) continue;
        float distance = sqrtf(f3_dot(to_light, to_light)), inverse = 1 / distance;
        struct f3 direction = f3_scale(to_light, inverse), through = f3(1, 1, 1);
        if (model->scene->view.shadows) {
            tracer->rays[KIND_SHADOW]++;
            through = light_through(model, at, direction, distance);
            if (!(f3_max(through) > 0)) continue;
        }
        struct f3 strength = f3_mul(model->lights[i].color, through);
        *color = f3_add_scaled(*color, f3_mul(strength, material->diffuse), cos_a * inverse);
        float cos_b = f3_dot(mirrored, direction);
        if (material->specular > 0 && cos_b > 0)
            *color = f3_add_scaled(*color, strength,
                                   material->specular * powf(cos_b, material->shininess));
    }
}

/* false: total reflection */
static bool refract_at(const struct place *at, struct f3 normal, struct f3 *direction)
{
    float ior = at->material->ior, eta = at->entering ? 1 / ior : ior;
    float cos_i = -f3_dot(at->view, normal);
    float k = 1 - eta * eta * (1 - cos_i * cos_i);
    if (k < 0) return false;
    *direction = f3_add_scaled(f3_scale(at->view, eta), normal, eta * cos_i - sqrtf(k));
    *direction = f3_normalize(*direction);
    return true;
}

static bool refracted(const struct place *at, struct f3 *direction)
{
    if (at->material->ior == 1) {
        *direction = at->view;
        return true;
    }
    if (f3_dot(at->view, at->normal) < 0) {
        if (!refract_at(at, at->normal, direction)) return false;
        if (f3_dot(*direction, at->geometric) < 0) return true;
    }
    return refract_at(at, at->geometric, direction);
}

static struct f3 reflected(const struct place *at)
{
    struct f3 out = f3_add_scaled(at->view, at->normal, -2 * f3_dot(at->view, at->normal));
    if (!(f3_dot(out, at->geometric) > 0))
        out = f3_add_scaled(at->view, at->geometric, -2 * f3_dot(at->view, at->geometric));
    return f3_normalize(out);
}

static void add_children(struct tracer *tracer, const struct pending *parent,
                         const struct place *at)
{
    const struct surface_material *material = at->material;
    float kr = material->reflection;
    struct f3 mirrored = f3(kr, kr, kr), direction;
    if (material->transparent) {
        if (refracted(at, &direction))
            add_pending(tracer, parent, at, direction, material->transmitted, KIND_REFRACTION);
        else
            mirrored = f3_add(mirrored, material->transmitted);
    }
    if (f3_max(mirrored) > 0)
        add_pending(tracer, parent, at, reflected(at), mirrored, KIND_REFLECTION);
}

/* ---- the picture ---- */

static struct f3 trace_pixel(struct tracer *tracer, struct f3 eye, struct f3 direction)
{
    const struct model *model = tracer->model;
    struct f3 sum = f3(0, 0, 0);
    struct pending ray;
    tracer->count = 1;
    tracer->pending[0] = (struct pending){eye, direction, {1, 1, 1}, 0, INFINITY, 0, KIND_PRIMARY};
    while (next_pending(tracer, &ray)) {
        struct RTCRayHit found = {
            .ray = {.org_x = ray.origin.x,
                    .org_y = ray.origin.y,
                    .org_z = ray.origin.z,
                    .tnear = ray.near,
                    .dir_x = ray.direction.x,
                    .dir_y = ray.direction.y,
                    .dir_z = ray.direction.z,
                    .tfar = INFINITY,
                    .mask = UINT32_MAX},
            .hit = {.geomID = RTC_INVALID_GEOMETRY_ID},
        };
        tracer->rays[ray.kind]++;
        trace_nearest(model, &found);
        if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
            sum = f3_add(sum, f3_mul(ray.weight, sky_color(&model->scene->view, ray.direction)));
            continue;
        }
        struct place at = place_of(model, &ray, &found);
        struct f3 color = at.material->ambient;
        add_lights(tracer, &at, &color);
        sum = f3_add(sum, f3_mul(ray.weight, color));
        add_children(tracer, &ray, &at);
    }
    return sum;
}

/* Pixels that are near each other meet the same nodes: the picture is gone through in squares. */
#define SQUARE 16

static void trace_square(struct tracer *tracer, uint32_t x0, uint32_t y0, float *rgb)
{
    const struct view *view = &tracer->model->scene->view;
    struct f3 eye = f3_of(view->camera.eye);
    for (uint32_t y = y0; y < y0 + SQUARE && y < view->height; y++)
        for (uint32_t x = x0; x < x0 + SQUARE && x < view->width; x++) {
            struct f3 direction = primary_direction(view, (float)x + 0.5f, (float)y + 0.5f);
            struct f3 color = trace_pixel(tracer, eye, direction);
            float *out = &rgb[3 * ((size_t)y * view->width + x)];
            out[0] = color.x;
            out[1] = color.y;
            out[2] = color.z;
        }
}

void trace_picture(const struct model *model, float *rgb, uint64_t rays[KIND_COUNT])
{
    const struct view *view = &model->scene->view;
    struct tracer *tracer = allocate(1, sizeof *tracer);
    tracer->model = model;
    tracer->bound = bounds_by_depth(model->scene);
    tracer->max_depth = view->max_depth;
    tracer->cutoff = (float)view->cutoff;
    tracer->rays = rays;
    for (uint32_t y = 0; y < view->height; y += SQUARE)
        for (uint32_t x = 0; x < view->width; x += SQUARE)
            trace_square(tracer, x, y, rgb);
    free(tracer->bound);
    free(tracer);
}
