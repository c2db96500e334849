#include "worker/shade.h"

struct shading_point shading_point(const struct scene *scene, const struct ray *ray,
                                   const struct surface *surface)
{
    struct shading_point at = {
        .point = surface->point,
        .view = ray->direction,
        .geometric = surface->geometric,
        .normal = surface->shading,
        .entering = vec_dot(ray->direction, surface->geometric) <= 0,
        .material = &scene_materials(scene)[surface->material],
    };
    if (!at.entering) at.geometric = vec_neg(at.geometric);
    if (vec_dot(at.normal, at.geometric) < 0) at.normal = vec_neg(at.normal);
    return at;
}

struct vec3 shade_ambient(const struct material *material)
{
    return vec_scale(material->color, material->ambient);
}

bool light_faces(const struct shading_point *at, const struct light *light, struct vec3 *to_light)
{
    *to_light = vec_sub(light->position, at->point);
    return vec_dot(*to_light, at->geometric) > 0 && vec_dot(*to_light, at->normal) > 0;
}

struct vec3 shade_light(const struct shading_point *at, struct vec3 to_light, struct vec3 strength)
{
    const struct material *material = at->material;
    struct vec3 l = vec_neg(vec_normalize(to_light));
    double l_n = vec_dot(l, at->normal);
    double cos_a = -l_n;
    struct vec3 color = vec_scale(vec_mul(strength, material->color), material->diffuse * cos_a);
    if (material->specular > 0) {
        double cos_b = 2 * l_n * vec_dot(at->normal, at->view) - vec_dot(l, at->view);
        if (cos_b > 0) {
            double lobe = material->specular * pow(cos_b, material->shininess);
            color = vec_add_scaled(color, strength, lobe);
        }
    }
    return color;
}

static struct vec3 mirror(struct vec3 view, struct vec3 normal)
{
    return vec_normalize(vec_add_scaled(view, normal, -2 * vec_dot(view, normal)));
}

struct vec3 reflect(const struct shading_point *at)
{
    struct vec3 direction = mirror(at->view, at->normal);
    /* An interpolated normal may send the ray below the surface, into the object. */
    if (vec_dot(direction, at->geometric) > 0) return direction;
    return mirror(at->view, at->geometric);
}

/* Snell's law for a unit normal on the incoming side; eta = n1 / n2. */
static bool snell(struct vec3 view, struct vec3 normal, double eta, struct vec3 *direction)
{
    double cos_i = -vec_dot(view, normal);
    /* cos^2 of the refracted angle; 1 - eta^2 (1 - cos_i^2) would cancel as eta goes to 1. */
    double k = (1 - eta) * (1 + eta) + eta * cos_i * (eta * cos_i);
    if (k < 0) return false;
    struct vec3 along = vec_scale(view, eta);
    *direction = vec_normalize(vec_add_scaled(along, normal, eta * cos_i - sqrt(k)));
    return true;
}

bool refract(const struct shading_point *at, struct vec3 *direction)
{
    double ior = at->material->ior;
    if (ior == 1) {
        *direction = at->view;
        return true;
    }
    double eta = at->entering ? 1 / ior : ior;
    bool facing = vec_dot(at->view, at->normal) < 0;
    if (facing) {
        if (!snell(at->view, at->normal, eta, direction)) return false;
        if (vec_dot(*direction, at->geometric) < 0) return true;
    }
    return snell(at->view, at->geometric, eta, direction);
}

struct vec3 background(const struct view *view, struct vec3 direction)
{
    double up = 0.5 * (1 + vec_dot(direction, view->background_up));
    struct vec3 bottom = vec_scale(view->background_bottom, 1 - up);
    return vec_add_scaled(bottom, view->background_top, up);
}

double shade_bound(const struct scene *scene)
{
    const struct light *lights = scene_lights(scene);
    struct vec3 strength = {0, 0, 0};
    for (uint64_t i = 0; i < scene->lights.count; i++)
        strength = vec_add(strength, lights[i].color);
    const struct material *materials = scene_materials(scene);
    double largest = 0;
    for (uint64_t i = 0; i < scene->materials.count; i++) {
        const struct material *m = &materials[i];
        struct vec3 color = vec_mul(strength, vec_scale(m->color, m->diffuse));
        color = vec_add(color, vec_scale(strength, m->specular));
        color = vec_add(color, shade_ambient(m));
        largest = fmax(largest, vec_max(color));
    }
    return largest;
}

double spawn_bound(const struct scene *scene)
{
    const struct material *materials = scene_materials(scene);
    double largest = 0;
    for (uint64_t i = 0; i < scene->materials.count; i++) {
        const struct material *m = &materials[i];
        largest = fmax(largest, m->reflection + m->transmission * vec_max(m->color));
    }
    return largest;
}
