/*
 * Intersection of a ray with a sphere, cylinder, cone or frustum in plain arithmetic, for eight pairs or for
 * one: the intervals of distances in which the ray enters and leaves the solid, or that it misses it; and the
 * interval in which it crosses a plane. Where rounding leaves that undecided, and for the distances
 * themselves, worker/sphere.h, cone.h and planar.h are used. For a packet, eight rays are tested with one
 * solid. For a single ray, the few solids of a leaf are tested one by one, since a miss is found before any
 * root is computed.
 *
 * For both kinds of solids the line is parametrised from its point closest to the solid, o + t0 d. t0 is an
 * ordinary double and is not rounded any further, so all that is left to be computed is of the size of the
 * solid. L, in the code `reach`, is the sum of absolute values of f = o - c (o - base) and the solid's own
 * lengths, and so at least as long as any of the vectors below.
 */
#ifndef FARM_WORKER_SOLID_LANES_H
#define FARM_WORKER_SOLID_LANES_H

#include "worker/lanes3.h"
#include "worker/shape.h"
#include "worker/sphere.h"

/* ---- the arithmetic, of eight pairs and of one ---- */

#define OF(name)  name##_lanes
#define OP(name)  lanes_##name
#define OP3(name) lanes3_##name
#define NUMBER    struct lanes
#define VECTOR    struct lanes3
#define ALL       ALL_LANES
#include "worker/solid_spans.h"

#define ONE_2(name, expression)                                                                    \
    static INLINED double one_##name(double a, double b)                                           \
    {                                                                                              \
        return expression;                                                                         \
    }

ONE_2(add, a + b)
ONE_2(sub, a - b)
ONE_2(mul, (a * b))
ONE_2(div, a / b)
ONE_2(larger, a > b ? a : b)
ONE_2(smaller, a < b ? a : b)

static INLINED lane_set one_less(double a, double b)
{
    return a < b;
}

static INLINED double one_choose(lane_set set, double a, double b)
{
    return set ? a : b;
}

#define OF(name)          name##_one
#define OP(name)          one_##name
#define OP3(name)         one3_##name
#define NUMBER            double
#define VECTOR            struct vec3
#define ALL               1u
#define one_of(a)         (a)
#define one_negate(a)     (-(a))
#define one_abs           fabs
#define one_sqrt          sqrt
#define one_fma           fma
#define one3_sub          vec_sub
#define one3_sum_of_sizes sum_of_sizes
#include "worker/solid_spans.h"

/* ---- rays ---- */

static INLINED struct ray_one ray_in_one(const struct ray *ray)
{
    struct vec3 d = ray->direction;
    return (struct ray_one){ray->origin, d, sum_of_sizes(d), 1 / vec_dot(d, d)};
}

static INLINED struct ray_lanes rays_in_lanes(const struct lanes o[3], const struct lanes d[3])
{
    struct ray_lanes rays = {.o = {o[0], o[1], o[2]}, .d = {d[0], d[1], d[2]}};
    rays.speed = lanes3_sum_of_sizes(rays.d);
    rays.inverse2 = lanes_div(lanes_of(1), lanes3_dot(rays.d, rays.d));
    return rays;
}

/* ---- what there is in a scene ---- */

/* The same solid in all lanes. */
static INLINED struct sphere_lanes sphere_in_lanes(const struct scene *scene, uint32_t id)
{
    const struct sphere *it = &scene_spheres(scene)[primitive_index(id)];
    return (struct sphere_lanes){lanes3_of(it->center), lanes_of(it->radius)};
}

static INLINED struct cone_lanes cone_in_lanes(const struct scene *scene, uint32_t id)
{
    const struct cone *it = &scene_cones(scene)[primitive_index(id)];
    return (struct cone_lanes){lanes3_of(it->base), lanes3_of(it->apex), lanes_of(it->base_radius),
                               lanes_of(it->apex_radius)};
}

/* Whether it is a solid of these kinds, visible from both sides, whose spans may be used. */
static inline bool has_usable_spans(const struct scene *scene, uint32_t id)
{
    if (primitive_kind(id) == PRIMITIVE_CONE) return scene_cones(scene)[primitive_index(id)].capped;
    return !scene_spheres(scene)[primitive_index(id)].inside_only;
}

/*
 * The same for a ray that meets it at `from` or later: close to its start it may have passed a surface that
 * lies in the one it starts on.
 */
static inline bool has_usable_spans_ahead(const struct scene *scene, uint32_t id,
                                          const struct ray *ray, double from)
{
    return from > start_reach(ray) && has_usable_spans(scene, id);
}

static inline bool has_spans(uint32_t id)
{
    return primitive_kind(id) == PRIMITIVE_SPHERE || primitive_kind(id) == PRIMITIVE_CONE;
}

/* The spans of one solid and one ray. */
static INLINED struct spans_one spans_of_one(const struct scene *scene, uint32_t id,
                                             const struct ray_one *ray)
{
    if (primitive_kind(id) == PRIMITIVE_CONE) {
        const struct cone *it = &scene_cones(scene)[primitive_index(id)];
        struct cone_one cone = {it->base, it->apex, it->base_radius, it->apex_radius};
        return cone_spans_one(&cone, ray);
    }
    const struct sphere *it = &scene_spheres(scene)[primitive_index(id)];
    struct sphere_one sphere = {it->center, it->radius};
    return sphere_spans_one(&sphere, ray);
}

/* The spans of one solid and eight rays. */
static INLINED struct spans_lanes spans_of_rays(const struct scene *scene, uint32_t id,
                                                const struct ray_lanes *rays)
{
    if (primitive_kind(id) == PRIMITIVE_CONE) {
        struct cone_lanes cone = cone_in_lanes(scene, id);
        return cone_spans_lanes(&cone, rays);
    }
    struct sphere_lanes sphere = sphere_in_lanes(scene, id);
    return sphere_spans_lanes(&sphere, rays);
}

static INLINED struct plane_span_one plane_span_of_one(const struct scene *scene, uint32_t id,
                                                       const struct ray_one *ray)
{
    const struct plane *it = &scene_planes(scene)[primitive_index(id)];
    return plane_span_one(it->point, it->normal, ray);
}

static INLINED struct plane_span_lanes plane_span_of_rays(const struct scene *scene, uint32_t id,
                                                          const struct ray_lanes *rays)
{
    const struct plane *it = &scene_planes(scene)[primitive_index(id)];
    return plane_span_lanes(lanes3_of(it->point), lanes3_of(it->normal), rays);
}

#endif
