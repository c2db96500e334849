#include "worker/points.h"

#include "worker/cone_line.h"
#include "worker/corner.h"
#include "worker/place.h"
#include "worker/primitive.h"
#include "worker/sphere_line.h"
#include "worker/triangle.h"

/* ---- where the rays end ---- */

/* Groups of points with code of their own in lanes, in the order in which the points are stored. */
enum group {
    GROUP_SPHERES,
    GROUP_TRIANGLES,
    GROUP_PATCHES,
    GROUP_SIDES,
    GROUP_EXITS, /* sides of cones that the ray starts on */
    GROUP_CAPS,
    GROUP_FLATS, /* discs and planes */
    GROUP_OTHERS,
    GROUPS
};

static enum group group_of(const struct ray *ray, const struct hit *hit)
{
    switch (primitive_kind(hit->primitive)) {
    case PRIMITIVE_SPHERE:
        return GROUP_SPHERES;
    case PRIMITIVE_TRIANGLE:
        return GROUP_TRIANGLES;
    case PRIMITIVE_PATCH:
        return GROUP_PATCHES;
    case PRIMITIVE_CONE:
        if (hit->part != CONE_SIDE) return GROUP_CAPS;
        return ray->from == hit->primitive ? GROUP_EXITS : GROUP_SIDES;
    case PRIMITIVE_DISC:
    case PRIMITIVE_PLANE:
        return GROUP_FLATS;
    case PRIMITIVE_BOX:
    case PRIMITIVE_KINDS:
        break;
    }
    return GROUP_OTHERS;
}

/* Fills points->slot; group g is first[g] .. first[g + 1] - 1. */
static void sort_by_group(const struct ray *rays, const struct hit *hits, uint32_t count,
                          struct points *points, uint32_t first[GROUPS + 1])
{
    uint32_t sizes[GROUPS] = {0};
    uint32_t at[GROUPS];
    for (uint32_t i = 0; i < count; i++)
        if (hits[i].primitive != PRIMITIVE_NONE) sizes[group_of(&rays[i], &hits[i])]++;
    first[0] = 0;
    for (int g = 0; g < GROUPS; g++) {
        at[g] = first[g];
        first[g + 1] = first[g] + sizes[g];
    }
    for (uint32_t i = 0; i < count; i++)
        if (hits[i].primitive != PRIMITIVE_NONE)
            points->slot[at[group_of(&rays[i], &hits[i])]++] = i;
    points->count = first[GROUPS];
}

static void gather_rays(const struct ray *rays, const struct hit *hits, struct points *points)
{
    for (uint32_t i = 0; i < points->count; i++) {
        const struct ray *ray = &rays[points->slot[i]];
        const struct hit *hit = &hits[points->slot[i]];
        set_lane(&points->view, i, ray->direction);
        set_lane(&points->origin, i, ray->origin);
        points->t[i] = hit->t;
        points->u[i] = hit->u;
        points->v[i] = hit->v;
    }
}

static void gather_materials(const struct scene *scene, const struct hit *hits,
                             struct points *points)
{
    const struct material *materials = scene_materials(scene);
    for (uint32_t i = 0; i < points->count; i++) {
        uint32_t primitive = hits[points->slot[i]].primitive;
        points->material[i] = &materials[primitive_material(scene, primitive)];
    }
}

static void gather_spheres(const struct scene *scene, const struct hit *hits, uint32_t begin,
                           uint32_t end, struct points *points)
{
    const struct sphere *spheres = scene_spheres(scene);
    for (uint32_t i = begin; i < end; i++) {
        const struct sphere *sphere = &spheres[primitive_index(hits[points->slot[i]].primitive)];
        set_lane(&points->a, i, sphere->center);
        points->radius[i] = sphere->radius;
    }
}

static void gather_triangles(const struct scene *scene, const struct hit *hits, uint32_t begin,
                             uint32_t end, struct points *points)
{
    for (uint32_t i = begin; i < end; i++) {
        struct vec3 at[3];
        triangle_vertices(scene, hits[points->slot[i]].primitive, at);
        set_lane(&points->a, i, at[0]);
        set_lane(&points->b, i, at[1]);
        set_lane(&points->c, i, at[2]);
    }
}

