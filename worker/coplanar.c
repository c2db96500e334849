#include "worker/coplanar.h"

#include "worker/box.h"
#include "worker/planar.h"

/* A plane, given by three corners, or by one point and a normal of any length; corners = 0: not flat. */
struct flat {
    unsigned corners;
    struct vec3 at[3];
    struct dd3 normal;
};

static struct flat flat_across(struct vec3 point, struct dd3 normal)
{
    return (struct flat){.corners = 1, .at = {point}, .normal = normal};
}

static struct flat cap_flat(const struct cone *cone, uint32_t part)
{
    if (part == CONE_SIDE) return (struct flat){.corners = 0};
    return flat_across(part == CONE_BASE_CAP ? cone->base : cone->apex,
                       exact_difference3(cone->apex, cone->base));
}

static struct flat corner_flat(const struct scene *scene, uint32_t id)
{
    struct flat flat = {.corners = 3};
    triangle_vertices(scene, id, flat.at);
    return flat;
}

static struct flat flat_of(const struct scene *scene, uint32_t id, uint32_t part)
{
    uint32_t index = primitive_index(id);
    const struct box *box;
    struct supporting_plane plane;
    switch (primitive_kind(id)) {
    case PRIMITIVE_BOX:
        box = &scene_boxes(scene)[index];
        return flat_across(part & 1 ? box->max : box->min, dd3_of(box_normal(part)));
    case PRIMITIVE_CONE:
        return cap_flat(&scene_cones(scene)[index], part);
    case PRIMITIVE_DISC:
    case PRIMITIVE_PLANE:
        plane = supporting_plane(scene, id);
        return flat_across(plane.point, dd3_of(plane.normal));
    case PRIMITIVE_TRIANGLE:
    case PRIMITIVE_PATCH:
        return corner_flat(scene, id);
    case PRIMITIVE_SPHERE:
    case PRIMITIVE_KINDS:
        break;
    }
    return (struct flat){.corners = 0};
}

/*
 * Whether (p x q).r = 0. The value rounded to double has an error of less than 16 u of the product of the
 * sizes. Triples near 0 mostly consist of vectors between points of similar magnitude, which fit into
 * integers.
 */
static bool triple_is_zero(const struct dd3 *p, const struct dd3 *q, const struct dd3 *r)
{
    struct vec3 a = dd3_round(*p), b = dd3_round(*q), c = dd3_round(*r);
    double base = sum_of_sizes(a) * sum_of_sizes(b), size = base * sum_of_sizes(c);
    bool in_range = base > 0x1p-400 && size > 0x1p-400 && size < 0x1p400;
    if (in_range && fabs(vec_dot(vec_cross(a, b), c)) > 16 * UNIT_ROUNDOFF * size) return false;
    struct integers i, j, k;
    int ignored;
    if (exact_integers(p, &i) && exact_integers(q, &j) && exact_integers(r, &k))
        return integers_triple(&i, &j, &k, &ignored).high == 0;
    struct accumulator sum;
    accumulator_clear(&sum);
    accumulator_add_triple(&sum, p, q, r);
    return accumulator_sign(&sum) == 0;
}

static bool is_in_plane(struct vec3 point, const struct flat *flat)
{
    struct dd3 way = exact_difference3(point, flat->at[0]);
    int ignored;
    if (flat->corners == 1) return exact_dot3(way, flat->normal, &ignored).high == 0;
    struct dd3 p = exact_difference3(flat->at[1], flat->at[0]);
    struct dd3 q = exact_difference3(flat->at[2], flat->at[0]);
    return triple_is_zero(&p, &q, &way);
}

/* Whether p x q = 0, that is whether it is orthogonal to all three axes. */
static bool are_parallel(const struct dd3 *p, const struct dd3 *q)
{
    const struct vec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (unsigned i = 0; i < 3; i++) {
        struct dd3 axis = dd3_of(axes[i]);
        if (!triple_is_zero(p, q, &axis)) return false;
    }
    return true;
}

static bool are_one_sphere(const struct sphere *a, const struct sphere *b)
{
    return a->radius == b->radius && vec_is_same(a->center, b->center);
}

