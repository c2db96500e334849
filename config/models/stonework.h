/*
 * Shapes of carved stone: profiles that become solids of revolution or hexagonal solids, lotus petals carved into them,
 * and the finish of the surface.
 */
#ifndef FARM_CONFIG_MODELS_STONEWORK_H
#define FARM_CONFIG_MODELS_STONEWORK_H

#include "config/models/mesh.h"

#define STONEWORK_POINTS 512 /* of a profile or an outline, at most */
#define STONEWORK_SIDES  6   /* of hexagonal solids */

/* A polyline of (radius, height) from the bottom upwards. */
struct profile {
    struct point2 points[STONEWORK_POINTS];
    size_t count;
    double step; /* the greatest length of a segment */
};

void profile_start(struct profile *profile, double radius, double height, double step);
void profile_line(struct profile *profile, double x, double y);

/* A quadratic Bezier curve towards (x, y), pulled by (cx, cy). */
void profile_curve(struct profile *profile, double cx, double cy, double x, double y);

/* A solid of revolution. */
void profile_turn(struct mesh *mesh, const struct profile *profile, size_t segments);

/* A hexagonal solid: its corners point along x, its faces along z and every 60 degrees from there;
 * the radius is that of the corners. */
void profile_cut(struct mesh *mesh, const struct profile *profile, double rounding,
                 size_t side_points);

/* The outline that profile_cut() uses, of STONEWORK_POINTS at most: more side points are left out.
 */
size_t hexagon_outline(struct point2 *outline, double rounding, size_t side_points);

/* A ring of lotus petals on a solid of revolution. */
struct petals {
    double root, tip;      /* heights where the petals begin and end */
    double inner;          /* only points farther than this from the axis are carved */
    double count;          /* petals round the axis */
    double relief;         /* how far the petals stand out */
    struct vec3 direction; /* in which they stand out: x is radial, y is up */
};

/* A mesh_move that carves petals; context: struct petals. */
struct vec3 petals_carve(const void *context, struct vec3 p);

struct stone {
    double moss; /* 0: none, 1: all over the upper sides */
    uint32_t seed;
};

/* Finishes a part as stone: welds it, roughens it, smooths it up to crease degrees, and paints it with granite,
 * granite_light, granite_dark and moss. */
void stone_finish(struct mesh *mesh, struct mesh_mark from, const struct stone *stone,
                  double crease);

#endif