static void gather_normals(const struct scene *scene, const struct hit *hits, uint32_t begin,
                           uint32_t end, struct points *points)
{
    const struct patch *patches = scene_patches(scene);
    const struct vec3 *normals = scene_normals(scene);
    for (uint32_t i = begin; i < end; i++) {
        uint32_t index = primitive_index(hits[points->slot[i]].primitive);
        const uint32_t *corner = patches[index].normal;
        set_lane(&points->a, i, normals[corner[0]]);
        set_lane(&points->b, i, normals[corner[1]]);
        set_lane(&points->c, i, normals[corner[2]]);
    }
}

static inline void put_surface(struct points *points, uint32_t i, const struct place *place,
                               struct vec3 normal, bool sure)
{
    set_lane(&points->point, i, offset_from_surface(place, normal, lane(&points->view, i)));
    set_lane(&points->geometric, i, normal);
    set_lane(&points->normal, i, normal);
    points->sure[i] = truth(sure);
}

/* sphere_point() for a sphere and a ray of ordinary size that certainly meet. */
static inline struct place sphere_place(const struct points *points, uint32_t i, bool *sure)
{
    struct vec3 center = lane(&points->a, i), o = lane(&points->origin, i);
    struct vec3 d = lane(&points->view, i);
    double r = points->radius[i], t = points->t[i];
    double reach = larger_number(vec_largest(o), vec_largest(center));
    *sure = is_ordinary(reach + r);
    *sure &= is_ordinary(r);
    *sure &= is_ordinary(vec_largest(d));
    struct sphere_line line =
        sphere_line_from(center, r, o, d, sphere_closest_approach(center, o, d));
    *sure &= line.discriminant.high > SPHERE_LINE_FILTER * sphere_line_error(&line, r);
    line.half = dd_root(line.discriminant);
    double behind = sphere_line_behind(&line, t);
    *sure &= fabs(behind) > sphere_line_behind_error(&line, d, r) + points->t_error[i];
    struct dd s = sphere_line_root(&line, behind > 0);
    return (struct place){center, dd3_add(line.p, dd3_scale(d, s))};
}

static inline void find_sphere(struct points *points, uint32_t i)
{
    bool sure;
    struct place place = sphere_place(points, i, &sure);
    struct vec3 normal = plain_unit(dd3_round(place.offset), &sure);
    put_surface(points, i, &place, normal, sure);
}

IN_LANES(find_spheres, points, find_sphere)

/* The axes of shear_of() without a branch: z is the longest component of the direction. */
struct turn {
    bool to_z, to_y;
};

static inline struct turn turn_of(struct vec3 direction)
{
    double x = fabs(direction.x), y = fabs(direction.y), z = fabs(direction.z);
    return (struct turn){(z >= x) & (z >= y), y >= x};
}

static inline struct vec3 turned(struct turn turn, struct vec3 v)
{
    struct vec3 other = choose(turn.to_y, vec3(v.z, v.x, v.y), vec3(v.y, v.z, v.x));
    return choose(turn.to_z, v, other);
}

/* shear_vertex() with a turned direction. slant.z is its z; slant.x and slant.y are x / z and y / z. */
static inline struct sheared shear_lane(struct turn turn, struct vec3 slant, struct vec3 way)
{
    struct vec3 v = turned(turn, way);
    return (struct sheared){v.x - slant.x * v.z, v.y - slant.y * v.z, v.z};
}

/*
 * Whether triangle_plane_distance() certainly succeeds, so that the weights are kept when the distance is
 * corrected. Plain arithmetic errs by 2^-40 of what is compared; the limits are twice those of that function.
 */
static inline bool plane_is_decided(struct vec3 a, struct vec3 b, struct vec3 c, struct vec3 origin,
                                    struct vec3 direction)
{
    struct vec3 p = vec_sub(b, a), q = vec_sub(c, a), f = vec_sub(a, origin);
    struct vec3 normal = vec_cross(p, q);
    double edges = sum_of_sizes(p) * sum_of_sizes(q);
    double heights = edges * sum_of_sizes(f), speeds = edges * sum_of_sizes(direction);
    double height = fabs(vec_dot(normal, f)), speed = fabs(vec_dot(normal, direction));
    return (height > 2 * PLANE_SHARE * heights) & (speed > 2 * PLANE_SHARE * speeds) &
           (heights > 0x1p-399) & (speeds > 0x1p-399) & (heights < 0x1p399) & (speeds < 0x1p399);
}