/* Whether the sides of two cones lie on one surface; cylinders may differ in length. */
static bool are_one_side(const struct cone *a, const struct cone *b)
{
    if (vec_is_same(a->base, b->base) && vec_is_same(a->apex, b->apex))
        return a->base_radius == b->base_radius && a->apex_radius == b->apex_radius;
    if (a->base_radius == a->apex_radius) {
        struct dd3 p = exact_difference3(a->apex, a->base), q = exact_difference3(b->apex, b->base);
        struct dd3 way = exact_difference3(b->base, a->base);
        return b->base_radius == a->base_radius && b->apex_radius == a->base_radius &&
               are_parallel(&p, &q) && are_parallel(&p, &way);
    }
    return vec_is_same(a->base, b->apex) && vec_is_same(a->apex, b->base) &&
           a->base_radius == b->apex_radius && a->apex_radius == b->base_radius;
}

/* For primitives of the same kind whose parts a and b are not flat. */
static bool are_in_one(const struct scene *scene, uint32_t a, uint32_t part_of_a, uint32_t b,
                       uint32_t part_of_b)
{
    uint32_t i = primitive_index(a), k = primitive_index(b);
    if (primitive_kind(a) == PRIMITIVE_SPHERE)
        return are_one_sphere(&scene_spheres(scene)[i], &scene_spheres(scene)[k]);
    return primitive_kind(a) == PRIMITIVE_CONE && part_of_a == CONE_SIDE &&
           part_of_b == CONE_SIDE && are_one_side(&scene_cones(scene)[i], &scene_cones(scene)[k]);
}

/* Whether all corners have this coordinate on the axis. */
static bool is_across(const struct flat *flat, unsigned axis, double place)
{
    for (unsigned i = 0; i < flat->corners; i++)
        if (vec_component(&flat->at[i], axis) != place) return false;
    return true;
}

/* Whether two triangles lie in one plane orthogonal to an axis: walls and floors are decided without
 * arithmetic. */
static bool are_across_one_axis(const struct flat *a, const struct flat *b)
{
    if (a->corners != 3 || b->corners != 3) return false;
    for (unsigned axis = 0; axis < 3; axis++) {
        double place = vec_component(&a->at[0], axis);
        if (is_across(a, axis, place) && is_across(b, axis, place)) return true;
    }
    return false;
}

static bool are_in_one_plane(const struct flat *a, const struct flat *b)
{
    if (a->corners == 0 || b->corners == 0) return false;
    if (are_across_one_axis(a, b)) return true;
    const struct flat *points = a->corners == 3 ? a : b, *plane = a->corners == 3 ? b : a;
    for (unsigned i = 0; i < points->corners; i++)
        if (!is_in_plane(points->at[i], plane)) return false;
    return points->corners == 3 || are_parallel(&a->normal, &b->normal);
}

bool is_in_plane_of(const struct scene *scene, uint32_t flat_primitive, struct vec3 point)
{
    struct flat flat = flat_of(scene, flat_primitive, 0);
    return is_in_plane(point, &flat);
}

enum surfaces surfaces_of(const struct scene *scene, uint32_t a, uint32_t part_of_a, uint32_t b,
                          uint32_t part_of_b)
{
    struct flat one = flat_of(scene, a, part_of_a), other = flat_of(scene, b, part_of_b);
    if (are_in_one_plane(&one, &other)) return SURFACES_ONE_PLANE;
    bool round = one.corners == 0 && other.corners == 0;
    bool same = round && primitive_kind(a) == primitive_kind(b) &&
                are_in_one(scene, a, part_of_a, b, part_of_b);
    return same ? SURFACES_ONE_ROUND : SURFACES_TWO;
}

/* Computes n.way, with the plane's normal n. */
static void along_normal(const struct flat *flat, struct dd3 way, struct accumulator *sum)
{
    accumulator_clear(sum);
    if (flat->corners == 3) {
        struct dd3 p = exact_difference3(flat->at[1], flat->at[0]);
        struct dd3 q = exact_difference3(flat->at[2], flat->at[0]);
        accumulator_add_triple(sum, &p, &q, &way);
        return;
    }
    accumulator_add_dd(sum, 1, flat->normal.x, way.x, dd(1));
    accumulator_add_dd(sum, 1, flat->normal.y, way.y, dd(1));
    accumulator_add_dd(sum, 1, flat->normal.z, way.z, dd(1));
}

/* The ray's line crosses the plane at height / speed. */
struct approach {
    struct accumulator height, speed;
};

