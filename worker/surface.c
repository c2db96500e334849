/* Where a hit lies and which way its surface faces. */
#include "worker/nearest.h"
#include "worker/primitive.h"

static double largest_component(struct vec3 v)
{
    return fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z)));
}

/* The rounding error of o + t d, up to a factor of u. */
static double along_ray_error(const struct ray *ray, double t)
{
    return largest_component(ray->origin) + fabs(t) * largest_component(ray->direction);
}

static void sphere_surface(const struct sphere *sphere, const struct ray *ray, double t,
                           struct surface *surface)
{
    surface->geometric = sphere_normal(sphere, ray, t);
    if (largest_component(sphere->center) + sphere->radius < along_ray_error(ray, t))
        surface->point = vec_add_scaled(sphere->center, surface->geometric, sphere->radius);
}

/*
 * The weighted mean of the vertices errs by some u of their coordinates and stays in the triangle,
 * however far away the eye is; o + t d is better on a ground of a few huge triangles around the
 * eye.
 */
static void triangle_surface(const struct scene *scene, const struct ray *ray,
                             const struct hit *hit, struct surface *surface)
{
    const uint32_t *corner = corner_indices(scene, hit->primitive);
    const struct vec3 *vertices = scene_vertices(scene);
    struct vec3 a = vertices[corner[0]], b = vertices[corner[1]], c = vertices[corner[2]];
    surface->geometric = triangle_normal(&a, &b, &c);
    double reach = fmax(largest_component(a), fmax(largest_component(b), largest_component(c)));
    if (reach < along_ray_error(ray, hit->t)) {
        struct vec3 p = vec_add_scaled(a, vec_sub(b, a), hit->u);
        surface->point = vec_add_scaled(p, vec_sub(c, a), hit->v);
    }
}

static struct vec3 patch_normal(const struct scene *scene, const struct hit *hit,
                                struct vec3 geometric)
{
    const uint32_t *corner = scene_patches(scene)[primitive_index(hit->primitive)].normal;
    const struct vec3 *normals = scene_normals(scene);
    struct vec3 sum = vec_scale(normals[corner[0]], 1 - hit->u - hit->v);
    sum = vec_add_scaled(sum, normals[corner[1]], hit->u);
    sum = vec_add_scaled(sum, normals[corner[2]], hit->v);
    return vec_is_zero(sum) ? geometric : vec_normalize(sum);
}

void surface_at(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                struct surface *surface)
{
    uint32_t index = primitive_index(hit->primitive);
    surface->point = vec_add_scaled(ray->origin, ray->direction, hit->t);
    surface->material = primitive_material(scene, hit->primitive);
    switch (primitive_kind(hit->primitive)) {
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
        triangle_surface(scene, ray, hit, surface);
        break;
    case PRIMITIVE_SPHERE:
        sphere_surface(&scene_spheres(scene)[index], ray, hit->t, surface);
        break;
    case PRIMITIVE_BOX:
        surface->geometric = box_normal(hit->part);
        break;
    case PRIMITIVE_CONE: {
        const struct cone *cone = &scene_cones(scene)[index];
        struct vec3 f = vec_sub(ray->origin, cone->base);
        surface->geometric =
            cone_normal(cone, vec_add_scaled(f, ray->direction, hit->t), hit->part);
        break;
    }
    case PRIMITIVE_DISC:
        surface->geometric = scene_discs(scene)[index].normal;
        break;
    case PRIMITIVE_PLANE:
        surface->geometric = scene_planes(scene)[index].normal;
        break;
    case PRIMITIVE_KINDS:
        break;
    }
    surface->shading = surface->geometric;
    if (primitive_kind(hit->primitive) == PRIMITIVE_PATCH)
        surface->shading = patch_normal(scene, hit, surface->geometric);
}
