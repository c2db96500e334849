#include "worker/nearest.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "worker/primitive.h"
#include "worker/traverse.h"

/* A ray and what its tests need. */
struct probe {
    const struct scene *scene;
    const struct ray *ray;
    struct shear shear;
    uint64_t *exact;
};

static bool ray_is_finite(const struct ray *ray)
{
    return vec_is_finite(ray->origin) && vec_is_finite(ray->direction);
}

/* The ids of the planes, which are tested for every ray, are consecutive. */
static uint32_t plane_ids_end(const struct scene *scene)
{
    return primitive_id(PRIMITIVE_PLANE, (uint32_t)scene->primitives[PRIMITIVE_PLANE].count);
}

static inline struct crossings probe_crossings(const struct probe *probe, uint32_t id)
{
    return primitive_crossings(probe->scene, id, probe->ray, &probe->shear, probe->exact);
}

static inline bool crossing_counts(const struct ray *ray, double t)
{
    return t > 0 && t < ray->t_max;
}

struct nearest_walk {
    struct probe probe;
    struct hit hit;
};

static inline bool nearer(const struct hit *hit, double t, uint32_t id, uint32_t part)
{
    if (t != hit->t) return t < hit->t;
    return id < hit->primitive || (id == hit->primitive && part < hit->part);
}

static inline void nearest_primitive(struct nearest_walk *walk, uint32_t id)
{
    struct crossings found = probe_crossings(&walk->probe, id);
    for (unsigned i = 0; i < 2; i++) {
        double t = found.t[i];
        if (crossing_counts(walk->probe.ray, t) && nearer(&walk->hit, t, id, found.part[i]))
            walk->hit = (struct hit){t, found.u, found.v, id, found.part[i]};
    }
}

static inline bool nearest_leaf(void *context, const uint32_t *ids, uint32_t count, double *limit)
{
    struct nearest_walk *walk = context;
    for (uint32_t i = 0; i < count; i++)
        nearest_primitive(walk, ids[i]);
    if (walk->hit.t < *limit) *limit = walk->hit.t;
    return true;
}

static struct hit nearest_hit(const struct scene *scene, const struct bvh *bvh,
                              const struct ray *ray, uint64_t *exact)
{
    struct nearest_walk walk = {{scene, ray, shear_of(&ray->direction), exact},
                                {.t = INFINITE, .primitive = PRIMITIVE_NONE}};
    if (!ray_is_finite(ray)) return walk.hit;
    uint32_t end = plane_ids_end(scene);
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end; id++)
        nearest_primitive(&walk, id);
    traverse(bvh, ray, fmin(ray->t_max, walk.hit.t), nearest_leaf, &walk);
    return walk.hit;
}

void nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays, size_t count,
             struct hit *hits, uint64_t *exact_fallbacks)
{
    for (size_t i = 0; i < count; i++)
        hits[i] = nearest_hit(scene, bvh, &rays[i], exact_fallbacks);
}

/* How often a ray crossed surfaces of a material. */
struct passage {
    uint32_t material;
    uint64_t crossings;
};

/* Most rays pass few transparent materials; more of them move to the heap. */
#define INLINE_PASSAGES 16

/* The passages of one ray, by ascending material; reused for the rays of a batch. */
struct passages {
    size_t count, capacity;
    struct passage *at; /* fixed, or allocated when capacity is greater */
    struct passage fixed[INLINE_PASSAGES];
};

static void passages_grow(struct passages *passages)
{
    size_t capacity = 2 * passages->capacity;
    if (passages->at == passages->fixed) {
        passages->at = allocate(capacity, sizeof *passages->at);
        memcpy(passages->at, passages->fixed, sizeof passages->fixed);
    } else {
        passages->at = reallocate(passages->at, capacity, sizeof *passages->at);
    }
    passages->capacity = capacity;
}

static void passages_add(struct passages *passages, uint32_t material, uint64_t crossings)
{
    size_t i = passages->count;
    while (i > 0 && passages->at[i - 1].material > material)
        i--;
    if (i > 0 && passages->at[i - 1].material == material) {
        passages->at[i - 1].crossings += crossings;
        return;
    }
    if (passages->count == passages->capacity) passages_grow(passages);
    memmove(&passages->at[i + 1], &passages->at[i], (passages->count - i) * sizeof *passages->at);
    passages->at[i] = (struct passage){material, crossings};
    passages->count++;
}

