/* Which of two crossings comes first. */
#ifndef FARM_WORKER_ORDER_H
#define FARM_WORKER_ORDER_H

#include "worker/triangle.h"

/*
 * Distances are rounded, and so are the origins of rays that start on a surface: by this many u of
 * the largest coordinate or distance in play, 8 for a triangle's distance and 4 for where a ray
 * starts, which the slope of the surfaces magnifies. Closer than that the order is taken from
 * double-double, in which a way out is nearer than WAY_OUT_ERROR to what is said of it.
 */
#define ORDER_ERROR (64 * UNIT_ROUNDOFF)

/* The share of it that the ray's origin has in every distance along the ray. */
static inline double order_error_of_origin(const struct ray *ray)
{
    return ORDER_ERROR * largest_component(ray->origin) / largest_component(ray->direction);
}

/* -1, 0 or 1 for crossings of different primitives close to t: part as in struct hit. */
struct crossing {
    uint32_t primitive, part;
    double t;
};

int compare_crossings(const struct scene *scene, const struct ray *ray, const struct shear *shear,
                      const struct crossing *a, const struct crossing *b);

#endif
