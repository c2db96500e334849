/*
 * Chooses which rods, that is long thin cylinders and cones, are cut into pieces. The reasons are the same as for
 * triangles, see worker/bvh_slivers.h. The pieces of a rod are of equal length: cone_piece_bounds().
 */
#ifndef FARM_WORKER_BVH_RODS_H
#define FARM_WORKER_BVH_RODS_H

#include "common/scene.h"
#include "worker/bvh_trees.h"

/* The area of a rod's box divided by that of the box which the same rod would have along an axis. NaN where products
 * of the sizes overflow or underflow. */
double rod_waste(const struct cone *cone);

/*
 * Sets the number of halvings (bvh_slivers_find()) to 0 for rods that cutting does not separate: in a bundle that is no
 * wider than a piece is long, the box of each piece overlaps pieces of all the other rods. A ray along the bundle would
 * then test all rods again for each piece of one.
 */
void keep_bundles_whole(const struct scene *scene, const struct bvh_trees *trees,
                        uint8_t *halvings);

#endif
