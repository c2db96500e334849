/*
 * A bounding volume hierarchy (BVH) over the bounded primitives of a scene. A node has up to eight children, whose
 * boxes a ray tests at once in SIMD. Like the scene block it is one block of memory with indices instead of pointers,
 * so that the ranks of a compute node share one copy. The same scene gives the same bytes on every machine.
 */
#ifndef FARM_WORKER_BVH_H
#define FARM_WORKER_BVH_H

#include <stdalign.h>
#include <stddef.h>
#include <stdint.h>

#include "common/scene.h"

#define BVH_WIDTH 8

/* Alignment of trees and of the arrays in them, in bytes. */
#define BVH_ALIGNMENT ((size_t)64)

/* The boxes of a node's children, relative to the tree's centre and rounded outward to float. Empty slots come after
 * the others. Their box is min = infinity, max = -infinity. Their child and count are both 0, which no other slot
 * has, as node 0 is the root. */
struct bvh_node {
    alignas(BVH_ALIGNMENT) float min[3][BVH_WIDTH];
    float max[3][BVH_WIDTH];
    /* an inner node: its index; a leaf: index of its first entry in bvh_leaves() */
    uint32_t child[BVH_WIDTH];
    /* a leaf: number of its entries; 0: an inner node, or an empty slot */
    uint32_t count[BVH_WIDTH];
};

_Static_assert(sizeof(struct bvh_node) == 256, "four cache lines");

/*
 * An entry of a leaf: what the leaf stores of a primitive. The entries of a leaf are sorted by id, so triangles and
 * patches come first.
 */
struct bvh_leaf {
    uint32_t id : 31;
    /* 1: its material transmits light; here for shadow rays, which need nothing else of an opaque primitive */
    uint32_t transparent : 1;
};

_Static_assert(sizeof(struct bvh_leaf) == 4, "sixteen to a cache line");
_Static_assert(PRIMITIVE_KINDS <= 8, "an id has 31 bits");

/*
 * The vertices of a leaf's triangles, quantized to 16 bits for worker/rough_triangles.h; stored directly after the
 * leaf's entries. On each axis a vertex is at base + place * unit, relative to the tree's centre and rounded to the
 * nearest place. Row axis * 3 + corner has one place for each triangle of the leaf.
 */
struct bvh_corners {
    float base[3];
    /* 1 / unit, where the unit is a power of two; NaN: the places must not be used */
    float inverse;
    uint16_t place[];
};

#define CORNER_ROWS 9

/*
 * BVH_MAX_DEPTH: the most nodes on a path from the root to a leaf, both ends included. A traversal that descends into
 * the nearest child and pushes the others needs a stack of BVH_STACK entries.
 */
#define BVH_MAX_DEPTH 32
#define BVH_STACK     ((BVH_WIDTH - 1) * BVH_MAX_DEPTH + 1)

/*
 * A tree. Some clusters are too fine for floats relative to the centre of most of a scene. They are in further trees
 * with centres of their own, which follow the first one in the same block; see worker/bvh_trees.h. A ray is traced, in
 * any order, through the trees whose boxes it meets; see worker/several.h.
 */
struct bvh {
    uint64_t bytes; /* first tree only: bytes in use by all trees together */
    uint64_t node_count;
    uint64_t leaf_count;    /* number of entries of all leaves */
    uint64_t transparent;   /* 1: some material of the scene transmits light; else 0 */
    uint64_t nodes_offset;  /* struct bvh_node; the root is node 0 (absent when node_count is 0) */
    uint64_t leaves_offset; /* struct bvh_leaf */
    /* Origin of the tree's coordinates; 0 in the first tree unless most of the scene is small and far from the
     * origin: a float's spacing is 64 at 1e9. */
    double center[3];
    float min[3], max[3]; /* box of the root, relative to the centre as in a node */
    double reach;         /* largest absolute coordinate of min and max */
    /* reach plus the centre's largest absolute coordinate: no coordinate of a primitive is larger except by rounding */
    double size;
    /* bytes from the start of this tree to that of the next one; 0: this is the last */
    uint64_t next_offset;
    uint64_t boxes_offset; /* first of several trees: byte offset of bvh_boxes(); else 0 */
};

static inline const struct bvh *bvh_next(const struct bvh *bvh)
{
    return bvh->next_offset ? (const void *)((const char *)bvh + bvh->next_offset) : NULL;
}

/*
 * The boxes of all trees, so that a ray is prepared only for the trees whose boxes it meets; NULL: there is one tree.
 * They are stored as a tree whose nodes are a flat array; leaf_count is their number. The child of a box is the offset
 * of its tree from the first one, in units of BVH_ALIGNMENT; its count is 1.
 */
static inline const struct bvh *bvh_boxes(const struct bvh *first)
{
    return first->boxes_offset ? (const void *)((const char *)first + first->boxes_offset) : NULL;
}

static inline const struct bvh_node *bvh_nodes(const struct bvh *bvh)
{
    return (const void *)((const char *)bvh + bvh->nodes_offset);
}

static inline const struct bvh_leaf *bvh_leaves(const struct bvh *bvh)
{
    return (const void *)((const char *)bvh + bvh->leaves_offset);
}

/* Byte offsets in a node of the planes of an axis that a ray meets first (near) and last (far). */
struct node_planes {
    size_t near, far;
};

static inline struct node_planes node_planes_of(unsigned axis, bool down)
{
    size_t row = axis * (BVH_WIDTH * sizeof(float));
    size_t min = offsetof(struct bvh_node, min) + row, max = offsetof(struct bvh_node, max) + row;
    return down ? (struct node_planes){max, min} : (struct node_planes){min, max};
}

/* The leaf entry of any primitive, planes included. */
struct bvh_leaf bvh_leaf_of(const struct scene *scene, uint32_t id);

/* The number of triangles among the primitives of a leaf; they come first. */
static inline uint32_t triangles_of(const struct bvh_leaf *leaves, uint32_t count)
{
    if (is_triangle(leaves[count - 1].id)) return count;
    uint32_t triangles = 0;
    while (is_triangle(leaves[triangles].id))
        triangles++;
    return triangles;
}

/* The vertices of a leaf with `count` entries, if the first of these is a triangle. */
static inline const struct bvh_corners *bvh_corners(const struct bvh_leaf *leaves, uint32_t count)
{
    return (const void *)(leaves + count);
}

/* The size of the struct bvh_corners of this number of triangles, as a number of leaf entries. */
static inline uint32_t corner_entries(uint32_t triangles)
{
    size_t bytes = sizeof(struct bvh_corners) + (size_t)triangles * CORNER_ROWS * sizeof(uint16_t);
    return (uint32_t)((bytes + sizeof(struct bvh_leaf) - 1) / sizeof(struct bvh_leaf));
}

/* Upper bound on the bytes that bvh_build() needs for this scene; a multiple of 64. */
size_t bvh_bytes_bound(const struct scene *scene);

/* Builds into memory of bvh_bytes_bound() bytes, aligned to 64, with at most this many threads (>= 1, the calling
 * one included), which do not affect the bytes. Fatal if the weight (struct range) of all primitives and possible
 * pieces exceeds UINT32_MAX, or the leaves of a tree, vertices included, take more entries than that. */
struct bvh *bvh_build(const struct scene *scene, void *memory, unsigned threads);

#endif
