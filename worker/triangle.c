/* The decisions about a ray and a triangle that plain arithmetic leaves open. */
#include "worker/triangle.h"

#include <float.h>
#include <limits.h>

/*
 * The vertices, and their exact positions relative to the ray's origin. Their order depends on nothing but
 * their coordinates, so that all copies of a triangle are hit at the same t.
 */
struct corners {
    struct vec3 at[3];
    struct dd3 from_origin[3];
    unsigned given[3]; /* their original indices */
    struct vec3 direction;
};

static bool comes_before(const struct vec3 *a, const struct vec3 *b)
{
    if (a->x != b->x) return a->x < b->x;
    if (a->y != b->y) return a->y < b->y;
    return a->z < b->z;
}

static struct corners ordered_corners(const struct vec3 given[3], const struct ray *ray)
{
    struct corners it = {.given = {0, 1, 2}, .direction = ray->direction};
    for (unsigned i = 0; i < 3; i++) {
        unsigned last = i == 1 ? 2 : 1; /* swaps 0-1, 1-2, 0-1 */
        if (!comes_before(&given[it.given[last]], &given[it.given[last - 1]])) continue;
        unsigned swapped = it.given[last];
        it.given[last] = it.given[last - 1];
        it.given[last - 1] = swapped;
    }
    for (unsigned i = 0; i < 3; i++) {
        it.at[i] = given[it.given[i]];
        it.from_origin[i] = exact_difference3(it.at[i], ray->origin);
    }
    return it;
}

/*
 * d.(p x q) 2^-*exponent; 0 only if the exact value is 0. Double-double errs by less than 64 u^2 of the
 * product of the lengths. If the value is less than 2^-44 of that, or products leave the range of double, it
 * is computed exactly and rounded.
 */
static struct dd edge_of(const struct corners *corners, unsigned from, unsigned to, int *exponent)
{
    const struct dd3 *p = &corners->from_origin[from], *q = &corners->from_origin[to];
    const struct vec3 *d = &corners->direction;
    struct dd value = dd3_dot_vec(dd3_cross(*p, *q), *d);
    double size = sum_of_sizes(dd3_round(*p)) * sum_of_sizes(dd3_round(*q)) * sum_of_sizes(*d);
    *exponent = 0;
    if (fabs(value.high) > 0x1p-44 * size && size > 0x1p-400 && size < 0x1p400) return value;
    return exact_triple(p, q, *d, exponent);
}

/* The values of the three edges, each opposite to the vertex of the same index; in integers if they fit. */
static void edges_of(const struct corners *corners, struct dd edges[3], int exponents[3])
{
    struct dd3 direction = dd3_of(corners->direction);
    struct integers d, at[3];
    bool fit = exact_integers(&direction, &d);
    for (unsigned i = 0; i < 3 && fit; i++)
        fit = exact_integers(&corners->from_origin[i], &at[i]);
    for (unsigned i = 0; i < 3; i++) {
        unsigned from = (i + 1) % 3, to = (i + 2) % 3;
        edges[i] = fit ? integers_triple(&at[from], &at[to], &d, &exponents[i])
                       : edge_of(corners, from, to, &exponents[i]);
    }
}

/*
 * The sign of direction z times the component of q - p along `axis` in the sheared plane. Double-double errs
 * by less than 8 u^2 of the products.
 */
static int sheared_step_sign(const struct corners *corners, const struct shear *shear,
                             unsigned from, unsigned to, unsigned axis)
{
    struct dd3 step = exact_difference3(corners->at[to], corners->at[from]);
    struct dd along = dd3_component(&step, axis), z = dd3_component(&step, shear->z);
    double dz = shear->dz, da = vec_component(&corners->direction, axis);
    double size = fabs(along.high * dz) + fabs(z.high * da);
    double value = dd_sub(dd_scale(along, dz), dd_scale(z, da)).high;
    if (fabs(value) > 8 * DD_ROUNDOFF * size && size > 0x1p-400 && size < 0x1p400)
        return value > 0 ? 1 : -1;
    struct accumulator difference;
    accumulator_clear(&difference);
    accumulator_add_dd(&difference, 1, along, dd(dz), dd(1));
    accumulator_add_dd(&difference, -1, z, dd(da), dd(1));
    return accumulator_sign(&difference);
}

