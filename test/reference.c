#include "test/reference.h"

#include <math.h>
#include <mpfr.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- numbers ---- */

/* Numbers live in one pool and are given back in the reverse order, all at once: see mark(). */
#define POOL_SIZE 30000u

typedef mpfr_ptr real;

struct point {
    real x, y, z;
};

/* A sphere around a primitive, in double: what is clearly past it need not be looked at closer. */
struct reach {
    double center[3], radius;
};

struct reference {
    const struct scene *scene;
    mpfr_t *pool;
    size_t used;
    struct reach *reach[PRIMITIVE_KINDS];
    double displacement;
    uint64_t random, decisions;
};

typedef struct reference *ref;

static real new_real(ref r)
{
    if (r->used == POOL_SIZE) {
        fprintf(stderr, "reference: out of numbers\n");
        abort();
    }
    return r->pool[r->used++];
}

static size_t mark(ref r)
{
    return r->used;
}

static void release(ref r, size_t at)
{
    r->used = at;
}

static real number(ref r, double value)
{
    real out = new_real(r);
    mpfr_set_d(out, value, MPFR_RNDN);
    return out;
}

#define BINARY(name, function)                                                                     \
    static real name(ref r, real a, real b)                                                        \
    {                                                                                              \
        real out = new_real(r);                                                                    \
        function(out, a, b, MPFR_RNDN);                                                            \
        return out;                                                                                \
    }
BINARY(add, mpfr_add)
BINARY(sub, mpfr_sub)
BINARY(mul, mpfr_mul)
BINARY(divide, mpfr_div)
BINARY(power, mpfr_pow)
#undef BINARY

static real root(ref r, real a)
{
    real out = new_real(r);
    mpfr_sqrt(out, a, MPFR_RNDN);
    return out;
}

static int sign(real a)
{
    return mpfr_sgn(a);
}

static int compare(real a, real b)
{
    return mpfr_cmp(a, b);
}

static struct point new_point(ref r)
{
    real x = new_real(r), y = new_real(r);
    return (struct point){x, y, new_real(r)};
}

static void point_copy(struct point to, struct point from)
{
    mpfr_set(to.x, from.x, MPFR_RNDN);
    mpfr_set(to.y, from.y, MPFR_RNDN);
    mpfr_set(to.z, from.z, MPFR_RNDN);
}

static struct point point_of(ref r, struct vec3 v)
{
    real x = number(r, v.x), y = number(r, v.y);
    return (struct point){x, y, number(r, v.z)};
}

static struct point point_add(ref r, struct point a, struct point b)
{
    return (struct point){add(r, a.x, b.x), add(r, a.y, b.y), add(r, a.z, b.z)};
}

static struct point point_sub(ref r, struct point a, struct point b)
{
    return (struct point){sub(r, a.x, b.x), sub(r, a.y, b.y), sub(r, a.z, b.z)};
}

static struct point point_mul(ref r, struct point a, struct point b)
{
    return (struct point){mul(r, a.x, b.x), mul(r, a.y, b.y), mul(r, a.z, b.z)};
}

static struct point point_scale(ref r, struct point a, real s)
{
    return (struct point){mul(r, a.x, s), mul(r, a.y, s), mul(r, a.z, s)};
}

static struct point point_along(ref r, struct point a, struct point d, real t)
{
    return point_add(r, a, point_scale(r, d, t));
}

static real dot(ref r, struct point a, struct point b)
{
    return add(r, add(r, mul(r, a.x, b.x), mul(r, a.y, b.y)), mul(r, a.z, b.z));
}

static struct point cross(ref r, struct point a, struct point b)
{
    return (struct point){sub(r, mul(r, a.y, b.z), mul(r, a.z, b.y)),
                          sub(r, mul(r, a.z, b.x), mul(r, a.x, b.z)),
                          sub(r, mul(r, a.x, b.y), mul(r, a.y, b.x))};
}

static struct point unit(ref r, struct point a)
{
    real length = root(r, dot(r, a, a));
    return (struct point){divide(r, a.x, length), divide(r, a.y, length), divide(r, a.z, length)};
}

static struct point negative(ref r, struct point a)
{
    return point_scale(r, a, number(r, -1));
}

static double largest(struct point a)
{
    double x = fabs(mpfr_get_d(a.x, MPFR_RNDN)), y = fabs(mpfr_get_d(a.y, MPFR_RNDN));
    return fmax(fmax(x, y), fabs(mpfr_get_d(a.z, MPFR_RNDN)));
}

/* ---- displacements and decisions ---- */

static void decide(ref r, uint64_t what)
{
    r->decisions = (r->decisions ^ what) * UINT64_C(0x9e3779b97f4a7c15);
    r->decisions ^= r->decisions >> 29;
}

static double random_sign(ref r)
{
    r->random ^= r->random << 13;
    r->random ^= r->random >> 7;
    r->random ^= r->random << 17;
    return (double)(r->random >> 11) * 0x1p-52 - 1;
}