/* Whether the line certainly crosses the triangle, by the filter of triangle_crossings(). */
static inline bool certainly_crosses(const struct sheared *p, const struct sheared *q,
                                     const struct sheared *r)
{
    double e0 = q->x * r->y - q->y * r->x, e1 = r->x * p->y - r->y * p->x;
    double e2 = p->x * q->y - p->y * q->x, error = edge_error(p, q, r);
    double low = smaller_number(smaller_number(e0, e1), e2),
           high = larger_number(larger_number(e0, e1), e2);
    return (low > error) | (high < -error);
}

/*
 * Whether triangle_crossings() certainly leaves the distance uncorrected. The limit here is half of its
 * limit, a margin larger than the error of the distance.
 */
static inline bool is_flat(const struct sheared *p, const struct sheared *q,
                           const struct sheared *r, double sum, double size)
{
    bool gentle = triangle_slope(p, q, r, sum) <= SLOPE_MAX;
    bool near = corners_are_near(p, q, r, size / 2);
    return gentle & near;
}

/* Whether the distance, which is known to lie in an interval, is certainly far enough, or certainly not. */
static inline bool distance_is_decided(const struct points *points, uint32_t i, double size,
                                       double longest)
{
    double from = points->t[i] - points->t_error[i], to = points->t[i] + points->t_error[i];
    return (size <= from * longest) | !(size <= to * longest);
}

/*
 * The weights of a triangle's rough hit, as triangle_crossings() computes them. Where that function goes on
 * to correct the distance it keeps the weights, unless it needs exact arithmetic. start_is_close() need not
 * be asked: a rough hit is ahead of the ray whatever the error of its distance, which is at least 64 u of the
 * largest z.
 */
static inline void weigh_corners(struct points *points, uint32_t i)
{
    struct vec3 a = lane(&points->a, i), b = lane(&points->b, i), c = lane(&points->c, i);
    struct vec3 origin = lane(&points->origin, i), direction = lane(&points->view, i);
    struct turn turn = turn_of(direction);
    struct vec3 d = turned(turn, direction), slant = vec3(d.x / d.z, d.y / d.z, d.z);
    struct sheared p = shear_lane(turn, slant, vec_sub(a, origin));
    struct sheared q = shear_lane(turn, slant, vec_sub(b, origin));
    struct sheared r = shear_lane(turn, slant, vec_sub(c, origin));
    double e0 = edge_value(&q, &r), e1 = edge_value(&r, &p), e2 = edge_value(&p, &q);
    double sum = e0 + e1 + e2;
    double way = points->t[i] * fabs(d.z);
    bool crosses = certainly_crosses(&p, &q, &r);
    bool flat = is_flat(&p, &q, &r, sum, way + vec_largest(origin));
    bool plane = plane_is_decided(a, b, c, origin, direction);
    bool distance = distance_is_decided(points, i, triangle_size(a, b, c), fabs(d.z));
    bool sure = crosses & (flat | plane) & distance;
    bool rough = points->v[i] == WEIGHT_UNKNOWN;
    points->u[i] = rough ? e1 / sum : points->u[i];
    points->v[i] = rough ? e2 / sum : points->v[i];
    points->sure[i] = truth(sure | !rough);
}

IN_LANES(weigh_triangles, points, weigh_corners)

/* Whether all points are so far from their rays' origins that the means of the vertices are used. */
static FLATTENED bool triangles_are_far(struct points *points, uint32_t begin, uint32_t end)
{
    double near = 0;
    _Pragma("omp simd reduction(+ : near)") for (uint32_t i = begin; i < end; i++)
    {
        double size = triangle_size(lane(&points->a, i), lane(&points->b, i), lane(&points->c, i));
        double distance = fabs(points->t[i]) * vec_largest(lane(&points->view, i));
        near += size <= distance ? 0.0 : 1.0;
    }
    return near == 0;
}

