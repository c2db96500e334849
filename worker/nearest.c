#include "worker/nearest.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "worker/order.h"
#include "worker/primitive.h"
#include "worker/traverse.h"
#include "worker/triangle_lanes.h"

#define INLINED inline __attribute__((always_inline))

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

/* naive is a constant wherever this is inlined: the choice of formulas costs nothing per ray. */
static INLINED struct crossings probe_crossings(const struct probe *probe, uint32_t id, bool any,
                                                bool naive)
{
    if (naive) return naive_crossings(probe->scene, id, probe->ray);
    return primitive_crossings(probe->scene, id, probe->ray, &probe->shear, any, probe->exact);
}

static INLINED struct crossings probe_triangle(const struct probe *probe,
                                               const struct bvh_leaf *leaf, bool any, bool naive)
{
    if (naive) return naive_corner_crossings(probe->scene, leaf->vertex, probe->ray);
    return corner_crossings(probe->scene, leaf->id, leaf->vertex, probe->ray, &probe->shear, any,
                            probe->exact);
}

/* How many of the primitives of a leaf are triangles; they come first. */
static inline uint32_t triangles_of(const struct bvh_leaf *leaves, uint32_t count)
{
    if (is_triangle(leaves[count - 1].id)) return count;
    uint32_t triangles = 0;
    while (is_triangle(leaves[triangles].id))
        triangles++;
    return triangles;
}

/* Those of `count` triangles, 8 at most, that need a closer look. */
static INLINED lane_set candidates(const struct probe *probe, const struct bvh_leaf *leaves,
                                   uint32_t count, bool naive)
{
    if (!LANES_IN_SIMD || naive) return first_lanes(count);
    return triangles_not_missed(scene_vertices(probe->scene), leaves, count, probe->ray,
                                &probe->shear);
}

static inline bool crossing_counts(const struct ray *ray, double t)
{
    return t > 0 && t < ray->t_max;
}

struct nearest_walk {
    struct probe probe;
    double origin_error; /* of distances along the ray */
    struct hit hit;
    double hit_error; /* of its distance */
};

/* Whether a crossing that is about as far as the hit comes first; counted as exact arithmetic. */
static bool precedes(const struct nearest_walk *walk, const struct crossing *crossing)
{
    const struct probe *probe = &walk->probe;
    const struct hit *hit = &walk->hit;
    if (hit->primitive == PRIMITIVE_NONE) return true;
    ++*probe->exact;
    struct crossing best = {hit->primitive, hit->part, hit->t};
    int order = compare_crossings(probe->scene, probe->ray, &probe->shear, crossing, &best);
    return order < 0 || (order == 0 && crossing->primitive < hit->primitive);
}

static INLINED void nearest_crossing(struct nearest_walk *walk, const struct crossings *found,
                                     unsigned i, uint32_t id, bool naive)
{
    struct crossing crossing = {id, found->part[i], found->t[i]};
    double t = crossing.t, error = 0;
    if (!crossing_counts(walk->probe.ray, t)) return;
    if (id == walk->hit.primitive) return; /* a triangle of which there are several pieces */
    if (!naive) {
        error = walk->origin_error + ORDER_ERROR * t;
        if (id == walk->probe.ray->from) error += WAY_OUT_ERROR * t;
    }
    if (t > walk->hit.t + (walk->hit_error + error)) return;
    if (!(t < walk->hit.t - (walk->hit_error + error)) && !naive && !precedes(walk, &crossing))
        return;
    if (naive && t == walk->hit.t && id >= walk->hit.primitive) return;
    walk->hit = (struct hit){t, found->u, found->v, id, crossing.part};
    walk->hit_error = error;
}

static INLINED void nearest_of(struct nearest_walk *walk, const struct crossings *found,
                               uint32_t id, bool naive)
{
    /* Where it comes in, if that is ahead: at a rim it may go out at the same place. */
    unsigned first = crossing_counts(walk->probe.ray, found->t[0]) ? 0 : 1;
    nearest_crossing(walk, found, first, id, naive);
}

static INLINED void nearest_primitive(struct nearest_walk *walk, uint32_t id, bool naive)
{
    struct crossings found = probe_crossings(&walk->probe, id, false, naive);
    nearest_of(walk, &found, id, naive);
}

