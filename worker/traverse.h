/* How a ray walks through the tree: nearest() and occluded() differ in what they do at the leaves.
 */
#ifndef FARM_WORKER_TRAVERSE_H
#define FARM_WORKER_TRAVERSE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#include "worker/bvh.h"
#include "worker/shape.h"

/*
 * A distance to a plane, (bound - origin) * (1 / d), is rounded three times: its relative error is
 * at most gamma3 = 3 u / (1 - 3 u). Comparing two of them is safe when the far one is enlarged by
 * 1 + 2 gamma3 (T. Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013).
 */
#define GAMMA3       (3 * UNIT_ROUNDOFF / (1 - 3 * UNIT_ROUNDOFF))
#define FAR_WIDENING (1 + 2 * GAMMA3)

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
 * A ray that leaves a primitive starts within 4 u R of it (surface.c), and it is inside a grown
 * box. Bound minus centre, origin minus centre and the sum with this margin: 3 u R. Together less
 * than 32 u R; the slabs' quotients are the business of FAR_WIDENING. The factor of 2 is for terms
 * of second order and costs nothing beside the boxes' outward rounding to float.
 */
#define TEST_ERROR (64 * UNIT_ROUNDOFF)

struct slabs {
    size_t near_plane[3], far_plane[3]; /* offsets in struct bvh_node, of the first child's */
    double near_origin[3], far_origin[3];
    double inverse[3];
};

/* The largest coordinate of the root's box. */
static inline double bvh_reach(const struct bvh *bvh)
{
    double reach = 0;
    for (unsigned axis = 0; axis < 3; axis++) {
        reach = larger(reach, fabs((double)bvh->min[axis]));
        reach = larger(reach, fabs((double)bvh->max[axis]));
    }
    return reach;
}

/* 1 / d; NaN, so that the axis decides nothing, when that overflows although d is not zero. */
static inline double slab_inverse(double d)
{
    double inverse = 1 / d;
    return isinf(inverse) && d != 0 ? (double)NAN : inverse;
}

static inline struct slabs slabs_of(const struct ray *ray, const struct bvh *bvh)
{
    const double *center = bvh->center;
    struct slabs slabs;
    double margin = largest_component(ray->origin);
    margin += larger(fabs(center[0]), larger(fabs(center[1]), fabs(center[2])));
    margin = TEST_ERROR * (margin + bvh_reach(bvh));
    for (unsigned axis = 0; axis < 3; axis++) {
        double origin = vec_component(&ray->origin, axis) - center[axis];
        double direction = vec_component(&ray->direction, axis);
        size_t min = offsetof(struct bvh_node, min) + axis * sizeof(float[BVH_WIDTH]);
        size_t max = offsetof(struct bvh_node, max) + axis * sizeof(float[BVH_WIDTH]);
        bool down = signbit(direction);
        slabs.near_plane[axis] = down ? max : min;
        slabs.far_plane[axis] = down ? min : max;
        slabs.near_origin[axis] = down ? origin - margin : origin + margin;
        slabs.far_origin[axis] = down ? origin + margin : origin - margin;
        slabs.inverse[axis] = slab_inverse(direction);
    }
    return slabs;
}

static inline double node_plane(const struct bvh_node *node, size_t offset, unsigned child)
{
    return (double)((const float *)(const void *)((const char *)node + offset))[child];
}

/*
 * Whether the ray is in the child's box somewhere in 0 <= t <= limit; *enter is where that begins. A NaN,
 * from an origin in a plane that the ray is parallel to, loses the comparisons: the slab is closed.
 */
static inline bool slabs_meet(const struct slabs *slabs, const struct bvh_node *node,
                              unsigned child, double limit, double *enter)
{
    double near = 0, far = INFINITE;
    for (unsigned axis = 0; axis < 3; axis++) {
        double in = (node_plane(node, slabs->near_plane[axis], child) - slabs->near_origin[axis]) *
                    slabs->inverse[axis];
        double out = (node_plane(node, slabs->far_plane[axis], child) - slabs->far_origin[axis]) *
                     slabs->inverse[axis];
        near = in > near ? in : near;
        far = out < far ? out : far;
    }
    *enter = near;
    return near <= far * FAR_WIDENING && near <= limit;
}

/* Looks at the primitives of a leaf; may lower *limit; false ends the walk. */
typedef bool visit_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                        double *limit);

/* A node, or a leaf where count is not 0, to go to from t = enter on. */
struct place {
    double enter;
    uint32_t child, count;
};

/* Puts the children that the ray reaches on the stack, the nearest on top. */
static inline unsigned push_children(const struct slabs *slabs, const struct bvh_node *node,
                                     double limit, struct place *stack, unsigned top)
{
    unsigned bottom = top;
    for (unsigned i = 0; i < BVH_WIDTH; i++) {
        struct place place = {.child = node->child[i], .count = node->count[i]};
        if (place.child == 0 && place.count == 0) break; /* where no axis decides, it is met */
        if (!slabs_meet(slabs, node, i, limit, &place.enter)) continue;
        unsigned at = top++;
        for (; at > bottom && stack[at - 1].enter < place.enter; at--)
            stack[at] = stack[at - 1];
        stack[at] = place;
    }
    return top;
}

/*
 * Visits all leaves that the ray reaches at t <= limit, near ones first. Equal distances are
 * visited, too: which of two equally near primitives wins must not depend on the tree.
 */
static inline __attribute__((always_inline)) void traverse(const struct bvh *bvh,
                                                           const struct ray *ray, double limit,
                                                           visit_leaf *visit, void *context)
{
    if (bvh->node_count == 0) return;
    const struct bvh_node *nodes = bvh_nodes(bvh);
    const struct bvh_leaf *leaves = bvh_leaves(bvh);
    struct slabs slabs = slabs_of(ray, bvh);
    struct place stack[BVH_STACK];
    unsigned top = push_children(&slabs, nodes, limit, stack, 0);
    while (top > 0) {
        const struct place *place = &stack[--top];
        if (!(place->enter <= limit)) continue;
        if (place->count == 0)
            top = push_children(&slabs, &nodes[place->child], limit, stack, top);
        else if (!visit(context, leaves + place->child, place->count, &limit))
            return;
    }
}

#endif
