#include "master/enclosed.h"

#include <stdbool.h>
#include <stdlib.h>

#include "common/message.h"
#include "common/vec.h"
#include "master/key.h"

/* Most pairs of a light and a solid that are tested: a tenth of a second, at 5 to 10 ns each. */
#define PAIRS_MOST UINT64_C(10000000)

static bool is_in_sphere(const struct sphere *sphere, struct vec3 at)
{
    struct vec3 way = vec_sub(at, sphere->center);
    return vec_dot(way, way) < sphere->radius * sphere->radius;
}

static bool is_in_box(const struct box *box, struct vec3 at)
{
    return at.x > box->min.x && at.y > box->min.y && at.z > box->min.z && at.x < box->max.x &&
           at.y < box->max.y && at.z < box->max.z;
}

static bool is_in_cone(const struct cone *cone, struct vec3 at)
{
    struct vec3 axis = vec_sub(cone->apex, cone->base), way = vec_sub(at, cone->base);
    double height = vec_dot(way, axis) / vec_dot(axis, axis); /* 0 at the base, 1 at the apex */
    double radius = cone->base_radius + height * (cone->apex_radius - cone->base_radius);
    struct vec3 out = vec_add_scaled(way, axis, -height);
    return height > 0 && height < 1 && vec_dot(out, out) < radius * radius;
}

static bool is_in(const struct scene *scene, uint32_t solid, struct vec3 at)
{
    uint32_t index = primitive_index(solid);
    enum primitive_kind kind = primitive_kind(solid);
    return kind == PRIMITIVE_SPHERE ? is_in_sphere(&scene_spheres(scene)[index], at)
           : kind == PRIMITIVE_BOX  ? is_in_box(&scene_boxes(scene)[index], at)
                                    : is_in_cone(&scene_cones(scene)[index], at);
}

/* Whether the primitive is an opaque solid with the light inside and the eye outside. */
static bool encloses(const struct scene *scene, uint32_t id, const struct light *light)
{
    const struct material *material = &scene_materials(scene)[primitive_material(scene, id)];
    return primitive_is_solid(scene, id) && !(material->transmission > 0) &&
           is_in(scene, id, light->position) && !is_in(scene, id, scene->view.camera.eye);
}

static const enum primitive_kind solids[] = {PRIMITIVE_SPHERE, PRIMITIVE_BOX, PRIMITIVE_CONE};
#define SOLIDS (sizeof solids / sizeof *solids)

static bool is_enclosed(const struct scene *scene, const struct light *light)
{
    for (size_t k = 0; k < SOLIDS; k++)
        for (uint32_t i = 0; i < scene->primitives[solids[k]].count; i++)
            if (encloses(scene, primitive_id(solids[k], i), light)) return true;
    return false;
}

void warn_of_enclosed_lights(const struct scene *scene, const char *config)
{
    const struct light *lights = scene_lights(scene), *first = NULL;
    uint64_t solid_count = 0;
    uint32_t enclosed = 0;
    for (size_t k = 0; k < SOLIDS; k++)
        solid_count += scene->primitives[solids[k]].count;
    if (!scene->view.shadows || solid_count * scene->lights.count > PAIRS_MOST) return;
    for (uint32_t i = 0; i < scene->lights.count; i++) {
        if (!is_enclosed(scene, &lights[i])) continue;
        enclosed++;
        if (!first) first = &lights[i];
    }
    if (!first) return;
    bool one = enclosed == 1;
    char *which = one ? copy_text("a light is inside of an opaque solid,")
                      : format_text("%u lights are inside of opaque solids, one", enclosed);
    char *at = format_vector(first->position);
    user_warning(config, 0, "%s at %s: %s nothing outside", which, at,
                 one ? "it lights" : "they light");
    free(at);
    free(which);
}
