#include "worker/eye_media.h"

#include <math.h>

#include "worker/coplanar.h"
#include "worker/exact.h"
#include "worker/nearest.h"
#include "worker/triangle.h"
#include "worker/visit.h"

/* Media around a point that are found, the rays that find them, of which the first goes `ahead`: see media_at(). */
#define EXITS_MAX  64
#define DIRECTIONS 5

/* Hits of one ray; more occur only with surfaces that lie within each other. */
#define FOLLOWED_HITS 4096

/* Surfaces behind which a ray has left media that it had not entered, the innermost first. */
struct exits {
    uint32_t count;
    uint32_t primitives[EXITS_MAX];
};

static void note_crossing(struct media *media, const struct ray *ray, const struct hit *hit,
                          const struct surface *surface, uint32_t *stack, struct exits *exits)
{
    double cosine = vec_dot(ray->direction, surface->geometric);
    bool entering = cosine <= 0;
    struct crossing_media crossing = media_cross(media, *stack, hit->primitive, entering);
    *stack = crossing.stack;
    if (crossing.unmatched && !entering && !is_grazing(cosine) && exits->count < EXITS_MAX)
        exits->primitives[exits->count++] = hit->primitive;
}

/* The latest crossings of a ray, in a ring: four surfaces that meet in one point, each entered and left. Where more of
 * them do, FOLLOWED_HITS ends the ray. */
#define RECENT 8
struct recent {
    uint32_t count;
    uint32_t primitive[RECENT];
    bool entering[RECENT];
};

/* Whether the ray has crossed this surface in this direction before; if not, it has now. */
static bool is_repeated(struct recent *recent, uint32_t primitive, bool entering)
{
    for (uint32_t i = 0; i < RECENT && i < recent->count; i++)
        if (recent->primitive[i] == primitive && recent->entering[i] == entering) return true;
    uint32_t place = recent->count++ % RECENT;
    recent->primitive[place] = primitive;
    recent->entering[place] = entering;
    return false;
}

/*
 * Follows a ray through all surfaces. Planes are treated separately. A line enters and leaves a primitive once. But
 * where it goes through an edge in which two of them meet, the point on each is before the other one (see
 * worker/place.h), and they would be crossed in turn for ever: the second time the ray is moved on, each time twice as
 * far, because a surface that it grazes is only left after many roundings.
 */
static void follow(struct media *media, const struct bvh *bvh, struct ray ray, struct exits *exits)
{
    const struct scene *scene = media_scene(media);
    uint32_t stack = MEDIUM_OUTSIDE;
    struct recent recent = {.count = 0};
    double step = 8 * UNIT_ROUNDOFF; /* twice as far as a point may be from its surface */
    for (uint32_t i = 0; i < FOLLOWED_HITS; i++) {
        struct hit hit;
        struct surface surface;
        uint64_t exact = 0;
        nearest(scene, bvh, &ray, 1, &hit, &exact);
        if (hit.primitive == PRIMITIVE_NONE) break;
        surface_at(scene, &ray, &hit, &surface);
        ray.origin = surface.point;
        ray.from = hit.primitive;
        ray.from_part = hit.part;
        if (is_repeated(&recent, hit.primitive, vec_dot(ray.direction, surface.geometric) <= 0)) {
            double distance = step * vec_largest(ray.origin);
            ray.origin = vec_add_scaled(ray.origin, ray.direction, distance);
            step *= 2;
            continue;
        }
        if (primitive_kind(hit.primitive) != PRIMITIVE_PLANE && transmits(scene, hit.primitive))
            note_crossing(media, &ray, &hit, &surface, &stack, exits);
    }
}

/* Far from each other and from directions that are common in scenes. With their opposites they go to all octants. */
static const struct vec3 uncommon[DIRECTIONS - 1] = {
    {0.48, 0.61, 0.63}, {-0.59, -0.65, 0.48}, {0.66, -0.47, -0.58}, {-0.51, 0.53, -0.67}};

static void find_exits(struct media *media, const struct bvh *bvh, struct vec3 point,
                       struct vec3 direction, struct exits *exits)
{
    struct ray ray = {
        .origin = point, .direction = direction, .t_max = HUGE_VAL, .from = PRIMITIVE_NONE};
    exits->count = 0;
    follow(media, bvh, ray, exits);
}

/* How often the medium behind this primitive was left, from index `first` of the exits on. */
static uint32_t count_of(const struct scene *scene, const struct exits *exits, uint32_t first,
                         uint32_t primitive)
{
    uint32_t count = 0;
    for (uint32_t i = first; i < exits->count; i++)
        count += is_same_medium(scene, exits->primitives[i], primitive);
    return count;
}

