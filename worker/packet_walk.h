/* The traversal of the tree by packets of rays; see worker/packet.h. */
#ifndef FARM_WORKER_PACKET_WALK_H
#define FARM_WORKER_PACKET_WALK_H

#include "worker/lanes3.h"
#include "worker/packet.h"
#include "worker/several.h"
#include "worker/traverse.h"
#include "worker/triangle_lanes.h"

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
 * The slab of one axis for all rays of a bundle. A distance is (bound - origin) * (1 / d), as in
 * worker/float_slabs.h.
 *
 * If rays go both ways, those that go up fastest are the first to enter a box above them, and those that go
 * down fastest are the first to enter one below. There is then no bound on when they leave it.
 */
struct range_slab {
    bool both_ways;
    size_t near_plane, far_plane; /* if both_ways: as for rays that go up */
    float in_origin, out_origin;  /* the relevant ends of the range of origins */
    float inverse_low, inverse_high;
    /* As in_origin and out_origin, for tests of single rays with a common origin. */
    float ray_in, ray_out;
};

/* struct float_slab of each ray; for rays with a common origin the origins are those of a range_slab. */
struct lane_slab {
    struct floats near_origin, far_origin, inverse;
};

/* A packet: LANES rays, one in each lane. */
struct packet {
    const struct bvh *bvh; /* the tree whose leaves are tested */
    uint32_t from[LANES];  /* primitives that the rays start on, as in struct ray */
    struct lanes o[3], d[3], t_max;

    /* Values for tests; see packet_prepare(), and packet_enters() for the origins of slabs. */
    bool prepared;
    unsigned axes[3]; /* x, y and z of the shear */
    struct lane_slab slabs[3];
    struct lanes origin[3], sx, sy; /* origin: in the order of the shear's axes */
    struct lanes inverse_dz;        /* 1 / the direction's component along the shear's z axis */
    struct floats float_sx, float_sy;
};

/* The range of a component over some rays. */
struct ends {
    double low, high;
};

/* The ranges over the rays of all packets. */
struct bundle_ends {
    struct ends o[3], d[3];
    bool finite;
};

/* A bundle: packets that traverse the tree together. */
struct bundle {
    const struct bvh *bvh; /* the tree that is traversed */
    unsigned count;
    struct packet *packets[BUNDLE];
    unsigned leaves, visits; /* leaves tested; sum over these of the rays in them */
    unsigned axes[3];        /* x, y and z of the shear, the same for all rays */
    struct bundle_ends ends;
    double margin, wide; /* how much boxes grow; wide: on axes along which rays hardly move */
    struct range_slab ranges[3];
    bool one_origin; /* all rays have a common origin */
};

static INLINED struct lanes largest_of(const struct lanes v[3])
{
    return lanes_largest(lanes_abs(v[0]), lanes_abs(v[1]), lanes_abs(v[2]));
}

/* origin: the common origin; NULL: each ray has its own. */
static INLINED void load_packet(struct packet *packet, const struct ray *rays,
                                const struct vec3 *origin)
{
    _Static_assert(offsetof(struct ray, t_max) ==
                       offsetof(struct ray, direction) + sizeof(struct vec3),
                   "four doubles");
    const struct axis_order xyz = axis_order(0, 1, 2);
    const double *origins[LANES], *ways[LANES];
    struct lanes way[4];
    packet->prepared = false;
    UNROLLED
    for (unsigned i = 0; i < LANES; i++) {
        origins[i] = &rays[i].origin.x;
        ways[i] = &rays[i].direction.x;
        packet->from[i] = rays[i].from;
    }
    lanes_of_rows(ways, way);
    UNROLLED
    for (unsigned axis = 0; axis < 3; axis++) {
        packet->d[axis] = way[axis];
        if (origin) packet->o[axis] = lanes_of(vec_component(origin, axis));
    }
    packet->t_max = way[3];
    if (!origin) lanes_transpose(origins, &xyz, packet->o);
}

/* The ranges, lane by lane. */
struct lane_ends {
    struct lanes low[3], high[3];
    struct lanes zero[3]; /* sum of 0 times all values: NaN if one is not finite */
};

