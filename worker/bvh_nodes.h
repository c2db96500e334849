/* The nodes of the tree, while it is built. */
#ifndef FARM_WORKER_BVH_NODES_H
#define FARM_WORKER_BVH_NODES_H

#include "worker/bvh.h"
#include "worker/bvh_split.h"

/* A leaf of more weight is always split, whatever the heuristic says. */
#define LEAF_WEIGHT_MAX (2 * PACK)
_Static_assert(LEAF_WEIGHT_MAX >= BVH_WIDTH, "bvh_nodes_bound()");

/* All nodes over so many items are built by one thread: some milliseconds. */
#define SUBTREE_ITEMS 4096u

/*
 * Of items of so much weight, and as many pieces of triangles as there is room for, which weigh 1 each.
 * A node either has eight children, or all of them are leaves and it holds more than LEAF_WEIGHT_MAX in
 * weight, unless it is the only one. With n nodes of the one sort and m of the other, n has 8 n = n + m
 * - 1 + leaves, and the weight is at least leaves + 9 m, as LEAF_WEIGHT_MAX is no less than 8: n + m is
 * largest for m = 0, a seventh of it.
 */
static inline uint64_t bvh_nodes_bound(uint64_t weight)
{
    return weight == 0 ? 0 : weight / (BVH_WIDTH - 1) + 1;
}

/* A node without children, and the box of one of them, rounded outward already. */
void bvh_empty_node(struct bvh_node *node);
void bvh_fill_slot(struct bvh_node *node, unsigned slot, const struct extent *extent);

/*
 * The nodes over all items, whose range is not empty, into memory for bvh_nodes_bound() of them; returns
 * how many there are. Where a leaf begins (child) and how many entries it has (count) are told of
 * whole->items, which are reordered, and to which pieces are added as long as there is room.
 */
uint32_t bvh_build_nodes(const struct whole *whole, const struct range *all,
                         struct bvh_node *nodes);

#endif
