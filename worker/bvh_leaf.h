/* What stands in the leaves of the tree, while it is built. */
#ifndef FARM_WORKER_BVH_LEAF_H
#define FARM_WORKER_BVH_LEAF_H

#include "worker/bvh.h"
#include "worker/bvh_split.h"

/* Writes what stands behind `count` entries of a leaf; returns how many entries' bytes that takes. */
uint32_t bvh_write_corners(const struct scene *scene, const double center[3],
                           struct bvh_leaf *leaves, uint32_t count);

/* Entries of all leaves, and the room that they take with what stands behind them, in entries. */
struct leaf_room {
    uint64_t entries, room;
};

/* Writes the leaves of bvh_build_nodes() in order of their nodes, which learn where they stand. Pieces
 * of the same primitive become one entry of a leaf. */
struct leaf_room bvh_write_leaves(const struct whole *whole, struct bvh_node *nodes,
                                  uint32_t node_count, struct bvh_leaf *leaves);

#endif
