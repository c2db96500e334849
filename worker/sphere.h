/* Ray and sphere. */
#ifndef FARM_WORKER_SPHERE_H
#define FARM_WORKER_SPHERE_H

#include "worker/exact.h"
#include "worker/shape.h"

static inline struct bounds sphere_bounds(const struct sphere *sphere)
{
    struct vec3 c = sphere->center;
    double r = sphere->radius;
    return (struct bounds){{c.x - r, c.y - r, c.z - r}, {c.x + r, c.y + r, c.z + r}};
}

/*
 * |o - center|^2 - r^2, the product of the roots times d.d. From an eye close to a huge sphere
 * nearly all digits cancel, hence the compensated sum and the rounding errors of o - center.
 */
static inline double sphere_power(const struct sphere *sphere, const struct vec3 *origin)
{
    struct compensated sum = {0, 0};
    double lost = 0;
    for (unsigned axis = 0; axis < 3; axis++) {
        struct compensated f =
            exact_difference(vec_component(origin, axis), vec_component(&sphere->center, axis));
        sum = add_product(sum, f.high, f.high);
        lost += f.high * f.low;
    }
    sum = add_product(sum, -sphere->radius, sphere->radius);
    return sum.high + (sum.low + 2 * lost);
}

/* The line's point nearest to the centre, seen from the centre: at parameter t, at distance |l|. */
struct sphere_approach {
    double a; /* d.d */
    double b; /* -f.d */
    double t; /* b / a */
    struct vec3 l;
    double discriminant; /* r^2 - |l|^2, as a product so that a distant sphere loses nothing */
};

/* Haines, Gunther and Akenine-Moller, "Precision improvements for ray/sphere intersection", Ray
 * Tracing Gems ch. 7: r^2 - |f - (f.d) d|^2 instead of b^2 - a c. */
static inline struct sphere_approach sphere_approach(const struct sphere *sphere,
                                                     const struct ray *ray)
{
    struct vec3 f = vec_sub(ray->origin, sphere->center);
    double a = vec_dot(ray->direction, ray->direction);
    double b = -vec_dot(f, ray->direction);
    double t = b / a;
    struct vec3 l = vec_add_scaled(f, ray->direction, t);
    double distance = sqrt(vec_dot(l, l));
    double discriminant = (sphere->radius - distance) * (sphere->radius + distance);
    return (struct sphere_approach){a, b, t, l, discriminant};
}

/*
 * In and out. leaving: the ray starts on this sphere, so that one root is 0 and is left out; the
 * other one, 2 b / a, lies ahead when the ray goes inward. A tangent touches twice at the same t.
 */
static inline struct crossings sphere_crossings(const struct sphere *sphere, const struct ray *ray,
                                                bool leaving)
{
    struct sphere_approach near = sphere_approach(sphere, ray);
    struct crossings found = NO_CROSSINGS;
    if (leaving) {
        found.t[1] = 2 * near.t;
        return found;
    }
    if (!(near.discriminant >= 0)) return found;
    double q = near.b + copysign(sqrt(near.a * near.discriminant), near.b);
    if (q == 0)
        return found; /* the origin is the point of contact of a tangent: both roots are 0 */
    double first = sphere_power(sphere, &ray->origin) / q;
    double second = q / near.a;
    if (!sphere->inside_only) found.t[0] = fmin(first, second);
    found.t[1] = fmax(first, second);
    return found;
}

/*
 * The outward normal at the crossing t. l and half the chord are added, instead of o + t d -
 * center: these two have the size of the radius, however far away the origin is.
 */
static inline struct vec3 sphere_normal(const struct sphere *sphere, const struct ray *ray,
                                        double t)
{
    struct sphere_approach near = sphere_approach(sphere, ray);
    double half_chord = sqrt(fmax(near.discriminant, 0) / near.a);
    double along = t < near.t ? -half_chord : half_chord;
    return vec_normalize(vec_add_scaled(near.l, ray->direction, along));
}

#endif
