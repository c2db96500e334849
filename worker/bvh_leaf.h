/* Writes the leaves of a tree during its construction. */
#ifndef FARM_WORKER_BVH_LEAF_H
#define FARM_WORKER_BVH_LEAF_H

#include "worker/bvh.h"
#include "worker/bvh_item.h"

/* Writes the vertices (struct bvh_corners) of a leaf after its `count` entries; returns their size, as a number of
 * entries. */
uint32_t bvh_write_corners(const struct scene *scene, const double center[3],
                           struct bvh_leaf *leaves, uint32_t count);

/* Entries of all leaves, and the size of the leaves with their vertices, as a number of entries. */
struct leaf_room {
    uint64_t entries, room;
};

/* Writes the leaves of bvh_build_nodes() in the order of their nodes, which get their positions. Pieces of the same
 * primitive become one entry of a leaf. Fatal if the leaves take more than UINT32_MAX entries. */
struct leaf_room bvh_write_leaves(const struct bvh_input *input, struct bvh_node *nodes,
                                  uint32_t node_count, struct bvh_leaf *leaves);

#endif
