/*
 * Where a hit lies and which way its surface faces.
 *
 * A point cannot lie on the surface but for luck: what a secondary ray does with other surfaces
 * that touch this one there would be luck, too. So the point is put off the surface, to the side
 * that the ray came from, by just more than its coordinates' rounding. A ray that goes through then
 * still has everything before it that touches this surface from behind, such as the floor under a
 * glass ball, and a reflected or shadow ray starts on the side where it belongs. The surface itself
 * is not met again because the ray names it. For this the point is known in double-double and
 * rounded once.
 */
#include "worker/nearest.h"
#include "worker/primitive.h"

/*
 * Rounding displaces each coordinate by u of itself at most, the point by sqrt(3) u of the largest
 * one; 2 u is what it is put off by, so it ends between 0.26 u and 3.74 u from the surface.
 */
#define STAND_OFF (2 * UNIT_ROUNDOFF)

/* A point as an offset from one of the primitive's own, which are exact. */
struct place {
    struct vec3 anchor;
    struct dd3 offset;
};

static struct vec3 place_rounded(const struct place *place)
{
    return dd3_round(dd3_add(dd3_of(place->anchor), place->offset));
}

/* Off the surface to the side against which the ray runs. */
static struct vec3 stand_off(const struct place *place, struct vec3 normal, const struct ray *ray)
{
    double distance = STAND_OFF * largest_component(place_rounded(place));
    double side = vec_dot(ray->direction, normal) <= 0 ? 1 : -1;
    struct dd3 step = dd3_of(vec_scale(normal, side * distance));
    struct place off = {place->anchor, dd3_add(place->offset, step)};
    return place_rounded(&off);
}

static struct place sphere_place(const struct sphere *sphere, const struct ray *ray,
                                 const struct hit *hit, struct vec3 *normal)
{
    struct place place = {sphere->center, sphere_point(sphere, ray, hit->t)};
    *normal = vec_normalize(dd3_round(place.offset));
    return place;
}

/* The two coordinates along the face from o + t d, the third from the face. */
static struct place box_place(const struct box *box, const struct ray *ray, const struct hit *hit)
{
    unsigned axis = hit->part / 2;
    const struct dd to_face =
        exact_difference(box_face(box, hit->part), vec_component(&ray->origin, axis));
    struct dd t = dd_div(to_face, dd(vec_component(&ray->direction, axis)));
    /* A way out that takes no time is not at the face that it is said to lead through. */
    if (!(fabs(t.high - hit->t) <= 0x1p-40 * fabs(t.high))) t = dd(hit->t);
    struct place place = {ray->origin, dd3_scale(ray->direction, t)};
    if (axis == 0) place.offset.x = to_face;
    if (axis == 1) place.offset.y = to_face;
    if (axis == 2) place.offset.z = to_face;
    return place;
}

static struct place cone_place(const struct cone *cone, const struct ray *ray,
                               const struct hit *hit, struct vec3 *normal)
{
    bool leaving = hit->primitive == ray->from;
    struct place place = {cone->base, cone_point(cone, ray, hit->t, hit->part, leaving)};
    *normal = cone_normal(cone, place.offset, hit->part);
    return place;
}

static struct dd3 along_edges(const struct vec3 corners[3], double u, double v)
{
    struct dd3 to_b = exact_difference3(corners[1], corners[0]);
    struct dd3 to_c = exact_difference3(corners[2], corners[0]);
    return dd3_add(dd3_multiply(to_b, dd(u)), dd3_multiply(to_c, dd(v)));
}

/*
 * The weighted mean of the vertices is in the triangle's plane and in the triangle, however far
 * away the eye is; where the line crosses the plane is better on a ground of a few huge triangles
 * around the eye: u of the distance instead of u of the triangle. From an eye that sees the plane
 * from its edge it may be nowhere near the hit.
 */