/* Stores the point of a triangle; not sure if it may have to be drawn in. */
static inline void put_triangle(struct points *points, uint32_t i, const struct place *place,
                                struct vec3 b, struct vec3 c)
{
    struct vec3 a = place->anchor, across = vec_cross(vec_sub(b, a), vec_sub(c, a));
    bool sure = points->sure[i] != 0;
    sure &= !may_move_inward(points->u[i], points->v[i], across, triangle_size(a, b, c),
                             vec_largest(place_rounded(place)));
    struct vec3 normal = plain_unit(across, &sure);
    put_surface(points, i, place, normal, sure);
}

static inline void find_far_triangle(struct points *points, uint32_t i)
{
    struct vec3 a = lane(&points->a, i), b = lane(&points->b, i), c = lane(&points->c, i);
    struct place mean = {a, triangle_mean(a, b, c, points->u[i], points->v[i])};
    put_triangle(points, i, &mean, b, c);
}

IN_LANES(find_far_triangles, points, find_far_triangle)

static inline void find_triangle(struct points *points, uint32_t i)
{
    struct vec3 a = lane(&points->a, i), b = lane(&points->b, i), c = lane(&points->c, i);
    struct vec3 direction = lane(&points->view, i);
    double size = triangle_size(a, b, c), speed;
    bool far = size <= fabs(points->t[i]) * vec_largest(direction);
    struct dd3 mean = triangle_mean(a, b, c, points->u[i], points->v[i]);
    struct dd3 passage = triangle_passage(a, b, c, lane(&points->origin, i), direction, &speed);
    bool passes = !far & triangle_passes(&passage, speed, &mean, size);
    struct place place = {a, choose_dd3(passes, passage, mean)};
    put_triangle(points, i, &place, b, c);
}

IN_LANES(find_triangles, points, find_triangle)

/* The interpolated normal of a patch, from the vertex normals in a, b and c. */
static inline void interpolate_normal(struct points *points, uint32_t i)
{
    double u = points->u[i], v = points->v[i];
    bool sure = points->sure[i] != 0;
    struct vec3 sum = vec_scale(lane(&points->a, i), 1 - u - v);
    sum = vec_add_scaled(sum, lane(&points->b, i), u);
    sum = vec_add_scaled(sum, lane(&points->c, i), v);
    set_lane(&points->normal, i, plain_unit(sum, &sure));
    points->sure[i] = truth(sure);
}

IN_LANES(interpolate_normals, points, interpolate_normal)

/* a: base; b: apex; c: radii; special: 1 for the cap at the apex. */
static void gather_cones(const struct scene *scene, const struct hit *hits, uint32_t begin,
                         uint32_t end, struct points *points)
{
    const struct cone *cones = scene_cones(scene);
    for (uint32_t i = begin; i < end; i++) {
        const struct hit *hit = &hits[points->slot[i]];
        const struct cone *cone = &cones[primitive_index(hit->primitive)];
        set_lane(&points->a, i, cone->base);
        set_lane(&points->b, i, cone->apex);
        set_lane(&points->c, i, vec3(cone->base_radius, cone->apex_radius, 0));
        points->special[i] = truth(hit->part == CONE_APEX_CAP);
    }
}

static inline struct cone cone_at(const struct points *points, uint32_t i)
{
    return (struct cone){.base = lane(&points->a, i),
                         .apex = lane(&points->b, i),
                         .base_radius = points->c.x[i],
                         .apex_radius = points->c.y[i]};
}

/* A point of a line relative to `anchor`, as in plane_point() and cone_point(). */
static inline struct place line_place(struct vec3 anchor, struct vec3 origin, struct vec3 direction,
                                      struct dd t)
{
    return (struct place){anchor,
                          dd3_add(exact_difference3(origin, anchor), dd3_scale(direction, t))};
}

/* cone_point() and cone_normal() on the side, where the parameter is t. */
static inline void put_side(struct points *points, uint32_t i, const struct cone *cone, struct dd t,
                            bool sure)
{
    struct vec3 o = lane(&points->origin, i), d = lane(&points->view, i);
    struct place place = line_place(cone->base, o, d, t);
    struct vec3 normal = plain_unit(cone_side_gradient(cone, place.offset, &sure), &sure);
    put_surface(points, i, &place, normal, sure);
}

