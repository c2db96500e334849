/* What a tree is built from: boxes of primitives and of their pieces, and ranges of such boxes. */
#ifndef FARM_WORKER_BVH_ITEM_H
#define FARM_WORKER_BVH_ITEM_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "common/scene.h"
#include "common/thread_pool.h"
#include "worker/extent.h"

/*
 * The box of a primitive, or of a piece of a triangle or rod, during construction, relative to the tree's centre. Items
 * are moved, not indices of them, to read memory in order. Coordinates are finite: -FLT_MAX and FLT_MAX also stand for
 * values beyond them, so that nothing here becomes infinite or NaN.
 */
struct item {
    float min[3];
    uint32_t id;
    float max[3];
    uint32_t weight; /* cost of its intersection test, in units of 1 / PACK */
};

/*
 * This many triangles of a leaf count as one test: a single ray tests eight of them at once, a packet of rays tests
 * them one by one. With 4 the trees of meshes are 9 to 16 % larger and a ray's nodes more often not in the cache; with
 * 8 large meshes take 4 to 8 % longer (bench-kernel's garden, rings_mesh). Weights are in units of 1 / PACK of such a
 * test, costs of the heuristic in units of a whole one.
 */
#define PACK 6u

/* Items that one thread processes in one iteration of a parallel loop, in 0.1 to 0.2 ms: several times as long as
 * waking a thread. */
#define CHUNK_ITEMS 16384u

/* What a tree is built from. The items are reordered and cut meanwhile. */
struct bvh_input {
    const struct scene *scene;
    const double *center; /* of the tree, [3] */
    struct item *items;
    struct thread_pool *pool; /* for large ranges; may be NULL */
};

/* ---- boxes ---- */

/* round_down(): one float below the float nearest to x, or -FLT_MAX; this also covers the rounding errors of bounds. */
float round_down(double x);

/* The same upwards: one float above, or FLT_MAX. */
float round_up(double x);

/* These floats may stand for values beyond them. */
static inline float open_below(float min)
{
    return min > -FLT_MAX ? min : -INFINITY;
}

static inline float open_above(float max)
{
    return max < FLT_MAX ? max : INFINITY;
}

static inline struct extent item_extent(const struct item *item)
{
    struct extent extent; /* of four floats: the last one is the member that follows */
    memcpy(&extent.min, (const char *)item + offsetof(struct item, min), sizeof extent.min);
    memcpy(&extent.max, (const char *)item + offsetof(struct item, max), sizeof extent.max);
    return extent;
}

/* Half the centre, which cannot overflow. The last lane is cleared: it would be an id or a weight, which may be slow
 * as a float. */
static inline float4 half_center(const struct extent *extent)
{
    typedef uint32_t mask4 __attribute__((vector_size(16)));
    const float4 quarter = {0.25f, 0.25f, 0.25f, 0};
    const mask4 xyz = {~0u, ~0u, ~0u, 0};
    float4 min = (float4)((mask4)extent->min & xyz), max = (float4)((mask4)extent->max & xyz);
    return min * quarter + max * quarter;
}

/* The same along one axis. */
static inline float half_center_at(const struct item *item, unsigned axis)
{
    return item->min[axis] * 0.25f + item->max[axis] * 0.25f;
}

/* ---- ranges ---- */

/* Consecutive items, the room after them, and their sums and bounds. */
struct range {
    uint32_t first, count;
    uint32_t room; /* for this many more items */
    uint32_t weight;
    struct extent extent;
    struct extent centers; /* bounds of half the centres of the items' boxes */
};

/* A range that starts at the item of index first, to which range_add() adds the items from there on. */
static inline struct range range_empty(uint32_t first)
{
    return (struct range){first, 0, 0, 0, empty_extent(), empty_extent()};
}

static inline void range_add(struct range *range, const struct item *item)
{
    struct extent extent = item_extent(item);
    float4 center = half_center(&extent);
    extend(&range->extent, &extent);
    range->centers.min = min4(range->centers.min, center);
    range->centers.max = max4(range->centers.max, center);
    range->count++;
    range->weight += item->weight;
}

/* Adds the items of another range, which directly follow those of the first one. */
static inline void range_append(struct range *range, const struct range *more)
{
    extend(&range->extent, &more->extent);
    extend(&range->centers, &more->centers);
    range->count += more->count;
    range->weight += more->weight;
}

#endif
