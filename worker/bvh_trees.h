/*
 * Decides how many trees a scene gets, where their centres are, and which primitive is in which tree.
 *
 * Boxes are floats relative to the centre of a tree. Far from the centre floats are coarse: at a distance of 1e6 their
 * spacing is 1/16, and many smaller triangles of a mesh would have the same box. So primitives that are crowded and too
 * fine for the floats at their place get a tree of their own, with a centre in their midst. Most scenes have one tree.
 */
#ifndef FARM_WORKER_BVH_TREES_H
#define FARM_WORKER_BVH_TREES_H

#include <stdint.h>

#include "common/scene.h"
#include "common/thread_pool.h"

/* Each tree costs a pass over some primitives while trees are built, and a box test for every ray; eight boxes cost
 * as much as one node. */
#define TREES_MAX 32

struct bvh_trees {
    uint32_t count;
    double center[TREES_MAX][3];
    /* The tree of each bounded primitive, indexed as in bounded_id(); owned; NULL: all are in tree 0. */
    uint8_t *tree_of;
};

/* The tree of a bounded primitive, and the centre of this tree, [3]. */
static inline uint32_t tree_of_bounded(const struct bvh_trees *trees, uint64_t index)
{
    return trees->tree_of ? trees->tree_of[index] : 0;
}

static inline const double *center_of_bounded(const struct bvh_trees *trees, uint64_t index)
{
    return trees->center[tree_of_bounded(trees, index)];
}

/* For a scene with a bounded primitive. No tree is empty. The result does not depend on the pool, which may be NULL.
 * *trees: free it with bvh_trees_free(). */
void bvh_trees_find(const struct scene *scene, struct thread_pool *pool, struct bvh_trees *trees);
void bvh_trees_free(struct bvh_trees *trees);

#endif
