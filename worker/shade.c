#include "worker/shade.h"

#include "worker/exact.h"
#include "worker/optics.h"

/*
 * Whether d . n <= 0, so that the ray meets the front or lies in the surface. The rounding errors of the
 * three products and their sums are at most 3 u |d| |n|; if the result is not clearly larger, the exact sum
 * decides.
 */
static bool meets_front(struct vec3 direction, struct vec3 normal, bool exact)
{
    double side = vec_dot(direction, normal);
    if (exact && fabs(side) < 4 * UNIT_ROUNDOFF) side = exact_dot(direction, normal).high;
    return side <= 0;
}

struct shading_point shading_point(const struct scene *scene, const struct ray *ray,
                                   const struct surface *surface)
{
    bool exact = scene->view.formulas == FORMULAS_EXACT;
    struct shading_point at = {
        .point = surface->point,
        .view = ray->direction,
        .geometric = surface->geometric,
        .normal = surface->shading,
        .entering = meets_front(ray->direction, surface->geometric, exact),
        .formulas = scene->view.formulas,
        .material = &scene_materials(scene)[surface->material],
    };
    if (!at.entering) at.geometric = vec_neg(at.geometric);
    if (vec_dot(at.normal, at.geometric) < 0) at.normal = vec_neg(at.normal);
    return at;
}

bool light_faces(const struct shading_point *at, const struct light *light, struct vec3 *to_light)
{
    *to_light = vec_sub(light->position, at->point);
    return vec_dot(*to_light, at->geometric) > 0 && vec_dot(*to_light, at->normal) > 0;
}

struct vec3 shade_light(const struct shading_point *at, struct vec3 to_light, struct vec3 strength)
{
    const struct material *material = at->material;
    struct vec3 unit = vec_normalize(to_light);
    double cos_a = lit_cosine(unit, at->normal);
    struct vec3 color = vec_scale(vec_mul(strength, material->color), material->diffuse * cos_a);
    if (material->specular > 0) {
        double lobe = at->formulas == FORMULAS_PAPER
                          ? naive_phong_lobe(at->view, at->normal, unit, material->shininess)
                          : phong_lobe(at->view, at->normal, to_light, material->shininess);
        color = vec_add_scaled(color, strength, material->specular * lobe);
    }
    return color;
}

static struct vec3 mirrored(const struct shading_point *at, struct vec3 normal)
{
    return at->formulas == FORMULAS_PAPER ? naive_mirror(at->view, normal)
                                          : mirror(at->view, normal);
}

struct vec3 reflect(const struct shading_point *at)
{
    struct vec3 direction = mirrored(at, at->normal);
    /* With an interpolated normal the mirrored ray may go below the surface. */
    if (vec_dot(direction, at->geometric) > 0) return direction;
    return mirrored(at, at->geometric);
}

static bool refracted(const struct shading_point *at, struct vec3 normal, double from, double to,
                      struct vec3 *direction)
{
    return at->formulas == FORMULAS_PAPER ? naive_snell(at->view, normal, from / to, direction)
                                          : snell(at->view, normal, from, to, direction);
}

bool refract(const struct shading_point *at, double from, double to, struct vec3 *direction)
{
    if (from == to) {
        *direction = at->view;
        return true;
    }
    bool facing = vec_dot(at->view, at->normal) < 0;
    if (facing) {
        if (!refracted(at, at->normal, from, to, direction)) return false;
        if (vec_dot(*direction, at->geometric) < 0) return true;
    }
    return refracted(at, at->geometric, from, to, direction);
}
