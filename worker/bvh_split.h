/*
 * Divides a range of boxes in two: by their centres (object split), or by a plane that cuts triangles in two (spatial
 * split). Either way the surface area heuristic is evaluated at the borders of bins (I. Wald, "On fast Construction of
 * SAH-based Bounding Volume Hierarchies", IEEE RT 2007; M. Stich, H. Friedrich and A. Dietrich, "Spatial Splits in
 * Bounding Volume Hierarchies", HPG 2009).
 */
#ifndef FARM_WORKER_BVH_SPLIT_H
#define FARM_WORKER_BVH_SPLIT_H

#include <stdbool.h>
#include <stdint.h>

#include "common/whole.h"
#include "worker/bvh_item.h"

/* The cost of visiting a leaf, without its tests. */
#define LEAF_COST 0.5

/* Object split: items with (place - low) * scale < end are on the left, where place is half their centre. Spatial
 * split: triangles across the plane are cut, then items whose centre is below the plane are on the left. */
struct split {
    unsigned axis; /* without a split: the longest one of the range */
    bool spatial;
    float low, scale, end; /* object split */
    float plane;           /* spatial split */
    /* sum of area * cost_of(weight) over both sides; infinite: all centres coincide */
    double cost;
    /* how far the left side reaches past the beginning of the right one; negative: a gap; infinite: there are no
     * sides; spatial split: 0 */
    double overlap;
};

/* The cost of a leaf of this weight. */
static inline double cost_of(uint32_t weight)
{
    uint32_t packs = divide_up(weight, PACK);
    return LEAF_COST + packs;
}

/* The cheapest object split; cost is infinite if all centres coincide. */
struct split find_object_split(const struct bvh_input *input, const struct range *range);

/* The cheapest spatial split along the axis of an object split, or *split if none is cheaper. To try the other two axes
 * takes three times as long, and trees of meshes are no better. */
struct split find_spatial_split(const struct bvh_input *input, const struct range *range,
                                const struct split *split);

/* Reorders the items of a range, and adds pieces as long as there is room; without a split (cost is infinite) halves
 * the range in its present order. Neither side becomes empty. */
void split_range(const struct bvh_input *input, const struct range *range,
                 const struct split *split, struct range *left, struct range *right);

/* Divides a range in the middle, in its present order. */
void halve_range(const struct bvh_input *input, const struct range *range, struct range *left,
                 struct range *right);

#endif
