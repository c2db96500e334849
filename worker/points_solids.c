/* Spheres, cones, discs and planes of a wave. */
#include "worker/cone_line.h"
#include "worker/planar.h"
#include "worker/points_kinds.h"
#include "worker/sphere_line.h"

/* ---- spheres ---- */

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

/* sphere_point() for a sphere and a ray of ordinary size that certainly meet. */
static inline struct place sphere_place(const struct points *points, size_t i, bool *sure)
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

static inline void find_sphere(struct points *points, size_t i)
{
    bool sure;
    struct place place = sphere_place(points, i, &sure);
    struct vec3 normal = plain_unit(dd3_round(place.offset), &sure);
    put_surface(points, i, &place, normal, sure);
}

FIND_IN_LANES(find_on_spheres, gather_spheres, find_sphere)

/* ---- lines and planes ---- */

/* A point of a line relative to `anchor`, as in plane_point() and cone_point(). */
static inline struct place line_place(struct vec3 anchor, struct vec3 origin, struct vec3 direction,
                                      struct dd t)
{
    return (struct place){anchor,
                          dd3_add(exact_difference3(origin, anchor), dd3_scale(direction, t))};
}

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

/* ---- cones ---- */

/* a: base; b: apex; c: radii; at_apex: of its caps. */
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
        points->at_apex[i] = truth(hit->part == CONE_APEX_CAP);
    }
}

static inline struct cone cone_at(const struct points *points, size_t i)
{
    return (struct cone){.base = lane(&points->a, i),
                         .apex = lane(&points->b, i),
                         .base_radius = points->c.x[i],
                         .apex_radius = points->c.y[i]};
}

/* cone_point() and cone_normal() on the side. leaving: the ray starts on this cone. */
static inline void find_on_side(struct points *points, size_t i, bool leaving)
{
    struct vec3 o = lane(&points->origin, i), d = lane(&points->view, i);
    struct cone cone = cone_at(points, i);
    double near = points->t[i], error = points->t_error[i];
    bool sure = true;
    struct dd t = leaving ? cone_exit_parameter(&cone, o, d, near, error, &sure)
                          : cone_side_parameter(&cone, o, d, near, error, &sure);
    struct place place = line_place(cone.base, o, d, t);
    struct vec3 normal = plain_unit(cone_side_gradient(&cone, place.offset, &sure), &sure);
    put_surface(points, i, &place, normal, sure);
}

static inline void find_side(struct points *points, size_t i)
{
    find_on_side(points, i, false);
}

static inline void find_exit(struct points *points, size_t i)
{
    find_on_side(points, i, true);
}

FIND_IN_LANES(find_on_sides, gather_cones, find_side)
FIND_IN_LANES(find_on_exits, gather_cones, find_exit)

/*
 * cone_point() and cone_normal() on a cap. The distance of the cap differs from that of the hit if the hit is
 * too close to the rim.
 */
static inline void find_cap(struct points *points, size_t i)
{
    struct vec3 o = lane(&points->origin, i), d = lane(&points->view, i);
    struct cone cone = cone_at(points, i);
    bool sure = cone_is_ordinary(&cone, o, d), at_apex = points->at_apex[i] != 0;
    struct dd3 w = exact_difference3(cone.apex, cone.base);
    struct dd t = flat_distance(choose(at_apex, cone.apex, cone.base), w, o, d, &sure);
    sure &= fabs(t.high - points->t[i]) <= points->t_error[i];
    struct place place = line_place(cone.base, o, d, t);
    struct vec3 axis = dd3_round(w);
    struct vec3 normal = plain_unit(choose(at_apex, axis, vec_neg(axis)), &sure);
    put_surface(points, i, &place, normal, sure);
}

FIND_IN_LANES(find_on_caps, gather_cones, find_cap)

/* ---- discs and planes ---- */

static void gather_flats(const struct scene *scene, const struct hit *hits, uint32_t begin,
                         uint32_t end, struct points *points)
{
    for (uint32_t i = begin; i < end; i++) {
        struct supporting_plane plane = supporting_plane(scene, hits[points->slot[i]].primitive);
        set_lane(&points->a, i, plane.point);
        set_lane(&points->b, i, plane.normal);
    }
}

static inline void find_flat(struct points *points, size_t i)
{
    struct vec3 anchor = lane(&points->a, i), normal = lane(&points->b, i);
    struct vec3 o = lane(&points->origin, i), d = lane(&points->view, i);
    bool sure = true;
    struct dd t = flat_distance(anchor, dd3_of(normal), o, d, &sure);
    struct place place = line_place(anchor, o, d, t);
    put_surface(points, i, &place, normal, sure);
}

FIND_IN_LANES(find_on_flats, gather_flats, find_flat)
