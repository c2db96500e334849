/*
 * Long thin cylinders and cones, rods: which of them are worth cutting into pieces. What worker/bvh_slivers.h says of
 * triangles goes for them, too. Pieces are of equal length: cone_piece_bounds().
 */
#ifndef FARM_WORKER_BVH_RODS_H
#define FARM_WORKER_BVH_RODS_H

#include "common/scene.h"
#include "worker/bvh_trees.h"

/* The area of its box to that of the box that it would have along an axis. NaN: what cannot be multiplied. */
double rod_waste(const struct cone *cone);

/*
 * Leaves the rods whole, with no halvings (as in struct bvh_slivers), that pieces do not take apart: of a bundle that
 * is no wider than a piece is long, each piece has pieces of all others in its box. A ray along it would be tested
 * with all rods again for each piece of one.
 */
void keep_bundles_whole(const struct scene *scene, const struct bvh_trees *trees,
                        uint8_t *halvings);

#endif
