#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "worker/nearest.h"
#include "worker/probe.h"

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
    struct reach reach;
    struct passages *passages;
    bool blocked;
};

/* Returns false, with blocked set, at an opaque surface. */
static INLINED bool occlusion_by(struct occlusion_walk *walk, uint32_t id, unsigned crossings)
{
    /* Nothing is transparent where there is no list: any crossing will do. */
    walk->blocked = !walk->passages;
    if (walk->blocked) return false;
    const struct scene *scene = walk->probe.scene;
    uint32_t material = primitive_material(scene, id);
    walk->blocked = !(scene_materials(scene)[material].transmission > 0);
    if (!walk->blocked) passages_add(walk->passages, material, id, crossings);
    return !walk->blocked;
}

static INLINED bool occlusion_of(struct occlusion_walk *walk, const struct crossings *found,
                                 uint32_t id)
{
    unsigned crossings = crossing_counts(walk->probe.ray, found->t[0]);
    crossings += crossing_counts(walk->probe.ray, found->t[1]);
    return crossings == 0 || occlusion_by(walk, id, crossings);
}

static INLINED bool occlusion_primitive(struct occlusion_walk *walk, uint32_t id, bool naive)
{
    struct crossings found = probe_crossings(&walk->probe, id, naive);
    return occlusion_of(walk, &found, id);
}

static INLINED bool occlusion_triangle(struct occlusion_walk *walk, const struct bvh_leaf *leaf,
                                       bool certain, bool naive)
{
    if (certain) return leaf->id == walk->probe.ray->from || occlusion_by(walk, leaf->id, 1);
    struct crossings found = probe_triangle(&walk->probe, leaf, naive);
    return occlusion_of(walk, &found, leaf->id);
}

static INLINED bool occlusion_triangles(struct occlusion_walk *walk, const struct bvh_leaf *leaves,
                                        uint32_t count, bool naive)
{
    for (uint32_t i = 0; i < count; i += LANES) {
        struct triangle_sets sets =
            probe_triangles(&walk->probe, leaves + i, count - i, &walk->reach, naive);
        for (lane_set set = sets.maybe; set; set = without_lowest(set)) {
            unsigned lane = lowest_lane(set);
            if (!occlusion_triangle(walk, &leaves[i + lane], sets.certain >> lane & 1, naive))
                return false;
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

static INLINED bool occlusion_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                                   double *limit)
{
    (void)limit;
    return occlusion_in(context, leaves, count, false);
}

static INLINED bool naive_occlusion_leaf(void *context, const struct bvh_leaf *leaves,
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
    struct occlusion_walk walk = {.probe = probe_of(scene, ray, true, exact), .passages = passages};
    walk.reach = reach_of(ray, &walk.probe.shear);
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

void occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
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