static struct place triangle_place(const struct scene *scene, const struct ray *ray,
                                   const struct hit *hit, struct vec3 *normal)
{
    const uint32_t *corner = corner_indices(scene, hit->primitive);
    const struct vec3 *vertices = scene_vertices(scene);
    struct vec3 at[3] = {vertices[corner[0]], vertices[corner[1]], vertices[corner[2]]};
    double size =
        largest_component(vec_sub(at[1], at[0])) + largest_component(vec_sub(at[2], at[0]));
    struct place mean = {at[0], along_edges(at, hit->u, hit->v)}, line = {at[0], mean.offset};
    *normal = triangle_normal(&at[0], &at[1], &at[2]);
    double distance = fabs(hit->t) * largest_component(ray->direction);
    if (size <= distance) return mean;
    if (!triangle_plane_point(&at[0], &at[1], &at[2], ray, &line.offset)) return mean;
    struct vec3 apart = vec_sub(dd3_round(line.offset), dd3_round(mean.offset));
    return largest_component(apart) <= 0x1p-40 * size ? line : mean;
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

static struct place plane_place(struct vec3 point, struct vec3 unit, const struct ray *ray,
                                struct vec3 *normal)
{
    *normal = unit;
    return (struct place){point, plane_point(point, unit, ray)};
}

static struct place place_of(const struct scene *scene, const struct ray *ray,
                             const struct hit *hit, struct vec3 *normal)
{
    uint32_t index = primitive_index(hit->primitive);
    const struct disc *disc;
    const struct plane *plane;
    switch (primitive_kind(hit->primitive)) {
    case PRIMITIVE_SPHERE:
        return sphere_place(&scene_spheres(scene)[index], ray, hit, normal);
    case PRIMITIVE_BOX:
        *normal = box_normal(hit->part);
        return box_place(&scene_boxes(scene)[index], ray, hit);
    case PRIMITIVE_CONE:
        return cone_place(&scene_cones(scene)[index], ray, hit, normal);
    case PRIMITIVE_DISC:
        disc = &scene_discs(scene)[index];
        return plane_place(disc->center, disc->normal, ray, normal);
    case PRIMITIVE_PLANE:
        plane = &scene_planes(scene)[index];
        return plane_place(plane->point, plane->normal, ray, normal);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    return triangle_place(scene, ray, hit, normal);
}

/* o + t d, and the normals that it gives. */
static void naive_surface(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                          struct surface *surface)
{
    uint32_t index = primitive_index(hit->primitive);
    const struct vec3 *vertices = scene_vertices(scene);
    const uint32_t *corner;
    surface->point = vec_add_scaled(ray->origin, ray->direction, hit->t);
    switch (primitive_kind(hit->primitive)) {
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
        corner = corner_indices(scene, hit->primitive);
        surface->geometric =
            triangle_normal(&vertices[corner[0]], &vertices[corner[1]], &vertices[corner[2]]);
        break;
    case PRIMITIVE_SPHERE:
        surface->geometric = naive_sphere_normal(&scene_spheres(scene)[index], surface->point);
        break;
    case PRIMITIVE_BOX:
        surface->geometric = box_normal(hit->part);
        break;
    case PRIMITIVE_CONE:
        surface->geometric =
            naive_cone_normal(&scene_cones(scene)[index], surface->point, hit->part);
        break;
    case PRIMITIVE_DISC:
        surface->geometric = scene_discs(scene)[index].normal;
        break;
    case PRIMITIVE_PLANE:
        surface->geometric = scene_planes(scene)[index].normal;
        break;
    case PRIMITIVE_KINDS:
        break;
    }
}

static void exact_surface(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                          struct surface *surface)
{
    struct place place = place_of(scene, ray, hit, &surface->geometric);
    surface->point = stand_off(&place, surface->geometric, ray);
}

FLATTENED void surface_at(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                          struct surface *surface)
{
    surface->material = primitive_material(scene, hit->primitive);
    if (scene->view.formulas == FORMULAS_PAPER)
        naive_surface(scene, ray, hit, surface);
    else
        exact_surface(scene, ray, hit, surface);
    surface->shading = surface->geometric;
    if (primitive_kind(hit->primitive) == PRIMITIVE_PATCH)
        surface->shading = patch_normal(scene, hit, surface->geometric);
}