static INLINED struct lane_ends no_ends(void)
{
    struct lanes all = lanes_of(INFINITE), none = lanes_of(-INFINITE), zero = lanes_of(0);
    return (struct lane_ends){{all, all, all}, {none, none, none}, {zero, zero, zero}};
}

static INLINED void widen(struct lane_ends *ends, const struct lanes v[3])
{
    UNROLLED
    for (unsigned axis = 0; axis < 3; axis++) {
        ends->low[axis] = lanes_smaller(v[axis], ends->low[axis]);
        ends->high[axis] = lanes_larger(v[axis], ends->high[axis]);
        ends->zero[axis] = lanes_fma(v[axis], lanes_of(0), ends->zero[axis]);
    }
}

/* Reduces the ranges over all lanes; returns whether all values are finite. */
static INLINED bool ends_of_lanes(const struct lane_ends *lanes, struct ends ends[3])
{
    UNROLLED
    for (unsigned axis = 0; axis < 3; axis++)
        ends[axis] =
            (struct ends){lanes_lowest(lanes->low[axis]), lanes_highest(lanes->high[axis])};
    struct lanes zero = lanes_add(lanes_add(lanes->zero[0], lanes->zero[1]), lanes->zero[2]);
    return lanes_at_most(zero, lanes_of(0)) == ALL_LANES;
}

static INLINED bool ends_of_point(const struct vec3 *point, struct ends ends[3])
{
    for (unsigned axis = 0; axis < 3; axis++)
        ends[axis] = (struct ends){vec_component(point, axis), vec_component(point, axis)};
    return vec_is_finite(*point);
}

static INLINED void load_bundle(struct bundle *bundle, const struct ray *rays)
{
    struct lane_ends o = no_ends(), d = no_ends();
    struct bundle_ends *ends = &bundle->ends;
    const struct vec3 *origin = bundle->one_origin ? &rays[0].origin : NULL;
    for (unsigned i = 0; i < bundle->count; i++) {
        struct packet *packet = bundle->packets[i];
        load_packet(packet, rays + (size_t)i * LANES, origin);
        widen(&d, packet->d);
        if (!origin) widen(&o, packet->o);
    }
    ends->finite = ends_of_lanes(&d, ends->d);
    ends->finite &= origin ? ends_of_point(origin, ends->o) : ends_of_lanes(&o, ends->o);
}

/* The largest magnitude, and the smallest if all have one sign, else a number <= 0. */
static INLINED double largest_end(struct ends ends)
{
    return larger_number(ends.high, -ends.low);
}

static INLINED double smallest_end(struct ends ends)
{
    return larger_number(ends.low, -ends.high);
}

/* Whether z is certainly the longest axis of all directions. */
static INLINED bool have_one_shear(const struct bundle *bundle)
{
    const struct bundle_ends *ends = &bundle->ends;
    const unsigned *axes = bundle->axes;
    double least = smallest_end(ends->d[axes[2]]);
    return largest_end(ends->d[axes[0]]) < least && largest_end(ends->d[axes[1]]) < least;
}

/*
 * Sets the slab of one axis. If rays go both ways, the range of directions is widened until the inverses of
 * both ends fit into float. That is safe: it is as if there were faster rays, too, which enter a box earlier,
 * and there is no bound on when rays leave it; so more boxes are met, none fewer. A ray's own component is
 * limited by not_too_slow().
 */
