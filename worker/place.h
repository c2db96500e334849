/*
 * Where on a primitive a hit lies, in double-double, and where a ray goes on from there.
 *
 * A point cannot lie on the surface but for luck: what a secondary ray does with other surfaces
 * that touch this one there would be luck, too. So the point is put off the surface, to the side
 * that the ray came from, by just more than its coordinates' rounding. A ray that goes through then
 * still has everything before it that touches this surface from behind, such as the floor under a
 * glass ball, and a reflected or shadow ray starts on the side where it belongs. The surface itself
 * is not met again because the ray names it; for others in its plane see worker/order.h. For this
 * the point is known in double-double and rounded once.
 */
#ifndef FARM_WORKER_PLACE_H
#define FARM_WORKER_PLACE_H

#include "worker/exact.h"

/* A point as an offset from one of the primitive's own, which are exact. */
struct place {
    struct vec3 anchor;
    struct dd3 offset;
};

static inline struct vec3 place_rounded(const struct place *place)
{
    return dd3_round(dd3_add(dd3_of(place->anchor), place->offset));
}

/*
 * Rounding displaces each coordinate by u of itself at most, the point by sqrt(3) u of the largest
 * one; 2 u is what it is put off by, so it ends between 0.26 u and 3.74 u from the surface.
 */
#define STAND_OFF (2 * UNIT_ROUNDOFF)

/* Off the surface to the side against which the ray runs. */
static inline struct vec3 stand_off(const struct place *place, struct vec3 normal,
                                    struct vec3 direction)
{
    double distance = STAND_OFF * vec_largest(place_rounded(place));
    double side = vec_dot(direction, normal) <= 0 ? 1 : -1;
    struct dd3 step = dd3_of(vec_scale(normal, side * distance));
    struct place off = {place->anchor, dd3_add(place->offset, step)};
    return place_rounded(&off);
}

/* ---- triangles ---- */

/*
 * The weighted mean of the vertices is in the triangle's plane and in the triangle, however far
 * away the eye is; where the line crosses the plane is better on a ground of a few huge triangles
 * around the eye: u of the distance instead of u of the triangle. From an eye that sees the plane
 * from its edge it may be nowhere near the hit.
 */
static inline double triangle_size(struct vec3 a, struct vec3 b, struct vec3 c)
{
    return vec_largest(vec_sub(b, a)) + vec_largest(vec_sub(c, a));
}

/*
 * On an edge a hit is on the triangle behind it, too, as far as rounding tells. What goes on from there would be on
 * this or that side of the other one by luck, and what is thrown back into a corner be lost outside of it. So a
 * point that is nearer to an edge than EDGE_OFF of its largest coordinate is drawn in, towards the middle, until it
 * is not: farther than stand_off() puts it off the plane, if the two meet at 3.4 degrees or more. Not by more than
 * DRAWN_IN_MOST of the way: in a triangle 10^4 times as long as high that is less far. Weights err by some u, a
 * point by as much of the triangle's size, and at the origin there is no coordinate: SHARE_OF_SIZE counts as one.
 */
#define EDGE_OFF      (64 * UNIT_ROUNDOFF)
#define DRAWN_IN_MOST 0x1p-30
#define SHARE_OF_SIZE 0.25

static inline double edge_distance(double size, double coordinate)
{
    return EDGE_OFF * larger_number(coordinate, SHARE_OF_SIZE * size);
}

/* The share of the way to the middle that leads so far from each edge. normal: (b - a) x (c - a), twice the area, which
 * is the lowest height times the longest edge, of 3^0.5 sizes at most; coordinate: the point's largest. */
static inline double drawn_in(struct vec3 normal, double size, double coordinate)
{
    double share = 3 * edge_distance(size, coordinate) * 2 * size / vec_length(normal);
    return share < DRAWN_IN_MOST ? share : DRAWN_IN_MOST;
}

static inline double least_weight(double u, double v)
{
    return smaller_number(smaller_number(u, v), 1 - u - v);
}

/* Whether the point may be so near to an edge, with twice the limit of drawn_in() to spare for rounding; true
 * where that is not to be told. Without a root or a quotient, for lanes. */
static inline bool may_be_drawn_in(double u, double v, struct vec3 normal, double size,
                                   double coordinate)
{
    double height = 4 * edge_distance(size, coordinate) * size, least = least_weight(u, v);
    double square = vec_dot(normal, normal);
    return !((least > 0) & (square < HUGE_VAL) & (least * least * square > height * height));
}

/* The mean, from a: b has the weight u, c has v. */
static inline struct dd3 triangle_mean(struct vec3 a, struct vec3 b, struct vec3 c, double u,
                                       double v)
{
    struct dd3 to_b = exact_difference3(b, a), to_c = exact_difference3(c, a);
    return dd3_add(dd3_multiply(to_b, dd(u)), dd3_multiply(to_c, dd(v)));
}

/* Where the line crosses the plane, from a; *speed is 0 where that is not to be told. */
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

/* Whether the passage, which is NaN or infinite where there is none, is as near to the mean as it
 * should. */
static inline bool triangle_passes(const struct dd3 *passage, double speed, const struct dd3 *mean,
                                   double size)
{
    struct vec3 at = dd3_round(*passage), apart = vec_sub(at, dd3_round(*mean));
    bool finite = (at.x - at.x) + (at.y - at.y) + (at.z - at.z) == 0;
    return (speed != 0) & finite & (vec_largest(apart) <= 0x1p-40 * size);
}

#endif
