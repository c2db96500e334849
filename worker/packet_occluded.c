#include "worker/packet.h"

#include "worker/lanes.h"

/*
 * Without SIMD packets are not used (worker/nearest.c, occluded.c), and compiling eight times the scalar code
 * would take half a minute.
 */
#if LANES_IN_SIMD

#include "worker/occlusion_walk.h"
#include "worker/packet_walk.h"
#include "worker/rough_packet.h"

struct occlusion_packet {
    struct bundle bundle;
    struct packet packet;
    struct ray_lanes ray_lanes;
    const struct scene *scene;
    const struct ray *rays;
    uint64_t *exact;
    struct blocker *blocker;
    bool given_up;
    struct passages *passages; /* NULL: nothing is transparent */
    lane_set open;             /* rays not blocked yet */
    struct lanes least;        /* nearer crossings may be a passage where the ray starts */
    lane_set walking;          /* rays whose walk has begun */
    struct occlusion_walk walks[LANES];
};

static struct occlusion_walk *walk_of(struct occlusion_packet *it, unsigned lane)
{
    struct occlusion_walk *walk = &it->walks[lane];
    if (!(it->walking >> lane & 1))
        occlusion_begin(walk, it->scene, &it->rays[lane], it->passages ? &it->passages[lane] : NULL,
                        it->exact);
    it->walking |= UINT32_C(1) << lane;
    return walk;
}

static INLINED void note(struct occlusion_packet *it, unsigned lane, bool goes_on)
{
    if (!goes_on) it->open &= ~(UINT32_C(1) << lane);
}

/* Records crossings that certainly count, for rays that do not start on the primitive. */
static void certain_crossings(struct occlusion_packet *it, const struct bvh_leaf *leaf,
                              lane_set set, unsigned crossings)
{
    if (is_opaque(it->passages, leaf)) {
        it->open &= ~set;
        return;
    }
    for (; set; set = without_lowest(set)) {
        unsigned lane = lowest_lane(set);
        note(it, lane, occlusion_by(walk_of(it, lane), leaf, crossings));
    }
}

static INLINED lane_set triangle_in_the_way(void *context, const struct bvh_leaf *leaf,
                                            const struct rough_crossings *found)
{
    struct occlusion_packet *it = context;
    lane_set set = found->maybe & ~rays_from(&it->packet, leaf->id), certain = found->certain;
    lane_set beyond =
        lanes_less(it->packet.t_max, found->from) | lanes_less(found->to, lanes_of(0));
    lane_set within = lanes_less(it->least, found->from) & lanes_less(found->to, it->packet.t_max);
    certain_crossings(it, leaf, set & certain & within, 1);
    for (set &= ~(certain & (within | beyond)); set; set = without_lowest(set)) {
        unsigned lane = lowest_lane(set);
        note(it, lane, occlusion_triangle(walk_of(it, lane), leaf, false));
    }
    return it->open;
}

/* Tests rays with a primitive, one by one. */
static void test_each(struct occlusion_packet *it, const struct bvh_leaf *leaf, lane_set set)
{
    for (; set; set = without_lowest(set)) {
        unsigned lane = lowest_lane(set);
        if (is_left_behind(it->scene, leaf->id, &it->rays[lane])) continue;
        note(it, lane, occlusion_primitive(walk_of(it, lane), leaf));
    }
}

static NOINLINE void solid_in_the_way(struct occlusion_packet *it, const struct bvh_leaf *leaf,
                                      lane_set rays)
{
    lane_set leaving = rays & rays_from(&it->packet, leaf->id);
    rays &= ~leaving;
    if (rays) {
        struct spans_lanes spans = spans_of_rays(it->scene, leaf->id, &it->ray_lanes);
        rays &= may_be_crossed_lanes(&spans, it->packet.t_max);
        struct crossing_sets_lanes certain = crossing_sets_lanes(&spans, it->packet.t_max);
        lane_set decided = has_usable_spans(it->scene, leaf->id) ? rays : 0;
        decided &= lanes_less(it->least, first_crossing_lanes(&spans).from);
        certain_crossings(it, leaf, decided & certain.once, 1);
        certain_crossings(it, leaf, decided & certain.twice, 2);
        rays &= ~(decided & (certain.once | certain.twice));
    }
    test_each(it, leaf, rays | leaving);
}

/* Tests a leaf. Keeps as blocker the leaf if a triangle has blocked a ray, or another primitive that has. */
static NOINLINE void look_in_leaf(struct occlusion_packet *it, const struct bvh_leaf *leaves,
                                  uint32_t count, lane_set rays)
{
    uint32_t triangles = triangles_of(leaves, count);
    lane_set before = it->open;
    if (triangles > 0)
        packet_triangles(&it->packet, it->scene, leaves, count, triangles, rays,
                         triangle_in_the_way, it);
    if (it->open != before) *it->blocker = (struct blocker){leaves, count, it->packet.bvh};
    for (uint32_t i = triangles; i < count && (rays & it->open); i++) {
        before = it->open;
        if (has_spans(leaves[i].id))
            solid_in_the_way(it, &leaves[i], rays & it->open);
        else
            test_each(it, &leaves[i], rays & it->open);
        if (it->open != before) *it->blocker = (struct blocker){&leaves[i], 1, it->packet.bvh};
    }
}

static INLINED void visit_by_packet(void *context, const struct bvh_node *node, unsigned slot,
                                    double *limit)
{
    struct occlusion_packet *it = context;
    struct packet_box box = packet_box(&it->bundle, node, slot);
    lane_set rays = it->open & rays_meet(&it->packet, &box, ray_limits(it->packet.t_max));
    it->given_up = !is_worth_it(&it->bundle, (unsigned)__builtin_popcount(rays));
    if (it->given_up) *limit = -INFINITE; /* ends the traversal */
    if (!rays || it->given_up) return;
    look_in_leaf(it, bvh_leaves(it->packet.bvh) + node->child[slot], node->count[slot], rays);
    if (!it->open) *limit = -INFINITE; /* all rays are blocked */
}