/* Moves each component by up to `displacement` u of magnitude. */
static void displace(ref r, struct point p, double magnitude)
{
    if (!(r->displacement > 0)) return;
    double reach = r->displacement * 0x1p-53 * magnitude;
    real component[] = {p.x, p.y, p.z};
    for (int i = 0; i < 3; i++)
        mpfr_add_d(component[i], component[i], reach * random_sign(r), MPFR_RNDN);
}

/* ---- rays and crossings ---- */

enum { CONE_SIDE_PART, CONE_BASE_PART, CONE_APEX_PART }; /* a box's parts are its faces */

struct ray {
    struct point origin, direction;
    uint32_t from, from_part;
    double o[3], d[3]; /* the same, rounded */
};

static struct ray make_ray(struct point origin, struct point direction, uint32_t from,
                           uint32_t part)
{
    struct ray ray = {origin, direction, from, part, {0}, {0}};
    real o[] = {origin.x, origin.y, origin.z}, d[] = {direction.x, direction.y, direction.z};
    for (int i = 0; i < 3; i++) {
        ray.o[i] = mpfr_get_d(o[i], MPFR_RNDN);
        ray.d[i] = mpfr_get_d(d[i], MPFR_RNDN);
    }
    return ray;
}

/* Where a ray's line meets one primitive: 6 faces at most. */
struct crossing {
    real t, u, v;
    uint32_t part;
};

struct crossings {
    unsigned count;
    struct crossing at[6];
};

static void cross_at(struct crossings *found, real t, uint32_t part)
{
    found->at[found->count++] = (struct crossing){t, NULL, NULL, part};
}

/* The root of a surface on which the ray starts is the one nearer to 0. */
static void drop_own_root(struct crossings *found)
{
    if (found->count == 0) return;
    unsigned own = 0;
    if (found->count == 2 && mpfr_cmpabs(found->at[1].t, found->at[0].t) < 0) own = 1;
    found->at[own] = found->at[--found->count];
}

static void cross_sphere(ref r, const struct sphere *sphere, const struct ray *ray, bool leaving,
                         struct crossings *found)
{
    struct point f = point_sub(r, ray->origin, point_of(r, sphere->center));
    real radius = number(r, sphere->radius);
    real a = dot(r, ray->direction, ray->direction), b = dot(r, f, ray->direction);
    real c = sub(r, dot(r, f, f), mul(r, radius, radius));
    real discriminant = sub(r, mul(r, b, b), mul(r, a, c));
    if (sign(discriminant) < 0) return;
    real half = root(r, discriminant), minus_b = mul(r, b, number(r, -1));
    if (!sphere->inside_only || leaving) cross_at(found, divide(r, sub(r, minus_b, half), a), 0);
    cross_at(found, divide(r, add(r, minus_b, half), a), 0);
    if (leaving) drop_own_root(found);
}

static real plane_parameter(ref r, struct vec3 point, struct vec3 normal, const struct ray *ray)
{
    struct point n = point_of(r, normal);
    real speed = dot(r, ray->direction, n);
    if (sign(speed) == 0) return NULL;
    return divide(r, dot(r, point_sub(r, point_of(r, point), ray->origin), n), speed);
}

static void cross_plane(ref r, const struct plane *plane, const struct ray *ray,
                        struct crossings *found)
{
    real t = plane_parameter(r, plane->point, plane->normal, ray);
    if (t) cross_at(found, t, 0);
}

static void cross_disc(ref r, const struct disc *disc, const struct ray *ray,
                       struct crossings *found)
{
    real t = plane_parameter(r, disc->center, disc->normal, ray);
    if (!t) return;
    struct point f = point_sub(r, ray->origin, point_of(r, disc->center));
    struct point p = point_along(r, f, ray->direction, t);
    real radius = number(r, disc->radius);
    if (compare(dot(r, p, p), mul(r, radius, radius)) <= 0) cross_at(found, t, 0);
}

/* Cramer's rule; all edges belong to the triangle. */
static void cross_triangle(ref r, struct point a, struct point b, struct point c,
                           const struct ray *ray, struct crossings *found)
{
    struct point ab = point_sub(r, b, a), ac = point_sub(r, c, a);
    struct point f = point_sub(r, ray->origin, a), across = cross(r, ray->direction, ac);
    real det = dot(r, across, ab);
    if (sign(det) == 0) return;
    struct point turned = cross(r, f, ab);
    real u = divide(r, dot(r, across, f), det);
    real v = divide(r, dot(r, turned, ray->direction), det);
    if (sign(u) < 0 || sign(v) < 0 || compare(add(r, u, v), number(r, 1)) > 0) return;
    found->at[found->count++] = (struct crossing){divide(r, dot(r, turned, ac), det), u, v, 0};
}

