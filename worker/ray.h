/* What the intersection kernel takes and gives. */
#ifndef FARM_WORKER_RAY_H
#define FARM_WORKER_RAY_H

#include <stdint.h>

#include "common/scene.h"

/* Parts of a solid, so that a ray that leaves a surface knows which one. Other kinds have part 0.
 */
enum {
    CONE_SIDE = 0,
    CONE_BASE_CAP = 1,
    CONE_APEX_CAP = 2,
    /* box: 2 * axis + (0: the min face, 1: the max face) */
};

/* Beside a part in from_part, see below. */
#define FROM_REVERSED 0x100u

/*
 * The half-open segment origin + t direction, 0 < t < t_max. direction need not have unit length
 * and is never zero; t_max may be infinite.
 *
 * A ray that starts on a surface names it (from, from_part; PRIMITIVE_NONE otherwise), and that
 * root is left out by identity, not by an epsilon: a plane, disc, triangle, patch, box face or cap
 * is not met again; of a sphere or cone side the root at the origin is known to be 0 and the other
 * one is solved for with that knowledge.
 *
 * Surfaces in one plane are crossed at one place, one after the other; worker/order.h tells which.
 * FROM_REVERSED in from_part: this ray crosses those of the plane that it starts in from the last one to
 * the first, because it is on its way back.
 */
struct ray {
    struct vec3 origin;
    struct vec3 direction;
    double t_max;
    uint32_t from;
    uint32_t from_part;
};

/* Of rays that name a surface: the part alone. */
static inline uint32_t ray_from_part(const struct ray *ray)
{
    return ray->from_part & ~FROM_REVERSED;
}

struct hit {
    double t;           /* of the nearest hit; infinite when there is none */
    double u, v;        /* triangle, patch: weights of vertex 1 and 2; else 0, but that of a rough
                         * hit u is what t may be off by: see nearest_rough(), is_rough_hit() */
    uint32_t primitive; /* PRIMITIVE_NONE: the ray meets nothing */
    uint16_t part;
    /* 1: others may be crossed in the same point, see worker/corner.h; else 0. */
    uint16_t in_corner;
};

#endif
