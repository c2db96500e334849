/*
 * Intersection formulas of the paper, or of textbooks, selected by render.formulas = paper for comparison
 * with the exact ones in the primitives' files. A ray does not hit again the surface it leaves because
 * everything closer than an absolute distance is ignored.
 */
#ifndef FARM_WORKER_NAIVE_H
#define FARM_WORKER_NAIVE_H

#include "worker/box.h"

/* The usual absolute epsilon, in scene units along a unit direction. */
#define NAIVE_EPSILON 1e-9

/* Solves r^2 = |o + t d - c|^2 with d of unit length: t = b -+ sqrt(b^2 - L^2 + r^2). */
static inline struct crossings naive_sphere(const struct sphere *sphere, const struct ray *ray)
{
    struct crossings found = NO_CROSSINGS;
    double length = vec_length(ray->direction);
    struct vec3 d = vec_scale(ray->direction, 1 / length);
    struct vec3 l = vec_sub(sphere->center, ray->origin);
    double b = vec_dot(l, d);
    double discriminant = b * b - vec_dot(l, l) + sphere->radius * sphere->radius;
    if (!(discriminant >= 0)) return found;
    double half_chord = sqrt(discriminant);
    if (!sphere->inside_only) found.t[0] = (b - half_chord) / length;
    found.t[1] = (b + half_chord) / length;
    return found;
}

static inline struct vec3 naive_sphere_normal(const struct sphere *sphere, struct vec3 point)
{
    struct vec3 radial = vec_sub(point, sphere->center);
    return vec_is_zero(radial) ? vec3(0, 1, 0) : vec_normalize(radial);
}

static inline double naive_plane_distance(struct vec3 point, struct vec3 normal,
                                          const struct ray *ray)
{
    double speed = vec_dot(ray->direction, normal);
    return speed == 0 ? NOT_CROSSED : vec_dot(vec_sub(point, ray->origin), normal) / speed;
}

static inline struct crossings naive_disc(const struct disc *disc, const struct ray *ray)
{
    double t = naive_plane_distance(disc->center, disc->normal, ray);
    struct vec3 p = vec_add_scaled(ray->origin, ray->direction, t);
    struct vec3 out = vec_sub(p, disc->center);
    return vec_dot(out, out) <= disc->radius * disc->radius ? one_crossing(t) : NO_CROSSINGS;
}

static inline struct crossings naive_box(const struct box *box, const struct ray *ray)
{
    struct crossings line = {.t = {-INFINITE, INFINITE}};
    for (unsigned axis = 0; axis < 3; axis++) {
        double inverse = 1 / vec_component(&ray->direction, axis);
        double origin = vec_component(&ray->origin, axis);
        uint32_t in = 2 * axis + (inverse < 0 ? 1 : 0);
        double enter = (box_face(box, in) - origin) * inverse;
        double leave = (box_face(box, in ^ 1) - origin) * inverse;
        if (enter > line.t[0]) {
            line.t[0] = enter;
            line.part[0] = in;
        }
        if (leave < line.t[1]) {
            line.t[1] = leave;
            line.part[1] = in ^ 1;
        }
    }
    return line.t[0] <= line.t[1] ? line : NO_CROSSINGS;
}

/* T. Moeller and B. Trumbore, "Fast, minimum storage ray/triangle intersection", JGT 2(1), 1997. */
static inline struct crossings naive_triangle(const struct vec3 *a, const struct vec3 *b,
                                              const struct vec3 *c, const struct ray *ray)
{
    struct vec3 e1 = vec_sub(*b, *a), e2 = vec_sub(*c, *a);
    struct vec3 p = vec_cross(ray->direction, e2);
    double determinant = vec_dot(e1, p);
    if (determinant == 0) return NO_CROSSINGS;
    struct vec3 s = vec_sub(ray->origin, *a);
    double u = vec_dot(s, p) / determinant;
    if (!(u >= 0 && u <= 1)) return NO_CROSSINGS;
    struct vec3 q = vec_cross(s, e1);
    double v = vec_dot(ray->direction, q) / determinant;
    if (!(v >= 0 && u + v <= 1)) return NO_CROSSINGS;
    struct crossings found = one_crossing(vec_dot(e2, q) / determinant);
    found.u = u;
    found.v = v;
    return found;
}

