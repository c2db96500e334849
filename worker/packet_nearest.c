#include "worker/packet.h"

#include "worker/lanes.h"

/*
 * Without SIMD packets are not used (worker/nearest.c, occluded.c), and compiling eight times the scalar code
 * would take half a minute.
 */
#if LANES_IN_SIMD

#include "worker/packet_candidates.h"
#include "worker/packet_walk.h"
#include "worker/pinhole.h"

/*
 * If fewer packets than this meet a leaf, computations for the whole bundle do not pay: with one, primary
 * rays of large meshes (bench-kernel's million, lantern) took longer.
 */
#define TOGETHER_MIN 2

/* A bundle in search of its nearest hits. */
struct nearest_bundle {
    struct bundle bundle;
    const struct bvh_leaf *leaves; /* leaves of the tree that is traversed */
    bool given_up, prepared, among_leaves;
    struct pinhole eye;
    struct nearest_packet packets[BUNDLE];
};

/* Prepares all packets for their first tests. */
static void bundle_prepare(struct nearest_bundle *it)
{
    it->prepared = true;
    for (unsigned i = 0; i < it->bundle.count; i++)
        nearest_prepare(&it->packets[i], &it->bundle);
}

/* Called before the first leaf of a tree. */
static void bundle_enter_leaves(struct nearest_bundle *it)
{
    const struct bundle *bundle = &it->bundle;
    if (!it->prepared) bundle_prepare(it);
    it->among_leaves = true;
    for (unsigned i = 0; i < bundle->count; i++)
        packet_enters(&it->packets[i].packet, bundle);
    if (!bundle->one_origin) return;
    it->eye = pinhole_of(bundle);
    for (unsigned i = 0; i < bundle->count; i++)
        it->packets[i].through = pinhole_rays_of(&it->eye, &it->packets[i].packet);
}

static INLINED void solids_in_leaf(struct nearest_packet *it, const struct bvh_leaf *leaves,
                                   uint32_t count, lane_set rays)
{
    for (uint32_t i = 0; i < count; i++) {
        if (has_spans(leaves[i].id))
            solid_candidates(it, &leaves[i], rays);
        else
            test_each(it, leaves[i].id, rays);
    }
}

static INLINED double farthest_limit(const struct nearest_bundle *it)
{
    struct lanes farthest = lanes_load(it->packets[0].limit);
    for (unsigned i = 1; i < it->bundle.count; i++)
        farthest = lanes_larger(lanes_load(it->packets[i].limit), farthest);
    return lanes_highest(farthest);
}

/* Tests rays with some of LANES triangles, which begin at `leaves`. */
static INLINED void look_at_triangles(struct nearest_packet *it, const struct bvh_leaf *leaves,
                                      const struct pinhole_leaf *leaf,
                                      const struct pinhole_triangles *seen, lane_set set,
                                      lane_set rays)
{
    struct pinhole_rays through = rays_at_leaf(&it->through, leaf);
    for (set &= in_window(seen, &through.window); set; set = without_lowest(set)) {
        lane_set open;
        unsigned i = lowest_lane(set);
        struct rough_crossings found =
            pinhole_crossings(&it->packet, leaf, seen, i, &through, rays, &open);
        if (found.maybe) triangle_candidates(it, &leaves[i], &found);
        if (!open) continue;
        found = crossings_in_double(&it->packet, it->scene, leaves[i].id, open);
        if (found.maybe) triangle_candidates(it, &leaves[i], &found);
    }
}

/*
 * Tests the rays of all packets with the triangles of a leaf with `count` entries. false: they must be tested
 * packet by packet.
 */
static INLINED bool look_at_leaf(struct nearest_bundle *it, const struct bvh_leaf *leaves,
                                 uint32_t count, uint32_t triangles, const lane_set rays[BUNDLE])
{
    const struct bvh_corners *corners = bvh_corners(leaves, count);
    struct pinhole_leaf leaf;
    struct pinhole_triangles seen;
    if (!pinhole_leaf_of(&it->eye, it->bundle.axes, corners, &leaf)) return false;
    for (uint32_t first = 0; first < triangles; first += LANES) {
        struct rough_places places =
            rough_places(&it->packets[0].packet, corners, triangles, first);
        lane_set set = pinhole_triangles(&it->eye, &leaf, &places, &seen);
        set &= first_lanes(triangles - first);
        for (unsigned i = 0; i < it->bundle.count && set; i++)
            if (rays[i])
                look_at_triangles(&it->packets[i], leaves + first, &leaf, &seen, set, rays[i]);
    }
    return true;
}

/* The rays of each packet that meet a box. */
struct bundle_sets {
    lane_set rays[BUNDLE];
    unsigned met, packets; /* number of rays, and of packets with any */
};