static INLINED void nearest_triangles(struct nearest_walk *walk, const struct bvh_leaf *leaves,
                                      uint32_t count, bool naive)
{
    for (uint32_t i = 0; i < count; i += LANES) {
        lane_set set = candidates(&walk->probe, leaves + i, count - i, naive);
        for (; set; set = without_lowest(set)) {
            const struct bvh_leaf *leaf = &leaves[i + lowest_lane(set)];
            struct crossings found = probe_triangle(&walk->probe, leaf, false, naive);
            nearest_crossing(walk, &found, 0, leaf->id, naive);
        }
    }
}

/* As far as something that comes before the hit may seem to be. */
static INLINED double farthest_nearer(const struct nearest_walk *walk)
{
    return walk->hit.t + 2 * walk->hit_error;
}

static INLINED bool nearest_in(struct nearest_walk *walk, const struct bvh_leaf *leaves,
                               uint32_t count, double *limit, bool naive)
{
    uint32_t triangles = triangles_of(leaves, count);
    nearest_triangles(walk, leaves, triangles, naive);
    for (uint32_t i = triangles; i < count; i++)
        nearest_primitive(walk, leaves[i].id, naive);
    double farthest = farthest_nearer(walk);
    if (farthest < *limit) *limit = farthest;
    return true;
}

static inline bool nearest_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                                double *limit)
{
    return nearest_in(context, leaves, count, limit, false);
}

static inline bool naive_nearest_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                                      double *limit)
{
    return nearest_in(context, leaves, count, limit, true);
}

static INLINED struct hit nearest_hit(const struct scene *scene, const struct bvh *bvh,
                                      const struct ray *ray, uint64_t *exact, bool naive)
{
    struct nearest_walk walk = {{scene, ray, shear_of(&ray->direction), exact},
                                order_error_of_origin(ray),
                                {.t = INFINITE, .primitive = PRIMITIVE_NONE},
                                0};
    if (!ray_is_finite(ray)) return walk.hit;
    uint32_t end = plane_ids_end(scene);
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end; id++)
        nearest_primitive(&walk, id, naive);
    visit_leaf *visit = naive ? naive_nearest_leaf : nearest_leaf;
    traverse(bvh, ray, fmin(ray->t_max, farthest_nearer(&walk)), true, visit, &walk);
    return walk.hit;
}

FLATTENED void nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                       size_t count, struct hit *hits, uint64_t *exact_fallbacks)
{
    if (scene->view.formulas == FORMULAS_PAPER) {
        for (size_t i = 0; i < count; i++)
            hits[i] = nearest_hit(scene, bvh, &rays[i], exact_fallbacks, true);
        return;
    }
    for (size_t i = 0; i < count; i++)
        hits[i] = nearest_hit(scene, bvh, &rays[i], exact_fallbacks, false);
}

/* How often a ray crossed the surface of a transparent primitive. */
struct passage {
    uint32_t material, primitive;
    uint32_t crossings;
};

/* Most rays pass few transparent primitives; more of them move to the heap. */
#define INLINE_PASSAGES 16

/* The passages of one ray, as they were found; reused for the rays of a batch. */
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

static void passages_add(struct passages *passages, uint32_t material, uint32_t primitive,
                         uint32_t crossings)
{
    if (passages->count == passages->capacity) passages_grow(passages);
    passages->at[passages->count++] = (struct passage){material, primitive, crossings};
}

static int by_material(const void *a, const void *b)
{
    const struct passage *p = a, *q = b;
    if (p->material != q->material) return p->material < q->material ? -1 : 1;
    return (p->primitive > q->primitive) - (p->primitive < q->primitive);
}

/*
 * One factor after the other, always in the same order: the same bits for every tree. A triangle of
 * which there are pieces in several leaves may have been found more than once.
 */