static void cross_box(ref r, const struct box *box, const struct ray *ray, bool leaving,
                      struct crossings *found)
{
    struct point low = point_of(r, box->min), high = point_of(r, box->max);
    real min[] = {low.x, low.y, low.z}, max[] = {high.x, high.y, high.z};
    real o[] = {ray->origin.x, ray->origin.y, ray->origin.z};
    real d[] = {ray->direction.x, ray->direction.y, ray->direction.z};
    for (unsigned face = 0; face < 6; face++) {
        unsigned axis = face / 2;
        bool sheet = compare(min[axis], max[axis]) == 0;
        bool own = leaving && (face == ray->from_part || (sheet && axis == ray->from_part / 2));
        if (sign(d[axis]) == 0 || own || (sheet && face & 1)) continue;
        real t = divide(r, sub(r, face & 1 ? max[axis] : min[axis], o[axis]), d[axis]);
        bool inside = true;
        for (unsigned other = 0; other < 3; other++) {
            if (other == axis) continue;
            real at = add(r, o[other], mul(r, d[other], t));
            inside = inside && compare(at, min[other]) >= 0 && compare(at, max[other]) <= 0;
        }
        if (inside) cross_at(found, t, face);
    }
}

/* The axis as the cone's own measure: w = apex - base, W = w.w, height s = p.w / W. */
struct axis {
    struct point base, w;
    real W;
};

static struct axis cone_axis(ref r, const struct cone *cone)
{
    struct point base = point_of(r, cone->base);
    struct point w = point_sub(r, point_of(r, cone->apex), base);
    return (struct axis){base, w, dot(r, w, w)};
}

/* rho = base_radius + (apex_radius - base_radius) s for a dot product with w. */
static real cone_radius(ref r, const struct cone *cone, const struct axis *axis, real along,
                        double at_base)
{
    real widening = sub(r, number(r, cone->apex_radius), number(r, cone->base_radius));
    return add(r, number(r, at_base), mul(r, widening, divide(r, along, axis->W)));
}

static void cone_side_root(ref r, const struct axis *axis, struct point f, const struct ray *ray,
                           real t, struct crossings *found)
{
    real along = dot(r, point_along(r, f, ray->direction, t), axis->w);
    if (sign(along) >= 0 && compare(along, axis->W) <= 0) cross_at(found, t, CONE_SIDE_PART);
}

/* |p x w|^2 = W rho^2 along the ray: (F + t D)^2 = W (rho0 + t rho1)^2. */
static void cross_cone_side(ref r, const struct cone *cone, const struct axis *axis, struct point f,
                            const struct ray *ray, bool leaving, struct crossings *found)
{
    struct point F = cross(r, f, axis->w), D = cross(r, ray->direction, axis->w);
    real rho0 = cone_radius(r, cone, axis, dot(r, f, axis->w), cone->base_radius);
    real rho1 = cone_radius(r, cone, axis, dot(r, ray->direction, axis->w), 0);
    real W = axis->W;
    real A = sub(r, dot(r, D, D), mul(r, W, mul(r, rho1, rho1)));
    real B = sub(r, mul(r, W, mul(r, rho0, rho1)), dot(r, F, D));
    real C = sub(r, dot(r, F, F), mul(r, W, mul(r, rho0, rho0)));
    if (sign(A) == 0) {
        if (sign(B) != 0 && !leaving)
            cone_side_root(r, axis, f, ray, divide(r, C, mul(r, number(r, 2), B)), found);
        return;
    }
    real discriminant = sub(r, mul(r, B, B), mul(r, A, C));
    if (sign(discriminant) < 0) return;
    real half = root(r, discriminant);
    real low = divide(r, sub(r, B, half), A), high = divide(r, add(r, B, half), A);
    if (leaving && ray->from_part == CONE_SIDE_PART) {
        cone_side_root(r, axis, f, ray, mpfr_cmpabs(low, high) < 0 ? high : low, found);
    } else {
        cone_side_root(r, axis, f, ray, low, found);
        cone_side_root(r, axis, f, ray, high, found);
    }
}

static void cross_cap(ref r, const struct axis *axis, struct point f, const struct ray *ray,
                      double height, double radius, uint32_t part, struct crossings *found)
{
    real speed = dot(r, ray->direction, axis->w);
    if (sign(speed) == 0) return;
    real wanted = mul(r, number(r, height), axis->W);
    real t = divide(r, sub(r, wanted, dot(r, f, axis->w)), speed);
    struct point out = cross(r, point_along(r, f, ray->direction, t), axis->w);
    real limit = mul(r, number(r, radius), number(r, radius));
    if (compare(dot(r, out, out), mul(r, axis->W, limit)) <= 0) cross_at(found, t, part);
}

