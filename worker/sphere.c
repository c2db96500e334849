/* Crossings of a line with a sphere in double-double: see sphere_line.h. */
#include "worker/sphere.h"

#include "worker/sphere_line.h"

/*
 * A sphere and a ray, with lengths divided by 2^length and the direction by 2^speed, so that no product
 * leaves the range of double. The scaling is exact.
 */
struct scaled {
    struct sphere sphere;
    struct vec3 origin, direction;
    int length, speed;
};

static struct scaled scaled_of(const struct sphere *sphere, const struct ray *ray)
{
    struct scaled scaled = {*sphere, ray->origin, ray->direction, 0, 0};
    double reach = fmax(vec_largest(ray->origin), vec_largest(sphere->center));
    double speed = vec_largest(ray->direction);
    if (is_ordinary(reach + sphere->radius) && is_ordinary(sphere->radius) && is_ordinary(speed))
        return scaled;
    (void)frexp(fmax(reach, sphere->radius), &scaled.length);
    (void)frexp(speed, &scaled.speed);
    scaled.sphere.center = vec_scale_exactly(sphere->center, -scaled.length);
    scaled.sphere.radius = ldexp(sphere->radius, -scaled.length);
    scaled.origin = vec_scale_exactly(ray->origin, -scaled.length);
    scaled.direction = vec_scale_exactly(ray->direction, -scaled.speed);
    return scaled;
}

static struct sphere_line line_from(const struct scaled *it, double t)
{
    return sphere_line_from(it->sphere.center, it->sphere.radius, it->origin, it->direction, t);
}

static double closest_approach(const struct scaled *it)
{
    return sphere_closest_approach(it->sphere.center, it->origin, it->direction);
}

/* The discriminant a r^2 - |f x d|^2, rounded once; 0 only if the exact value is 0. */
static struct dd exact_discriminant(const struct scaled *it)
{
    struct accumulator sum;
    int exponent;
    struct dd3 f = exact_difference3(it->origin, it->sphere.center);
    const struct dd fs[3] = {f.x, f.y, f.z};
    const double ds[3] = {it->direction.x, it->direction.y, it->direction.z};
    double r = it->sphere.radius;
    accumulator_clear(&sum);
    for (unsigned i = 0; i < 3; i++) {
        unsigned j = (i + 1) % 3;
        struct accumulator cross;
        accumulator_clear(&cross);
        accumulator_add_dd(&cross, 1, fs[i], dd(ds[j]), dd(1));
        accumulator_add_dd(&cross, -1, fs[j], dd(ds[i]), dd(1));
        accumulator_add_product(&sum, &cross, &cross, NULL, true);
        const double square[4] = {ds[i], ds[i], r, r};
        accumulator_add(&sum, square, 4, false);
    }
    struct dd value = accumulator_round(&sum, &exponent);
    /* A value too small for a double must not become 0: its sign matters. */
    return dd_ldexp(value, exponent > -1000 ? exponent : -1000);
}

/*
 * Decides whether the line meets the sphere, and completes it. If the discriminant is within 2^12 times its
 * error bound, its sign and its value are computed exactly. Otherwise its root errs by 2^-13 of itself times
 * the root of the error bound, or by less than 2^-56 of the radius.
 */
static bool line_meets(const struct scaled *it, struct sphere_line *line, uint64_t *exact)
{
    double error = SPHERE_LINE_FILTER * sphere_line_error(line, it->sphere.radius);
    if (fabs(line->discriminant.high) <= error) {
        ++*exact;
        line->discriminant = exact_discriminant(it);
    }
    line->half = dd_sqrt(line->discriminant);
    return line->discriminant.high >= 0;
}

/* |f|^2 - r^2, times 2^-*exponent, rounded once. */
static struct dd exact_power(const struct scaled *it, int *exponent)
{
    struct accumulator sum;
    struct dd3 f = exact_difference3(it->origin, it->sphere.center);
    const struct dd fs[3] = {f.x, f.y, f.z};
    accumulator_clear(&sum);
    for (unsigned i = 0; i < 3; i++)
        accumulator_add_dd(&sum, 1, fs[i], fs[i], dd(1));
    const double square[2] = {it->sphere.radius, it->sphere.radius};
    accumulator_add(&sum, square, 2, true);
    return accumulator_round(&sum, exponent);
}

/* A root smaller than this relative to the terms that it is the difference of has lost too many bits. */
#define ROOT_CANCELLED 0x1p-46

