#include "bench/error_scale.h"

#include <math.h>

/* Write access to what the accessors of common/scene.h return as const. */
static void *writable(struct scene *scene, const struct scene_span *span)
{
    return (char *)scene + span->offset;
}

static double thickness_of_box(const struct box *box)
{
    struct vec3 size = vec_sub(box->max, box->min);
    return fmin(size.x, fmin(size.y, size.z));
}

static double thickness_of_cone(const struct cone *cone)
{
    double length = vec_length(vec_sub(cone->apex, cone->base));
    return fmin(length, 2 * fmax(cone->base_radius, cone->apex_radius));
}

/* The least thickness; 1 if there are no such objects. Boxes without volume do not count. */
static double thinnest(const struct scene *scene)
{
    const struct scene_span *spans = scene->primitives;
    double least = 1;
    for (uint64_t i = 0; i < spans[PRIMITIVE_SPHERE].count; i++)
        least = fmin(least, 2 * scene_spheres(scene)[i].radius);
    for (uint64_t i = 0; i < spans[PRIMITIVE_DISC].count; i++)
        least = fmin(least, 2 * scene_discs(scene)[i].radius);
    for (uint64_t i = 0; i < spans[PRIMITIVE_CONE].count; i++)
        least = fmin(least, thickness_of_cone(&scene_cones(scene)[i]));
    for (uint64_t i = 0; i < spans[PRIMITIVE_BOX].count; i++) {
        double thickness = thickness_of_box(&scene_boxes(scene)[i]);
        if (thickness > 0) least = fmin(least, thickness);
    }
    return least;
}

static void scale_point(struct vec3 *point, double by)
{
    *point = vec_scale(*point, by);
}

static void scale_flat(struct scene *scene, double by)
{
    struct vec3 *vertices = writable(scene, &scene->vertices);
    struct plane *planes = writable(scene, &scene->primitives[PRIMITIVE_PLANE]);
    struct disc *discs = writable(scene, &scene->primitives[PRIMITIVE_DISC]);
    for (uint64_t i = 0; i < scene->vertices.count; i++)
        scale_point(&vertices[i], by);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_PLANE].count; i++)
        scale_point(&planes[i].point, by);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_DISC].count; i++) {
        scale_point(&discs[i].center, by);
        discs[i].radius *= by;
    }
}

static void scale_solids(struct scene *scene, double by)
{
    struct sphere *spheres = writable(scene, &scene->primitives[PRIMITIVE_SPHERE]);
    struct box *boxes = writable(scene, &scene->primitives[PRIMITIVE_BOX]);
    struct cone *cones = writable(scene, &scene->primitives[PRIMITIVE_CONE]);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_SPHERE].count; i++) {
        scale_point(&spheres[i].center, by);
        spheres[i].radius *= by;
    }
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_BOX].count; i++) {
        scale_point(&boxes[i].min, by);
        scale_point(&boxes[i].max, by);
    }
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_CONE].count; i++) {
        scale_point(&cones[i].base, by);
        scale_point(&cones[i].apex, by);
        cones[i].base_radius *= by;
        cones[i].apex_radius *= by;
    }
}

void scale_for_peers(struct scene *scene)
{
    double by = exp2(ceil(-log2(thinnest(scene))));
    struct light *lights = writable(scene, &scene->lights);
    scale_point(&scene->view.camera.eye, by);
    for (uint64_t i = 0; i < scene->lights.count; i++)
        scale_point(&lights[i].position, by);
    scale_flat(scene, by);
    scale_solids(scene, by);
}
