/* The walk of a packet of rays through the tree; see worker/packet.h. */
#ifndef FARM_WORKER_PACKET_WALK_H
#define FARM_WORKER_PACKET_WALK_H

#include <float.h>

#include "worker/traverse.h"
#include "worker/triangle_lanes.h"

/* One axis for all rays. */
struct range_slab {
    size_t near_plane, far_plane;
    struct lanes in_origin, out_origin; /* the ends of the ranges that count */
    struct lanes inverse_low, inverse_high;
};

/* One axis, a lane for each ray. */
struct lane_slab {
    size_t near_plane, far_plane;
    struct lanes near_origin, far_origin, inverse;
};

struct packet {
    const struct bvh *bvh;
    struct range_slab ranges[3];
    /* A lane for each ray: */
    struct lane_slab slabs[3];
    struct lanes o[3], d[3];
    struct lanes origin[3], sx, sy, inverse_dz; /* origin: in the order of the shear's axes */
    unsigned axes[3];                           /* x, y and z of the shear */
};

static INLINED double lowest_of(struct lanes a)
{
    double at[LANES];
    lanes_store(at, a);
    double low = at[0];
    for (unsigned i = 1; i < LANES; i++)
        low = smaller(at[i], low);
    return low;
}

static INLINED double highest_of(struct lanes a)
{
    double at[LANES];
    lanes_store(at, a);
    double high = at[0];
    for (unsigned i = 1; i < LANES; i++)
        high = larger(at[i], high);
    return high;
}

static INLINED bool all_finite(struct lanes a)
{
    return lanes_at_most(lanes_abs(a), lanes_of(DBL_MAX)) == ALL_LANES;
}

static INLINED struct lanes largest_of(const struct lanes v[3])
{
    return lanes_largest(lanes_abs(v[0]), lanes_abs(v[1]), lanes_abs(v[2]));
}

/* Which axis is z is certain, and the same, for all rays. */
static INLINED bool have_one_shear(struct packet *packet, const struct lanes d[3],
                                   const struct vec3 *first)
{
    unsigned z = shear_of(first).z, x = (z + 1) % 3, y = (z + 2) % 3;
    packet->axes[0] = x;
    packet->axes[1] = y;
    packet->axes[2] = z;
    struct lanes size = lanes_abs(d[z]);
    lane_set steeper = lanes_less(lanes_abs(d[x]), size) & lanes_less(lanes_abs(d[y]), size);
    return steeper == ALL_LANES && all_finite(size);
}

/* The slabs of one axis; false: the rays do not all go up, or all down. */
static INLINED bool set_slab(struct packet *packet, unsigned axis, struct lanes origin,
                             struct lanes direction, struct lanes margin)
{
    size_t min = offsetof(struct bvh_node, min) + axis * BVH_WIDTH * sizeof(float);
    size_t max = offsetof(struct bvh_node, max) + axis * BVH_WIDTH * sizeof(float);
    bool down = lanes_less(direction, lanes_of(0)) == ALL_LANES;
    if (!down && lanes_less(lanes_of(0), direction) != ALL_LANES) return false;
    struct lane_slab *slab = &packet->slabs[axis];
    slab->near_plane = down ? max : min;
    slab->far_plane = down ? min : max;
    struct lanes low = lanes_sub(origin, margin), high = lanes_add(origin, margin);
    slab->near_origin = down ? low : high;
    slab->far_origin = down ? high : low;
    slab->inverse = lanes_div(lanes_of(1), direction);
    double lowest = lowest_of(low), highest = highest_of(high);
    packet->ranges[axis] = (struct range_slab){slab->near_plane,
                                               slab->far_plane,
                                               lanes_of(down ? lowest_of(low) : highest),
                                               lanes_of(down ? highest : lowest),
                                               lanes_of(lowest_of(slab->inverse)),
                                               lanes_of(highest_of(slab->inverse))};
    return all_finite(slab->inverse) && all_finite(high) && all_finite(low);
}