/* For a ray that does not start on that cone. */
static inline void find_side(struct points *points, uint32_t i)
{
    struct vec3 o = lane(&points->origin, i), d = lane(&points->view, i);
    struct cone cone = cone_at(points, i);
    bool sure = true;
    struct dd t = cone_side_parameter(&cone, o, d, points->t[i], points->t_error[i], &sure);
    put_side(points, i, &cone, t, sure);
}

IN_LANES(find_sides, points, find_side)

/* For a ray that starts on that cone. */
static inline void find_exit(struct points *points, uint32_t i)
{
    struct vec3 o = lane(&points->origin, i), d = lane(&points->view, i);
    struct cone cone = cone_at(points, i);
    bool sure = true;
    struct dd t = cone_exit_parameter(&cone, o, d, points->t[i], points->t_error[i], &sure);
    put_side(points, i, &cone, t, sure);
}

IN_LANES(find_exits, points, find_exit)

/*
 * The parameter at which a line crosses a plane through a point: plane_parameter() and its like for a cap,
 * where exact_dot3() needs no exact arithmetic.
 */
static inline struct dd flat_distance(struct vec3 through, struct dd3 normal, struct vec3 origin,
                                      struct vec3 direction, bool *sure)
{
    struct dd speed = plain_dot3(dd3_of(direction), normal, sure);
    return dd_div(plain_dot3(exact_difference3(through, origin), normal, sure), speed);
}

/*
 * cone_point() and cone_normal() on a cap. The distance of the cap differs from that of the hit if the hit is
 * too close to the rim.
 */
static inline void find_cap(struct points *points, uint32_t i)
{
    struct vec3 o = lane(&points->origin, i), d = lane(&points->view, i);
    struct cone cone = cone_at(points, i);
    bool sure = cone_is_ordinary(&cone, o, d), at_apex = points->special[i] != 0;
    struct dd3 w = exact_difference3(cone.apex, cone.base);
    struct dd t = flat_distance(choose(at_apex, cone.apex, cone.base), w, o, d, &sure);
    sure &= fabs(t.high - points->t[i]) <= points->t_error[i];
    struct place place = line_place(cone.base, o, d, t);
    struct vec3 axis = dd3_round(w);
    struct vec3 normal = plain_unit(choose(at_apex, axis, vec_neg(axis)), &sure);
    put_surface(points, i, &place, normal, sure);
}

IN_LANES(find_caps, points, find_cap)

static void gather_flats(const struct scene *scene, const struct hit *hits, uint32_t begin,
                         uint32_t end, struct points *points)
{
    for (uint32_t i = begin; i < end; i++) {
        struct supporting_plane plane = supporting_plane(scene, hits[points->slot[i]].primitive);
        set_lane(&points->a, i, plane.point);
        set_lane(&points->b, i, plane.normal);
    }
}

static inline void find_flat(struct points *points, uint32_t i)
{
    struct vec3 anchor = lane(&points->a, i), normal = lane(&points->b, i);
    struct vec3 o = lane(&points->origin, i), d = lane(&points->view, i);
    bool sure = true;
    struct dd t = flat_distance(anchor, dd3_of(normal), o, d, &sure);
    struct place place = line_place(anchor, o, d, t);
    put_surface(points, i, &place, normal, sure);
}

IN_LANES(find_flats, points, find_flat)

static void find_by_groups(const struct scene *scene, const struct hit *hits,
                           const uint32_t first[GROUPS + 1], struct points *points)
{
    uint32_t spheres = first[GROUP_SPHERES], triangles = first[GROUP_TRIANGLES];
    uint32_t patches = first[GROUP_PATCHES], sides = first[GROUP_SIDES];
    uint32_t exits = first[GROUP_EXITS], caps = first[GROUP_CAPS], flats = first[GROUP_FLATS],
             others = first[GROUP_OTHERS];
    if (triangles > spheres) {
        gather_spheres(scene, hits, spheres, triangles, points);
        find_spheres(points, spheres, triangles);
    }
    if (sides > triangles) {
        gather_triangles(scene, hits, triangles, sides, points);
        weigh_triangles(points, triangles, sides);
        if (triangles_are_far(points, triangles, sides))
            find_far_triangles(points, triangles, sides);
        else
            find_triangles(points, triangles, sides);
    }
    if (sides > patches) {
        gather_normals(scene, hits, patches, sides, points);
        interpolate_normals(points, patches, sides);
    }
    if (flats > sides) {
        gather_cones(scene, hits, sides, flats, points);
        find_sides(points, sides, exits);
        find_exits(points, exits, caps);
        find_caps(points, caps, flats);
    }
    if (others > flats) {
        gather_flats(scene, hits, flats, others, points);
        find_flats(points, flats, others);
    }
}

