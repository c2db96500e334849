/*
 * Where surfaces of several primitives meet: two planes of a room in an edge, three in a corner, a wall and the floor
 * that it stands on. A ray that meets the edge to the last bit has all of them at one distance and hits one; its point
 * would be before or behind the others by the luck of rounding, and what goes on from behind would never meet them.
 */
#ifndef FARM_WORKER_CORNER_H
#define FARM_WORKER_CORNER_H

#include "worker/nearest.h"

/*
 * Where a ray goes on from a hit of nearest() with in_corner: the point of surface_at(), drawn along the surface to the
 * side of each other one that the ray came from, until it is farther from it than any rounding. As it is where the
 * others run along the surface (as a pane's second side) or are not that near.
 */
struct vec3 corner_point(const struct scene *scene, const struct bvh *bvh, const struct ray *ray,
                         const struct hit *hit);

#endif
