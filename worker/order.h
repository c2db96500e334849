/* The order of crossings that are close to each other. */
#ifndef FARM_WORKER_ORDER_H
#define FARM_WORKER_ORDER_H

#include "worker/triangle.h"

/*
 * Crossings closer than this have an uncertain order, because distances are rounded, as are the origins of
 * rays that start on a surface. The errors are multiples of u of the largest coordinate or distance involved:
 * 8 for a triangle's distance and 4 for the origin of a ray, magnified by the slope of the surfaces. The
 * order of such crossings is decided exactly for flat surfaces, and in double-double for others, where the
 * distance of an exit has an error of up to WAY_OUT_ERROR.
 */
#define ORDER_ERROR (64 * UNIT_ROUNDOFF)

/* The part of this error that the ray's origin causes, the same for every distance along the ray. */
static inline double order_error_of_origin(const struct ray *ray)
{
    return ORDER_ERROR * vec_largest(ray->origin) / vec_largest(ray->direction);
}

/* A crossing of a primitive; part as in struct hit. */
struct crossing {
    uint32_t primitive, part;
    double t;
};

/*
 * Compares crossings of different primitives at distances close to each other: -1, 0 or 1. Flat surfaces are
 * compared exactly. Double-double, with the formulas of each kind, would order coplanar surfaces one way or
 * the other. A third surface through the same line might then come before one of them and after the other, so
 * that the hit would depend on which pair is compared first.
 *
 * Two triangles that transmit light and meet in an edge or a corner, exactly where the ray goes through, are in the
 * order in which a displaced ray crosses them, the one that decides whether they are crossed at all. So the ray enters
 * a mesh before it leaves it, or the other way round in a groove of the mesh, as a ray beside it does.
 */
int compare_crossings(const struct scene *scene, const struct ray *ray, const struct shear *shear,
                      const struct crossing *a, const struct crossing *b);

/*
 * Whether a is hit, not b, at equal distances. Opaque surfaces win, so that glass on a floor has the floor
 * itself for its bottom, as if it were sunk a little. A ray reflected by the floor starts on the glass's side
 * of both and so has not left the glass; if the glass had won, the ray would leave it twice. Of two opaque or
 * two transparent ones the lower id wins.
 */
bool has_priority(const struct scene *scene, uint32_t a, uint32_t b);

/*
 * Surfaces in one plane, sphere, cylinder or cone are crossed in the order of has_priority(), whatever the
 * ray's direction, as if they were slightly apart in that order. A ray that goes on from one of them starts
 * on that side of all of them that it came from. Those before it in the order then lie ahead once more, but
 * the ray has passed them. A ray that one of them reflects is between it and the one before it. It starts on
 * the other side of the surface, see surface_beyond(), and crosses them in the reverse order; if it is
 * reflected again on its way, in the original order. All this applies only where is_near_start() is true.
 */

/*
 * Whether the crossing is at the start of the ray: with a surface that lies in the one that it starts on and,
 * if that is round, on the near side of it.
 */
bool is_at_start(const struct scene *scene, const struct ray *ray, const struct crossing *crossing);

/* Whether the ray has already passed the surface of such a crossing. */
bool is_passed(const struct scene *scene, const struct ray *ray, const struct crossing *crossing);

/* Whether the ray crosses coplanar surfaces in the reverse order. */
static inline bool is_reversed(const struct ray *ray)
{
    return (ray->from_part & FROM_REVERSED) != 0;
}

/* Whether a comes first, of two crossings for which compare_crossings() gives 0. */
bool precedes_if_equal(const struct scene *scene, const struct ray *ray, const struct crossing *a,
                       const struct crossing *b);

#endif
