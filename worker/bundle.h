/* Packets and bundles of rays, see worker/packet.h, and what is computed of them before they meet any box. */
#ifndef FARM_WORKER_BUNDLE_H
#define FARM_WORKER_BUNDLE_H

#include "worker/float_slabs.h"
#include "worker/lanes3.h"
#include "worker/packet.h"
#include "worker/triangle.h"

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

static INLINED struct lanes lanes_largest(struct lanes a, struct lanes b, struct lanes c)
{
    return lanes_larger(lanes_larger(a, b), c);
}

static INLINED struct lanes lanes_least(struct lanes a, struct lanes b, struct lanes c)
{
    return lanes_smaller(lanes_smaller(a, b), c);
}

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

#endif