static void approach_of(const struct flat *flat, const struct ray *ray, struct approach *approach)
{
    along_normal(flat, exact_difference3(flat->at[0], ray->origin), &approach->height);
    along_normal(flat, dd3_of(ray->direction), &approach->speed);
}

/* The same in double-double, with bounds on the sizes of the terms. */
struct rough_approach {
    struct dd height, speed;
    double way, step;
};

static struct rough_approach rough_approach_of(const struct flat *flat, const struct ray *ray)
{
    struct dd3 normal = flat->normal, way = exact_difference3(flat->at[0], ray->origin);
    double size = dd3_size(normal);
    if (flat->corners == 3) {
        struct dd3 p = exact_difference3(flat->at[1], flat->at[0]);
        struct dd3 q = exact_difference3(flat->at[2], flat->at[0]);
        normal = dd3_cross(p, q);
        size = dd3_size(p) * dd3_size(q);
    }
    return (struct rough_approach){dd3_dot(normal, way), dd3_dot_vec(normal, ray->direction),
                                   size * dd3_size(way), size * sum_of_sizes(ray->direction)};
}

/* Relative to these sizes, an upper bound on the error of double-double: that of heights and speeds is less
 * than 64 u^2. */
#define ROUGH_ERROR 0x1p-96

/* The sign of a value with terms of this size: -1 or 1, or 0 if it is uncertain. */
static int rough_sign(struct dd value, double size)
{
    bool in_range = size > 0x1p-400 && size < 0x1p400;
    if (!in_range || !(fabs(value.high) > ROUGH_ERROR * size)) return 0;
    return value.high < 0 ? -1 : 1;
}

/* The order of compare_flats(), or 0 if it needs exact arithmetic. */
static int rough_order(const struct flat *a, const struct flat *b, const struct ray *ray)
{
    struct rough_approach p = rough_approach_of(a, ray), q = rough_approach_of(b, ray);
    struct dd difference = dd_sub(dd_mul(p.height, q.speed), dd_mul(q.height, p.speed));
    int sign = rough_sign(p.speed, p.step) * rough_sign(q.speed, q.step);
    return sign * rough_sign(difference, p.way * q.step + q.way * p.step);
}

/* The order of two crossings, times the signs of both speeds. */
static int approach_difference(const struct approach *p, const struct approach *q)
{
    struct accumulator difference;
    accumulator_clear(&difference);
    accumulator_add_product(&difference, &p->height, &q->speed, NULL, false);
    accumulator_add_product(&difference, &q->height, &p->speed, NULL, true);
    return accumulator_sign(&difference);
}

bool compare_flats(const struct scene *scene, const struct ray *ray, uint32_t a, uint32_t part_of_a,
                   uint32_t b, uint32_t part_of_b, int *order)
{
    struct flat one = flat_of(scene, a, part_of_a), other = flat_of(scene, b, part_of_b);
    struct approach p, q;
    if (one.corners == 0 || other.corners == 0) return false;
    *order = rough_order(&one, &other, ray);
    if (*order != 0) return true;
    approach_of(&one, ray, &p);
    approach_of(&other, ray, &q);
    int sign = accumulator_sign(&p.speed) * accumulator_sign(&q.speed);
    *order = approach_difference(&p, &q) * sign;
    return sign != 0;
}

int compare_flats_beside(const struct scene *scene, const struct ray *ray,
                         const struct shear *shear, uint32_t a, uint32_t b)
{
    const struct dd3 axes[3] = {dd3_of(vec3(1, 0, 0)), dd3_of(vec3(0, 1, 0)),
                                dd3_of(vec3(0, 0, 1))};
    const unsigned ways[2] = {shear->x, shear->y};
    struct flat one = flat_of(scene, a, 0), other = flat_of(scene, b, 0);
    struct approach p, q;
    approach_of(&one, ray, &p);
    approach_of(&other, ray, &q);
    int order = 0, sign = accumulator_sign(&p.speed) * accumulator_sign(&q.speed);
    for (unsigned i = 0; i < 2 && order == 0; i++) {
        along_normal(&one, axes[ways[i]], &p.height);
        along_normal(&other, axes[ways[i]], &q.height);
        order = approach_difference(&p, &q) * sign;
    }
    return order;
}