/*
 * Tests the triangles of the leaf that has blocked preceding rays, where that is quickly decided; the
 * traversal tests the rest.
 */
static void look_in_last_leaf(struct occlusion_packet *it, const struct blocker *last)
{
    const struct bvh_corners *corners = bvh_corners(last->leaves, last->count);
    uint32_t triangles = triangles_of(last->leaves, last->count);
    struct rough_leaf rough;
    struct rough_places places;
    it->packet.bvh = last->bvh;
    lane_set rays = it->open & ~rough_leaf_of(&it->packet, corners, &rough), undecided;
    for (uint32_t i = 0; i < triangles && rays; i++) {
        if (i % LANES == 0) places = rough_places(&it->packet, corners, triangles, i);
        struct rough_crossings found =
            crossings_in_float(&it->packet, &rough, &places, i % LANES, rays, &undecided);
        if (found.maybe) rays &= triangle_in_the_way(it, &last->leaves[i], &found);
    }
}

static void look_at_blocker(struct occlusion_packet *it)
{
    struct blocker last = *it->blocker;
    if (last.count == 0 || !it->open) return;
    if (is_triangle(last.leaves->id))
        look_in_last_leaf(it, &last);
    else if (has_spans(last.leaves->id))
        solid_in_the_way(it, last.leaves, it->open);
}

/* Tests a plane. Rays that start on it do not hit it. */
static void plane_in_the_way(struct occlusion_packet *it, uint32_t id)
{
    struct bvh_leaf leaf = bvh_leaf_of(it->scene, id);
    struct plane_span_lanes span = plane_span_of_rays(it->scene, id, &it->ray_lanes);
    lane_set beyond = lanes_less(it->packet.t_max, span.from) | lanes_less(span.to, lanes_of(0));
    lane_set within = lanes_less(it->least, span.from) & lanes_less(span.to, it->packet.t_max);
    lane_set set = it->open & ~rays_from(&it->packet, id);
    certain_crossings(it, &leaf, set & span.decided & within, 1);
    test_each(it, &leaf, set & ~(span.decided & (within | beyond)));
}

/* Tests the planes, which are not in the tree. */
static void planes_in_the_way(struct occlusion_packet *it)
{
    uint32_t end = plane_ids_end(it->scene);
    for (uint32_t id = primitive_id(PRIMITIVE_PLANE, 0); id < end && it->open; id++)
        plane_in_the_way(it, id);
}

static void begin_rays(struct occlusion_packet *it)
{
    const struct packet *packet = &it->packet;
    struct lanes way = lanes_mul(largest_of(packet->o), lanes_abs(packet->inverse_dz));
    it->least = lanes_mul(lanes_of(PASSAGE_REACH), way);
    for (unsigned lane = 0; lane < LANES && it->passages; lane++)
        it->passages[lane].count = 0;
    planes_in_the_way(it);
}

/* Traverses the trees until all rays are blocked or the packet gives up. */
static INLINED void walk_trees(struct occlusion_packet *it, const struct bvh *bvh)
{
    double limit = lanes_highest(it->packet.t_max);
    if (!it->open) return;
    lane_set trees = trees_of_bundle(&it->bundle, bvh, limit);
    while (trees && it->open && !it->given_up) {
        it->given_up = !bundle_enters(&it->bundle, take_tree(bvh, &trees));
        if (it->given_up) return;
        packet_enters(&it->packet, &it->bundle);
        bundle_traverse(&it->bundle, limit, visit_by_packet, it);
    }
}

bool occluded_packet(const struct occlusion_batch *batch, const struct ray *rays,
                     struct vec3 *transmittance, lane_set *open)
{
    const struct scene *scene = batch->scene;
    struct occlusion_packet it;
    it.bundle.count = 1;
    it.bundle.packets[0] = &it.packet;
    *open = ALL_LANES;
    if (batch->bvh->node_count == 0 || !bundle_of(rays, &it.bundle)) return false;
    packet_prepare(&it.packet, &it.bundle);
    if (has_lines(scene)) it.ray_lanes = rays_in_lanes(it.packet.o, it.packet.d);
    it.scene = scene;
    it.rays = rays;
    it.exact = batch->exact;
    it.passages = batch->passages;
    it.open = ALL_LANES;
    it.walking = 0;
    it.given_up = false;
    it.blocker = batch->blocker;
    begin_rays(&it);
    look_at_blocker(&it);
    walk_trees(&it, batch->bvh);
    /*
     * A blocker saves a packet the traversal only if it blocks all rays. If one of these rays was not
     * blocked, some of the next are likely not to be either, so the blocker is forgotten, however many rays
     * it has blocked.
     */
    if (it.open && !it.given_up) it.blocker->count = 0;
    *open = it.given_up ? it.open : 0;
    for (unsigned lane = 0; lane < LANES; lane++)
        if (!(*open >> lane & 1))
            transmittance[lane] = transmittance_of(scene, it.passages ? &it.passages[lane] : NULL,
                                                   !(it.open >> lane & 1));
    return !it.given_up;
}

#else

bool occluded_packet(const struct occlusion_batch *batch, const struct ray *rays,
                     struct vec3 *transmittance, lane_set *open)
{
    (void)batch;
    (void)rays;
    (void)transmittance;
    *open = ALL_LANES;
    return false; /* none is worth it */
}

#endif
