/*
 * The intersection kernel: takes batches of rays and returns hits. Rays are independent of each other. The
 * results are bit-identical however rays are divided into batches, and whether a processor level traces them
 * one by one, as the portable one, or several at once.
 *
 * There are no error checks: the scene is valid (scene_valid()) and directions are not zero. A ray with a
 * non-finite component hits nothing.
 */
#ifndef FARM_WORKER_NEAREST_H
#define FARM_WORKER_NEAREST_H

#include "worker/bvh.h"
#include "worker/ray.h"

/*
 * The nearest hit of every ray. Among equal distances has_priority() decides, see worker/order.h (with the
 * paper's formulas the lowest primitive id); within one primitive the entry. Adds to *exact_fallbacks the
 * number of predicates that needed exact arithmetic.
 */
void nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays, size_t count,
             struct hit *hits, uint64_t *exact_fallbacks);

/*
 * The same, but most crossings of a sphere or of a capped cone, and those of triangles and planes by bundles
 * of rays, are computed in plain arithmetic. Their t then differs from the rounded distance by at most hit_t_error(),
 * and is clearly less than that of any other crossing. That is all that points_find() needs, and saves the
 * computation of the rounded distance; most values of a point on a triangle follow from the weights alone.
 */
void nearest_rough(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                   size_t count, struct hit *hits, uint64_t *exact_fallbacks);

/* In place of a weight that is not yet computed, in the hit of a triangle or patch. */
#define WEIGHT_UNKNOWN (-1.0)

/* Whether t is only approximate. */
static inline bool is_rough_hit(const struct hit *hit)
{
    return is_triangle(hit->primitive) ? hit->v == WEIGHT_UNKNOWN : hit_t_error(hit) > 0;
}

/* The hit of nearest() for a ray, from that of nearest_rough(). */
struct hit settled_hit(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                       uint64_t *exact_fallbacks);

/* Whether the ray meets the solid from outside: its entry is ahead. */
bool is_entry_ahead(const struct scene *scene, const struct ray *ray, uint32_t primitive,
                    uint64_t *exact_fallbacks);

/*
 * The share of light that passes along 0 < t < t_max: (1,1,1) if nothing is in the way, (0,0,0) behind
 * anything opaque, else the product over all crossings of transparent surfaces of transmission * color of the
 * material. The factors are multiplied in the order of material index, so that the result does not depend on
 * the BVH. The tests are those of nearest().
 */
void occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
              size_t count, struct vec3 *transmittance, uint64_t *exact_fallbacks);

/* The point of a hit and the normals there. */
struct surface {
    /* Off the surface by at most 4 u of its largest coordinate, on the side that the ray came from. */
    struct vec3 point;
    struct vec3 geometric; /* unit; points outward on a solid, to the front on a triangle */
    struct vec3 shading;   /* unit; interpolated on a patch, else the geometric normal */
    uint32_t material;
};

/* The surface at a hit that nearest() found for this ray. */
void surface_at(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                struct surface *surface);

/* The most other surfaces that are taken into account at one point. More of them belong to a tangle, not to a
 * room. */
#define CORNER_OTHERS 8

/* The point of the hit, moved away from the first CORNER_OTHERS others, which are hits of the same ray: see
 * worker/corner.h. */
struct vec3 surface_away_from_others(const struct scene *scene, const struct ray *ray,
                                     const struct hit *hit, const struct hit *others,
                                     uint32_t count);

/*
 * The point of the hit, but moved off to the other side of the surface: the origin of a ray that goes back
 * through surfaces in the same plane, see worker/order.h.
 */
struct vec3 surface_beyond(const struct scene *scene, const struct ray *ray, const struct hit *hit);

#endif
