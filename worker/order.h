/* Which of two crossings comes first. */
#ifndef FARM_WORKER_ORDER_H
#define FARM_WORKER_ORDER_H

#include "worker/triangle.h"

/*
 * Distances are rounded, and so are the origins of rays that start on a surface: by this many u of
 * the largest coordinate or distance in play, 8 for a triangle's distance and 4 for where a ray
 * starts, which the slope of the surfaces magnifies. Closer than that the order of flat surfaces is told
 * without rounding, and that of others taken from double-double, in which a way out is nearer than
 * WAY_OUT_ERROR to what is said of it.
 */
#define ORDER_ERROR (64 * UNIT_ROUNDOFF)

/* The share of it that the ray's origin has in every distance along the ray. */
static inline double order_error_of_origin(const struct ray *ray)
{
    return ORDER_ERROR * vec_largest(ray->origin) / vec_largest(ray->direction);
}

/* Of a primitive: part as in struct hit. */
struct crossing {
    uint32_t primitive, part;
    double t;
};

/* -1, 0 or 1 for crossings of different primitives whose distances are close to each other. Of what is
 * flat without rounding: double-double, by the formulas of each, would call what lies in one plane one way
 * or the other, and a third surface through the same line might come before the one and behind the
 * other, so that which of the three is met would depend on which is looked at first. */
int compare_crossings(const struct scene *scene, const struct ray *ray, const struct shear *shear,
                      const struct crossing *a, const struct crossing *b);

/*
 * Which of two primitives is met where they are equally far: what is opaque, so that glass on a floor
 * has the floor itself for its bottom, as if it were sunk by a hair. A ray that the floor throws back
 * starts on the glass's side of both and so has not left the glass; had it been said to, it would leave
 * it twice. Of two of a kind the lower id.
 */
bool is_met_first(const struct scene *scene, uint32_t a, uint32_t b);

/*
 * Surfaces in one plane, sphere, cylinder or cone are crossed in the order of is_met_first(), whatever the ray's
 * direction, as if they were a hair apart in just that way. From each of them a ray goes on that starts on the side of
 * all of them that it came from: those before it lie ahead once more, and it has passed them. What one of
 * them throws back is between it and the one before it: it starts on the other side of the surface, see
 * surface_beyond(), and crosses them in the reverse order; and what is thrown back on its way, in their
 * order again. All this only where is_near_start() says so.
 */

/* Whether the crossing lies where the ray starts: with a surface that lies in the one that it starts on, and, where
 * that is round, on this side of it. */
bool is_at_start(const struct scene *scene, const struct ray *ray, const struct crossing *crossing);

/* Whether the ray has passed the surface of such a crossing already. */
bool is_passed(const struct scene *scene, const struct ray *ray, const struct crossing *crossing);

/* Whether it crosses them in the reverse order. */
static inline bool is_reversed(const struct ray *ray)
{
    return (ray->from_part & FROM_REVERSED) != 0;
}

/* Which of two crossings that compare_crossings() calls equal comes first. */
bool is_first_of_equals(const struct scene *scene, const struct ray *ray, const struct crossing *a,
                        const struct crossing *b);

#endif