/*
 * Recomputes a root that has cancelled because the origin is next to the sphere, as the product of the roots
 * divided by the other root. Then the sign is right, and with it the side of the sphere.
 */
static void mend_root(const struct scaled *it, const struct sphere_line *line, struct dd *root,
                      struct dd other)
{
    double size = fabs(line->t) + line->half.high / line->a.high;
    if (fabs(root->high) > ROOT_CANCELLED * size || other.high == 0) return;
    int exponent;
    struct dd power = exact_power(it, &exponent);
    *root = dd_ldexp(dd_div(power, dd_mul(line->a, other)), exponent);
}

/* Both roots, for a scaled line that meets the sphere. */
static void both_roots(const struct scaled *it, const struct sphere_line *line, struct dd roots[2])
{
    roots[0] = dd_add(dd(line->t), sphere_line_root(line, false));
    roots[1] = dd_add(dd(line->t), sphere_line_root(line, true));
    unsigned small = fabs(roots[0].high) < fabs(roots[1].high) ? 0 : 1;
    mend_root(it, line, &roots[small], roots[1 - small]);
}

FLATTENED struct crossings sphere_roots(const struct sphere *sphere, const struct ray *ray,
                                        uint64_t *exact)
{
    struct crossings found = NO_CROSSINGS;
    struct scaled it = scaled_of(sphere, ray);
    struct sphere_line line = line_from(&it, closest_approach(&it));
    struct dd roots[2];
    if (!line_meets(&it, &line, exact)) return found;
    both_roots(&it, &line, roots);
    int exponent = it.length - it.speed;
    if (!sphere->inside_only) found.t[0] = ldexp(roots[0].high, exponent);
    found.t[1] = ldexp(roots[1].high, exponent);
    return found;
}

FLATTENED struct crossings sphere_way_out(const struct sphere *sphere, const struct ray *ray)
{
    struct crossings found = NO_CROSSINGS;
    struct scaled it = scaled_of(sphere, ray);
    struct dd3 f = exact_difference3(it.sphere.center, it.origin);
    int exponent;
    struct dd b = exact_dot3(f, dd3_of(it.direction), &exponent);
    struct dd a = exact_dot(it.direction, it.direction);
    found.t[1] = ldexp(2 * dd_div(b, a).high, it.length - it.speed + exponent);
    return found;
}

/*
 * Which of the roots t belongs to. They are the same numbers as those that sphere_roots() found; a ray that
 * left this sphere has its exit at 2 b / a, close to the second one.
 */
static unsigned root_at(const struct sphere *sphere, const struct dd roots[2], double t)
{
    if (sphere->inside_only) return 1;
    if (t == roots[0].high || t == roots[1].high) return t != roots[0].high;
    return t > (roots[0].high + roots[1].high) / 2;
}

/* The parameter of the crossing at t, relative to line->t. */
static struct dd offset_at(const struct scaled *it, struct sphere_line *line, double t)
{
    double scaled_t = it->length == it->speed ? t : ldexp(t, it->speed - it->length);
    uint64_t ignored = 0;
    if (!line_meets(it, line, &ignored)) return dd_div(dd_negate(line->along), line->a);
    double behind = sphere_line_behind(line, scaled_t);
    bool second = behind > 0;
    /* Only near the middle are the roots themselves needed. */
    if (!(fabs(behind) > sphere_line_behind_error(line, it->direction, it->sphere.radius))) {
        struct dd roots[2];
        both_roots(it, line, roots);
        second = root_at(&it->sphere, roots, scaled_t);
    }
    return sphere_line_root(line, second);
}

FLATTENED struct dd sphere_parameter(const struct sphere *sphere, const struct ray *ray, double t,
                                     bool leaving)
{
    struct scaled it = scaled_of(sphere, ray);
    struct sphere_line line = line_from(&it, closest_approach(&it));
    struct dd root = dd_add(dd(line.t), offset_at(&it, &line, t));
    root = dd_ldexp(root, it.length - it.speed);
    if (leaving && !(fabs(root.high - t) <= WAY_OUT_ERROR * t)) return dd(t);
    return root;
}

FLATTENED struct dd3 sphere_point(const struct sphere *sphere, const struct ray *ray, double t)
{
    struct scaled it = scaled_of(sphere, ray);
    struct sphere_line line = line_from(&it, closest_approach(&it));
    struct dd s = offset_at(&it, &line, t);
    struct dd3 p = dd3_add(line.p, dd3_scale(it.direction, s));
    return it.length == 0 ? p : dd3_ldexp(p, it.length);
}