static INLINED void set_range(struct bundle *bundle, unsigned axis)
{
    const struct bundle_ends *ends = &bundle->ends;
    struct range_slab *range = &bundle->ranges[axis];
    double least = ends->d[axis].low, most = ends->d[axis].high;
    double center = bundle->bvh->center[axis];
    double first = ends->o[axis].low - center, last = ends->o[axis].high - center;
    float low = float_below(first - bundle->margin), high = float_above(last + bundle->margin);
    bool down = !range->both_ways && most < 0;
    double outward = range->both_ways ? bundle->wide : bundle->margin;
    float ray_low = float_below(first - outward), ray_high = float_above(last + outward);
    if (range->both_ways) {
        least = smaller_number(least, -FLOAT_COMPONENT_MIN);
        most = larger_number(most, FLOAT_COMPONENT_MIN);
    }
    struct node_planes planes = node_planes_of(axis, down);
    range->near_plane = planes.near;
    range->far_plane = planes.far;
    range->in_origin = down ? low : high;
    range->out_origin = down ? high : low;
    range->ray_in = down ? ray_low : ray_high;
    range->ray_out = down ? ray_high : ray_low;
    range->inverse_low = (float)(1 / most);
    range->inverse_high = (float)(1 / least);
}

/* Whether float suffices for all rays. */
static INLINED bool bundle_fits_floats(const struct bundle *bundle, double farthest_origin)
{
    double least = smallest_end(bundle->ends.d[bundle->axes[2]]);
    return float_slabs_do(farthest_origin, least, bundle->margin, bundle->bvh->reach);
}

static INLINED bool have_one_origin(const struct ray *rays, unsigned count)
{
    _Static_assert(offsetof(struct ray, direction) >=
                       offsetof(struct ray, origin) + sizeof(struct vec3),
                   "a fourth double to be read");
    lane_set same = 7;
    for (unsigned i = 1; i < count; i++)
        same &= quad_same(&rays[i].origin.x, &rays[0].origin.x);
    return same == 7;
}

/*
 * Sets up a bundle from the rays of bundle->count packets, for which bundle->packets has room. false: they
 * are not coherent enough.
 */
static INLINED bool bundle_of(const struct ray *rays, struct bundle *bundle)
{
    bundle->leaves = bundle->visits = 0;
    unsigned z = shear_of(&rays[0].direction).z;
    bundle->axes[0] = (z + 1) % 3;
    bundle->axes[1] = (z + 2) % 3;
    bundle->axes[2] = z;
    bundle->one_origin = have_one_origin(rays, bundle->count * LANES);
    load_bundle(bundle, rays);
    if (!bundle->ends.finite || !have_one_shear(bundle)) return false;
    for (unsigned axis = 0; axis < 3; axis++) {
        struct ends d = bundle->ends.d[axis];
        bundle->ranges[axis].both_ways = !(smallest_end(d) > FLOAT_COMPONENT_MIN);
    }
    /* The box of an empty slot is rejected because it ends before it begins; for rays that go both ways there
     * is no end. */
    if (bundle->ranges[z].both_ways) return false;
    /* Directions for which float suffices in any tree: planes and the last blocker are tested before the
     * first tree. */
    struct ends ahead = bundle->ends.d[z];
    return smallest_end(ahead) > FLOAT_DIRECTION_MIN && largest_end(ahead) < FLOAT_DIRECTION_MAX;
}

/* Called before the traversal of a tree, which must not be empty. false: float does not suffice for it. */
static INLINED bool bundle_enters(struct bundle *bundle, const struct bvh *bvh)
{
    double largest_origin = 0, distance = 0;
    bundle->bvh = bvh;
    for (unsigned axis = 0; axis < 3; axis++) {
        struct ends o = bundle->ends.o[axis];
        double center = bvh->center[axis];
        largest_origin = larger_number(largest_end(o), largest_origin);
        distance =
            larger_number(largest_end((struct ends){o.low - center, o.high - center}), distance);
    }
    bundle->margin = slab_margin(bvh, largest_origin);
    bundle->wide = slow_margin(bundle->margin, distance + bvh->reach);
    if (!bundle_fits_floats(bundle, distance)) return false;
    for (unsigned axis = 0; axis < 3; axis++)
        set_range(bundle, axis);
    return true;
}

/* A component of directions, with a magnitude of at least `least`. */
static INLINED struct lanes not_too_slow(struct lanes d, struct lanes least)
{
    struct lanes size = lanes_larger(lanes_abs(d), least);
    return lanes_choose(lanes_less(d, lanes_of(0)), lanes_negate(size), size);
}

