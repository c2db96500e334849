/*
 * A bounding volume hierarchy over the bounded primitives of a scene: eight boxes to a node, so
 * that one step looks at all of them in SIMD. Like the scene block it is one piece of memory with
 * indices instead of pointers, so that a node's ranks share one. The same scene gives the same
 * bytes on every machine.
 */
#ifndef FARM_WORKER_BVH_H
#define FARM_WORKER_BVH_H

#include <stdalign.h>
#include <stddef.h>
#include <stdint.h>

#include "common/scene.h"

#define BVH_WIDTH 8

/* Of trees, and of what is in them. */
#define BVH_ALIGNMENT ((size_t)64)

/* The boxes of a node's children, from the tree's centre and rounded outward to float. Those of an
 * empty slot, which comes behind the others, are min = infinity, max = -infinity; its child and
 * count are 0, as only the root's number is. */
struct bvh_node {
    alignas(BVH_ALIGNMENT) float min[3][BVH_WIDTH];
    float max[3][BVH_WIDTH];
    uint32_t child[BVH_WIDTH]; /* an inner node's index; a leaf's place in bvh_leaves() */
    uint32_t count[BVH_WIDTH]; /* entries of a leaf; 0: an inner node, or empty */
};

_Static_assert(sizeof(struct bvh_node) == 256, "four cache lines");

/*
 * What a leaf needs of a primitive. Those of a leaf are in the order of their ids: triangles and
 * patches come first.
 */
struct bvh_leaf {
    uint32_t id : 31;
    uint32_t transparent : 1; /* 1: its material lets light through; here for shadow rays, which
                               * need nothing else of what is opaque */
};

_Static_assert(sizeof(struct bvh_leaf) == 4, "sixteen to a cache line");
_Static_assert(PRIMITIVE_KINDS <= 8, "an id has 31 bits");

/*
 * Where a leaf's triangles are, roughly, for worker/rough_triangles.h; it stands behind the leaf's
 * entries. In each axis a corner is at base + place * unit from the tree's centre, rounded to the
 * nearest place. Row axis * 3 + corner has a place for each of the leaf's triangles.
 */
struct bvh_corners {
    float base[3];
    float inverse; /* of the unit, which is a power of two; NaN: such places say nothing */
    uint16_t place[];
};

#define CORNER_ROWS 9

/*
 * Nodes on the longest way from the root to a leaf, both ends counted: a walk that descends into
 * the nearest child and keeps the others needs a stack of BVH_STACK entries.
 */
#define BVH_MAX_DEPTH 32
#define BVH_STACK     ((BVH_WIDTH - 1) * BVH_MAX_DEPTH + 1)

/*
 * A tree. What is too fine for floats that count from the centre of most of a scene is in further trees, with centres
 * of their own, which stand behind the first one in the same block; see worker/bvh_trees.h. A ray is traced through
 * those whose boxes it meets, in any order; see worker/several.h.
 */
struct bvh {
    uint64_t bytes; /* of the first tree: in use, all trees together */
    uint64_t node_count;
    uint64_t leaf_count;    /* entries of all leaves */
    uint64_t transparent;   /* 1: some material of the scene lets light through; else 0 */
    uint64_t nodes_offset;  /* struct bvh_node; the root is node 0 (absent when node_count is 0) */
    uint64_t leaves_offset; /* struct bvh_leaf */
    /* 0 unless most of the scene is small and far from the origin: a float's spacing is 64 at 1e9. */
    double center[3];
    float min[3], max[3]; /* of the root, like a node's */
    double reach;         /* the largest coordinate of these */
    double size; /* the same, and the centre's largest coordinate: no coordinate of the scene
                           * is larger but by rounding */
    uint64_t next_offset;  /* from this one to the next tree, in bytes; 0: there is none */
    uint64_t boxes_offset; /* of the first of several trees: to bvh_boxes(); else 0 */
};

static inline const struct bvh *bvh_next(const struct bvh *bvh)
{
    return bvh->next_offset ? (const void *)((const char *)bvh + bvh->next_offset) : NULL;
}

/*
 * The boxes of all trees, so that a ray is made ready for those alone that it may meet something in: a tree whose nodes
 * stand side by side, and none above the others. A box's child is where its tree begins behind the first one, in units
 * of BVH_ALIGNMENT; its count is 1, and leaf_count is how many there are. NULL: there is one tree.
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

/* Where in a node the planes of an axis are that a ray meets first and last. */
struct node_planes {
    size_t near, far;
};

static inline struct node_planes node_planes_of(unsigned axis, bool down)
{
    size_t row = axis * (BVH_WIDTH * sizeof(float));
    size_t min = offsetof(struct bvh_node, min) + row, max = offsetof(struct bvh_node, max) + row;
    return down ? (struct node_planes){max, min} : (struct node_planes){min, max};
}

/* Of any primitive, planes too. */
struct bvh_leaf bvh_leaf_of(const struct scene *scene, uint32_t id);

/* Behind `count` entries of a leaf, of which the first so many are triangles. */
static inline const struct bvh_corners *bvh_corners(const struct bvh_leaf *leaves, uint32_t count)
{
    return (const void *)(leaves + count);
}

/* So many entries' bytes are what the corners of some triangles take. */
static inline uint32_t corner_entries(uint32_t triangles)
{
    size_t bytes = sizeof(struct bvh_corners) + (size_t)triangles * CORNER_ROWS * sizeof(uint16_t);
    return (uint32_t)((bytes + sizeof(struct bvh_leaf) - 1) / sizeof(struct bvh_leaf));
}

/* Bytes that bvh_build() may need for this scene, a multiple of 64. */
size_t bvh_bytes_bound(const struct scene *scene);

/* Builds into memory of bvh_bytes_bound() bytes, aligned to 64, with at most so many threads, the
 * calling one among them (>= 1), which make no difference to the bytes. Fatal where items, solids
 * counted as struct range weighs them, could be 2^32 or more. */
struct bvh *bvh_build(const struct scene *scene, void *memory, unsigned threads);

#endif
