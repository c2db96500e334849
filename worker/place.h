/*
 * The point of a hit on a primitive, in double-double, and the origin of rays that go on from there.
 *
 * A rounded point is hardly ever exactly on the surface. What a secondary ray does there with other surfaces
 * that touch this one would depend on the rounding. So the point is moved off the surface, to the side that
 * the ray came from, by just more than the rounding of its coordinates. A transmitted ray then still has
 * ahead of it everything that touches this surface from behind, such as the floor under a glass ball, and a
 * reflected or shadow ray starts on the correct side. The ray does not hit this surface again because it
 * names it; for others in the same plane see worker/order.h. The point is computed in double-double for this
 * and rounded once.
 */
#ifndef FARM_WORKER_PLACE_H
#define FARM_WORKER_PLACE_H

#include "worker/exact.h"

/* A point as an offset from an anchor: a point of the primitive whose coordinates are exact. */
struct place {
    struct vec3 anchor;
    struct dd3 offset;
};

static inline struct vec3 place_rounded(const struct place *place)
{
    return dd3_round(dd3_add(dd3_of(place->anchor), place->offset));
}

/*
 * Rounding displaces each coordinate by at most u of itself, hence the point by at most sqrt(3) u of its
 * largest coordinate. It is moved off by 2 u of that, so it ends between 0.26 u and 3.74 u from the surface.
 */
#define SURFACE_OFFSET (2 * UNIT_ROUNDOFF)

/* The rounded point, moved off the surface to the side that the ray comes from. */
static inline struct vec3 offset_from_surface(const struct place *place, struct vec3 normal,
                                              struct vec3 direction)
{
    double distance = SURFACE_OFFSET * vec_largest(place_rounded(place));
    double side = vec_dot(direction, normal) <= 0 ? 1 : -1;
    struct dd3 step = dd3_of(vec_scale(normal, side * distance));
    struct place off = {place->anchor, dd3_add(place->offset, step)};
    return place_rounded(&off);
}

/* ---- triangles ---- */

/*
 * There are two ways to compute the point of a hit. The weighted mean of the vertices lies in the triangle's
 * plane and in the triangle, however far away the eye is. The intersection of the line and the plane is more
 * accurate if the eye is near a few huge triangles, such as a ground: its error is u of the distance instead
 * of u of the triangle's size. But for an eye that sees the plane edge-on it may be nowhere near the hit.
 */
static inline double triangle_size(struct vec3 a, struct vec3 b, struct vec3 c)
{
    return vec_largest(vec_sub(b, a)) + vec_largest(vec_sub(c, a));
}

/* Whether the products of lengths by which a point is found stay in the range of double: products of up to four are
 * 2^-800 to 2^800 then, and their low parts, 2^-53 of them, and those of these are still above 2^-1022. */
static inline bool size_is_ordinary(double size)
{
    return (size > 0x1p-200) & (size < 0x1p200);
}

/*
 * A hit on an edge is also on the neighbouring triangle, as far as rounding can tell. The origin of a
 * secondary ray would be on a random side of the neighbour, and a ray reflected into a corner could be lost
 * outside of it. So a point that is closer to an edge than EDGE_OFF of its largest coordinate is moved
 * towards the triangle's centroid until it is not. That is farther than offset_from_surface() moves it off the plane,
 * if the two triangles meet at 3.4 degrees or more. The move is at most INWARD_SHARE_MOST of the way, which is
 * too little in a triangle 10^4 times as long as high. The error of a point is that of the weights, some u of
 * the triangle's size; near the origin, where coordinates are small, SHARE_OF_SIZE of the size counts as a
 * coordinate.
 */
#define EDGE_OFF          (64 * UNIT_ROUNDOFF)
#define INWARD_SHARE_MOST 0x1p-30
#define SHARE_OF_SIZE     0.25

static inline double edge_distance(double size, double coordinate)
{
    return EDGE_OFF * larger_number(coordinate, SHARE_OF_SIZE * size);
}

/*
 * The share of the way to the centroid that moves the point far enough from each edge. normal: (b - a) x (c -
 * a); its length is twice the area, which is the lowest height times the longest edge, and that is at most
 * 3^0.5 sizes. coordinate: the point's largest.
 */
static inline double inward_share(struct vec3 normal, double size, double coordinate)
{
    double share = 3 * edge_distance(size, coordinate) * 2 * size / vec_length(normal);
    return share < INWARD_SHARE_MOST ? share : INWARD_SHARE_MOST;
}

static inline double least_weight(double u, double v)
{
    return smaller_number(smaller_number(u, v), 1 - u - v);
}

/*
 * Whether the point may be so close to an edge that it is moved, with twice the limit of inward_share() as a
 * margin for rounding; also true if that cannot be decided. Uses no root or quotient, for use in lanes.
 */
static inline bool may_move_inward(double u, double v, struct vec3 normal, double size,
                                   double coordinate)
{
    double height = 4 * edge_distance(size, coordinate) * size, least = least_weight(u, v);
    double square = vec_dot(normal, normal);
    return !((least > 0) & (square < HUGE_VAL) & (least * least * square > height * height));
}

/* The weighted mean of the vertices, relative to a: b has the weight u, c has v. */
static inline struct dd3 triangle_mean(struct vec3 a, struct vec3 b, struct vec3 c, double u,
                                       double v)
{
    struct dd3 to_b = exact_difference3(b, a), to_c = exact_difference3(c, a);
    return dd3_add(dd3_multiply(to_b, dd(u)), dd3_multiply(to_c, dd(v)));
}

/* The intersection of the line and the plane, relative to a; *speed is 0 if it cannot be computed. */
static inline struct dd3 triangle_passage(struct vec3 a, struct vec3 b, struct vec3 c,
                                          struct vec3 origin, struct vec3 direction, double *speed)
{
    struct dd3 normal = dd3_cross(exact_difference3(b, a), exact_difference3(c, a));
    struct dd3 f = exact_difference3(origin, a);
    struct dd across = dd3_dot_vec(normal, direction);
    struct dd t = dd_negate(dd_div(dd3_dot(f, normal), across));
    *speed = across.high;
    return dd3_add(f, dd3_scale(direction, t));
}

/* Whether the intersection, which is NaN or infinite if there is none, is close enough to the mean. */
static inline bool triangle_passes(const struct dd3 *passage, double speed, const struct dd3 *mean,
                                   double size)
{
    struct vec3 at = dd3_round(*passage), apart = vec_sub(at, dd3_round(*mean));
    bool finite = (at.x - at.x) + (at.y - at.y) + (at.z - at.z) == 0;
    return (speed != 0) & finite & (vec_largest(apart) <= 0x1p-40 * size);
}

#endif
