/* A ray with the values that its tests need, for nearest() and occluded(). */
#ifndef FARM_WORKER_PROBE_H
#define FARM_WORKER_PROBE_H

#include "worker/primitive.h"
#include "worker/rough_triangles.h"
#include "worker/solid_lanes.h"

struct probe {
    const struct scene *scene;
    const struct ray *ray;
    struct shear shear;     /* defined if the scene has triangles */
    struct rough_ray rough; /* set by probe_leaves() */
    struct ray_one line;    /* defined if has_lines() is true */
    struct purpose purpose;
    uint64_t *exact;
};

static INLINED bool has_triangles(const struct scene *scene)
{
    return scene_triangle_count(scene) > 0;
}

static INLINED bool has_planes(const struct scene *scene)
{
    return scene->primitives[PRIMITIVE_PLANE].count > 0;
}

/* Whether there are primitives that worker/solid_lanes.h handles. */
static INLINED bool has_lines(const struct scene *scene)
{
    return has_planes(scene) ||
           scene->primitives[PRIMITIVE_SPHERE].count + scene->primitives[PRIMITIVE_CONE].count > 0;
}

/* Member by member: otherwise the struct would be built in one place and copied to another. */
static INLINED void probe_begin(struct probe *probe, const struct scene *scene,
                                const struct ray *ray, bool any, uint64_t *exact)
{
    probe->scene = scene;
    probe->ray = ray;
    probe->purpose = (struct purpose){any, ray->t_max};
    probe->exact = exact;
    if (has_triangles(scene)) probe->shear = shear_of(&ray->direction);
    if (has_lines(scene)) probe->line = ray_in_one(ray);
}

/* Prepares probe_triangles() for leaves of this tree. */
static INLINED void probe_leaves(struct probe *probe, const struct bvh *bvh)
{
    if (has_triangles(probe->scene)) rough_ray_begin(&probe->rough, bvh, probe->ray, &probe->shear);
}

static INLINED struct crossings probe_crossings(const struct probe *probe, uint32_t id)
{
    return primitive_crossings(probe->scene, id, probe->ray, &probe->shear, &probe->purpose,
                               probe->exact);
}

static INLINED struct crossings probe_triangle(const struct probe *probe,
                                               const struct bvh_leaf *leaf)
{
    return triangle_crossings_ahead(probe->scene, leaf->id, corner_indices(probe->scene, leaf->id),
                                    probe->ray, &probe->shear, &probe->purpose, probe->exact);
}

/*
 * Classifies LANES of the `triangles` of a leaf with `count` entries, from number `first` on: those that may
 * be crossed, and those that certainly are. The triangle that the ray starts on is left out where that costs
 * nothing. Where float does not tell anything, all may be crossed.
 */
static INLINED struct triangle_sets probe_triangles(const struct probe *probe,
                                                    const struct bvh_leaf *leaves, uint32_t count,
                                                    uint32_t triangles, uint32_t first,
                                                    const struct reach *reach)
{
    struct triangle_sets sets = {first_lanes(triangles - first), 0};
    if (!LANES_IN_SIMD) return sets;
    sets.maybe &= ~entries_of(leaves + first, probe->ray->from);
    (void)sort_rough_triangles(bvh_corners(leaves, count), triangles, first, &probe->rough, reach,
                               &sets);
    return sets;
}

#endif