/*
 * More than all rounding of the tests below, some ten unit roundoffs, and so little that no point of a solid's surface
 * is outside.
 */
#define OUTSIDE_MARGIN 0x1p-40

static bool is_outside_box(const struct box *box, struct vec3 p)
{
    return p.x < box->min.x || p.x > box->max.x || p.y < box->min.y || p.y > box->max.y ||
           p.z < box->min.z || p.z > box->max.z;
}

static bool is_outside_sphere(const struct sphere *sphere, struct vec3 p)
{
    struct vec3 f = vec_sub(p, sphere->center);
    return vec_dot(f, f) > sphere->radius * sphere->radius * (1 + OUTSIDE_MARGIN);
}

/* With the base at f = 0 and the apex at f = w, both cap planes and the distance from the axis. */
static bool is_outside_cone(const struct cone *cone, struct vec3 p)
{
    struct vec3 f = vec_sub(p, cone->base), w = vec_sub(cone->apex, cone->base);
    struct vec3 across = vec_cross(f, w);
    double ww = vec_dot(w, w), ff = vec_dot(f, f), along = vec_dot(f, w) / ww;
    double margin = OUTSIDE_MARGIN * sqrt(ff / ww);
    if (along < -margin || along > 1 + margin) return true;
    double radius = cone->base_radius + along * (cone->apex_radius - cone->base_radius);
    return vec_dot(across, across) / ww > radius * radius + OUTSIDE_MARGIN * (ff + ww);
}

/* Whether a point is certainly outside of a solid; what is not finite decides nothing. */
static bool is_outside(const struct scene *scene, uint32_t solid, struct vec3 point)
{
    uint32_t index = primitive_index(solid);
    switch (primitive_kind(solid)) {
    case PRIMITIVE_SPHERE:
        return is_outside_sphere(&scene_spheres(scene)[index], point);
    case PRIMITIVE_BOX:
        return is_outside_box(&scene_boxes(scene)[index], point);
    case PRIMITIVE_CONE:
        return is_outside_cone(&scene_cones(scene)[index], point);
    default:
        return false;
    }
}

/*
 * Whether all rays have found this medium as often as the first one has from its i-th medium on. Of a solid the first
 * ray alone tells, as the point may be on its surface. But where that ray goes along an edge, and on from another
 * surface at a rounded point, it may leave a solid that the point is outside of.
 */
static bool agreed(const struct scene *scene, const struct exits exits[DIRECTIONS], uint32_t i,
                   struct vec3 point)
{
    uint32_t primitive = exits[0].primitives[i];
    if (primitive_is_solid(scene, primitive)) return !is_outside(scene, primitive, point);
    uint32_t wanted = count_of(scene, &exits[0], i, primitive);
    for (int p = 1; p < DIRECTIONS; p++)
        if (count_of(scene, &exits[p], 0, primitive) < wanted) return false;
    return true;
}

/* The sign of a . b, exact. */
static int dot_sign(struct dd3 a, struct dd3 b)
{
    int exponent;
    double dot = exact_dot3(a, b, &exponent).high;
    return (dot > 0) - (dot < 0);
}

/* Decided without rounding, because the kernel decides so whether a ray from the point meets the plane. */
static int side_of(const struct plane *plane, struct vec3 point)
{
    return dot_sign(exact_difference3(point, plane->point), dd3_of(plane->normal));
}

static bool is_behind(const struct plane *plane, struct vec3 point, struct vec3 ahead)
{
    int side = side_of(plane, point);
    return side < 0 || (side == 0 && dot_sign(dd3_of(ahead), dd3_of(plane->normal)) < 0);
}

static uint32_t planes_around(struct media *media, struct vec3 point, struct vec3 ahead)
{
    const struct scene *scene = media_scene(media);
    const struct plane *planes = scene_planes(scene);
    uint32_t stack = MEDIUM_OUTSIDE;
    for (uint32_t i = 0; i < scene->primitives[PRIMITIVE_PLANE].count; i++) {
        uint32_t id = primitive_id(PRIMITIVE_PLANE, i);
        if (is_behind(&planes[i], point, ahead) && transmits(scene, id))
            stack = media_cross(media, stack, id, true).stack;
    }
    return stack;
}

