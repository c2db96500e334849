/*
 * How a range of boxes is divided in two: the surface area heuristic over bins of their centres (I.
 * Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", IEEE RT 2007).
 */
#ifndef FARM_WORKER_BVH_SPLIT_H
#define FARM_WORKER_BVH_SPLIT_H

#include <float.h>
#include <stdint.h>

/* x, y, z and one lane for which there is other use. */
typedef float float4 __attribute__((vector_size(16)));

/*
 * A primitive while the tree is built; moved about instead of its index, to read memory in order.
 * Coordinates are finite: -FLT_MAX or FLT_MAX also stands for what is beyond, so that nothing here
 * becomes infinite or NaN.
 */
struct item {
    float min[3];
    uint32_t id;
    float max[3];
    uint32_t weight; /* of its test, see PACK */
};

/*
 * A leaf's triangles are tested PACK at a time. Weights are in units of a PACKth of such a test;
 * the costs of the heuristic in units of a whole one.
 */
#define PACK 4u

/* The visit of a leaf, before the first test. */
#define LEAF_COST 0.5

struct extent {
    float4 min, max; /* the fourth lane is undefined */
};

/* Items in a row, and what is known about them. */
struct range {
    uint32_t first, count;
    uint32_t weight;
    struct extent extent;
    struct extent centers; /* of the boxes' centres, halved */
};

/* The left side are the items with (centre / 2 - low) * scale < end. */
struct split {
    unsigned axis;
    float low, scale, end;
    double cost; /* area * cost_of(weight), of both sides; infinite: all centres are the same */
};

struct range range_empty(uint32_t first);
void range_add(struct range *range, const struct item *item);

/* Half the surface; 0 for an empty extent. */
double extent_area(const struct extent *extent);

/* Of items of this weight together, as a leaf. */
static inline double cost_of(uint32_t weight)
{
    return LEAF_COST + (weight + PACK - 1) / PACK;
}

struct split find_split(const struct item *items, const struct range *range);

/* Reorders the items of range; without a split (cost is infinite) halves them as they are. Neither
 * side becomes empty. */
void split_range(struct item *items, const struct range *range, const struct split *split,
                 struct range *left, struct range *right);

/* Divides the items as they are. */
void halve_range(const struct item *items, const struct range *range, struct range *left,
                 struct range *right);

#endif
