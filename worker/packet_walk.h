/* The traversal of the trees by bundles of rays; see worker/packet.h. */
#ifndef FARM_WORKER_PACKET_WALK_H
#define FARM_WORKER_PACKET_WALK_H

#include "worker/bundle.h"
#include "worker/several.h"
#include "worker/traverse.h"

static INLINED void range_cut(const struct range_slab *range, const struct bvh_node *node,
                              struct floats *near, struct floats *far)
{
    struct floats inverse_low = floats_of(range->inverse_low);
    struct floats inverse_high = floats_of(range->inverse_high);
    struct floats in =
        floats_sub(node_floats(node, range->near_plane), floats_of(range->in_origin));
    struct floats out =
        floats_sub(node_floats(node, range->far_plane), floats_of(range->out_origin));
    struct floats in_low = floats_mul(in, inverse_low);
    struct floats out_high = floats_mul(out, inverse_high);
    if (range->both_ways) {
        *near = floats_larger(floats_larger(in_low, out_high), *near);
        return;
    }
    in = floats_smaller(in_low, floats_mul(in, inverse_high));
    out = floats_larger(floats_mul(out, inverse_low), out_high);
    *near = floats_larger(in, *near);
    *far = floats_smaller(out, *far);
}

/* The boxes of a node that some ray may meet within 0 <= t <= limit, a float_slab_limit(); *enter: the
 * earliest entries. */
static INLINED lane_set ranges_meet(const struct bundle *bundle, const struct bvh_node *node,
                                    float limit, struct floats *enter)
{
    struct floats near = floats_of(0), far = floats_of(limit);
    range_cut(&bundle->ranges[0], node, &near, &far);
    range_cut(&bundle->ranges[1], node, &near, &far);
    range_cut(&bundle->ranges[2], node, &near, &far);
    *enter = near;
    return floats_at_most(near, floats_mul(far, floats_of((float)FLOAT_WIDENING)));
}

/* The trees whose boxes some ray may meet within 0 <= t <= limit. Called before the bundle enters a tree. */
static INLINED lane_set trees_of_bundle(struct bundle *bundle, const struct bvh *bvh, double limit)
{
    const struct bvh *boxes = bvh_boxes(bvh);
    if (!boxes || !bundle_enters(bundle, boxes)) return all_trees(bvh);
    struct floats enter;
    lane_set set = 0;
    for (unsigned i = 0; i < boxes->node_count; i++)
        set |= ranges_meet(bundle, &bvh_nodes(boxes)[i], float_slab_limit(limit), &enter)
               << i * BVH_WIDTH;
    return set;
}

static INLINED struct floats one_plane(const struct bvh_node *node, size_t offset, unsigned slot)
{
    return floats_of(((const float *)(const void *)((const char *)node + offset))[slot]);
}

/* float_slab_limit() for each ray. */
static INLINED struct floats ray_limits(struct lanes limit)
{
    return floats_of_lanes(lanes_mul(limit, lanes_of(FLOAT_WIDENING)));
}

/* The planes of one box, in the order in which the rays meet them; relative to the common origin if there is
 * one. */
struct packet_box {
    bool one_origin, both_ways[3];
    struct floats near[3], far[3];
};

static INLINED struct packet_box packet_box(const struct bundle *bundle,
                                            const struct bvh_node *node, unsigned slot)
{
    struct packet_box box = {.one_origin = bundle->one_origin};
    UNROLLED
    for (unsigned axis = 0; axis < 3; axis++) {
        const struct range_slab *range = &bundle->ranges[axis];
        box.both_ways[axis] = range->both_ways;
        box.near[axis] = one_plane(node, range->near_plane, slot);
        box.far[axis] = one_plane(node, range->far_plane, slot);
        if (!bundle->one_origin) continue;
        box.near[axis] = floats_sub(box.near[axis], floats_of(range->ray_in));
        box.far[axis] = floats_sub(box.far[axis], floats_of(range->ray_out));
    }
    return box;
}

/* Orders two planes for each ray by the sign of its inverse. */
static INLINED void order_by_way(struct floats inverse, struct floats *first, struct floats *last)
{
    lane_set down = floats_less(inverse, floats_of(0));
    struct floats min = *first, max = *last;
    *first = floats_choose(down, max, min);
    *last = floats_choose(down, min, max);
}