/* A component smaller than this means that a ray hardly moves along the axis: float_slab_of(). */
static INLINED struct lanes slow_way(const struct packet *packet, const struct bundle *bundle)
{
    return lanes_mul(lanes_of(FLOAT_SLANT_MIN), lanes_abs(packet->d[bundle->axes[2]]));
}

/* Prepares the packet for tests of leaves, of which many packets meet none, and of planes. */
static INLINED void packet_prepare(struct packet *packet, const struct bundle *bundle)
{
    const unsigned *axes = bundle->axes;
    struct lanes slow = slow_way(packet, bundle), inverse[3];
    packet->prepared = true;
    UNROLLED
    for (unsigned i = 0; i < 3; i++) {
        packet->axes[i] = axes[i];
        packet->origin[i] = packet->o[axes[i]];
        struct lanes way = packet->d[i];
        if (bundle->ranges[i].both_ways) way = not_too_slow(way, slow);
        inverse[i] = lanes_div(lanes_of(1), way);
        packet->slabs[i].inverse = floats_of_lanes(inverse[i]);
    }
    packet->sx = lanes_div(packet->d[axes[0]], packet->d[axes[2]]);
    packet->sy = lanes_div(packet->d[axes[1]], packet->d[axes[2]]);
    packet->inverse_dz = inverse[axes[2]];
    packet->float_sx = floats_of_lanes(packet->sx);
    packet->float_sy = floats_of_lanes(packet->sy);
}

/* Sets the origins of struct float_slab for rays with different origins; see float_below() and float_above(). */
static INLINED void set_origins(struct lane_slab *slab, struct lanes origin, struct lanes margin)
{
    struct lanes low = lanes_sub(origin, margin), high = lanes_add(origin, margin);
    struct lanes outward = lanes_of(FLOAT_OUTWARD);
    lane_set down = floats_less(slab->inverse, floats_of(0));
    low = lanes_sub(low, lanes_mul(outward, lanes_abs(low)));
    high = lanes_add(high, lanes_mul(outward, lanes_abs(high)));
    slab->near_origin = floats_of_lanes(lanes_choose(down, low, high));
    slab->far_origin = floats_of_lanes(lanes_choose(down, high, low));
}

/* Called before the packet tests leaves of the tree that the bundle traverses. As float_slab_of() for a
 * single ray. */
static INLINED void packet_enters(struct packet *packet, const struct bundle *bundle)
{
    packet->bvh = bundle->bvh;
    if (bundle->one_origin) return;
    struct lanes slow = slow_way(packet, bundle);
    struct lanes margin = lanes_of(bundle->margin), wide = lanes_of(bundle->wide);
    UNROLLED
    for (unsigned i = 0; i < 3; i++) {
        lane_set is_slow = lanes_less(lanes_abs(packet->d[i]), slow);
        set_origins(&packet->slabs[i], lanes_sub(packet->o[i], lanes_of(bundle->bvh->center[i])),
                    lanes_choose(is_slow, wide, margin));
    }
}

/* The rays that start on a primitive. */
static INLINED lane_set rays_from(const struct packet *packet, uint32_t id)
{
    return equal_ids(packet->from, id);
}

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
    if (!set) return top;
    unsigned a = lowest_lane(set);
    lane_set rest = without_lowest(set);
    if (!without_lowest(rest)) { /* one or two */
        unsigned b = rest ? lowest_lane(rest) : a;
        bool swapped = at[b] < at[a];
        stack[top] = (struct packet_pending){node, swapped ? a : b, at[swapped ? a : b]};
        if (rest) top++;
        stack[top] = (struct packet_pending){node, swapped ? b : a, at[swapped ? b : a]};
        return top + 1;
    }
    unsigned end = top + (unsigned)__builtin_popcount(set);
    for (rest = set; rest; rest = without_lowest(rest)) {
        unsigned slot = lowest_lane(rest);
        struct floats here = floats_of(at[slot]);
        unsigned nearer =
            lanes_before(set, slot, floats_less(enter, here), floats_at_most(enter, here));
        stack[end - 1 - nearer] = (struct packet_pending){node, slot, at[slot]};
    }
    return end;
}

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
