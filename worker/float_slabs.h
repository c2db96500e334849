/*
 * Intersection of a ray with the eight boxes of a node, in float: a quarter of the work of worker/slabs.h.
 * Some boxes count as met although the ray passes them. The distance from the box may be some 2^-24 of the
 * distances of the ray's origin and of the box from the tree's centre, plus 2^-21 of the way to it; on an
 * axis along which the ray hardly moves, some 2^-28 of the way to the farthest box. No box that is met in
 * double is missed.
 */
#ifndef FARM_WORKER_FLOAT_SLABS_H
#define FARM_WORKER_FLOAT_SLABS_H

#include "worker/floats.h"
#include "worker/slabs.h"

/* Unit roundoff of float. */
#define FLOAT_ROUNDOFF 0x1p-24

/*
 * A distance to a plane, (bound - origin) I with I = 1 / d, is rounded three times: in the difference, in I
 * and in the product. Before that the origin, with the margin of worker/slabs.h, is rounded away from the box
 * (float_above(), float_below()). Two distances are compared, one of which may be the limit. The far one is
 * enlarged by this factor, in which 7 of its 8 roundings are used, one of them its own. The slack is relative
 * to the distance, however large the scene is: boxes near the ray's origin do not grow because of what lies
 * far away.
 */
#define FLOAT_WIDENING (1 + 8 * FLOAT_ROUNDOFF)

/*
 * An axis along which the ray hardly moves is treated as if the direction had FLOAT_SLANT_MIN of its largest
 * component there, and on it the boxes also grow by FLOAT_MARGIN of the way to the farthest plane. At the
 * last box, at t = way / largest, this slant makes less than 2^-29 of the way, half of what the boxes grow
 * by. So a ray that is inside a slab enters it before 0. It is then inside by the other half, so it leaves it
 * at no less than 2^-29 way * 2^30 / largest, which is beyond the last box. The way is that to the grown
 * boxes.
 */
#define FLOAT_SLANT_MIN 0x1p-30
#define FLOAT_MARGIN    0x1p-28

/*
 * Ranges in which neither overflow nor underflow matters. The boxes grow by at least 2^-97, by the margin
 * alone, which is 2^-137 in units of t; a result that is rounded to a subnormal number errs by 2^-150.
 * Distances are less than 2^52 2^70. For a bundle, the components along an axis form a range. It ends at no
 * less than FLOAT_COMPONENT_MIN, or is widened to that if rays go both ways (set_range()).
 */
#define FLOAT_SIZE_MIN      0x1p-50
#define FLOAT_SIZE_MAX      0x1p50
#define FLOAT_DIRECTION_MIN 0x1p-40
#define FLOAT_DIRECTION_MAX 0x1p40
#define FLOAT_COMPONENT_MIN 0x1p-60

/*
 * For an origin farther from the tree's centre than this many times the tree's reach, rounding in float would
 * enlarge every box by as much as the last bits of the tree's coordinates; double has more bits.
 */
#define FLOAT_DISTANCE_MAX 64

/*
 * Upper and lower bounds of x in float. x is moved by 2^-24 of itself, as much as rounding to nearest can
 * move it back, and a little more: the moved number is what is rounded, which may add 2^-48 of x, and the sum
 * has an error of 2^-53. A subnormal number has an absolute error of 2^-150 instead, for which the margin has
 * room.
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

/*
 * How much boxes grow on an axis along which a ray hardly moves. margin: how much they grow on other axes;
 * way: the distance of the farthest plane from the ray's origin on any axis.
 */
static inline double slow_margin(double margin, double way)
{
    return margin + FLOAT_MARGIN * (way + margin);
}

/* The range between the two planes of an axis; distances are (plane - origin) * inverse. */
struct float_slab {
    size_t near_plane, far_plane; /* offsets in struct bvh_node */
    struct floats near_origin, far_origin, inverse;
};

struct float_slabs {
    struct float_slab x, y, z;
};

static INLINED struct float_slab float_slab_of(const struct bvh *bvh, const struct ray *ray,
                                               unsigned axis, double margin, double wide,
                                               double least)
{
    double origin = vec_component(&ray->origin, axis) - bvh->center[axis];
    double direction = vec_component(&ray->direction, axis), size = fabs(direction);
    double outward = size < least ? wide : margin;
    double inverse = 1 / copysign(larger_number(size, least), direction);
    bool down = signbit(direction);
    struct node_planes planes = node_planes_of(axis, down);
    float low = float_below(origin - outward), high = float_above(origin + outward);
    return (struct float_slab){.near_plane = planes.near,
                               .far_plane = planes.far,
                               .near_origin = floats_of(down ? low : high),
                               .far_origin = floats_of(down ? high : low),
                               .inverse = floats_of((float)inverse)};
}

/*
 * Whether float suffices for a ray, or for several whose directions are no larger and whose origins are no
 * farther from the tree's centre on any axis.
 */
static inline bool float_slabs_do(double farthest_origin, double largest_direction, double margin,
                                  double reach)
{
    double size = margin * (1 / TEST_ERROR);
    return size > FLOAT_SIZE_MIN && size < FLOAT_SIZE_MAX &&
           largest_direction > FLOAT_DIRECTION_MIN && largest_direction < FLOAT_DIRECTION_MAX &&
           farthest_origin < FLOAT_DISTANCE_MAX * reach;
}

static INLINED bool float_slabs_of(const struct bvh *bvh, const struct ray *ray,
                                   struct float_slabs *slabs)
{
    double margin = slab_margin(bvh, vec_largest(ray->origin));
    double direction = vec_largest(ray->direction);
    const struct vec3 center = {bvh->center[0], bvh->center[1], bvh->center[2]};
    double distance = vec_largest(vec_sub(ray->origin, center));
    if (!float_slabs_do(distance, direction, margin, bvh->reach)) return false;
    double least = FLOAT_SLANT_MIN * direction, wide = slow_margin(margin, distance + bvh->reach);
    slabs->x = float_slab_of(bvh, ray, 0, margin, wide, least);
    slabs->y = float_slab_of(bvh, ray, 1, margin, wide, least);
    slabs->z = float_slab_of(bvh, ray, 2, margin, wide, least);
    return true;
}

/* An upper bound in float on distances within the limit. */
static inline float float_slab_limit(double limit)
{
    return (float)(limit * FLOAT_WIDENING);
}

static inline struct floats node_floats(const struct bvh_node *node, size_t offset)
{
    return floats_load((const void *)((const char *)node + offset));
}

/* float_slab_in(), float_slab_out(): distances to the near and to the far planes. */
static INLINED struct floats float_slab_in(const struct float_slab *slab,
                                           const struct bvh_node *node)
{
    return floats_mul(floats_sub(node_floats(node, slab->near_plane), slab->near_origin),
                      slab->inverse);
}

static INLINED struct floats float_slab_out(const struct float_slab *slab,
                                            const struct bvh_node *node)
{
    return floats_mul(floats_sub(node_floats(node, slab->far_plane), slab->far_origin),
                      slab->inverse);
}

/* slabs_meet() in float; limit: from float_slab_limit(). */
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
    return floats_at_most(near, floats_mul(far, floats_of((float)FLOAT_WIDENING)));
}

#endif