/* One factor after the other, always in the same order: the same bits for every tree. */
static struct vec3 passages_filter(const struct passages *passages,
                                   const struct material *materials)
{
    struct vec3 light = vec3(1, 1, 1);
    for (size_t i = 0; i < passages->count; i++) {
        const struct material *material = &materials[passages->at[i].material];
        struct vec3 factor = vec_scale(material->color, material->transmission);
        for (uint64_t k = 0; k < passages->at[i].crossings; k++)
            light = vec_mul(light, factor);
    }
    return light;
}

struct occlusion_walk {
    struct probe probe;
    struct passages *passages;
    bool blocked;
};

/* Returns false, with blocked set, at an opaque crossing. */
static inline bool occlusion_primitive(struct occlusion_walk *walk, uint32_t id)
{
    const struct probe *probe = &walk->probe;
    struct crossings found = probe_crossings(probe, id);
    unsigned crossings = crossing_counts(probe->ray, found.t[0]);
    crossings += crossing_counts(probe->ray, found.t[1]);
    if (crossings == 0) return true;
    uint32_t material = primitive_material(probe->scene, id);
    walk->blocked = !(scene_materials(probe->scene)[material].transmission > 0);
    if (!walk->blocked) passages_add(walk->passages, material, crossings);
    return !walk->blocked;
}

static inline bool occlusion_leaf(void *context, const uint32_t *ids, uint32_t count, double *limit)
{
    (void)limit;
    for (uint32_t i = 0; i < count; i++)
        if (!occlusion_primitive(context, ids[i])) return false;
    return true;
}

/* The same when nothing is transparent: any crossing will do. */
static inline bool blocking_primitive(struct occlusion_walk *walk, uint32_t id)
{
    struct crossings found = probe_crossings(&walk->probe, id);
    walk->blocked = crossing_counts(walk->probe.ray, found.t[0]) ||
                    crossing_counts(walk->probe.ray, found.t[1]);
    return !walk->blocked;
}

static inline bool blocking_leaf(void *context, const uint32_t *ids, uint32_t count, double *limit)
{
    (void)limit;
    for (uint32_t i = 0; i < count; i++)
        if (!blocking_primitive(context, ids[i])) return false;
    return true;
}

/* Whether an opaque surface is in the way; passages gets the transparent ones otherwise. */
static bool is_blocked(const struct scene *scene, const struct bvh *bvh, const struct ray *ray,
                       struct passages *passages, uint64_t *exact)
{
    struct occlusion_walk walk = {{scene, ray, shear_of(&ray->direction), exact}, passages, false};
    if (!ray_is_finite(ray)) return false;
    uint32_t end = plane_ids_end(scene);
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end; id++)
        if (!occlusion_primitive(&walk, id)) return true;
    if (passages)
        traverse(bvh, ray, ray->t_max, occlusion_leaf, &walk);
    else
        traverse(bvh, ray, ray->t_max, blocking_leaf, &walk);
    return walk.blocked;
}

static bool has_transparency(const struct scene *scene)
{
    const struct material *materials = scene_materials(scene);
    for (uint64_t i = 0; i < scene->materials.count; i++)
        if (materials[i].transmission > 0) return true;
    return false;
}

void occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
              size_t count, struct vec3 *transmittance, uint64_t *exact_fallbacks)
{
    struct passages passages = {.capacity = INLINE_PASSAGES};
    struct passages *transparent = has_transparency(scene) ? &passages : NULL;
    passages.at = passages.fixed;
    for (size_t i = 0; i < count; i++) {
        passages.count = 0;
        bool blocked = is_blocked(scene, bvh, &rays[i], transparent, exact_fallbacks);
        transmittance[i] =
            blocked ? vec3(0, 0, 0) : passages_filter(&passages, scene_materials(scene));
    }
    if (passages.at != passages.fixed) free(passages.at);
}
