/*
 * Points where surfaces of several primitives meet: two walls of a room in an edge, three in a corner, a wall
 * and the floor that it stands on. A ray that meets the edge to the last bit crosses all of them at one
 * distance and hits one of them. Rounding would put the hit point before or behind the other surfaces, and
 * secondary rays that start behind them would never meet them.
 */
#ifndef FARM_WORKER_CORNER_H
#define FARM_WORKER_CORNER_H

#include "worker/nearest.h"

/*
 * The origin of secondary rays from a hit of nearest() with in_corner: the point of surface_at(), moved along
 * the surface to that side of each other surface that the ray came from, until its distance from it exceeds
 * any rounding. The point is not moved if the others run along the surface (such as the other side of a pane)
 * or are not that close.
 */
struct vec3 corner_point(const struct scene *scene, const struct bvh *bvh, const struct ray *ray,
                         const struct hit *hit);

#endif
