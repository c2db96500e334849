/*
 * How many trees a scene gets, where their centres are, and which primitive is in which.
 *
 * Boxes are floats that count from a tree's centre. Far from that, floats are coarse: at 1e6 they are 1/16 apart, and
 * of a mesh with smaller triangles whole heaps would have the same box. So what is too fine for floats where it
 * stands, and crowded, gets a tree of its own, with a centre in its midst. Most scenes have one tree.
 */
#ifndef FARM_WORKER_BVH_TREES_H
#define FARM_WORKER_BVH_TREES_H

#include <stdint.h>

#include "common/crew.h"
#include "common/scene.h"

/* Each more is a look more at some primitives while trees are built, and a box for every ray; eight boxes cost what one
 * node does. */
#define TREES_MAX 32

struct bvh_trees {
    uint32_t count;
    double center[TREES_MAX][3];
    uint8_t *
        tree_of; /* of each bounded primitive, in order of kind and index; owned; NULL: all are in the first */
};

/* Primitives that a tree can hold: all but planes. */
uint64_t bounded_count(const struct scene *scene);

/* A bounded primitive, counted in order of kind and index, and the one behind it, of which there has to be one. */
uint32_t bounded_id(const struct scene *scene, uint64_t index);
uint32_t bounded_id_after(const struct scene *scene, uint32_t id);

/* Those of the kinds before one. */
uint64_t bounded_before(const struct scene *scene, enum primitive_kind kind);

/* The tree that it is in, and the centre of that, [3]. */
static inline uint32_t tree_of_bounded(const struct bvh_trees *trees, uint64_t index)
{
    return trees->tree_of ? trees->tree_of[index] : 0;
}

static inline const double *center_of_bounded(const struct bvh_trees *trees, uint64_t index)
{
    return trees->center[tree_of_bounded(trees, index)];
}

/* Of a scene that has something bounded. No tree is empty. The same for any crew, which may be NULL. */
void bvh_trees_find(const struct scene *scene, struct crew *crew, struct bvh_trees *trees);
void bvh_trees_free(struct bvh_trees *trees);

#endif
