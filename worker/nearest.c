#include "worker/nearest.h"

#include <stdbool.h>

#include "worker/naive_search.h"
#include "worker/nearest_walk.h"
#include "worker/packet.h"
#include "worker/several.h"
#include "worker/traverse.h"

/* Tests the triangles of a leaf with `count` entries. */
static INLINED void nearest_triangles(struct nearest_walk *walk, const struct bvh_leaf *leaves,
                                      uint32_t count, uint32_t triangles)
{
    for (uint32_t i = 0; i < triangles; i += LANES) {
        lane_set set = probe_triangles(&walk->probe, leaves, count, triangles, i, NULL).maybe;
        for (; set; set = without_lowest(set)) {
            const struct bvh_leaf *leaf = &leaves[i + lowest_lane(set)];
            if (is_behind_hit(walk, leaf->id)) continue;
            struct crossings found = probe_triangle(&walk->probe, leaf);
            nearest_crossing(walk, &found, 0, leaf->id);
        }
    }
}

static NOINLINE bool nearest_in_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                                     double *limit)
{
    struct nearest_walk *walk = context;
    uint32_t triangles = triangles_of(leaves, count);
    nearest_triangles(walk, leaves, count, triangles);
    nearest_solids(walk, leaves + triangles, count - triangles);
    *limit = walk->probe.purpose.farthest;
    return true;
}

static INLINED struct hit nearest_hit(const struct nearest_batch *batch, const struct ray *ray)
{
    const struct bvh *bvh = batch->bvh;
    struct nearest_walk walk;
    nearest_begin(&walk, batch->scene, ray, batch->planes, batch->exact);
    if (!ray_is_finite(ray)) return walk.hit;
    nearest_planes(&walk);
    for (lane_set trees = trees_of_ray(bvh, ray, walk.probe.purpose.farthest); trees;) {
        const struct bvh *tree = take_tree(bvh, &trees);
        probe_leaves(&walk.probe, tree);
        traverse(tree, ray, walk.probe.purpose.farthest, true, nearest_in_leaf, &walk);
    }
    if (!nearest_is_decided(&walk)) nearest_waiting(&walk);
    return walk.hit;
}

struct hit settled_hit(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                       uint64_t *exact_fallbacks)
{
    if (!is_rough_hit(hit)) return *hit;
    struct nearest_walk walk;
    nearest_begin(&walk, scene, ray, NULL, exact_fallbacks);
    nearest_primitive(&walk, hit->primitive);
    return walk.hit;
}

bool is_entry_ahead(const struct scene *scene, const struct ray *ray, uint32_t primitive,
                    uint64_t *exact_fallbacks)
{
    const struct shear shear = shear_of(&ray->direction);
    const struct purpose purpose = {false, ray->t_max};
    struct crossings found =
        primitive_crossings(scene, primitive, ray, &shear, &purpose, exact_fallbacks);
    return crossing_counts(ray, found.t[0]);
}

static void nearest_singly(const struct nearest_batch *batch, const struct ray *rays, size_t begin,
                           size_t end, struct hit *hits)
{
    for (size_t i = begin; i < end; i++)
        hits[i] = nearest_hit(batch, &rays[i]);
}

static void nearest_in_bundles(const struct nearest_batch *batch, const struct ray *rays,
                               size_t count, struct hit *hits)
{
    struct packet_trust bundles = {0, 0}, packets = {0, 0};
    for (size_t i = 0; i < count;) {
        size_t left = (count - i) / LANES, many = left < BUNDLE ? left : BUNDLE;
        size_t end = left == 0 ? count : i + LANES;
        if (left > 1 && packet_is_due(&bundles) &&
            packet_was(&bundles, nearest_bundle(batch, rays + i, (unsigned)many, hits + i)))
            end = i + many * LANES;
        else if (!(left > 0 && packet_is_due(&packets) &&
                   packet_was(&packets, nearest_bundle(batch, rays + i, 1, hits + i))))
            nearest_singly(batch, rays, i, end, hits);
        i = end;
    }
}

void nearest_rough(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                   size_t count, struct hit *hits, uint64_t *exact_fallbacks)
{
    if (scene->view.formulas == FORMULAS_PAPER) {
        naive_nearest(scene, bvh, rays, count, hits);
        return;
    }
    struct known_planes planes;
    planes.any = false;
    const struct nearest_batch batch = {scene, bvh, &planes, exact_fallbacks};
    if (LANES_IN_SIMD)
        nearest_in_bundles(&batch, rays, count, hits);
    else
        nearest_singly(&batch, rays, 0, count, hits);
}

void nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays, size_t count,
             struct hit *hits, uint64_t *exact_fallbacks)
{
    nearest_rough(scene, bvh, rays, count, hits, exact_fallbacks);
    for (size_t i = 0; i < count; i++)
        hits[i] = settled_hit(scene, &rays[i], &hits[i], exact_fallbacks);
}