/* The rays that meet a box within 0 <= t <= limit, which is from ray_limits(). */
static INLINED lane_set rays_meet(const struct packet *packet, const struct packet_box *box,
                                  struct floats limit)
{
    struct floats near = floats_of(0), far = limit;
    UNROLLED
    for (unsigned axis = 0; axis < 3; axis++) {
        const struct lane_slab *slab = &packet->slabs[axis];
        struct floats first = box->near[axis], last = box->far[axis];
        if (box->both_ways[axis]) order_by_way(slab->inverse, &first, &last);
        struct floats in, out;
        if (box->one_origin) {
            in = floats_mul(first, slab->inverse);
            out = floats_mul(last, slab->inverse);
        } else {
            in = floats_mul(floats_sub(first, slab->near_origin), slab->inverse);
            out = floats_mul(floats_sub(last, slab->far_origin), slab->inverse);
        }
        near = floats_larger(in, near);
        far = floats_smaller(out, far);
    }
    return floats_at_most(near, floats_mul(far, floats_of((float)FLOAT_WIDENING)));
}

/* A child that is still to be visited. */
struct packet_pending {
    uint32_t node, slot;
    float enter;
};

static INLINED unsigned push_for_packet(struct packet_pending *stack, unsigned top, uint32_t node,
                                        lane_set set, struct floats enter)
{
    float at[LANES];
    floats_store(at, enter);
    unsigned end = top + (unsigned)__builtin_popcount(set);
    for (lane_set rest = set; rest; rest = without_lowest(rest)) {
        unsigned slot = lowest_lane(rest);
        struct floats here = floats_of(at[slot]);
        unsigned nearer =
            lanes_before(set, slot, floats_less(enter, here), floats_at_most(enter, here));
        stack[end - 1 - nearer] = (struct packet_pending){node, slot, at[slot]};
    }
    return end;
}

/*
 * From LEAVES_ON_TRIAL leaves on a bundle gives up if there are LEAVES_TO_A_RAY leaves or more for each ray found in a
 * leaf. Rays with a common origin have higher limits: if triangles are as small as the spacing of rays (bench-kernel's
 * million), leaves that no ray meets cost less than separate traversals. With 64 and 8 the kernel took 0.85 of the time
 * there, and 0.97 for the lantern; never giving up was no faster.
 */
#define LEAVES_ON_TRIAL         16
#define LEAVES_TO_A_RAY         2
#define PINHOLE_ON_TRIAL        64
#define PINHOLE_LEAVES_TO_A_RAY 8

/*
 * Counts a leaf and its rays. false: too many leaves that the ranges meet are met by no ray, so the rays are
 * faster on their own.
 */
static INLINED bool is_worth_it(struct bundle *bundle, unsigned rays)
{
    bundle->leaves++;
    bundle->visits += rays;
    if (bundle->one_origin)
        return bundle->leaves < PINHOLE_ON_TRIAL ||
               PINHOLE_LEAVES_TO_A_RAY * bundle->visits > bundle->leaves;
    return bundle->leaves < LEAVES_ON_TRIAL || LEAVES_TO_A_RAY * bundle->visits > bundle->leaves;
}

/* Tests a leaf; may lower *limit, the largest distance that matters to any ray. */
typedef void visit_leaf_by_packet(void *context, const struct bvh_node *node, unsigned slot,
                                  double *limit);

static INLINED void bundle_traverse(const struct bundle *bundle, double limit,
                                    visit_leaf_by_packet *visit, void *context)
{
    const struct bvh_node *nodes = bvh_nodes(bundle->bvh);
    struct packet_pending stack[BVH_STACK + BVH_WIDTH];
    unsigned top = 0;
    uint32_t now = 0;
    float float_limit = float_slab_limit(limit);
    for (;;) {
        struct floats enter;
        lane_set set = ranges_meet(bundle, &nodes[now], float_limit, &enter);
        top = push_for_packet(stack, top, now, set, enter);
        prefetch_children(bundle->bvh, &nodes[now], set);
        for (;;) {
            if (top == 0) return;
            const struct packet_pending *next = &stack[--top];
            if (!(next->enter <= float_limit)) continue;
            const struct bvh_node *node = &nodes[next->node];
            if (node->count[next->slot] == 0) {
                now = node->child[next->slot];
                break;
            }
            visit(context, node, next->slot, &limit);
            float_limit = float_slab_limit(limit);
        }
    }
}

#endif