/* The rays that look for agreement with the one ahead of the point start from `beside`. */
static uint32_t media_from(struct media *media, const struct bvh *bvh, struct vec3 point,
                           struct vec3 ahead, struct vec3 beside)
{
    struct exits exits[DIRECTIONS];
    find_exits(media, bvh, point, ahead, &exits[0]);
    for (int p = 1; p < DIRECTIONS; p++)
        find_exits(media, bvh, beside, uncommon[p - 1], &exits[p]);
    uint32_t stack = planes_around(media, point, ahead);
    for (uint32_t i = exits[0].count; i-- > 0;)
        if (agreed(media_scene(media), exits, i, point))
            stack = media_cross(media, stack, exits[0].primitives[i], true).stack;
    return stack;
}

uint32_t media_at(struct media *media, const struct bvh *bvh, struct vec3 point, struct vec3 ahead)
{
    return media_from(media, bvh, point, ahead, point);
}

/* How far, of the way to the first surface, a point is displaced like a ray that meets an edge exactly. Along the
 * second axis it is the square of that, 2^-40, which is still far above the rounding of the point, 2^-53. */
#define ASIDE 0x1p-20

uint32_t media_ahead(struct media *media, const struct bvh *bvh, struct vec3 point,
                     struct vec3 ahead)
{
    struct ray ray = {
        .origin = point, .direction = ahead, .t_max = HUGE_VAL, .from = PRIMITIVE_NONE};
    struct shear shear = shear_of(&ahead);
    struct hit hit;
    uint64_t exact = 0;
    nearest(media_scene(media), bvh, &ray, 1, &hit, &exact);
    if (hit.primitive == PRIMITIVE_NONE) return media_from(media, bvh, point, ahead, point);
    double aside[3] = {0, 0, 0};
    aside[shear.x] = -ASIDE * hit.t;
    aside[shear.y] = -ASIDE * ASIDE * hit.t;
    struct vec3 middle = vec_add_scaled(point, ahead, hit.t / 2);
    return media_from(media, bvh, point, ahead,
                      vec_add(middle, vec3(aside[0], aside[1], aside[2])));
}

/* Whether b has all solids of a. */
static bool has_solids_of(const struct scene *scene, const struct exits *b, const struct exits *a)
{
    for (uint32_t i = 0; i < a->count; i++) {
        uint32_t primitive = a->primitives[i];
        if (primitive_is_solid(scene, primitive) && count_of(scene, b, 0, primitive) == 0)
            return false;
    }
    return true;
}

static bool is_on_plane(const struct scene *scene, struct vec3 point)
{
    for (uint32_t i = 0; i < scene->primitives[PRIMITIVE_PLANE].count; i++) {
        uint32_t id = primitive_id(PRIMITIVE_PLANE, i);
        if (transmits(scene, id) && is_in_plane_of(scene, id, point)) return true;
    }
    return false;
}

/* Whether the point is in the box of a triangle that transmits light and, exactly, in its plane. */
static bool is_on_triangle(const struct scene *scene, uint32_t id, struct vec3 point)
{
    struct vec3 at[3];
    if (!transmits(scene, id)) return false;
    triangle_vertices(scene, id, at);
    struct bounds box = triangle_bounds(&at[0], &at[1], &at[2]);
    for (unsigned axis = 0; axis < 3; axis++) {
        double place = vec_component(&point, axis);
        if (place < box.min[axis] || place > box.max[axis]) return false;
    }
    return is_in_plane_of(scene, id, point);
}

struct at_point {
    const struct scene *scene;
    struct vec3 point;
    bool found;
};

static bool look_in_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                         double *limit)
{
    struct at_point *at = context;
    (void)limit;
    for (uint32_t i = 0; i < count && !at->found; i++)
        at->found = is_triangle(leaves[i].id) && is_on_triangle(at->scene, leaves[i].id, at->point);
    return !at->found;
}

static bool is_on_mesh(const struct scene *scene, const struct bvh *bvh, struct vec3 point)
{
    const struct ray ray = {
        .origin = point, .direction = {0, 0, 1}, .t_max = HUGE_VAL, .from = PRIMITIVE_NONE};
    struct at_point at = {scene, point, false};
    visit_leaves(bvh, &ray, 0, look_in_leaf, &at);
    return at.found;
}

bool media_meet_at(struct media *media, const struct bvh *bvh, struct vec3 point)
{
    const struct scene *scene = media_scene(media);
    struct exits there, back;
    for (int p = 0; p < DIRECTIONS - 1; p++) {
        find_exits(media, bvh, point, uncommon[p], &there);
        find_exits(media, bvh, point, vec_neg(uncommon[p]), &back);
        if (!has_solids_of(scene, &there, &back) || !has_solids_of(scene, &back, &there))
            return true;
    }
    return is_on_plane(scene, point) || is_on_mesh(scene, bvh, point);
}
