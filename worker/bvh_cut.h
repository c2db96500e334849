/* Cuts triangles, and the pieces that are left of them, in two by planes orthogonal to an axis. */
#ifndef FARM_WORKER_BVH_CUT_H
#define FARM_WORKER_BVH_CUT_H

#include <stdbool.h>

#include "worker/bvh_item.h"

/* A triangle's vertices relative to the tree's centre, and their boxes, rounded outward. */
struct corners {
    double at[3][3];
    struct extent rounded[3];
};

struct corners corners_of(const struct bvh_input *input, uint32_t id);

/* The boxes of the parts of a piece on either side of a plane; false: there is nothing on one side. */
bool cut_triangle(const struct corners *corners, const struct extent *piece, unsigned axis,
                  float plane, struct extent *left, struct extent *right);

/* The item becomes its left part; false: one side is empty, and nothing changes. */
bool cut_item(const struct corners *corners, struct item *item, unsigned axis, float plane,
              struct item *right);

/* Halves a triangle's item repeatedly, each piece across its longest axis. There must be room for 2^halvings items
 * from `item` on. Returns the number of pieces: 2^halvings, or fewer. */
uint32_t halve_triangle(const struct bvh_input *input, struct item *item, unsigned halvings);

#endif