/*
 * Writes into the caller's struct. A returned one would be copied while its parts are still on their way to
 * memory, and the processor would stall.
 */
static INLINED void rays_in_box(const struct nearest_bundle *it, const struct packet_box *box,
                                struct bundle_sets *sets)
{
    sets->met = sets->packets = 0;
    for (unsigned i = 0; i < it->bundle.count; i++) {
        const struct nearest_packet *packet = &it->packets[i];
        sets->rays[i] = rays_meet(&packet->packet, box, packet->float_limit);
        sets->met += (unsigned)__builtin_popcount(sets->rays[i]);
        sets->packets += sets->rays[i] != 0;
    }
}

static INLINED void look_in_leaf(struct nearest_bundle *it, const struct bvh_leaf *leaves,
                                 uint32_t count, const struct bundle_sets *sets)
{
    uint32_t triangles = triangles_of(leaves, count);
    bool together = it->bundle.one_origin && sets->packets >= TOGETHER_MIN && triangles > 0 &&
                    look_at_leaf(it, leaves, count, triangles, sets->rays);
    for (unsigned i = 0; i < it->bundle.count; i++) {
        struct nearest_packet *packet = &it->packets[i];
        /* rays_in_box() has put it there. NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign) */
        lane_set rays = sets->rays[i];
        if (!rays) continue;
        if (!together && triangles > 0)
            packet_triangles(&packet->packet, packet->scene, leaves, count, triangles, rays,
                             triangle_candidates, packet);
        solids_in_leaf(packet, leaves + triangles, count - triangles, rays);
        packet->float_limit = ray_limits(lanes_load(packet->limit));
    }
}

static INLINED void visit_by_bundle(void *context, const struct bvh_node *node, unsigned slot,
                                    double *limit)
{
    struct nearest_bundle *it = context;
    if (!it->among_leaves) bundle_enter_leaves(it);
    struct packet_box box = packet_box(&it->bundle, node, slot);
    struct bundle_sets sets;
    rays_in_box(it, &box, &sets);
    if (sets.met > 0) {
        look_in_leaf(it, it->leaves + node->child[slot], node->count[slot], &sets);
        *limit = farthest_limit(it);
    }
    it->given_up = !is_worth_it(&it->bundle, sets.met);
    if (it->given_up) *limit = -INFINITE; /* ends the traversal */
}

/* false: the rays are faster on their own. */
static INLINED bool walk_trees(struct nearest_bundle *it, const struct bvh *bvh)
{
    for (lane_set trees = trees_of_bundle(&it->bundle, bvh, farthest_limit(it)); trees;) {
        const struct bvh *tree = take_tree(bvh, &trees);
        if (!bundle_enters(&it->bundle, tree)) return false;
        it->leaves = bvh_leaves(tree);
        it->among_leaves = false;
        bundle_traverse(&it->bundle, farthest_limit(it), visit_by_bundle, it);
        if (it->given_up) return false;
    }
    return true;
}

/* Tests the planes, which are not in the tree. */
static void bundle_planes(struct nearest_bundle *it, const struct scene *scene)
{
    uint32_t end = plane_ids_end(scene);
    if (!has_planes(scene)) return;
    bundle_prepare(it);
    for (unsigned i = 0; i < it->bundle.count; i++) {
        struct nearest_packet *packet = &it->packets[i];
        for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end; id++)
            plane_candidates(packet, id);
        packet->float_limit = ray_limits(lanes_load(packet->limit));
    }
}

bool nearest_bundle(const struct nearest_batch *batch, const struct ray *rays, unsigned packets,
                    struct hit *hits)
{
    struct nearest_bundle it;
    it.bundle.count = packets;
    for (unsigned i = 0; i < packets; i++)
        it.bundle.packets[i] = &it.packets[i].packet;
    if (batch->bvh->node_count == 0 || !bundle_of(rays, &it.bundle)) return false;
    it.given_up = it.prepared = false;
    for (unsigned i = 0; i < packets; i++)
        nearest_packet_begin(&it.packets[i], batch, rays + (size_t)i * LANES);
    bundle_planes(&it, batch->scene);
    if (!walk_trees(&it, batch->bvh)) return false;
    for (unsigned i = 0; i < packets && it.prepared; i++)
        prefetch_firsts(&it.packets[i]);
    for (unsigned i = 0; i < packets; i++)
        nearest_packet_end(&it.packets[i], hits + (size_t)i * LANES);
    return true;
}

#else

bool nearest_bundle(const struct nearest_batch *batch, const struct ray *rays, unsigned packets,
                    struct hit *hits)
{
    (void)batch;
    (void)rays;
    (void)packets;
    (void)hits;
    return false; /* none is worth it */
}

#endif
