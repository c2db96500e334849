/*
 * Divides a range of boxes in two: by their centres (object split), or by a plane that cuts triangles in two (spatial
 * split). Either way the surface area heuristic is evaluated at the borders of bins (I. Wald, "On fast Construction of
 * SAH-based Bounding Volume Hierarchies", IEEE RT 2007; M. Stich, H. Friedrich and A. Dietrich, "Spatial Splits in
 * Bounding Volume Hierarchies", HPG 2009).
 */
#ifndef FARM_WORKER_BVH_SPLIT_H
#define FARM_WORKER_BVH_SPLIT_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "common/scene.h"
#include "common/thread_pool.h"
#include "common/whole.h"
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

/* The cost of visiting a leaf, without its tests. */
#define LEAF_COST 0.5

/* Items that one thread processes in one iteration of a parallel loop, in 0.1 to 0.2 ms: several times as long as
 * waking a thread. */
#define CHUNK_ITEMS 16384u

/* Consecutive items, the room after them, and their sums and bounds. */
struct range {
    uint32_t first, count;
    uint32_t room; /* for this many more items */
    uint32_t weight;
    struct extent extent;
    struct extent centers; /* bounds of half the centres of the items' boxes */
};

/* Object split: items with (place - low) * scale < end are on the left, where place is half their centre. Spatial
 * split: triangles across the plane are cut, then items whose centre is below the plane are on the left. */
struct split {
    unsigned axis;
    bool spatial;
    float low, scale, end; /* object split */
    float plane;           /* spatial split */
    /* sum of area * cost_of(weight) over both sides; infinite: all centres coincide */
    double cost;
    double overlap; /* area of the intersection of both sides; spatial split: 0 */
};

/* What a tree is built from. The items are reordered and cut meanwhile. */
struct bvh_input {
    const struct scene *scene;
    const double *center; /* of the tree, [3] */
    struct item *items;
    struct thread_pool *pool; /* for large ranges; may be NULL */
};

/* A range that starts at the item of index first, to which range_add() adds the items from there on. */
struct range range_empty(uint32_t first);
void range_add(struct range *range, const struct item *item);

/* Adds the items of another range, which directly follow those of the first one. */
void range_append(struct range *range, const struct range *more);

/* The cost of a leaf of this weight. */
static inline double cost_of(uint32_t weight)
{
    uint32_t packs = divide_up(weight, PACK);
    return LEAF_COST + packs;
}

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

/* The cheapest object split; cost is infinite if all centres coincide. */
struct split find_object_split(const struct bvh_input *input, const struct range *range);

/* The cheapest spatial split, or *split if none is cheaper. */
struct split find_spatial_split(const struct bvh_input *input, const struct range *range,
                                const struct split *split);

/* Reorders the items of a range, and adds pieces as long as there is room; without a split (cost is infinite) halves
 * the range in its present order. Neither side becomes empty. */
void split_range(const struct bvh_input *input, const struct range *range,
                 const struct split *split, struct range *left, struct range *right);

/* Halves a triangle's item repeatedly, each piece across its longest axis. There must be room for 2^halvings items
 * from `item` on. Returns the number of pieces: 2^halvings, or fewer. */
uint32_t halve_triangle(const struct bvh_input *input, struct item *item, unsigned halvings);

/* Divides a range in the middle, in its present order. */
void halve_range(const struct bvh_input *input, const struct range *range, struct range *left,
                 struct range *right);

#endif
