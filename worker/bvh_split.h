/*
 * How a range of boxes is divided in two: by their centres, or by a plane that cuts triangles in
 * two. Either way the surface area heuristic is evaluated at the borders of bins (I. Wald, "On fast
 * Construction of SAH-based Bounding Volume Hierarchies", IEEE RT 2007; M. Stich, H. Friedrich and
 * A. Dietrich, "Spatial Splits in Bounding Volume Hierarchies", HPG 2009).
 */
#ifndef FARM_WORKER_BVH_SPLIT_H
#define FARM_WORKER_BVH_SPLIT_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "common/crew.h"
#include "common/scene.h"
#include "common/whole.h"
#include "worker/extent.h"

/*
 * A primitive, or a piece of a triangle or a rod, while the tree is built; moved about instead of its
 * index, to read memory in order. Coordinates are finite: -FLT_MAX or FLT_MAX also stands for what is
 * beyond, so that nothing here becomes infinite or NaN.
 */
struct item {
    float min[3];
    uint32_t id;
    float max[3];
    uint32_t weight; /* of its test, see PACK */
};

/*
 * So many triangles of a leaf count as one test: a ray on its own tests eight of them at once, a packet
 * of rays one after the other. With 4 the trees of meshes are 9 to 16 % larger and a ray's nodes more
 * often out of the cache; with 8 large meshes take 4 to 8 % longer (bench-kernel's garden, rings_mesh).
 * Weights are in units of a PACKth of such a test; the costs of the heuristic in units of a whole one.
 */
#define PACK 6u

/* The visit of a leaf, before the first test. */
#define LEAF_COST 0.5

/* So many of them one thread looks at in a round of a crew's loop: some 0.2 ms, several times what waking
 * a thread takes. */
#define ROUND_ITEMS 16384u

/* Items in a row, with room behind them, and what is known about them. */
struct range {
    uint32_t first, count;
    uint32_t room; /* for so many more items */
    uint32_t weight;
    struct extent extent;
    struct extent centers; /* of the boxes' centres, halved */
};

/* The left side are the items with (place - low) * scale < end, where place is half the centre; or
 * what is left of place = plane. */
struct split {
    unsigned axis;
    bool spatial;
    float low, scale, end; /* unless spatial */
    float plane;           /* if it is */
    double cost;    /* area * cost_of(weight), of both sides; infinite: all centres are the same */
    double overlap; /* area of what both sides have in common */
};

/* What the items are pieces of. */
struct whole {
    const struct scene *scene;
    const double *center; /* the tree's, [3] */
    struct item *items;
    struct crew *crew; /* that looks at many items together; may be NULL */
};

struct range range_empty(uint32_t first);
void range_add(struct range *range, const struct item *item);
/* The items of another range, which stand behind those of the first one. */
void range_append(struct range *range, const struct range *more);

/* Of items of this weight together, as a leaf. */
static inline double cost_of(uint32_t weight)
{
    uint32_t packs = divide_up(weight, PACK);
    return LEAF_COST + packs;
}

/* One float below x, or -FLT_MAX: also covers the roundings of bounds. */
float round_down(double x);
float round_up(double x);

/* What is at the end of all floats may be beyond. */
static inline float open_below(float min)
{
    return min > -FLT_MAX ? min : -INFINITY;
}

static inline float open_above(float max)
{
    return max < FLT_MAX ? max : INFINITY;
}

struct split find_object_split(const struct whole *whole, const struct range *range);

/* The cheapest spatial split, or *split if none is cheaper. */
struct split find_spatial_split(const struct whole *whole, const struct range *range,
                                const struct split *split);

/* Reorders the items of range, and adds pieces as long as there is room; without a split (cost is
 * infinite) halves them as they are. Neither side becomes empty. */
void split_range(const struct whole *whole, const struct range *range, const struct split *split,
                 struct range *left, struct range *right);

/* Cuts a triangle's item, behind which there is room, so often into halves, across its longest axis. Returns how many
 * items there are then: 2^halvings, or fewer. */
uint32_t halve_triangle(const struct whole *whole, struct item *item, unsigned halvings);

/* Divides the items as they are. */
void halve_range(const struct whole *whole, const struct range *range, struct range *left,
                 struct range *right);

#endif
