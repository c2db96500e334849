/* The point and the normals of a hit. */
#include "worker/box.h"
#include "worker/cone.h"
#include "worker/inlined.h"
#include "worker/naive.h"
#include "worker/nearest.h"
#include "worker/order.h"
#include "worker/place.h"
#include "worker/planar.h"
#include "worker/primitive.h"
#include "worker/sphere.h"

static struct place sphere_place(const struct sphere *sphere, const struct ray *ray,
                                 const struct hit *hit, struct vec3 *normal)
{
    struct place place = {sphere->center, sphere_point(sphere, ray, hit->t)};
    *normal = vec_normalize(dd3_round(place.offset));
    return place;
}

/* Clamps an offset from the anchor to the range from low to high. */
static struct dd between(struct dd offset, double anchor, double low, double high)
{
    struct dd to_low = exact_difference(low, anchor), to_high = exact_difference(high, anchor);
    if (dd_sub(offset, to_low).high < 0) return to_low;
    return dd_sub(to_high, offset).high < 0 ? to_high : offset;
}

/*
 * Two coordinates are those of o + t d on the face, the third is that of the face. Rounded distances have
 * told which of two faces is entered near their common edge; from far away the line may cross the one chosen
 * outside of the box, so the two coordinates are clamped.
 */
static struct place box_place(const struct box *box, const struct ray *ray, const struct hit *hit)
{
    unsigned axis = hit->part / 2;
    const struct dd to_face =
        exact_difference(box_face(box, hit->part), vec_component(&ray->origin, axis));
    struct dd t = box_parameter(box, ray, hit->part);
    /* An exit right where the ray starts need not lie on the face that it is said to lead through. */
    if (!(fabs(t.high - hit->t) <= 0x1p-40 * fabs(t.high))) t = dd(hit->t);
    const struct vec3 o = ray->origin;
    const struct dd3 way = dd3_scale(ray->direction, t);
    return (struct place){o,
                          {axis == 0 ? to_face : between(way.x, o.x, box->min.x, box->max.x),
                           axis == 1 ? to_face : between(way.y, o.y, box->min.y, box->max.y),
                           axis == 2 ? to_face : between(way.z, o.z, box->min.z, box->max.z)}};
}

static struct place cone_place(const struct cone *cone, const struct ray *ray,
                               const struct hit *hit, struct vec3 *normal)
{
    bool leaving = hit->primitive == ray->from;
    struct place place = {cone->base, cone_point(cone, ray, hit->t, hit->part, leaving)};
    *normal = cone_normal(cone, place.offset, hit->part);
    return place;
}

/* See EDGE_OFF. */
static void draw_in(struct place *place, struct vec3 b, struct vec3 c, const struct hit *hit)
{
    struct vec3 p = vec_sub(b, place->anchor), q = vec_sub(c, place->anchor);
    double share = inward_share(vec_cross(p, q), vec_largest(p) + vec_largest(q),
                                vec_largest(place_rounded(place)));
    if (least_weight(hit->u, hit->v) >= share / 3) return;
    struct vec3 middle = vec_scale(vec_add(p, q), 1.0 / 3);
    struct vec3 way = vec_sub(middle, dd3_round(place->offset));
    place->offset = dd3_add(place->offset, dd3_of(vec_scale(way, share)));
}

/* See triangle_size(). */
FLATTENED NOINLINE static struct place ordinary_triangle_place(const struct vec3 at[3],
                                                               struct vec3 origin,
                                                               struct vec3 direction,
                                                               const struct hit *hit)
{
    struct vec3 a = at[0], b = at[1], c = at[2];
    double size = triangle_size(a, b, c), speed;
    struct place place = {a, triangle_mean(a, b, c, hit->u, hit->v)};
    if (size > fabs(hit->t) * vec_largest(direction)) {
        struct dd3 passage = triangle_passage(a, b, c, origin, direction, &speed);
        if (triangle_passes(&passage, speed, &place.offset, size)) place.offset = passage;
    }
    draw_in(&place, b, c, hit);
    return place;
}