static void cross_cone(ref r, const struct cone *cone, const struct ray *ray, bool leaving,
                       struct crossings *found)
{
    struct axis axis = cone_axis(r, cone);
    struct point f = point_sub(r, ray->origin, axis.base);
    cross_cone_side(r, cone, &axis, f, ray, leaving, found);
    if (!cone->capped) return;
    if (!leaving || ray->from_part != CONE_BASE_PART)
        cross_cap(r, &axis, f, ray, 0, cone->base_radius, CONE_BASE_PART, found);
    if (!leaving || ray->from_part != CONE_APEX_PART)
        cross_cap(r, &axis, f, ray, 1, cone->apex_radius, CONE_APEX_PART, found);
}

/* ---- one call for all kinds ---- */

static const uint32_t *corners(const struct scene *scene, uint32_t id)
{
    uint32_t index = primitive_index(id);
    if (primitive_kind(id) == PRIMITIVE_PATCH) return scene_patches(scene)[index].vertex;
    return scene_triangles(scene)[index].vertex;
}

static void cross_primitive(ref r, uint32_t id, const struct ray *ray, struct crossings *found)
{
    const struct scene *scene = r->scene;
    uint32_t index = primitive_index(id);
    bool leaving = ray->from == id;
    found->count = 0;
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        cross_sphere(r, &scene_spheres(scene)[index], ray, leaving, found);
        return;
    case PRIMITIVE_BOX:
        cross_box(r, &scene_boxes(scene)[index], ray, leaving, found);
        return;
    case PRIMITIVE_CONE:
        cross_cone(r, &scene_cones(scene)[index], ray, leaving, found);
        return;
    case PRIMITIVE_DISC:
        if (!leaving) cross_disc(r, &scene_discs(scene)[index], ray, found);
        return;
    case PRIMITIVE_PLANE:
        if (!leaving) cross_plane(r, &scene_planes(scene)[index], ray, found);
        return;
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    if (leaving) return;
    const uint32_t *corner = corners(scene, id);
    const struct vec3 *vertices = scene_vertices(scene);
    cross_triangle(r, point_of(r, vertices[corner[0]]), point_of(r, vertices[corner[1]]),
                   point_of(r, vertices[corner[2]]), ray, found);
}

static void reach_around(struct reach *reach, const struct vec3 *points, int count, double more)
{
    struct vec3 sum = {0, 0, 0};
    for (int i = 0; i < count; i++)
        sum = vec_add(sum, vec_scale(points[i], 1.0 / count));
    *reach = (struct reach){{sum.x, sum.y, sum.z}, 0};
    for (int i = 0; i < count; i++)
        reach->radius = fmax(reach->radius, vec_length(vec_sub(points[i], sum)) + more);
}

static void primitive_reach(const struct scene *scene, uint32_t id, struct reach *reach)
{
    uint32_t index = primitive_index(id);
    struct vec3 points[3];
    double more = 0;
    int count = 2;
    switch (primitive_kind(id)) {
    case PRIMITIVE_SPHERE:
        points[0] = points[1] = scene_spheres(scene)[index].center;
        more = scene_spheres(scene)[index].radius;
        break;
    case PRIMITIVE_BOX:
        points[0] = scene_boxes(scene)[index].min;
        points[1] = scene_boxes(scene)[index].max;
        break;
    case PRIMITIVE_CONE:
        points[0] = scene_cones(scene)[index].base;
        points[1] = scene_cones(scene)[index].apex;
        more = fmax(scene_cones(scene)[index].base_radius, scene_cones(scene)[index].apex_radius);
        break;
    case PRIMITIVE_DISC:
        points[0] = points[1] = scene_discs(scene)[index].center;
        more = scene_discs(scene)[index].radius;
        break;
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
        count = 3;
        for (int i = 0; i < 3; i++)
            points[i] = scene_vertices(scene)[corners(scene, id)[i]];
        break;
    case PRIMITIVE_PLANE:
    case PRIMITIVE_KINDS:
        *reach = (struct reach){{0, 0, 0}, HUGE_VAL};
        return;
    }
    reach_around(reach, points, count, more);
}

/* Whether the line passes the primitive at a distance that no rounding explains: the margin is 1e4
 * roundings of the largest numbers in it. */
static bool clearly_past(const struct reach *reach, const struct ray *ray)
{
    const double *d = ray->d;
    double f[3], size = reach->radius;
    for (int i = 0; i < 3; i++) {
        f[i] = ray->o[i] - reach->center[i];
        size = fmax(size, fmax(fabs(ray->o[i]), fabs(reach->center[i])));
    }
    struct vec3 out = vec_cross(vec3(f[0], f[1], f[2]), vec3(d[0], d[1], d[2]));
    double distance = vec_length(out) / vec_length(vec3(d[0], d[1], d[2]));
    return distance > reach->radius + 1e-12 * size;
}

/* ---- nearest and occluded ---- */

struct hit {
    real t, u, v;
    uint32_t primitive, part;
};

