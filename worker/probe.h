/* A ray and what its tests need, for nearest() and occluded(). */
#ifndef FARM_WORKER_PROBE_H
#define FARM_WORKER_PROBE_H

#include "worker/primitive.h"
#include "worker/solid_lanes.h"
#include "worker/traverse.h"
#include "worker/triangle_lanes.h"

struct probe {
    const struct scene *scene;
    const struct ray *ray;
    struct shear shear; /* of scenes with triangles */
    struct shear_quad shear_quad;
    struct ray_one line; /* of scenes with spheres or cones */
    struct purpose purpose;
    uint64_t *exact;
};

static INLINED bool has_triangles(const struct scene *scene)
{
    return scene->primitives[PRIMITIVE_TRIANGLE].count + scene->primitives[PRIMITIVE_PATCH].count >
           0;
}

static INLINED bool has_solids(const struct scene *scene)
{
    return scene->primitives[PRIMITIVE_SPHERE].count + scene->primitives[PRIMITIVE_CONE].count > 0;
}

/* Member by member: as a whole it would be put together in one place and copied to another. */
static INLINED void probe_begin(struct probe *probe, const struct scene *scene,
                                const struct ray *ray, bool any, uint64_t *exact)
{
    probe->scene = scene;
    probe->ray = ray;
    probe->purpose = (struct purpose){any, ray->t_max};
    probe->exact = exact;
    if (has_triangles(scene)) {
        probe->shear = shear_of(&ray->direction);
        probe->shear_quad = shear_quad_of(&probe->shear, &ray->origin);
    }
    if (has_solids(scene)) probe->line = ray_in_one(ray);
}

static inline bool ray_is_finite(const struct ray *ray)
{
    return vec_is_finite(ray->origin) && vec_is_finite(ray->direction);
}

/* The ids of the planes, which are tested for every ray, are consecutive. */
static inline uint32_t plane_ids_end(const struct scene *scene)
{
    return primitive_id(PRIMITIVE_PLANE, (uint32_t)scene->primitives[PRIMITIVE_PLANE].count);
}

/* naive is a constant wherever this is inlined: the choice of formulas costs nothing per ray. */
static INLINED struct crossings probe_crossings(const struct probe *probe, uint32_t id, bool naive)
{
    if (naive) return naive_crossings(probe->scene, id, probe->ray);
    return primitive_crossings(probe->scene, id, probe->ray, &probe->shear, &probe->purpose,
                               probe->exact);
}

static INLINED struct crossings probe_triangle(const struct probe *probe,
                                               const struct bvh_leaf *leaf, bool naive)
{
    if (naive) return naive_corner_crossings(probe->scene, leaf->vertex, probe->ray);
    return corner_crossings(probe->scene, leaf->id, leaf->vertex, probe->ray, &probe->shear,
                            &probe->purpose, probe->exact);
}

/* How many of the primitives of a leaf are triangles; they come first. */
static inline uint32_t triangles_of(const struct bvh_leaf *leaves, uint32_t count)
{
    if (is_triangle(leaves[count - 1].id)) return count;
    uint32_t triangles = 0;
    while (is_triangle(leaves[triangles].id))
        triangles++;
    return triangles;
}

/* How many triangles probe_triangles() looks at. */
static INLINED uint32_t triangles_at_once(bool naive)
{
    return naive ? LANES : QUAD;
}

/* Of `count` triangles, of the first of them, those that may be crossed, and those that certainly
 * are. */
static INLINED struct triangle_sets probe_triangles(const struct probe *probe,
                                                    const struct bvh_leaf *leaves, uint32_t count,
                                                    const struct reach *reach, bool naive)
{
    if (!LANES_IN_SIMD) {
        uint32_t most = triangles_at_once(naive);
        return (struct triangle_sets){first_lanes(count < most ? count : most), 0};
    }
    const struct vec3 *vertices = scene_vertices(probe->scene);
    if (naive) return (struct triangle_sets){naive_crossed(vertices, leaves, count, probe->ray), 0};
    return sort_triangles(vertices, leaves, count, &probe->shear_quad, reach);
}

static inline bool crossing_counts(const struct ray *ray, double t)
{
    return t > 0 && t < ray->t_max;
}

#endif
