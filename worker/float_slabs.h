/*
 * A ray and the eight boxes of a node, in float: a quarter of the work of worker/slabs.h. Boxes are
 * met that the ray passes by at a distance of some 2^-22 of its coordinates, never fewer than are met
 * in double.
 */
#ifndef FARM_WORKER_FLOAT_SLABS_H
#define FARM_WORKER_FLOAT_SLABS_H

#include "worker/floats.h"
#include "worker/slabs.h"

/* Of float. */
#define FLOAT_ROUNDOFF 0x1p-24

/*
 * A distance to a plane, (bound - origin) * (1 / d), is rounded three times, in the difference, the
 * inverse and the product, beside the inverse's rounding in double: by less than this in all. The
 * far one is enlarged by twice that, as in worker/slabs.h; 6 roundings of 8 are used.
 */
#define FLOAT_GAMMA    (4 * FLOAT_ROUNDOFF / (1 - 4 * FLOAT_ROUNDOFF))
#define FLOAT_WIDENING (1 + 2 * FLOAT_GAMMA)

/*
 * Where neither overflow nor underflow matters. The margin of worker/slabs.h is at least 2^-97 then,
 * and 2^-137 in units of t; a product that is rounded to a subnormal number errs by 2^-150. Distances
 * along an axis that the ray hardly follows are below 2^62 / 2^-60.
 */
#define FLOAT_SIZE_MIN      0x1p-50
#define FLOAT_SIZE_MAX      0x1p60
#define FLOAT_DIRECTION_MIN 0x1p-40
#define FLOAT_DIRECTION_MAX 0x1p40
#define FLOAT_COMPONENT_MIN 0x1p-60

/* An origin that is so many times further away than the tree is large would make every box as large
 * as the tree's last bits; double has bits left for that. */
#define FLOAT_DISTANCE_MAX 64

/*
 * Not below x, and not above: x is moved by 2^-24 of itself, as much as rounding to nearest can move
 * it back, and a little more, because it is the moved number that is rounded, which may be another
 * 2^-48 of x, and the sum, which is 2^-53. A subnormal number errs by 2^-150 in place of that; the
 * margin has more to spare.
 */
#define FLOAT_OUTWARD (FLOAT_ROUNDOFF * (1 + 0x1p-20))

static inline float float_above(double x)
{
    return (float)(x + FLOAT_OUTWARD * fabs(x));
}

static inline float float_below(double x)
{
    return (float)(x - FLOAT_OUTWARD * fabs(x));
}

static INLINED struct floats floats_above(struct lanes x)
{
    return floats_of_lanes(lanes_add(x, lanes_mul(lanes_of(FLOAT_OUTWARD), lanes_abs(x))));
}

static INLINED struct floats floats_below(struct lanes x)
{
    return floats_of_lanes(lanes_sub(x, lanes_mul(lanes_of(FLOAT_OUTWARD), lanes_abs(x))));
}

/* Between the two planes of an axis. */
struct float_slab {
    size_t near_plane, far_plane; /* offsets in struct bvh_node */
    float near_origin, far_origin;
    float near_inverse, far_inverse;
};

struct float_slabs {
    struct float_slab x, y, z;
};

/* 1 / d; NaN, so that the axis decides nothing, where the ray hardly goes along it. */
static inline double float_slab_inverse(double d)
{
    return fabs(d) < FLOAT_COMPONENT_MIN && d != 0 ? (double)NAN : 1 / d;
}

static INLINED struct float_slab float_slab_of(const struct bvh *bvh, const struct ray *ray,
                                               unsigned axis, double margin)
{
    double origin = vec_component(&ray->origin, axis) - bvh->center[axis];
    double direction = vec_component(&ray->direction, axis);
    double inverse = float_slab_inverse(direction);
    size_t min = offsetof(struct bvh_node, min) + axis * (BVH_WIDTH * sizeof(float));
    size_t max = offsetof(struct bvh_node, max) + axis * (BVH_WIDTH * sizeof(float));
    bool down = signbit(direction);
    float low = float_below(origin - margin), high = float_above(origin + margin);
    return (struct float_slab){.near_plane = down ? max : min,
                               .far_plane = down ? min : max,
                               .near_origin = down ? low : high,
                               .far_origin = down ? high : low,
                               .near_inverse = (float)inverse,
                               .far_inverse = (float)(inverse * FLOAT_WIDENING)};
}

/* Whether float does for a ray, or for some that are not larger. */
static inline bool float_slabs_do(double largest_origin, double largest_direction, double margin,
                                  double reach)
{
    double size = margin * (1 / TEST_ERROR);
    return size > FLOAT_SIZE_MIN && size < FLOAT_SIZE_MAX &&
           largest_direction > FLOAT_DIRECTION_MIN && largest_direction < FLOAT_DIRECTION_MAX &&
           largest_origin < FLOAT_DISTANCE_MAX * reach;
}

static INLINED bool float_slabs_of(const struct bvh *bvh, const struct ray *ray,
                                   struct float_slabs *slabs)
{
    double origin = largest_component(ray->origin), margin = slab_margin(bvh, origin);
    double direction = largest_component(ray->direction);
    if (!float_slabs_do(origin, direction, margin, root_reach(bvh))) return false;
    *slabs =
        (struct float_slabs){float_slab_of(bvh, ray, 0, margin), float_slab_of(bvh, ray, 1, margin),
                             float_slab_of(bvh, ray, 2, margin)};
    return true;
}

/* What no distance within the limit is rounded beyond. */
static inline float float_slab_limit(double limit)
{
    return (float)(limit * FLOAT_WIDENING);
}

static inline struct floats node_floats(const struct bvh_node *node, size_t offset)
{
    return floats_load((const void *)((const char *)node + offset));
}

/* Distances to the near and to the far planes. */
static INLINED struct floats float_slab_in(const struct float_slab *slab,
                                           const struct bvh_node *node)
{
    struct floats way =
        floats_sub(node_floats(node, slab->near_plane), floats_of(slab->near_origin));
    return floats_mul(way, floats_of(slab->near_inverse));
}

static INLINED struct floats float_slab_out(const struct float_slab *slab,
                                            const struct bvh_node *node)
{
    struct floats way = floats_sub(node_floats(node, slab->far_plane), floats_of(slab->far_origin));
    return floats_mul(way, floats_of(slab->far_inverse));
}

/* slabs_meet(), of a float_slab_limit(). */
static INLINED lane_set float_slabs_meet(const struct float_slabs *slabs,
                                         const struct bvh_node *node, float limit,
                                         struct floats *enter)
{
    struct floats near = floats_larger(float_slab_in(&slabs->x, node), floats_of(0));
    struct floats far = floats_smaller(float_slab_out(&slabs->x, node), floats_of(limit));
    near = floats_larger(float_slab_in(&slabs->y, node), near);
    far = floats_smaller(float_slab_out(&slabs->y, node), far);
    near = floats_larger(float_slab_in(&slabs->z, node), near);
    far = floats_smaller(float_slab_out(&slabs->z, node), far);
    *enter = near;
    return floats_at_most(near, far);
}

#endif