static void consider(struct hit *hit, uint32_t id, const struct crossing *crossing)
{
    if (sign(crossing->t) <= 0) return;
    if (hit->primitive != PRIMITIVE_NONE) {
        int order = compare(crossing->t, hit->t);
        if (order > 0) return;
        if (order == 0 && id > hit->primitive) return;
        if (order == 0 && id == hit->primitive && crossing->part >= hit->part) return;
    }
    mpfr_set(hit->t, crossing->t, MPFR_RNDN);
    if (crossing->u) {
        mpfr_set(hit->u, crossing->u, MPFR_RNDN);
        mpfr_set(hit->v, crossing->v, MPFR_RNDN);
    }
    hit->primitive = id;
    hit->part = crossing->part;
}

static struct hit nearest_hit(ref r, const struct ray *ray)
{
    struct hit hit = {new_real(r), new_real(r), new_real(r), PRIMITIVE_NONE, 0};
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        for (uint32_t i = 0; i < r->scene->primitives[k].count; i++) {
            if (clearly_past(&r->reach[k][i], ray)) continue;
            uint32_t id = primitive_id((enum primitive_kind)k, i);
            struct crossings found;
            size_t before = mark(r);
            cross_primitive(r, id, ray, &found);
            for (unsigned c = 0; c < found.count; c++)
                consider(&hit, id, &found.at[c]);
            release(r, before);
        }
    }
    decide(r, hit.primitive);
    decide(r, hit.part);
    return hit;
}

/* The light's colour times what the surfaces in 0 < t < 1 let through. */
static struct point light_through(ref r, const struct ray *ray, struct vec3 color)
{
    struct point light = point_of(r, color);
    uint64_t crossings = 0;
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        for (uint32_t i = 0; i < r->scene->primitives[k].count; i++) {
            if (clearly_past(&r->reach[k][i], ray)) continue;
            uint32_t id = primitive_id((enum primitive_kind)k, i);
            const struct material *material =
                &scene_materials(r->scene)[primitive_material(r->scene, id)];
            struct crossings found;
            size_t before = mark(r);
            cross_primitive(r, id, ray, &found);
            real share = number(r, material->transmission);
            for (unsigned c = 0; c < found.count; c++) {
                if (sign(found.at[c].t) <= 0 || mpfr_cmp_ui(found.at[c].t, 1) >= 0) continue;
                struct point filter = point_scale(r, point_of(r, material->color), share);
                point_copy(light, point_mul(r, light, filter));
                crossings++;
            }
            release(r, before);
        }
    }
    bool dark = sign(light.x) == 0 && sign(light.y) == 0 && sign(light.z) == 0;
    decide(r, dark ? UINT64_MAX : crossings);
    return light;
}

/* Surfaces in 0 < t < 1. */
static uint64_t crossings_of(ref r, const struct ray *ray)
{
    uint64_t crossings = 0;
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        for (uint32_t i = 0; i < r->scene->primitives[k].count; i++) {
            if (clearly_past(&r->reach[k][i], ray)) continue;
            struct crossings found;
            size_t before = mark(r);
            cross_primitive(r, primitive_id((enum primitive_kind)k, i), ray, &found);
            for (unsigned c = 0; c < found.count; c++)
                crossings += sign(found.at[c].t) > 0 && mpfr_cmp_ui(found.at[c].t, 1) < 0;
            release(r, before);
        }
    }
    return crossings;
}

/* ---- the surface at a hit ---- */

struct surface {
    struct point point, geometric, normal;
    const struct material *material;
    bool entering;
};

static struct point cone_normal(ref r, const struct cone *cone, struct point p, uint32_t part)
{
    struct axis axis = cone_axis(r, cone);
    if (part == CONE_APEX_PART) return axis.w;
    if (part == CONE_BASE_PART) return negative(r, axis.w);
    struct point f = point_sub(r, p, axis.base);
    real along = divide(r, dot(r, f, axis.w), axis.W);
    struct point radial = point_sub(r, f, point_scale(r, axis.w, along));
    real widening = sub(r, number(r, cone->apex_radius), number(r, cone->base_radius));
    real slope = divide(r, mul(r, root(r, dot(r, radial, radial)), widening), axis.W);
    return point_sub(r, radial, point_scale(r, axis.w, slope));
}

static struct point triangle_normal(ref r, uint32_t id)
{
    const uint32_t *corner = corners(r->scene, id);
    const struct vec3 *vertices = scene_vertices(r->scene);
    struct point a = point_of(r, vertices[corner[0]]);
    struct point ab = point_sub(r, point_of(r, vertices[corner[1]]), a);
    return cross(r, ab, point_sub(r, point_of(r, vertices[corner[2]]), a));
}

static struct point face_normal(ref r, uint32_t face)
{
    double side = face & 1 ? 1 : -1;
    uint32_t axis = face / 2;
    return point_of(r, vec3(axis == 0 ? side : 0, axis == 1 ? side : 0, axis == 2 ? side : 0));
}

