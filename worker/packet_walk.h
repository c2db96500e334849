/* The walk of a packet of rays through the tree; see worker/packet.h. */
#ifndef FARM_WORKER_PACKET_WALK_H
#define FARM_WORKER_PACKET_WALK_H

#include <float.h>

#include "worker/traverse.h"
#include "worker/triangle_lanes.h"

/* Leaves after which a packet may turn out not to be worth it. */
#define LEAVES_ON_TRIAL 16

/*
 * One axis for all rays. A distance, (bound - origin) * (1 / d), is rounded three times, in the
 * difference, the inverse and the product: the far one is enlarged in the end by FLOAT_WIDENING, of
 * whose 8 roundings 7 are used.
 */
struct range_slab {
    size_t near_plane, far_plane;
    struct floats in_origin, out_origin; /* the ends of the ranges that count */
    struct floats inverse_low, inverse_high;
};

/* The same, a lane for each ray. */
struct lane_slab {
    struct floats near_origin, far_origin, inverse;
};

struct packet {
    const struct bvh *bvh;
    unsigned leaves, visits; /* leaves looked at; rays that were in them */
    struct range_slab ranges[3];
    /* A lane for each ray: */
    struct lane_slab slabs[3];
    struct lanes o[3], d[3];
    struct lanes origin[3], sx, sy; /* origin: in the order of the shear's axes */
    struct lanes inverse_dz;        /* of the shear's z */
    unsigned axes[3];               /* x, y and z of the shear */
};

static INLINED struct lanes largest_of(const struct lanes v[3])
{
    return lanes_largest(lanes_abs(v[0]), lanes_abs(v[1]), lanes_abs(v[2]));
}

static INLINED struct lanes sum_of(const struct lanes v[3])
{
    return lanes_add(lanes_add(lanes_abs(v[0]), lanes_abs(v[1])), lanes_abs(v[2]));
}

/* Which axis is z is certain, and the same, for all rays. */
static INLINED bool have_one_shear(struct packet *packet, const struct vec3 *first)
{
    const struct lanes *d = packet->d;
    unsigned z = shear_of(first).z, x = (z + 1) % 3, y = (z + 2) % 3;
    packet->axes[0] = x;
    packet->axes[1] = y;
    packet->axes[2] = z;
    struct lanes size = lanes_abs(d[z]);
    return (lanes_less(lanes_abs(d[x]), size) & lanes_less(lanes_abs(d[y]), size)) == ALL_LANES;
}

/* The slabs of one axis; false: the rays do not all go up, or all down, by what float can take. */
static INLINED bool set_slab(struct packet *packet, unsigned axis, double margin)
{
    size_t min = offsetof(struct bvh_node, min) + axis * (BVH_WIDTH * sizeof(float));
    size_t max = offsetof(struct bvh_node, max) + axis * (BVH_WIDTH * sizeof(float));
    struct lanes direction = packet->d[axis];
    bool down = lanes_less(direction, lanes_of(-FLOAT_COMPONENT_MIN)) == ALL_LANES;
    if (!down && lanes_less(lanes_of(FLOAT_COMPONENT_MIN), direction) != ALL_LANES) return false;
    struct lanes origin = lanes_sub(packet->o[axis], lanes_of(packet->bvh->center[axis]));
    float low = float_below(lanes_lowest(origin) - margin);
    float high = float_above(lanes_highest(origin) + margin);
    double first = 1 / lanes_highest(direction), last = 1 / lanes_lowest(direction);
    packet->ranges[axis] = (struct range_slab){down ? max : min,
                                               down ? min : max,
                                               floats_of(down ? low : high),
                                               floats_of(down ? high : low),
                                               floats_of((float)first),
                                               floats_of((float)last)};
    struct floats below = floats_below(lanes_sub(origin, lanes_of(margin)));
    struct floats above = floats_above(lanes_add(origin, lanes_of(margin)));
    packet->slabs[axis] = (struct lane_slab){down ? below : above, down ? above : below,
                                             floats_of_lanes(lanes_div(lanes_of(1), direction))};
    return true;
}

/* Nothing of it is infinite or NaN, nor overflows. */
static INLINED bool packet_is_finite(const struct packet *packet, double margin)
{
    struct lanes sum = lanes_add(sum_of(packet->o), sum_of(packet->d));
    return lanes_at_most(lanes_add(sum, lanes_of(margin)), lanes_of(DBL_MAX)) == ALL_LANES;
}

/* Whether float does for all of them. */
static INLINED bool packet_fits_floats(const struct packet *packet, double largest_origin,
                                       double margin)
{
    struct lanes largest = lanes_abs(packet->d[packet->axes[2]]);
    return float_slabs_do(largest_origin, lanes_lowest(largest), margin, packet->bvh->reach) &&
           lanes_highest(largest) < FLOAT_DIRECTION_MAX;
}