/* false: the rays are not alike. */
static INLINED bool packet_of(const struct bvh *bvh, const struct ray *rays, struct packet *packet)
{
    packet->bvh = bvh;
    const struct axis_order xyz = axis_order(0, 1, 2);
    const double *origins[LANES], *directions[LANES];
    struct lanes *o = packet->o, *d = packet->d;
    UNROLLED
    for (unsigned i = 0; i < LANES; i++) {
        origins[i] = &rays[i].origin.x;
        directions[i] = &rays[i].direction.x;
    }
    lanes_transpose(directions, &xyz, d);
    if (!have_one_shear(packet, d, &rays[0].direction)) return false;
    lanes_transpose(origins, &xyz, o);
    const double *center = bvh->center;
    double reach = root_reach(bvh);
    reach += larger(fabs(center[0]), larger(fabs(center[1]), fabs(center[2])));
    struct lanes margin =
        lanes_mul(lanes_of(TEST_ERROR), lanes_add(largest_of(o), lanes_of(reach)));
    for (unsigned axis = 0; axis < 3; axis++) {
        struct lanes origin = lanes_sub(o[axis], lanes_of(center[axis]));
        if (!set_slab(packet, axis, origin, d[axis], margin)) return false;
    }
    const unsigned *axes = packet->axes;
    for (unsigned i = 0; i < 3; i++)
        packet->origin[i] = o[axes[i]];
    packet->sx = lanes_div(d[axes[0]], d[axes[2]]);
    packet->sy = lanes_div(d[axes[1]], d[axes[2]]);
    packet->inverse_dz = packet->slabs[axes[2]].inverse;
    return true;
}

static INLINED void range_cut(const struct range_slab *range, const struct bvh_node *node,
                              struct lanes *near, struct lanes *far)
{
    struct lanes in = lanes_sub(node_planes(node, range->near_plane), range->in_origin);
    struct lanes out = lanes_sub(node_planes(node, range->far_plane), range->out_origin);
    in = lanes_smaller(lanes_mul(in, range->inverse_low), lanes_mul(in, range->inverse_high));
    out = lanes_larger(lanes_mul(out, range->inverse_low), lanes_mul(out, range->inverse_high));
    *near = lanes_larger(in, *near);
    *far = lanes_smaller(out, *far);
}

/* Of a node's boxes those that some ray may be in at 0 <= t <= limit, and from where on. */
static INLINED lane_set ranges_meet(const struct packet *packet, const struct bvh_node *node,
                                    double limit, struct lanes *enter)
{
    struct lanes near = lanes_of(0), far = lanes_of(limit);
    range_cut(&packet->ranges[0], node, &near, &far);
    range_cut(&packet->ranges[1], node, &near, &far);
    range_cut(&packet->ranges[2], node, &near, &far);
    *enter = near;
    return lanes_at_most(near, lanes_mul(far, lanes_of(FAR_WIDENING)));
}

static INLINED struct lanes one_plane(const struct bvh_node *node, size_t offset, unsigned slot)
{
    return lanes_of((double)((const float *)(const void *)((const char *)node + offset))[slot]);
}

/* The rays that are in one box at 0 <= t <= limit. */
static INLINED lane_set rays_meet(const struct packet *packet, const struct bvh_node *node,
                                  unsigned slot, struct lanes limit)
{
    struct lanes near = lanes_of(0), far = limit;
    for (unsigned axis = 0; axis < 3; axis++) {
        const struct lane_slab *slab = &packet->slabs[axis];
        struct lanes in = lanes_sub(one_plane(node, slab->near_plane, slot), slab->near_origin);
        struct lanes out = lanes_sub(one_plane(node, slab->far_plane, slot), slab->far_origin);
        near = lanes_larger(lanes_mul(in, slab->inverse), near);
        far = lanes_smaller(lanes_mul(out, slab->inverse), far);
    }
    return lanes_at_most(near, lanes_mul(far, lanes_of(FAR_WIDENING)));
}

/* A child for later. */
struct packet_pending {
    double enter;
    uint32_t node, slot;
};

static INLINED unsigned push_for_packet(struct packet_pending *stack, unsigned top, uint32_t node,
                                        lane_set set, struct lanes enter)
{
    double at[LANES];
    unsigned end = top + (unsigned)__builtin_popcount(set);
    lanes_store(at, enter);
    for (lane_set rest = set; rest; rest = without_lowest(rest)) {
        unsigned slot = lowest_lane(rest);
        struct lanes here = lanes_of(at[slot]);
        lane_set nearer = lanes_less(enter, here);
        nearer |= lanes_at_most(enter, here) & ((UINT32_C(1) << slot) - 1);
        stack[end - 1 - (unsigned)__builtin_popcount(nearer & set)] =
            (struct packet_pending){at[slot], node, slot};
    }
    return end;
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
    for (;;) {
        struct lanes enter;
        lane_set set = ranges_meet(packet, &nodes[now], limit, &enter);
        top = push_for_packet(stack, top, now, set, enter);
        for (;;) {
            if (top == 0) return;
            const struct packet_pending *next = &stack[--top];
            if (!(next->enter <= limit)) continue;
            const struct bvh_node *node = &nodes[next->node];
            if (node->count[next->slot] == 0) {
                now = node->child[next->slot];
                break;
            }
            visit(context, node, next->slot, &limit);
        }
    }
}

#endif