/* shading_point(), except for rays that run along the surface. */
static inline void turn_normal(struct points *points, uint32_t i)
{
    struct vec3 geometric = lane(&points->geometric, i), normal = lane(&points->normal, i);
    double side = vec_dot(lane(&points->view, i), geometric);
    bool sure = !(fabs(side) < 4 * UNIT_ROUNDOFF), entering = side <= 0;
    struct vec3 facing = choose(entering, geometric, vec_neg(geometric));
    struct vec3 shading = choose(vec_dot(normal, facing) < 0, vec_neg(normal), normal);
    set_lane(&points->geometric, i, choose(sure, facing, geometric));
    set_lane(&points->normal, i, choose(sure, shading, normal));
    points->entering[i] = truth(entering);
    points->sure[i] = truth(sure);
}

IN_LANES(turn_normals, points, turn_normal)

static void put_point(struct points *points, uint32_t i, const struct shading_point *at)
{
    set_lane(&points->point, i, at->point);
    set_lane(&points->geometric, i, at->geometric);
    set_lane(&points->normal, i, at->normal);
    points->entering[i] = at->entering;
}

/* Computes one by one the points that lanes are not sure of or have no code for. */
static void find_singly(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                        const struct hit *hits, struct points *points, uint64_t *exact_fallbacks)
{
    for (uint32_t i = 0; i < points->count; i++) {
        const struct ray *ray = &rays[points->slot[i]];
        const struct hit *found = &hits[points->slot[i]];
        if (points->sure[i] != 0 && !found->in_corner) continue;
        struct hit hit = settled_hit(scene, ray, found, exact_fallbacks);
        struct surface surface;
        surface_at(scene, ray, &hit, &surface);
        if (hit.in_corner) surface.point = corner_point(scene, bvh, ray, &hit);
        set_lane(&points->point, i, surface.point);
        set_lane(&points->geometric, i, surface.geometric);
        set_lane(&points->normal, i, surface.shading);
    }
}

static void turn_singly(const struct scene *scene, const struct ray *rays, struct points *points)
{
    for (uint32_t i = 0; i < points->count; i++) {
        if (points->sure[i] != 0) continue;
        struct surface surface = {.point = lane(&points->point, i),
                                  .geometric = lane(&points->geometric, i),
                                  .shading = lane(&points->normal, i)};
        struct shading_point at = shading_point(scene, &rays[points->slot[i]], &surface);
        put_point(points, i, &at);
    }
}

static void doubt_from(struct points *points, uint32_t begin)
{
    for (uint32_t i = begin; i < points->count; i++)
        points->sure[i] = 0;
}

void points_find(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                 const struct hit *hits, uint32_t count, struct points *points,
                 uint64_t *exact_fallbacks)
{
    uint32_t first[GROUPS + 1];
    points->formulas = scene->view.formulas;
    sort_by_group(rays, hits, count, points, first);
    gather_rays(rays, hits, points);
    gather_materials(scene, hits, points);
    bool exact = points->formulas == FORMULAS_EXACT;
    if (exact) find_by_groups(scene, hits, first, points);
    doubt_from(points, exact ? first[GROUP_OTHERS] : 0); /* lanes have the exact formulas alone */
    find_singly(scene, bvh, rays, hits, points, exact_fallbacks);
    if (exact) turn_normals(points, 0, points->count);
    turn_singly(scene, rays, points);
}

struct shading_point points_get(const struct points *points, uint32_t i)
{
    return (struct shading_point){.point = lane(&points->point, i),
                                  .view = lane(&points->view, i),
                                  .geometric = lane(&points->geometric, i),
                                  .normal = lane(&points->normal, i),
                                  .entering = points->entering[i] != 0,
                                  .formulas = points->formulas,
                                  .material = points->material[i]};
}