/* false: the rays are not alike. */
static INLINED bool packet_of(const struct bvh *bvh, const struct ray *rays, struct packet *packet)
{
    packet->bvh = bvh;
    packet->leaves = packet->visits = 0;
    const struct axis_order xyz = axis_order(0, 1, 2);
    const double *origins[LANES], *directions[LANES];
    UNROLLED
    for (unsigned i = 0; i < LANES; i++) {
        origins[i] = &rays[i].origin.x;
        directions[i] = &rays[i].direction.x;
    }
    lanes_transpose(directions, &xyz, packet->d);
    if (!have_one_shear(packet, &rays[0].direction)) return false;
    lanes_transpose(origins, &xyz, packet->o);
    double largest_origin = lanes_highest(largest_of(packet->o));
    double margin = slab_margin(bvh, largest_origin);
    if (!packet_is_finite(packet, margin)) return false;
    if (!packet_fits_floats(packet, largest_origin, margin)) return false;
    for (unsigned axis = 0; axis < 3; axis++)
        if (!set_slab(packet, axis, margin)) return false;
    const unsigned *axes = packet->axes;
    for (unsigned i = 0; i < 3; i++)
        packet->origin[i] = packet->o[axes[i]];
    packet->sx = lanes_div(packet->d[axes[0]], packet->d[axes[2]]);
    packet->sy = lanes_div(packet->d[axes[1]], packet->d[axes[2]]);
    packet->inverse_dz = lanes_div(lanes_of(1), packet->d[axes[2]]);
    return true;
}

static INLINED void range_cut(const struct range_slab *range, const struct bvh_node *node,
                              struct floats *near, struct floats *far)
{
    struct floats in = floats_sub(node_floats(node, range->near_plane), range->in_origin);
    struct floats out = floats_sub(node_floats(node, range->far_plane), range->out_origin);
    in = floats_smaller(floats_mul(in, range->inverse_low), floats_mul(in, range->inverse_high));
    out = floats_larger(floats_mul(out, range->inverse_low), floats_mul(out, range->inverse_high));
    *near = floats_larger(in, *near);
    *far = floats_smaller(out, *far);
}

/* Of a node's boxes those that some ray may be in at 0 <= t <= limit, a float_slab_limit(), and from
 * where on. */
static INLINED lane_set ranges_meet(const struct packet *packet, const struct bvh_node *node,
                                    float limit, struct floats *enter)
{
    struct floats near = floats_of(0), far = floats_of(limit);
    range_cut(&packet->ranges[0], node, &near, &far);
    range_cut(&packet->ranges[1], node, &near, &far);
    range_cut(&packet->ranges[2], node, &near, &far);
    *enter = near;
    return floats_at_most(near, floats_mul(far, floats_of((float)FLOAT_WIDENING)));
}

static INLINED struct floats one_plane(const struct bvh_node *node, size_t offset, unsigned slot)
{
    return floats_of(((const float *)(const void *)((const char *)node + offset))[slot]);
}

/* float_slab_limit() of each ray. */
static INLINED struct floats ray_limits(struct lanes limit)
{
    return floats_of_lanes(lanes_mul(limit, lanes_of(FLOAT_WIDENING)));
}

/* The rays that are in one box at 0 <= t <= limit, of ray_limits(). */
static INLINED lane_set rays_meet(const struct packet *packet, const struct bvh_node *node,
                                  unsigned slot, struct floats limit)
{
    struct floats near = floats_of(0), far = limit;
    for (unsigned axis = 0; axis < 3; axis++) {
        const struct lane_slab *slab = &packet->slabs[axis];
        const struct range_slab *range = &packet->ranges[axis];
        struct floats in = floats_sub(one_plane(node, range->near_plane, slot), slab->near_origin);
        struct floats out = floats_sub(one_plane(node, range->far_plane, slot), slab->far_origin);
        near = floats_larger(floats_mul(in, slab->inverse), near);
        far = floats_smaller(floats_mul(out, slab->inverse), far);
    }
    return floats_at_most(near, floats_mul(far, floats_of((float)FLOAT_WIDENING)));
}

/* A child for later. */
struct packet_pending {
    uint32_t node, slot;
    float enter;
};

static INLINED unsigned push_for_packet(struct packet_pending *stack, unsigned top, uint32_t node,
                                        lane_set set, struct floats enter)
{
    float at[LANES];
    unsigned end = top + (unsigned)__builtin_popcount(set);
    floats_store(at, enter);
    for (lane_set rest = set; rest; rest = without_lowest(rest)) {
        unsigned slot = lowest_lane(rest);
        struct floats here = floats_of(at[slot]);
        unsigned nearer =
            lanes_before(set, slot, floats_less(enter, here), floats_at_most(enter, here));
        stack[end - 1 - nearer] = (struct packet_pending){node, slot, at[slot]};
    }
    return end;
}

/* Counts a leaf and its rays. false: most leaves that the ranges meet are met by no ray, and the
 * rays are better off on their own. */
static INLINED bool is_worth_it(struct packet *packet, lane_set rays)
{
    packet->leaves++;
    packet->visits += (unsigned)__builtin_popcount(rays);
    return packet->leaves < LEAVES_ON_TRIAL || 2 * packet->visits > packet->leaves;
}

/* Looks at a leaf; may lower *limit, the farthest that is of interest to any ray. */
typedef void visit_leaf_by_packet(void *context, const struct bvh_node *node, unsigned slot,
                                  double *limit);

static INLINED void packet_traverse(const struct bvh *bvh, const struct packet *packet,
                                    double limit, visit_leaf_by_packet *visit, void *context)
{
    if (bvh->node_count == 0) return;
    const struct bvh_node *nodes = bvh_nodes(bvh);
    struct packet_pending stack[BVH_STACK + BVH_WIDTH];
    unsigned top = 0;
    uint32_t now = 0;
    float float_limit = float_slab_limit(limit);
    for (;;) {
        struct floats enter;
        lane_set set = ranges_meet(packet, &nodes[now], float_limit, &enter);
        top = push_for_packet(stack, top, now, set, enter);
        prefetch_children(bvh, &nodes[now], set);
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
