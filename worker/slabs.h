/* Intersection of a ray with the eight boxes of a node, in double: for any ray and a scene of any size. */
#ifndef FARM_WORKER_SLABS_H
#define FARM_WORKER_SLABS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#include "worker/bvh.h"
#include "worker/lanes.h"
#include "worker/shape.h"

/*
 * A distance to a plane, (bound - origin) * (1 / d), is rounded three times: its relative error is at most
 * gamma3 = 3 u / (1 - 3 u). Comparing two of them is safe if the far one is enlarged by 1 + 2 gamma3 (T. Ize,
 * "Robust BVH Ray Traversal", JCGT 2(2), 2013). Here 1 / d is enlarged instead, so there is one more
 * rounding, and that of the constant.
 */
#define GAMMA4       (4 * UNIT_ROUNDOFF / (1 - 4 * UNIT_ROUNDOFF))
#define FAR_WIDENING (1 + 4 * GAMMA4)

/*
 * The boxes grow by this many u of R, the sum of the largest numbers involved: |o|, the tree's centre and the
 * reach of the root's box. Every ray that hits a primitive in a box then meets the box:
 *
 * Where a test accepts a crossing, the line meets the primitive itself: tests of triangles, spheres, discs
 * and boxes make no rounding errors, a cone's treats what is within 2^-88 R as one. So the line meets a bound
 * on the primitive's coordinates, up to the rounding of the bound. That is less than 1 u R for triangles and
 * boxes (none) and spheres (c +- r), and 12 u R for discs and cones (the axis' direction errs by 4 u, the
 * extents by 5 u more, the sum by 1 u; apex - base by 1 u). The bounds of pieces of cones err by 5 u R more.
 *
 * The reported t, with an error of at most 10 u, only decides what is nearer: a box that begins beyond it is
 * skipped. A ray that leaves a primitive starts within 8 u R of its box (surface.c: 4 u for standing off, 4 u
 * for being drawn in from a corner), hence inside the grown box. Bound minus centre, origin minus centre and
 * the sum with this margin: 3 u R. The total is less than 32 u R; the errors of the slabs' quotients are
 * covered by FAR_WIDENING. The factor of 2 is for terms of second order, and costs nothing beside the outward
 * rounding of boxes to float.
 */
#define TEST_ERROR (64 * UNIT_ROUNDOFF)

/* The range between the two planes of an axis. */
struct slab {
    size_t near_plane, far_plane; /* offsets in struct bvh_node */
    double near_origin, far_origin;
    double near_inverse, far_inverse;
};

struct slabs {
    struct slab x, y, z;
    /* Empty slots would count as met: no component of the direction has an inverse, or the margin is
     * infinite. */
    bool blind;
};

/* 1 / d; NaN if that overflows although d is not zero, so that the axis decides nothing. */
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

/* How much the boxes grow for rays whose origins have no coordinate larger than this. */
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

/* slab_in(), slab_out(): distances to the near and to the far planes. */
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
 * The boxes of a node that the ray meets within 0 <= t <= limit; *enter is where it enters them. A NaN, from
 * an origin in a plane that the ray is parallel to, loses the comparisons, so the planes of a box belong to
 * it.
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