/* Outward, or to the front; any length. */
static struct point outward(ref r, const struct hit *hit, struct point p)
{
    const struct scene *scene = r->scene;
    uint32_t index = primitive_index(hit->primitive);
    switch (primitive_kind(hit->primitive)) {
    case PRIMITIVE_SPHERE:
        return point_sub(r, p, point_of(r, scene_spheres(scene)[index].center));
    case PRIMITIVE_BOX:
        return face_normal(r, hit->part);
    case PRIMITIVE_CONE:
        return cone_normal(r, &scene_cones(scene)[index], p, hit->part);
    case PRIMITIVE_DISC:
        return point_of(r, scene_discs(scene)[index].normal);
    case PRIMITIVE_PLANE:
        return point_of(r, scene_planes(scene)[index].normal);
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
    case PRIMITIVE_KINDS:
        break;
    }
    return triangle_normal(r, hit->primitive);
}

static struct point interpolated(ref r, const struct hit *hit, struct point geometric)
{
    if (primitive_kind(hit->primitive) != PRIMITIVE_PATCH) return geometric;
    const uint32_t *at = scene_patches(r->scene)[primitive_index(hit->primitive)].normal;
    const struct vec3 *normals = scene_normals(r->scene);
    real rest = sub(r, sub(r, number(r, 1), hit->u), hit->v);
    struct point sum = point_scale(r, point_of(r, normals[at[0]]), rest);
    sum = point_along(r, sum, point_of(r, normals[at[1]]), hit->u);
    sum = point_along(r, sum, point_of(r, normals[at[2]]), hit->v);
    return sign(dot(r, sum, sum)) == 0 ? geometric : unit(r, sum);
}

/* The largest number that the point is made of: of the better one of o + t d and the primitive. */
static double point_magnitude(ref r, const struct ray *ray, const struct hit *hit)
{
    double t = fabs(mpfr_get_d(hit->t, MPFR_RNDN));
    double along = fmax(largest(ray->origin), t * largest(ray->direction));
    enum primitive_kind kind = primitive_kind(hit->primitive);
    const struct reach *reach = &r->reach[kind][primitive_index(hit->primitive)];
    if (kind != PRIMITIVE_SPHERE && kind != PRIMITIVE_TRIANGLE && kind != PRIMITIVE_PATCH)
        return along;
    double own = reach->radius;
    for (int i = 0; i < 3; i++)
        own = fmax(own, fabs(reach->center[i]) + reach->radius);
    return fmin(along, own);
}

static struct surface surface_at(ref r, const struct ray *ray, const struct hit *hit)
{
    struct surface at;
    at.point = point_along(r, ray->origin, ray->direction, hit->t);
    at.geometric = unit(r, outward(r, hit, at.point));
    at.normal = interpolated(r, hit, at.geometric);
    at.material = &scene_materials(r->scene)[primitive_material(r->scene, hit->primitive)];
    displace(r, at.point, point_magnitude(r, ray, hit));
    displace(r, at.geometric, 1);
    if (at.normal.x != at.geometric.x) displace(r, at.normal, 1);
    at.entering = sign(dot(r, ray->direction, at.geometric)) <= 0;
    if (!at.entering) {
        bool same = at.normal.x == at.geometric.x;
        at.geometric = negative(r, at.geometric);
        if (same) at.normal = at.geometric;
    }
    if (sign(dot(r, at.normal, at.geometric)) < 0) at.normal = negative(r, at.normal);
    decide(r, at.entering);
    return at;
}

/* ---- light ---- */

static struct point mirror(ref r, struct point view, struct point normal)
{
    real twice = mul(r, number(r, -2), dot(r, view, normal));
    return unit(r, point_along(r, view, normal, twice));
}

static struct point reflected(ref r, const struct surface *at, struct point view)
{
    struct point direction = mirror(r, view, at->normal);
    bool above = sign(dot(r, direction, at->geometric)) > 0;
    decide(r, above);
    if (!above) direction = mirror(r, view, at->geometric);
    displace(r, direction, 1);
    return direction;
}

static bool snell(ref r, struct point view, struct point normal, double from, double to,
                  struct point *direction)
{
    real eta = divide(r, number(r, from), number(r, to)), one = number(r, 1);
    real cosine = mul(r, number(r, -1), dot(r, view, normal));
    real sine2 = sub(r, one, mul(r, cosine, cosine));
    real k = sub(r, one, mul(r, mul(r, eta, eta), sine2));
    decide(r, sign(k) >= 0);
    if (sign(k) < 0) return false;
    real along = sub(r, mul(r, eta, cosine), root(r, k));
    *direction = unit(r, point_along(r, point_scale(r, view, eta), normal, along));
    displace(r, *direction, 1);
    return true;
}

static bool refracted(ref r, const struct surface *at, struct point view, double from, double to,
                      struct point *direction)
{
    if (from == to) {
        *direction = view;
        return true;
    }
    if (sign(dot(r, view, at->normal)) < 0) {
        if (!snell(r, view, at->normal, from, to, direction)) return false;
        if (sign(dot(r, *direction, at->geometric)) < 0) return true;
    }
    return snell(r, view, at->geometric, from, to, direction);
}

