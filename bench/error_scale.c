#include "bench/error_scale.h"

#include <math.h>

#include "bench/scenes.h"

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

void scale_for_peers(struct scene *scene)
{
    double by = exp2(ceil(-log2(thinnest(scene))));
    scene_move(scene, by, vec3(0, 0, 0));
}
