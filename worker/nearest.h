/*
 * The intersection kernel: batches of rays in, hits out. Rays are independent: how they are divided
 * into batches changes no bit, nor does it whether a level of processor takes them one after the
 * other, as the portable one, or several at once.
 *
 * No error checks: the scene is valid (scene_valid()), directions are not zero. A ray with a
 * non-finite component meets nothing.
 */
#ifndef FARM_WORKER_NEAREST_H
#define FARM_WORKER_NEAREST_H

#include "worker/bvh.h"
#include "worker/ray.h"

/* The nearest hit of every ray; among equal distances the one of is_met_first(), see worker/order.h (by
 * the paper's formulas the lowest primitive id), and of one primitive the way in. exact_fallbacks is
 * increased by the number of predicates that needed exact arithmetic. */
void nearest(const struct scene *scene, const struct bvh *bvh, const struct ray *rays, size_t count,
             struct hit *hits, uint64_t *exact_fallbacks);

/*
 * The same, but that most crossings of a sphere or of a cone with caps, and those of triangles and planes
 * by bundles of rays, are told by plain arithmetic: t is then next to the rounded distance, by u at most,
 * and clearly nearer than any other crossing. That is all that points_find() needs, and saves what it takes
 * to round the distance; most of what it says of a triangle follows from the weights alone.
 */
void nearest_rough(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                   size_t count, struct hit *hits, uint64_t *exact_fallbacks);

/* In place of a weight where a hit of a triangle or patch has none yet. */
#define WEIGHT_UNKNOWN (-1.0)

/* Whether t is not yet rounded. Solids are the kinds behind the patches. */
static inline bool is_rough_hit(const struct hit *hit)
{
    return primitive_kind(hit->primitive) > PRIMITIVE_PATCH ? hit->u > 0 : hit->v == WEIGHT_UNKNOWN;
}

/* What nearest() tells of a ray, from what nearest_rough() does. */
struct hit settled_hit(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                       uint64_t *exact_fallbacks);

/*
 * What share of light comes through along 0 < t < t_max: (1,1,1) when nothing is in the way,
 * (0,0,0) behind anything opaque, else for every crossing of a transparent surface transmission *
 * color of its material, multiplied in the order of material index so that it does not depend on
 * the BVH. The same tests as nearest().
 */
void occluded(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
              size_t count, struct vec3 *transmittance, uint64_t *exact_fallbacks);

/* Where a hit lies and which way the surface faces there. */
struct surface {
    struct vec3 point;     /* off the surface by 4 u of its largest coordinate at most, to the side
                            * that the ray came from */
    struct vec3 geometric; /* unit; a solid's points outward, a triangle's to its front */
    struct vec3 shading;   /* unit; interpolated on a patch, else the geometric one */
    uint32_t material;
};

/* The surface at a hit that nearest() found for this ray. */
void surface_at(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                struct surface *surface);

/* More surfaces than so many others in one point are those of a crowd, not of a room. */
#define CORNER_OTHERS 8

/* Its point, drawn in from the corner with the first CORNER_OTHERS others, hits of the same ray: see
 * worker/corner.h. */
struct vec3 surface_drawn_in(const struct scene *scene, const struct ray *ray,
                             const struct hit *hit, const struct hit *others, uint32_t count);

/* Its point, but put off to the other side: where a ray starts that goes back through surfaces in the same
 * plane; see worker/order.h. */
struct vec3 surface_beyond(const struct scene *scene, const struct ray *ray, const struct hit *hit);

#endif