/*
 * On which side of the directed edge the ray passes, in the sheared plane, where e = d.(p x q) / d.z. If e is
 * 0, the ray is treated as displaced by (-eps, -eps^2), which changes e by eps dy - eps^2 dx. The result is 0
 * if the edge is parallel to the ray or has no length: the triangle is then seen edge-on.
 */
static int edge_side(const struct corners *corners, const struct shear *shear, unsigned from,
                     unsigned to, struct dd edge)
{
    int sign = (edge.high > 0) - (edge.high < 0);
    if (sign == 0) sign = sheared_step_sign(corners, shear, from, to, shear->y);
    if (sign == 0) sign = -sheared_step_sign(corners, shear, from, to, shear->x);
    return shear->dz < 0 ? -sign : sign;
}

/* Brings the edges to exponent 0, after dividing them by a power of two that makes the largest about 1. */
static void align(struct dd edges[3], const int exponents[3])
{
    int largest = INT_MIN;
    for (unsigned i = 0; i < 3; i++) {
        int size;
        (void)frexp(edges[i].high, &size);
        if (edges[i].high != 0 && size + exponents[i] > largest) largest = size + exponents[i];
    }
    for (unsigned i = 0; i < 3; i++)
        if (edges[i].high != 0) edges[i] = dd_ldexp(edges[i], exponents[i] - largest);
}

static struct dd weighted(const struct corners *corners, const struct dd edges[3], unsigned axis)
{
    struct dd sum = dd(0);
    for (unsigned i = 0; i < 3; i++)
        sum = dd_add(sum, dd_mul(edges[i], dd3_component(&corners->from_origin[i], axis)));
    return sum;
}

FLATTENED struct crossings triangle_crossings_exact(const struct vec3 corners[3],
                                                    const struct ray *ray,
                                                    const struct shear *shear, struct dd *distance)
{
    struct corners it = ordered_corners(corners, ray);
    struct dd edges[3];
    int side = 0, exponents[3];
    edges_of(&it, edges, exponents);
    for (unsigned i = 0; i < 3; i++) {
        unsigned from = (i + 1) % 3, to = (i + 2) % 3;
        int here = edge_side(&it, shear, from, to, edges[i]);
        if (here == 0 || (side != 0 && here != side)) return NO_CROSSINGS;
        side = here;
    }
    align(edges, exponents);
    struct dd sum = dd_add(dd_add(edges[0], edges[1]), edges[2]);
    struct dd t = dd_div(weighted(&it, edges, shear->z), dd_scale(sum, shear->dz));
    struct crossings found = one_crossing(t.high);
    if (distance) *distance = t;
    double *weights[3] = {NULL, &found.u, &found.v};
    for (unsigned i = 0; i < 3; i++)
        if (it.given[i] > 0) *weights[it.given[i]] = dd_div(edges[i], sum).high;
    return found;
}