static struct vec3 passages_filter(struct passages *passages, const struct material *materials)
{
    struct vec3 light = vec3(1, 1, 1);
    if (passages->count > 1)
        qsort(passages->at, passages->count, sizeof *passages->at, by_material);
    for (size_t i = 0; i < passages->count; i++) {
        const struct passage *passage = &passages->at[i];
        if (i > 0 && passage->primitive == passage[-1].primitive) continue;
        const struct material *material = &materials[passage->material];
        struct vec3 factor = vec_scale(material->color, material->transmission);
        for (uint32_t k = 0; k < passage->crossings; k++)
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
static INLINED bool occlusion_of(struct occlusion_walk *walk, const struct crossings *found,
                                 uint32_t id)
{
    const struct probe *probe = &walk->probe;
    unsigned crossings = crossing_counts(probe->ray, found->t[0]);
    crossings += crossing_counts(probe->ray, found->t[1]);
    if (crossings == 0) return true;
    /* Nothing is transparent where there is no list: any crossing will do. */
    walk->blocked = !walk->passages;
    if (walk->blocked) return false;
    uint32_t material = primitive_material(probe->scene, id);
    walk->blocked = !(scene_materials(probe->scene)[material].transmission > 0);
    if (!walk->blocked) passages_add(walk->passages, material, id, crossings);
    return !walk->blocked;
}

static INLINED bool occlusion_primitive(struct occlusion_walk *walk, uint32_t id, bool naive)
{
    struct crossings found = probe_crossings(&walk->probe, id, true, naive);
    return occlusion_of(walk, &found, id);
}

static INLINED bool occlusion_triangles(struct occlusion_walk *walk, const struct bvh_leaf *leaves,
                                        uint32_t count, bool naive)
{
    for (uint32_t i = 0; i < count; i += LANES) {
        lane_set set = candidates(&walk->probe, leaves + i, count - i, naive);
        for (; set; set = without_lowest(set)) {
            const struct bvh_leaf *leaf = &leaves[i + lowest_lane(set)];
            struct crossings found = probe_triangle(&walk->probe, leaf, true, naive);
            if (!occlusion_of(walk, &found, leaf->id)) return false;
        }
    }
    return true;
}

static INLINED bool occlusion_in(struct occlusion_walk *walk, const struct bvh_leaf *leaves,
                                 uint32_t count, bool naive)
{
    uint32_t triangles = triangles_of(leaves, count);
    if (!occlusion_triangles(walk, leaves, triangles, naive)) return false;
    for (uint32_t i = triangles; i < count; i++)
        if (!occlusion_primitive(walk, leaves[i].id, naive)) return false;
    return true;
}

static inline bool occlusion_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                                  double *limit)
{
    (void)limit;
    return occlusion_in(context, leaves, count, false);
}

static inline bool naive_occlusion_leaf(void *context, const struct bvh_leaf *leaves,
                                        uint32_t count, double *limit)
{
    (void)limit;
    return occlusion_in(context, leaves, count, true);
}

/* Whether an opaque surface is in the way; passages gets the transparent ones otherwise. */
static INLINED bool is_blocked(const struct scene *scene, const struct bvh *bvh,
                               const struct ray *ray, struct passages *passages, uint64_t *exact,
                               bool naive)
{
    struct occlusion_walk walk = {{scene, ray, shear_of(&ray->direction), exact}, passages, false};
    if (!ray_is_finite(ray)) return false;
    uint32_t end = plane_ids_end(scene);
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end; id++)
        if (!occlusion_primitive(&walk, id, naive)) return true;
    visit_leaf *visit = naive ? naive_occlusion_leaf : occlusion_leaf;
    traverse(bvh, ray, ray->t_max, false, visit, &walk);
    return walk.blocked;
}

static bool has_transparency(const struct scene *scene)
{
    const struct material *materials = scene_materials(scene);
    for (uint64_t i = 0; i < scene->materials.count; i++)
        if (materials[i].transmission > 0) return true;
    return false;
}

FLATTENED void occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                        size_t count, struct vec3 *transmittance, uint64_t *exact_fallbacks)
{
    struct passages passages = {.capacity = INLINE_PASSAGES};
    struct passages *transparent = has_transparency(scene) ? &passages : NULL;
    passages.at = passages.fixed;
    for (size_t i = 0; i < count; i++) {
        passages.count = 0;
        bool blocked = scene->view.formulas == FORMULAS_PAPER
                           ? is_blocked(scene, bvh, &rays[i], transparent, exact_fallbacks, true)
                           : is_blocked(scene, bvh, &rays[i], transparent, exact_fallbacks, false);
        transmittance[i] =
            blocked ? vec3(0, 0, 0) : passages_filter(&passages, scene_materials(scene));
    }
    if (passages.at != passages.fixed) free(passages.at);
}
