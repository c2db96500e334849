/* A ray and the eight boxes of a node, in double: whatever the ray and however large the scene. */
#ifndef FARM_WORKER_SLABS_H
#define FARM_WORKER_SLABS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#include "worker/bvh.h"
#include "worker/lanes.h"
#include "worker/shape.h"

/*
 * A distance to a plane, (bound - origin) * (1 / d), is rounded three times: its relative error is
 * at most gamma3 = 3 u / (1 - 3 u). Comparing two of them is safe when the far one is enlarged by
 * 1 + 2 gamma3 (T. Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013); one more rounding, and that
 * of the constant, because 1 / d is what is enlarged.
 */
#define GAMMA4       (4 * UNIT_ROUNDOFF / (1 - 4 * UNIT_ROUNDOFF))
#define FAR_WIDENING (1 + 4 * GAMMA4)

/*
 * The boxes grow by this many u of the largest numbers involved, |o|, the tree's centre and the
 * reach of the root's box (R together), so that a box is entered by every ray on which a primitive
 * in it is met:
 *
 * Where a test accepts a crossing, the line meets the primitive itself: the decisions of triangles,
 * spheres, discs and boxes have no rounding error, a cone's are closed by 2^-88 of R. So does a
 * bound on the primitive's coordinates, but for its own roundings, which are less than 1 u R for
 * triangles and boxes (none) and spheres (c +- r), 12 u R for discs and cones (the axis' direction
 * errs by 4 u, the extents by 5 u more, the sum by 1 u; apex - base by 1 u). The reported t, which
 * is at most 10 u off, decides only what is nearer: a box is left out when it begins beyond that.
 * A ray that leaves a primitive starts within 8 u R of its box (surface.c: 4 u for standing off, 4 u where it is drawn
 * in from a corner), and it is inside a grown box. Bound minus centre, origin minus centre and the sum with this
 * margin: 3 u R. Together less than 32 u R; the slabs' quotients are the business of FAR_WIDENING. The factor of 2 is
 * for terms of second order and costs nothing beside the boxes' outward rounding to float.
 */
#define TEST_ERROR (64 * UNIT_ROUNDOFF)

/* Between the two planes of an axis. */
struct slab {
    size_t near_plane, far_plane; /* offsets in struct bvh_node */
    double near_origin, far_origin;
    double near_inverse, far_inverse;
};

struct slabs {
    struct slab x, y, z;
    /* The boxes of empty slots are met, too: no component of the direction has an inverse, or the margin is
     * infinite. */
    bool blind;
};

/* 1 / d; NaN, so that the axis decides nothing, when that overflows although d is not zero. */
static inline double slab_inverse(double d)
{
    double inverse = 1 / d;
    return isinf(inverse) && d != 0 ? (double)NAN : inverse;
}

static INLINED struct slab slab_of(const struct bvh *bvh, const struct ray *ray, unsigned axis,
                                   double margin)
{
    double origin = vec_component(&ray->origin, axis) - bvh->center[axis];
    double direction = vec_component(&ray->direction, axis), inverse = slab_inverse(direction);
    bool down = signbit(direction);
    struct node_planes planes = node_planes_of(axis, down);
    double outward = down ? -margin : margin;
    return (struct slab){.near_plane = planes.near,
                         .far_plane = planes.far,
                         .near_origin = origin + outward,
                         .far_origin = origin - outward,
                         .near_inverse = inverse,
                         .far_inverse = inverse * FAR_WIDENING};
}

/* By how much the boxes grow for rays whose origins' coordinates are not larger than this. */
static INLINED double slab_margin(const struct bvh *bvh, double largest_origin)
{
    return TEST_ERROR * (largest_origin + bvh->size);
}

static INLINED struct slabs slabs_of(const struct bvh *bvh, const struct ray *ray)
{
    double margin = slab_margin(bvh, vec_largest(ray->origin));
    return (struct slabs){slab_of(bvh, ray, 0, margin), slab_of(bvh, ray, 1, margin),
                          slab_of(bvh, ray, 2, margin),
                          isinf(1 / vec_largest(ray->direction)) || isinf(margin)};
}

static inline struct lanes node_planes(const struct bvh_node *node, size_t offset)
{
    return lanes_load_floats((const void *)((const char *)node + offset));
}

static inline lane_set occupied(const struct bvh_node *node)
{
    return lanes_at_most(lanes_load_floats(node->min[0]), lanes_load_floats(node->max[0]));
}

/* Distances to the near and to the far planes. */
static INLINED struct lanes slab_in(const struct slab *slab, const struct bvh_node *node)
{
    struct lanes way = lanes_sub(node_planes(node, slab->near_plane), lanes_of(slab->near_origin));
    return lanes_mul(way, lanes_of(slab->near_inverse));
}

static INLINED struct lanes slab_out(const struct slab *slab, const struct bvh_node *node)
{
    struct lanes way = lanes_sub(node_planes(node, slab->far_plane), lanes_of(slab->far_origin));
    return lanes_mul(way, lanes_of(slab->far_inverse));
}

/*
 * In which of a node's boxes the ray is somewhere in 0 <= t <= limit; *enter is where that begins.
 * A NaN, from an origin in a plane that the ray is parallel to, loses the comparisons: the slab is
 * closed.
 */
static INLINED lane_set slabs_meet(const struct slabs *slabs, const struct bvh_node *node,
                                   double limit, struct lanes *enter)
{
    struct lanes near = lanes_larger(slab_in(&slabs->x, node), lanes_of(0));
    struct lanes far = lanes_smaller(slab_out(&slabs->x, node), lanes_of(limit));
    near = lanes_larger(slab_in(&slabs->y, node), near);
    far = lanes_smaller(slab_out(&slabs->y, node), far);
    near = lanes_larger(slab_in(&slabs->z, node), near);
    far = lanes_smaller(slab_out(&slabs->z, node), far);
    *enter = near;
    lane_set met = lanes_at_most(near, far);
    return __builtin_expect(slabs->blind, 0) ? met & occupied(node) : met;
}

#endif
