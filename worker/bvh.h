/*
 * A bounding volume hierarchy over the bounded primitives of a scene, built with a binned surface
 * area heuristic (I. Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", IEEE RT
 * 2007). Like the scene block it is one piece of memory with indices instead of pointers, so that a
 * node's ranks share one. The same scene gives the same bytes on every machine.
 */
#ifndef FARM_WORKER_BVH_H
#define FARM_WORKER_BVH_H

#include <stddef.h>
#include <stdint.h>

#include "common/scene.h"

/* Bounds are taken from the tree's centre and rounded outward to float. */
struct bvh_node {
    float min[3], max[3];
    uint32_t first; /* inner node: its two children are nodes first and first + 1; */
    uint32_t count; /* leaf: primitives first .. first + count - 1 of the list; inner: 0 */
};

_Static_assert(sizeof(struct bvh_node) == 32, "two nodes, the children of one, in a cache line");

/* A node deeper than this becomes a leaf; the fixed traversal stack holds this many and two more.
 */
#define BVH_MAX_DEPTH 62

struct bvh {
    uint64_t bytes; /* in use */
    uint64_t node_count;
    uint64_t primitive_count;
    uint64_t nodes_offset; /* struct bvh_node; the root is node 0 (absent when node_count is 0) */
    uint64_t primitives_offset; /* uint32_t primitive ids */
    double center[3]; /* 0 unless the scene is small and far from the origin: a float's spacing is
                       * 64 at 1e9 */
};

static inline const struct bvh_node *bvh_nodes(const struct bvh *bvh)
{
    return (const void *)((const char *)bvh + bvh->nodes_offset);
}

static inline const uint32_t *bvh_primitives(const struct bvh *bvh)
{
    return (const void *)((const char *)bvh + bvh->primitives_offset);
}

/* Bytes that bvh_build() may need for this scene. */
size_t bvh_bytes_bound(const struct scene *scene);

/* Builds into memory of bvh_bytes_bound() bytes, aligned to 64. */
struct bvh *bvh_build(const struct scene *scene, void *memory);

#endif