/* Whether the height at t along the axis, 0 at the base and 1 at the apex, is on the side. */
static inline bool naive_cone_holds(const struct cone *cone, const struct ray *ray, double t)
{
    struct vec3 w = vec_sub(cone->apex, cone->base);
    struct vec3 p = vec_sub(vec_add_scaled(ray->origin, ray->direction, t), cone->base);
    double height = vec_dot(p, w) / vec_dot(w, w);
    return height >= 0 && height <= 1;
}

static inline void naive_cone_add(struct crossings *found, double t, uint32_t part)
{
    unsigned i = found->t[0] == NOT_CROSSED ? 0u : 1u;
    if (i == 1 && t < found->t[0]) {
        found->t[1] = found->t[0];
        found->part[1] = found->part[0];
        i = 0;
    }
    found->t[i] = t;
    found->part[i] = part;
}

static inline void naive_cap(const struct cone *cone, const struct ray *ray, uint32_t part,
                             struct crossings *found)
{
    bool base = part == CONE_BASE_CAP;
    struct disc cap = {.center = base ? cone->base : cone->apex,
                       .normal = vec_normalize(vec_sub(cone->apex, cone->base)),
                       .radius = base ? cone->base_radius : cone->apex_radius};
    double t = naive_disc(&cap, ray).t[0];
    if (t != NOT_CROSSED) naive_cone_add(found, t, part);
}

/* The quadratic in t of |p|^2 - (p.axis)^2 = (r0 + slope p.axis)^2, axis a unit vector. */
static inline struct crossings naive_cone(const struct cone *cone, const struct ray *ray)
{
    struct crossings found = NO_CROSSINGS;
    struct vec3 w = vec_sub(cone->apex, cone->base), f = vec_sub(ray->origin, cone->base);
    struct vec3 axis = vec_normalize(w), d = ray->direction;
    double slope = (cone->apex_radius - cone->base_radius) / vec_length(w);
    double da = vec_dot(d, axis), fa = vec_dot(f, axis), stretch = 1 + slope * slope;
    double a = vec_dot(d, d) - stretch * da * da;
    double b = 2 * (vec_dot(f, d) - stretch * da * fa - cone->base_radius * slope * da);
    double r = cone->base_radius;
    double c = vec_dot(f, f) - stretch * fa * fa - 2 * r * slope * fa - r * r;
    double discriminant = b * b - 4 * a * c;
    if (discriminant >= 0) {
        double roots[2] = {(-b - sqrt(discriminant)) / (2 * a),
                           (-b + sqrt(discriminant)) / (2 * a)};
        for (unsigned i = 0; i < 2; i++)
            if (naive_cone_holds(cone, ray, roots[i])) naive_cone_add(&found, roots[i], CONE_SIDE);
    }
    if (cone->capped) {
        naive_cap(cone, ray, CONE_BASE_CAP, &found);
        naive_cap(cone, ray, CONE_APEX_CAP, &found);
    }
    return found;
}

/* Away from the axis, tilted by the slope. */
static inline struct vec3 naive_cone_normal(const struct cone *cone, struct vec3 point,
                                            uint32_t part)
{
    struct vec3 w = vec_sub(cone->apex, cone->base), axis = vec_normalize(w);
    if (part == CONE_APEX_CAP) return axis;
    if (part == CONE_BASE_CAP) return vec_neg(axis);
    double slope = (cone->apex_radius - cone->base_radius) / vec_length(w);
    struct vec3 p = vec_sub(point, cone->base);
    struct vec3 radial = vec_add_scaled(p, axis, -vec_dot(p, axis));
    struct vec3 normal = vec_add_scaled(radial, axis, -slope * vec_length(radial));
    return vec_is_zero(normal) ? axis : vec_normalize(normal);
}

/* Ignores crossings closer than the epsilon: they are taken for the surface that the ray starts on. */
static inline struct crossings naive_beyond_epsilon(struct crossings found, const struct ray *ray)
{
    if (!(found.t[0] > 0 || found.t[1] > 0)) return NO_CROSSINGS;
    double epsilon = NAIVE_EPSILON / vec_length(ray->direction);
    for (unsigned i = 0; i < 2; i++)
        if (!(found.t[i] > epsilon)) found.t[i] = NOT_CROSSED;
    return found;
}

#endif