/* s kd cos(a) Cs + s ks cos^n(b), added to *color. */
static void add_light(ref r, const struct surface *at, struct point view, struct point to_light,
                      struct point strength, struct point color)
{
    const struct material *m = at->material;
    struct point l = unit(r, to_light);
    real diffuse = mul(r, number(r, m->diffuse), dot(r, l, at->normal));
    struct point shade = point_mul(r, strength, point_of(r, m->color));
    point_copy(color, point_along(r, color, shade, diffuse));
    struct point away = mirror(r, negative(r, l), at->normal);
    real cosine = mul(r, number(r, -1), dot(r, away, view));
    if (!(m->specular > 0) || sign(cosine) <= 0) return;
    real lobe = mul(r, number(r, m->specular), power(r, cosine, number(r, m->shininess)));
    point_copy(color, point_along(r, color, strength, lobe));
}

static void add_lights(ref r, const struct surface *at, struct point view, const struct hit *hit,
                       struct point color)
{
    for (uint64_t i = 0; i < r->scene->lights.count; i++) {
        const struct light *light = &scene_lights(r->scene)[i];
        size_t before = mark(r);
        struct point position = point_of(r, light->position);
        struct point to_light = point_sub(r, position, at->point);
        displace(r, to_light, fmax(largest(position), largest(at->point)));
        bool faces =
            sign(dot(r, to_light, at->geometric)) > 0 && sign(dot(r, to_light, at->normal)) > 0;
        decide(r, faces);
        if (faces) {
            struct ray ray = make_ray(at->point, to_light, hit->primitive, hit->part);
            struct point strength = r->scene->view.shadows ? light_through(r, &ray, light->color)
                                                           : point_of(r, light->color);
            add_light(r, at, view, to_light, strength, color);
        }
        release(r, before);
    }
}

/* ---- media ---- */

struct medium {
    uint32_t solid; /* PRIMITIVE_NONE: known by its index alone */
    double ior;
};

/* From the outermost to the one entered last. */
struct media {
    unsigned count;
    struct medium in[REFERENCE_MAX_DEPTH];
};

static bool bounds_a_volume(const struct scene *scene, uint32_t id)
{
    uint32_t index = primitive_index(id);
    enum primitive_kind kind = primitive_kind(id);
    if (kind == PRIMITIVE_SPHERE) return !scene_spheres(scene)[index].inside_only;
    if (kind == PRIMITIVE_CONE) return scene_cones(scene)[index].capped;
    return kind == PRIMITIVE_BOX;
}

static double innermost(const struct media *media)
{
    return media->count ? media->in[media->count - 1].ior : 1;
}

/* The media behind a surface; *from and *to are the indices of refraction on its sides. */
static struct media media_behind(ref r, struct media media, const struct hit *hit, bool entering,
                                 double ior, double *from, double *to)
{
    struct medium medium = {
        bounds_a_volume(r->scene, hit->primitive) ? hit->primitive : PRIMITIVE_NONE, ior};
    unsigned place = media.count;
    while (place > 0 &&
           (media.in[place - 1].solid != medium.solid || media.in[place - 1].ior != ior))
        place--;
    *from = innermost(&media);
    if (entering && !(place > 0 && medium.solid != PRIMITIVE_NONE)) {
        media.in[media.count++] = medium;
    } else if (!entering && place > 0) {
        for (unsigned i = place; i < media.count; i++)
            media.in[i - 1] = media.in[i];
        media.count--;
    } else if (!entering) {
        *from = ior;
    }
    *to = innermost(&media);
    return media;
}

/* ---- the tree ---- */

static void trace(ref r, const struct ray *ray, uint32_t depth, const struct media *media,
                  struct point color);

static void trace_child(ref r, const struct surface *at, const struct hit *hit,
                        struct point direction, uint32_t depth, const struct media *media,
                        struct point share, struct point color)
{
    if (depth == r->scene->view.max_depth) return;
    if (sign(share.x) == 0 && sign(share.y) == 0 && sign(share.z) == 0) return;
    struct ray ray = make_ray(at->point, direction, hit->primitive, hit->part);
    struct point brought = new_point(r);
    trace(r, &ray, depth + 1, media, brought);
    point_copy(color, point_add(r, color, point_mul(r, brought, share)));
}

static void trace_children(ref r, const struct surface *at, const struct hit *hit,
                           struct point view, uint32_t depth, const struct media *media,
                           struct point color)
{
    const struct material *m = at->material;
    struct point mirrored = point_of(r, vec3(m->reflection, m->reflection, m->reflection));
    if (m->transmission > 0) {
        double from, to;
        struct media behind = media_behind(r, *media, hit, at->entering, m->ior, &from, &to);
        struct point passed = point_scale(r, point_of(r, m->color), number(r, m->transmission));
        struct point direction;
        if (refracted(r, at, view, from, to, &direction))
            trace_child(r, at, hit, direction, depth, &behind, passed, color);
        else
            mirrored = point_add(r, mirrored, passed);
    }
    if (sign(mirrored.x) != 0 || sign(mirrored.y) != 0 || sign(mirrored.z) != 0)
        trace_child(r, at, hit, reflected(r, at, view), depth, media, mirrored, color);
}