struct crossings scaled_crossings(const struct vec3 *a, const struct vec3 *b, const struct vec3 *c,
                                  const struct ray *ray, const struct shear *shear,
                                  const struct purpose *purpose, uint64_t *exact)
{
    double size = vec_largest(vec_sub(*a, ray->origin));
    size = fmax(size, vec_largest(vec_sub(*b, ray->origin)));
    size = fmax(size, vec_largest(vec_sub(*c, ray->origin)));
    if (!(size > 0 && size <= DBL_MAX)) return exact_crossings(a, b, c, ray, shear);
    /* Scaled to a size of 0.5 to 1, so that this function is not called again. */
    int exponent;
    (void)frexp(size, &exponent);
    struct vec3 at[3] = {vec_scale_exactly(*a, -exponent), vec_scale_exactly(*b, -exponent),
                         vec_scale_exactly(*c, -exponent)};
    struct ray near = *ray;
    struct purpose here = *purpose;
    near.origin = vec_scale_exactly(ray->origin, -exponent);
    /* The triangle is so much smaller than its coordinates that they overflow when scaled. */
    if (!vec_is_finite(near.origin)) return exact_crossings(a, b, c, ray, shear);
    here.farthest = ldexp(purpose->farthest, -exponent);
    struct crossings found = triangle_crossings(&at[0], &at[1], &at[2], &near, shear, &here, exact);
    found.t[0] = ldexp(found.t[0], exponent);
    return found;
}

FLATTENED bool triangle_plane_distance(const struct vec3 *a, const struct vec3 *b,
                                       const struct vec3 *c, const struct ray *ray, double *t)
{
    struct dd3 p = exact_difference3(*b, *a), q = exact_difference3(*c, *a);
    struct dd3 f = exact_difference3(*a, ray->origin), normal = dd3_cross(p, q);
    struct dd height = dd3_dot(f, normal), speed = dd3_dot_vec(normal, ray->direction);
    double edges = sum_of_sizes(dd3_round(p)) * sum_of_sizes(dd3_round(q));
    double heights = edges * sum_of_sizes(dd3_round(f));
    double speeds = edges * sum_of_sizes(ray->direction);
    *t = dd_div(height, speed).high;
    return fabs(height.high) > PLANE_SHARE * heights && fabs(speed.high) > PLANE_SHARE * speeds &&
           smaller_number(heights, speeds) > 0x1p-400 && larger_number(heights, speeds) < 0x1p400;
}

/*
 * n.(a - o) and n.d for the plane of a triangle, with n = (b - a) x (c - a) not normalised. If an edge or the
 * way to the plane is very small, 0 or very large, they are divided by a power of two.
 */
struct plane_view {
    double height, speed, size; /* size: |n| */
    int exponent;               /* the height is divided by 2^exponent */
};

/* Divides a vector by a power of two, so that its size is about 1; returns the exponent. */
static int scale_to_one(struct dd3 *a)
{
    int exponent = vec_exponent(dd3_round(*a));
    *a = dd3_ldexp(*a, -exponent);
    return exponent;
}

static struct plane_view plane_view(const struct vec3 corners[3], const struct ray *ray)
{
    struct dd3 p = exact_difference3(corners[1], corners[0]);
    struct dd3 q = exact_difference3(corners[2], corners[0]);
    struct dd3 way = exact_difference3(corners[0], ray->origin);
    double edges = dd3_size(p) * dd3_size(q), all = edges * dd3_size(way);
    bool ordinary = smaller_number(edges, all) > 0x1p-400 && larger_number(edges, all) < 0x1p400;
    int exponent = 0;
    if (!ordinary) {
        scale_to_one(&p);
        scale_to_one(&q);
        exponent = scale_to_one(&way);
    }
    struct dd3 normal = dd3_cross(p, q);
    return (struct plane_view){.height = dd3_dot(normal, way).high,
                               .speed = dd3_dot_vec(normal, ray->direction).high,
                               .size = vec_length(dd3_round(normal)),
                               .exponent = exponent};
}

/* Twice the distance from its surface at which a point may end: at most 3.74 u, see SURFACE_OFFSET. */
#define START_ERROR (8 * UNIT_ROUNDOFF)

bool triangle_is_same_passage(const struct vec3 from[3], const struct vec3 of[3],
                              const struct ray *ray)
{
    double near = START_ERROR * vec_largest(ray->origin);
    struct plane_view here = plane_view(from, ray), there = plane_view(of, ray);
    bool goes_through = (here.height > 0) == (here.speed > 0) && here.height != 0;
    return goes_through && fabs(there.height) <= ldexp(near, -there.exponent) * there.size;
}
