/* The rays and hits of the intersection kernel. */
#ifndef FARM_WORKER_RAY_H
#define FARM_WORKER_RAY_H

#include <stdbool.h>
#include <stdint.h>

#include "common/scene.h"

/* Parts of a solid, so that a ray that leaves a surface can name it. Other kinds have only part 0. */
enum {
    CONE_SIDE = 0,
    CONE_BASE_CAP = 1,
    CONE_APEX_CAP = 2,
    /* box: 2 * axis + (0: the min face, 1: the max face) */
};

/* A flag in from_part beside the part, see below. */
#define FROM_REVERSED 0x100u

/*
 * A ray: origin + t direction for 0 < t < t_max. direction need not have unit length and is never zero; t_max
 * may be infinite.
 *
 * A ray that starts on a surface names it (from, from_part; otherwise PRIMITIVE_NONE). The intersection at
 * the origin is then excluded by identity, not by an epsilon. A plane, disc, triangle, patch, box face or cap
 * is not hit again. For a sphere or the side of a cone, the root at the origin is known to be 0, and the
 * other root is computed from that.
 *
 * Coplanar surfaces are crossed at one place, in an order that worker/order.h defines. FROM_REVERSED in
 * from_part says that this ray crosses the surfaces in the plane of its start in the reverse order, because
 * it is on its way back.
 */
struct ray {
    struct vec3 origin;
    struct vec3 direction;
    double t_max;
    uint32_t from;
    uint32_t from_part;
};

static inline bool ray_is_finite(const struct ray *ray)
{
    return vec_is_finite(ray->origin) && vec_is_finite(ray->direction);
}

/* The part alone, for rays that name a surface. */
static inline uint32_t ray_from_part(const struct ray *ray)
{
    return ray->from_part & ~FROM_REVERSED;
}

struct hit {
    double t; /* of the nearest hit; infinite if there is none */
    /*
     * Triangle, patch: barycentric weights of vertex 1 and 2; else 0. But in a rough hit u is a bound on the
     * error of t: see nearest_rough(), hit_t_error().
     */
    double u, v;
    uint32_t primitive; /* PRIMITIVE_NONE: no hit */
    uint16_t part;
    /* 1: other surfaces may be crossed at the same point, see worker/corner.h; else 0. */
    uint16_t in_corner;
};

/* In a rough hit (is_rough_hit()), where u is no weight: a bound on the error of t. */
static inline double hit_t_error(const struct hit *hit)
{
    return hit->u;
}

#endif