static void background(ref r, struct point direction, struct point color)
{
    const struct view *view = &r->scene->view;
    real one = number(r, 1), half = number(r, 0.5);
    real up = mul(r, half, add(r, one, dot(r, direction, point_of(r, view->background_up))));
    struct point bottom = point_scale(r, point_of(r, view->background_bottom), sub(r, one, up));
    point_copy(color, point_along(r, bottom, point_of(r, view->background_top), up));
}

static void trace(ref r, const struct ray *ray, uint32_t depth, const struct media *media,
                  struct point color)
{
    size_t before = mark(r);
    struct hit hit = nearest_hit(r, ray);
    if (hit.primitive == PRIMITIVE_NONE) {
        background(r, ray->direction, color);
    } else {
        struct surface at = surface_at(r, ray, &hit);
        struct point own = point_of(r, at.material->color);
        point_copy(color, point_scale(r, own, number(r, at.material->ambient)));
        add_lights(r, &at, ray->direction, &hit, color);
        trace_children(r, &at, &hit, ray->direction, depth, media, color);
    }
    release(r, before);
}

/* ---- pictures ---- */

struct reference *reference_create(const struct scene *scene, unsigned bits)
{
    struct reference *r = calloc(1, sizeof *r);
    r->scene = scene;
    r->pool = malloc(POOL_SIZE * sizeof *r->pool);
    for (size_t i = 0; i < POOL_SIZE; i++)
        mpfr_init2(r->pool[i], (mpfr_prec_t)bits);
    for (int k = 0; k < PRIMITIVE_KINDS; k++) {
        uint64_t count = scene->primitives[k].count;
        r->reach[k] = calloc(count + 1, sizeof *r->reach[k]);
        for (uint32_t i = 0; i < count; i++)
            primitive_reach(scene, primitive_id((enum primitive_kind)k, i), &r->reach[k][i]);
    }
    return r;
}

void reference_free(struct reference *r)
{
    for (size_t i = 0; i < POOL_SIZE; i++)
        mpfr_clear(r->pool[i]);
    for (int k = 0; k < PRIMITIVE_KINDS; k++)
        free(r->reach[k]);
    free(r->pool);
    free(r);
}

static void begin(ref r, double displacement, uint64_t seed)
{
    r->used = 0;
    r->decisions = 0;
    r->displacement = displacement;
    r->random = seed * 2 + 1;
}

void reference_render(struct reference *r, uint32_t x, uint32_t y, double displacement,
                      uint64_t seed, struct reference_sample *sample)
{
    const struct view *view = &r->scene->view;
    begin(r, displacement, seed);
    real height = number(r, view->height);
    real u = divide(r, number(r, 2.0 * x + 1 - view->width), height);
    real v = divide(r, number(r, 2.0 * y + 1 - view->height), height);
    struct point direction = point_of(r, view->camera.forward);
    direction = point_along(r, direction, point_of(r, view->camera.right), u);
    direction = point_along(r, direction, point_of(r, view->camera.down), v);
    direction = unit(r, direction);
    displace(r, direction, 1);
    struct ray ray = make_ray(point_of(r, view->camera.eye), direction, PRIMITIVE_NONE, 0);
    struct media media = {.count = 0};
    struct point color = new_point(r);
    trace(r, &ray, 0, &media, color);
    sample->color[0] = mpfr_get_d(color.x, MPFR_RNDN);
    sample->color[1] = mpfr_get_d(color.y, MPFR_RNDN);
    sample->color[2] = mpfr_get_d(color.z, MPFR_RNDN);
    sample->decisions = r->decisions;
}

uint32_t reference_nearest(struct reference *r, struct vec3 origin, struct vec3 direction,
                           uint32_t *part)
{
    begin(r, 0, 0);
    struct ray ray = make_ray(point_of(r, origin), point_of(r, direction), PRIMITIVE_NONE, 0);
    struct hit hit = nearest_hit(r, &ray);
    *part = hit.part;
    return hit.primitive;
}

uint64_t reference_crossings(struct reference *r, struct vec3 a, struct vec3 b, double displacement,
                             uint64_t seed)
{
    begin(r, displacement, seed);
    struct point origin = point_of(r, a), target = point_of(r, b);
    displace(r, origin, largest(origin));
    displace(r, target, largest(target));
    struct ray ray = make_ray(origin, point_sub(r, target, origin), PRIMITIVE_NONE, 0);
    return crossings_of(r, &ray);
}