/* See size_is_ordinary(): other triangles are scaled by a power of two, which gives the bits of their ordinary size. */
static struct place triangle_place(const struct scene *scene, const struct ray *ray,
                                   const struct hit *hit, struct vec3 *normal)
{
    struct vec3 at[3];
    triangle_vertices(scene, hit->primitive, at);
    *normal = triangle_normal(&at[0], &at[1], &at[2]);
    double size = triangle_size(at[0], at[1], at[2]);
    if (size_is_ordinary(size) || !(size > 0 && size < HUGE_VAL))
        return ordinary_triangle_place(at, ray->origin, ray->direction, hit);
    int exponent;
    (void)frexp(size, &exponent);
    struct hit near = *hit;
    near.t = ldexp(hit->t, -exponent);
    struct vec3 anchor = at[0], origin = vec_scale_exactly(ray->origin, -exponent);
    /* As in scaled_crossings(). */
    if (!vec_is_finite(vec_scale_exactly(anchor, -exponent)))
        return ordinary_triangle_place(at, ray->origin, ray->direction, hit);
    for (unsigned i = 0; i < 3; i++)
        at[i] = vec_scale_exactly(at[i], -exponent);
    struct place place = ordinary_triangle_place(at, origin, ray->direction, &near);
    return (struct place){anchor, dd3_ldexp(place.offset, exponent)};
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

static struct place plane_place(struct supporting_plane plane, const struct ray *ray,
                                struct vec3 *normal)
{
    *normal = plane.normal;
    return (struct place){plane.point, plane_point(plane.point, plane.normal, ray)};
}

FLATTENED NOINLINE static struct place place_of(const struct scene *scene, const struct ray *ray,
                                                const struct hit *hit, struct vec3 *normal)
{
    uint32_t index = primitive_index(hit->primitive);
    switch (primitive_kind(hit->primitive)) {
    case PRIMITIVE_SPHERE:
        return sphere_place(&scene_spheres(scene)[index], ray, hit, normal);
    case PRIMITIVE_BOX:
        *normal = box_normal(hit->part);
        return box_place(&scene_boxes(scene)[index], ray, hit);
    case PRIMITIVE_CONE:
        return cone_place(&scene_cones(scene)[index], ray, hit, normal);
    case PRIMITIVE_DISC:
    case PRIMITIVE_PLANE:
        return plane_place(supporting_plane(scene, hit->primitive), ray, normal);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    return triangle_place(scene, ray, hit, normal);
}

/* The surface by the paper's formulas: o + t d and the normal that follows from it. */
static void naive_surface(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                          struct surface *surface)
{
    uint32_t index = primitive_index(hit->primitive);
    struct vec3 at[3];
    surface->point = vec_add_scaled(ray->origin, ray->direction, hit->t);
    switch (primitive_kind(hit->primitive)) {
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
        triangle_vertices(scene, hit->primitive, at);
        surface->geometric = triangle_normal(&at[0], &at[1], &at[2]);
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
    case PRIMITIVE_PLANE:
        surface->geometric = supporting_plane(scene, hit->primitive).normal;
        break;
    case PRIMITIVE_KINDS:
        break;
    }
}

static void exact_surface(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                          struct surface *surface)
{
    struct place place = place_of(scene, ray, hit, &surface->geometric);
    surface->point = offset_from_surface(&place, surface->geometric, ray->direction);
}

/*
 * Constants for places where surfaces of several primitives meet, see worker/corner.h. A point closer to
 * another surface than CORNER_OFF of its largest coordinate is moved away from it, along its own surface.
 * This distance is more than the rounding of both points and what offset_from_surface() adds. Since coordinates are
 * small near the origin, SHARE_OF_WAY of the distance that the ray has come counts as a coordinate, too.
 * Surfaces that meet at less than 3.6 degrees, whose sine is MEET_LEAST, are treated like surfaces that
 * touch. If the directions away from two surfaces are opposite to within 5 degrees, their sum has a component
 * of only GAIN_LEAST along each: there is no room between the surfaces. Nor is there room on a surface so
 * small that the move would leave its box.
 */
#define CORNER_OFF   (64 * UNIT_ROUNDOFF)
#define SHARE_OF_WAY 0x1p-30
#define MEET_LEAST   0x1p-4
#define GAIN_LEAST   0x1p-8

/* A direction along a surface, away from another surface that meets it. */
struct inward {
    struct vec3 way; /* unit */
    double missing;  /* how far the point still has to move along it */
};

/*
 * Whether a point of a surface with this normal is close to another surface that meets it. It is to be on the
 * side of the other one that the ray came from, or, if the ray starts on the other one, that it goes to.
 */
static bool meets(const struct scene *scene, const struct ray *ray, const struct place *place,
                  struct vec3 normal, double off, const struct hit *other, struct inward *inward)
{
    struct vec3 across;
    struct place there = place_of(scene, ray, other, &across);
    bool along = vec_dot(ray->direction, across) > 0, starts = other->primitive == ray->from;
    if (along != starts) across = vec_neg(across);
    double apart = vec_dot(across, vec_sub(place_rounded(place), place_rounded(&there)));
    struct vec3 way = vec_add_scaled(across, normal, -vec_dot(across, normal));
    double sine = vec_length(way);
    if (!(apart < off && sine >= MEET_LEAST)) return false;
    *inward = (struct inward){vec_scale(way, 1 / sine), (off - apart) / sine};
    return true;
}

/*
 * The sum of the two directions with the largest angle between them. All others lie between these; duplicates
 * do not matter.
 */
static struct vec3 way_between(const struct inward *inward, uint32_t count)
{
    struct vec3 sum = {0, 0, 0};
    double least = HUGE_VAL;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t k = 0; k <= i; k++) {
            double cosine = vec_dot(inward[i].way, inward[k].way);
            if (cosine < least) sum = vec_add(inward[i].way, inward[k].way);
            least = smaller_number(least, cosine);
        }
    return sum;
}

/* The multiple of the sum that moves the point far enough from each surface; 0 if there is none. */
static double step_between(const struct inward *inward, uint32_t count, struct vec3 sum)
{
    double step = 0;
    for (uint32_t i = 0; i < count; i++) {
        double gain = vec_dot(sum, inward[i].way);
        if (!(gain >= GAIN_LEAST)) return 0;
        step = larger_number(step, inward[i].missing / gain);
    }
    return step;
}

/* Whether a point is in the box of a primitive, up to the rounding that slabs.h allows for. Planes have no
 * box. */
static bool is_in_bounds(const struct scene *scene, uint32_t id, struct vec3 point)
{
    if (primitive_kind(id) == PRIMITIVE_PLANE) return true;
    struct bounds bounds = primitive_bounds(scene, id);
    double slack = 4 * UNIT_ROUNDOFF * vec_largest(point);
    for (unsigned axis = 0; axis < 3; axis++) {
        double at = vec_component(&point, axis);
        if (!(at >= bounds.min[axis] - slack && at <= bounds.max[axis] + slack)) return false;
    }
    return true;
}

struct vec3 surface_away_from_others(const struct scene *scene, const struct ray *ray,
                                     const struct hit *hit, const struct hit *others,
                                     uint32_t count)
{
    struct inward inward[CORNER_OTHERS + 1];
    struct vec3 normal;
    uint32_t met = 0;
    struct place place = place_of(scene, ray, hit, &normal);
    double way = hit->t * vec_largest(ray->direction) * SHARE_OF_WAY;
    double off = CORNER_OFF * larger_number(vec_largest(place_rounded(&place)), way);
    for (uint32_t i = 0; i < count; i++)
        met += meets(scene, ray, &place, normal, off, &others[i], &inward[met]);
    /* The surface that the ray starts on counts as well. */
    const struct hit start = {0, 0, 0, ray->from, (uint16_t)ray_from_part(ray), 0};
    if (met > 0 && ray->from != PRIMITIVE_NONE && ray->from != hit->primitive)
        met += meets(scene, ray, &place, normal, off, &start, &inward[met]);
    struct vec3 sum = way_between(inward, met);
    struct vec3 step = vec_scale(sum, step_between(inward, met, sum));
    struct place moved = {place.anchor, dd3_add(place.offset, dd3_of(step))};
    if (is_in_bounds(scene, hit->primitive, place_rounded(&moved))) place = moved;
    return offset_from_surface(&place, normal, ray->direction);
}

struct vec3 surface_beyond(const struct scene *scene, const struct ray *ray, const struct hit *hit)
{
    struct vec3 normal;
    struct place place = place_of(scene, ray, hit, &normal);
    return offset_from_surface(&place, normal, vec_neg(ray->direction));
}

void surface_at(const struct scene *scene, const struct ray *ray, const struct hit *hit,
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
