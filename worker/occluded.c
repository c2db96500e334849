#include "worker/naive_search.h"
#include "worker/nearest.h"
#include "worker/occlusion_walk.h"
#include "worker/packet.h"
#include "worker/several.h"
#include "worker/traverse.h"

static NOINLINE bool occlusion_in_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                                       double *limit)
{
    (void)limit;
    struct occlusion_walk *walk = context;
    uint32_t triangles = triangles_of(leaves, count);
    if (!occlusion_triangles(walk, leaves, count, triangles))
        return end_at_blocker(walk, leaves, count);
    return occlusion_solids(walk, leaves + triangles, count - triangles);
}

/* Whether an opaque surface blocks the ray; otherwise passages receives the transparent ones. */
static INLINED bool is_blocked(const struct occlusion_batch *batch, const struct ray *ray)
{
    const struct bvh *bvh = batch->bvh;
    struct blocker *blocker = batch->blocker;
    struct occlusion_walk walk;
    occlusion_begin(&walk, batch->scene, ray, batch->passages, batch->exact);
    if (!ray_is_finite(ray)) return false;
    if (!occlusion_planes(&walk)) return true;
    walk.blocker = blocker;
    if (LANES_IN_SIMD && blocker->count > 0) {
        probe_leaves(&walk.probe, blocker->bvh);
        if (occlusion_by_blocker(&walk)) return true;
        blocker->count = 0;
    }
    for (lane_set trees = trees_of_ray(bvh, ray, ray->t_max); trees && !walk.blocked;) {
        walk.bvh = take_tree(bvh, &trees);
        probe_leaves(&walk.probe, walk.bvh);
        traverse(walk.bvh, ray, ray->t_max, false, occlusion_in_leaf, &walk);
    }
    return walk.blocked;
}

/* Traces the rays of a set one by one. */
static void occluded_singly(const struct occlusion_batch *batch, const struct ray *rays,
                            lane_set set, struct vec3 *transmittance)
{
    const struct scene *scene = batch->scene;
    struct passages *passages = batch->passages;
    for (; set; set = without_lowest(set)) {
        unsigned i = lowest_lane(set);
        if (passages) passages->count = 0;
        transmittance[i] = transmittance_of(scene, passages, is_blocked(batch, &rays[i]));
    }
}

void occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
              size_t count, struct vec3 *transmittance, uint64_t *exact_fallbacks)
{
    if (scene->view.formulas == FORMULAS_PAPER) {
        naive_occluded(scene, bvh, rays, count, transmittance);
        return;
    }
    struct passages passages[LANES];
    struct blocker blocker = {NULL, 0, NULL};
    const struct occlusion_batch batch = {scene, bvh, bvh->transparent ? passages : NULL, &blocker,
                                          exact_fallbacks};
    struct packet_trust trust = {0, 0};
    for (unsigned lane = 0; lane < LANES; lane++)
        passages_begin(&passages[lane]);
    for (size_t i = 0; i < count; i += LANES) {
        size_t n = count - i < LANES ? count - i : LANES;
        lane_set open = first_lanes((uint32_t)n);
        if (LANES_IN_SIMD && n == LANES && packet_is_due(&trust))
            (void)packet_was(&trust, occluded_packet(&batch, rays + i, transmittance + i, &open));
        occluded_singly(&batch, rays + i, open, transmittance + i);
    }
    for (unsigned lane = 0; lane < LANES; lane++)
        passages_end(&passages[lane]);
}
