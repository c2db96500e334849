/* The trees of a struct bvh that a ray has to be traced through. Most scenes have one. */
#ifndef FARM_WORKER_SEVERAL_H
#define FARM_WORKER_SEVERAL_H

#include "worker/bvh_trees.h"
#include "worker/slabs.h"

_Static_assert(TREES_MAX <= 32, "a set has 32 bits");

/* All trees as a set, in the order in which they were built. */
static inline lane_set all_trees(const struct bvh *bvh)
{
    const struct bvh *boxes = bvh_boxes(bvh);
    return boxes ? UINT32_MAX >> (32 - boxes->leaf_count) : 1;
}

/* Removes the first tree from a set, which must not be empty, and returns it. */
static inline const struct bvh *take_tree(const struct bvh *bvh, lane_set *set)
{
    const struct bvh *boxes = bvh_boxes(bvh);
    if (!boxes) {
        *set = 0;
        return bvh;
    }
    unsigned tree = lowest_lane(*set);
    *set = without_lowest(*set);
    uint32_t place = bvh_nodes(boxes)[tree / BVH_WIDTH].child[tree % BVH_WIDTH];
    return (const void *)((const char *)bvh + (size_t)place * BVH_ALIGNMENT);
}

/* The trees whose boxes the ray meets within 0 <= t <= limit. */
static INLINED lane_set trees_of_ray(const struct bvh *bvh, const struct ray *ray, double limit)
{
    const struct bvh *boxes = bvh_boxes(bvh);
    if (!boxes) return 1;
    struct slabs slabs = slabs_of(boxes, ray);
    struct lanes enter;
    lane_set set = 0;
    for (unsigned i = 0; i < boxes->node_count; i++)
        set |= slabs_meet(&slabs, &bvh_nodes(boxes)[i], limit, &enter) << i * BVH_WIDTH;
    return set;
}

#endif
