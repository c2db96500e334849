/* Builds the nodes of a tree, top down. */
#ifndef FARM_WORKER_BVH_NODES_H
#define FARM_WORKER_BVH_NODES_H

#include "worker/bvh.h"
#include "worker/bvh_item.h"

/* A range of more weight is always divided, whatever the heuristic says. */
#define LEAF_WEIGHT_MAX (2 * PACK)
_Static_assert(LEAF_WEIGHT_MAX >= BVH_WIDTH, "bvh_nodes_bound()");

/* The subtree over at most this number of items is built by one thread; takes some milliseconds. */
#define SUBTREE_ITEMS 4096u

/*
 * Upper bound on the nodes over items of this weight, which includes the pieces of triangles that there is room for, at
 * 1 each. A node either has eight children, or all of them are leaves and it holds more than LEAF_WEIGHT_MAX in weight,
 * unless it is the only one. With n nodes of the first sort, m of the second, and `leaves` leaves below the first, 8 n
 * = n + m - 1 + leaves. The weight is at least leaves + 9 m, as LEAF_WEIGHT_MAX is no less than 8. So n + m is largest
 * for m = 0: a seventh of the weight.
 */
static inline uint64_t bvh_nodes_bound(uint64_t weight)
{
    return weight == 0 ? 0 : weight / (BVH_WIDTH - 1) + 1;
}

/* Makes a node without children; fills in the box of one child, which is rounded outward already. */
void bvh_empty_node(struct bvh_node *node);
void bvh_fill_slot(struct bvh_node *node, unsigned slot, const struct extent *extent);

/*
 * Builds the nodes over all items, whose range must not be empty, and returns their number. `nodes` has room for
 * bvh_nodes_bound() of them. The child and count of a leaf denote a range of input->items, to be replaced by
 * bvh_write_leaves(). The items are reordered, and pieces are added as long as there is room.
 */
uint32_t bvh_build_nodes(const struct bvh_input *input, const struct range *all,
                         struct bvh_node *nodes);

#endif
