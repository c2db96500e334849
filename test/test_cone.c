#include "scene_fixture.h"

#include "worker/cone.h"

static uint64_t exact; /* counter of exact computations, which the tests do not check */

/* The purpose of a query for both entry and exit, at any distance. */
static const struct purpose BOTH = {true, INFINITE};

static const struct cone tube = {
    .base = {0, 0, 0}, .apex = {0, 0, 2}, .base_radius = 1, .apex_radius = 1};
static const struct cone rod = {
    .base = {0, 0, 0}, .apex = {0, 0, 2}, .base_radius = 1, .apex_radius = 1, .capped = 1};
static const struct cone hat = {.base = {0, 0, 0}, .apex = {0, 0, 2}, .base_radius = 1};
static const struct cone spike = {
    .base = {0, 0, 0}, .apex = {0, 0, 2}, .base_radius = 1, .capped = 1};
static const struct cone bucket = {
    .base = {0, 0, 0}, .apex = {0, 0, 4}, .base_radius = 1, .apex_radius = 2, .capped = 1};

static void assert_crossings(const struct cone *cone, struct ray ray, double enter,
                             uint32_t enter_part, double leave, uint32_t leave_part)
{
    struct crossings found = cone_crossings(cone, &ray, false, &BOTH, &exact);
    assert_near(found.t[0], enter, 1e-15 * fabs(enter));
    assert_near(found.t[1], leave, 1e-15 * fabs(leave));
    assert_int_equal(found.part[0], enter_part);
    assert_int_equal(found.part[1], leave_part);
}

static void assert_missed(const struct cone *cone, struct ray ray)
{
    struct crossings found = cone_crossings(cone, &ray, false, &BOTH, &exact);
    assert_int_equal(count_ahead(&found), 0);
}

static void test_cylinder_side(void **state)
{
    struct ray across = ray_along(vec3(-3, 0, 1), vec3(2, 0, 0));
    assert_crossings(&tube, across, 1, CONE_SIDE, 2, CONE_SIDE);
    assert_crossings(&rod, across, 1, CONE_SIDE, 2, CONE_SIDE);
    assert_crossings(&rod, ray_along(vec3(-3, 0.6, 1), vec3(1, 0, 0)), 2.2, CONE_SIDE, 3.8,
                     CONE_SIDE);
    /* The rims belong to it: a ray in the plane of either end meets them. */
    assert_crossings(&tube, ray_along(vec3(-3, 0, 0), vec3(1, 0, 0)), 2, CONE_SIDE, 4, CONE_SIDE);
    assert_crossings(&tube, ray_along(vec3(-3, 0, 2), vec3(1, 0, 0)), 2, CONE_SIDE, 4, CONE_SIDE);
    assert_missed(&tube, ray_along(vec3(-3, 0, nextafter(2, 3)), vec3(1, 0, 0)));
    assert_missed(&tube, ray_along(vec3(-3, 0, 2.5), vec3(1, 0, 0)));
    assert_missed(&rod, ray_along(vec3(-3, 1.5, 1), vec3(1, 0, 0)));
    assert_missed(&rod, ray_along(vec3(3, 0, 1), vec3(1, 0, 0)));
}

static void test_cylinder_caps(void **state)
{
    struct ray axis = ray_along(vec3(0, 0, -1), vec3(0, 0, 1));
    assert_crossings(&rod, axis, 1, CONE_BASE_CAP, 3, CONE_APEX_CAP);
    assert_missed(&tube, axis);
    assert_crossings(&rod, ray_along(vec3(0.5, 0, 3), vec3(0, 0, -1)), 1, CONE_APEX_CAP, 3,
                     CONE_BASE_CAP);
    assert_crossings(&rod, ray_along(vec3(0, 0, -1), vec3(0.5, 0, 1)), 1, CONE_BASE_CAP, 2,
                     CONE_SIDE);
    assert_missed(&rod, ray_along(vec3(1.5, 0, -1), vec3(0, 0, 1)));
}

static void test_from_inside(void **state)
{
    struct ray ray = ray_along(vec3(0.5, 0, 1), vec3(1, 0, 0));
    assert_crossings(&rod, ray, -1.5, CONE_SIDE, 0.5, CONE_SIDE);
    ray = ray_along(vec3(0.5, 0, 1), vec3(0, 0, 1));
    assert_crossings(&rod, ray, -1, CONE_BASE_CAP, 1, CONE_APEX_CAP);
}

/* A ray from the floor into a rod that stands on it, so far from the origin that all of the rod is near the start in
 * terms of rounding errors: the entry is reported. */
static void test_from_the_floor_far_away(void **state)
{
    for (int exponent = 0; exponent <= 40; exponent++) {
        double far = ldexp(1, exponent);
        struct cone standing = rod;
        standing.base.x = standing.apex.x = far;
        struct ray up = ray_along(vec3(far + 0.5, 0, -0x1p-51 * far), vec3(0, 0, 1));
        up.t_max = 10;
        up.from = primitive_id(PRIMITIVE_PLANE, 0);
        struct purpose number = {true, up.t_max};
        struct crossings found = cone_crossings(&standing, &up, false, &number, &exact);
        assert_true(is_near_start(&up, found.t[0]));
        assert_near(found.t[1], 2, 1e-3);
    }
}

static void test_tangent(void **state)
{
    assert_crossings(&tube, ray_along(vec3(-3, 1, 1), vec3(1, 0, 0)), 3, CONE_SIDE, 3, CONE_SIDE);
    assert_missed(&tube, ray_along(vec3(-3, nextafter(1, 2), 1), vec3(1, 0, 0)));
    /* along a line of the side, which belongs to the solid */
    assert_crossings(&rod, ray_along(vec3(1, 0, -1), vec3(0, 0, 1)), 1, CONE_BASE_CAP, 3,
                     CONE_APEX_CAP);
}

static void test_cone_side(void **state)
{
    struct ray across = ray_along(vec3(-3, 0, 1), vec3(1, 0, 0));
    assert_crossings(&hat, across, 2.5, CONE_SIDE, 3.5, CONE_SIDE);
    assert_crossings(&spike, across, 2.5, CONE_SIDE, 3.5, CONE_SIDE);
    /* the other nappe, above the tip */
    assert_missed(&hat, ray_along(vec3(-3, 0, 3), vec3(1, 0, 0)));
    assert_missed(&spike, ray_along(vec3(-3, 0, 3), vec3(1, 0, 0)));
    /* from the other nappe down through the tip */
    assert_crossings(&spike, ray_along(vec3(0, 0, 5), vec3(0, 0, -1)), 3, CONE_APEX_CAP, 5,
                     CONE_BASE_CAP);
    assert_crossings(&bucket, ray_along(vec3(-3, 0, 2), vec3(1, 0, 0)), 1.5, CONE_SIDE, 4.5,
                     CONE_SIDE);
}

/* A ray parallel to a generator, for which the quadratic term vanishes. */
static void test_cone_generator(void **state)
{
    struct ray up = ray_along(vec3(-0.25, 0, 1), vec3(-1, 0, 2));
    struct crossings found = cone_crossings(&spike, &up, false, &BOTH, &exact);
    assert_near(found.t[0], -0.5, 1e-15);
    assert_near(found.t[1], 0.125, 1e-15);
    assert_int_equal(found.part[0], CONE_BASE_CAP);
    assert_int_equal(found.part[1], CONE_SIDE);
    struct ray along = ray_along(vec3(2, 0, -2), vec3(-1, 0, 2));
    found = cone_crossings(&spike, &along, false, &BOTH, &exact);
    assert_false(isnan(found.t[0]) || isnan(found.t[1]));
    found = cone_crossings(&hat, &along, false, &BOTH, &exact);
    assert_false(isnan(found.t[0]) || isnan(found.t[1]));
}

static void test_leaving(void **state)
{
    struct ray ray = ray_along(vec3(-1, 0, 1), vec3(1, 0, 0));
    ray.from_part = CONE_SIDE;
    struct crossings found = cone_crossings(&rod, &ray, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 1);
    assert_same(found.t[1], 2);
    assert_int_equal(found.part[1], CONE_SIDE);
    ray.direction = vec3(1, 0, 2);
    found = cone_crossings(&rod, &ray, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 1);
    assert_same(found.t[1], 0.5);
    assert_int_equal(found.part[1], CONE_APEX_CAP);
    found = cone_crossings(&tube, &ray, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
    ray.direction = vec3(-1, 0, 0.1);
    found = cone_crossings(&rod, &ray, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
    ray = ray_along(vec3(0.25, 0, 2), vec3(0, 0, -1));
    ray.from_part = CONE_APEX_CAP;
    found = cone_crossings(&rod, &ray, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 1);
    assert_same(found.t[1], 2);
    assert_int_equal(found.part[1], CONE_BASE_CAP);
    ray.direction.z = 1;
    found = cone_crossings(&rod, &ray, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
}

/* A cone of any size, often far from the origin; a cylinder or one with a tip each third time. */
static struct cone any_solid(uint64_t *random)
{
    double size = ldexp(1, random_below(random, 4) ? 0 : random_exponent(random, -120, 120));
    double radius = size * pow(10, random_between(random, -3, random_below(random, 4) ? 0.3 : 4));
    double far = size * pow(10, random_between(random, 0, 8));
    double radii[2] = {radius, random_below(random, 3) * radius / 2};
    unsigned narrow = random_below(random, 2);
    struct vec3 base = random_vector(random, far);
    return (struct cone){.base = base,
                         .apex = vec_add(base, random_vector(random, size)),
                         .base_radius = radii[!narrow],
                         .apex_radius = radii[narrow],
                         .capped = 1};
}

/* A ray from a point of this part, up to rounding, in any direction or almost along the surface or towards the rim. */
static struct ray ray_on_part(uint64_t *random, const struct cone *cone, uint32_t part)
{
    struct vec3 axis = vec_sub(cone->apex, cone->base), unit = vec_normalize(axis);
    struct vec3 out = vec_normalize(vec_cross(axis, random_vector(random, 1)));
    double s = part == CONE_SIDE ? random_between(random, 0, 1) : part == CONE_APEX_CAP;
    double rho = cone->base_radius + (cone->apex_radius - cone->base_radius) * s;
    if (part != CONE_SIDE) rho *= 1 - pow(10, -random_between(random, 0, 17));
    struct vec3 at = vec_add_scaled(vec_add_scaled(cone->base, axis, s), out, rho);
    struct vec3 normal = part == CONE_SIDE ? out : unit, any = random_vector(random, 1);
    struct vec3 way = random_below(random, 2) ? any : vec_cross(normal, any);
    double off = random_between(random, -1, 1) * pow(10, -random_between(random, 0, 17));
    way = vec_scale(vec_add_scaled(way, normal, off), pow(10, random_between(random, -6, 6)));
    struct ray ray = ray_along(at, way);
    ray.from = 0;
    ray.from_part = part;
    return ray;
}

/* The interval of a way out contains the exit of double-double arithmetic, which is on its part. Where only the number
 * of exits matters, it is the same. */
static void test_way_out_spans(void **state)
{
    uint64_t random = 54;
    unsigned count = 200000, decided = 0, known = 0;
    for (unsigned i = 0; i < count; i++) {
        struct cone cone = any_solid(&random);
        uint32_t part = random_below(&random, 3);
        struct ray ray = ray_on_part(&random, &cone, part);
        struct cone_sketch sketch = cone_sketch(&cone, &ray);
        struct cone_span span;
        struct crossings found = cone_roots(&cone, &ray, true, false, &exact);
        if (ray_leaves_cone(&cone, &sketch, part)) assert_true(found.t[1] == NOT_CROSSED);
        if (!cone_way_out_span(&cone, &sketch, part, &span)) continue;
        assert_true(span.low > 0 && span.low <= found.t[1] && found.t[1] <= span.high);
        if (span.part_known) assert_int_equal(span.part, found.part[1]);
        decided++;
        known += span.part_known;
        double off = random_between(&random, -1, 1) * pow(10, -random_between(&random, 0, 17));
        struct purpose purpose = {true, found.t[1] * (1 + off)};
        bool counts = found.t[1] < purpose.farthest;
        found = cone_crossings(&cone, &ray, true, &purpose, &exact);
        assert_int_equal(found.t[1] < purpose.farthest, counts);
    }
    assert_true(decided > count / 8 && known > count / 10);
}

/* A ray that goes down inside the cone from a point of its side leaves it through the base, and never hits the other
 * nappe. */
static void test_leaving_a_cone_downwards(void **state)
{
    struct ray ray = ray_along(vec3(0.5, 0, 1), vec3(-0.1, 0, -1));
    struct crossings found = cone_crossings(&spike, &ray, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 1);
    assert_same(found.t[1], 1);
    assert_int_equal(found.part[1], CONE_BASE_CAP);
    found = cone_crossings(&hat, &ray, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
    ray.direction = vec3(0.1, 0, 1); /* out, past the tip */
    found = cone_crossings(&hat, &ray, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
}

static struct cone random_cone(uint64_t *random)
{
    struct cone cone = {.base = random_vector(random, 5), .capped = 1};
    cone.apex = vec_add(cone.base, random_vector(random, 5));
    cone.base_radius = random_between(random, 0.1, 3);
    cone.apex_radius = random_between(random, -3, 3);
    if (cone.apex_radius < -1) cone.apex_radius = cone.base_radius;
    if (cone.apex_radius < 0) cone.apex_radius = 0;
    return cone;
}

/* A point at height s, at r times the radius there; *out is the unit vector away from the axis. */
static struct vec3 point_of_cone(const struct cone *cone, uint64_t *random, double s, double r,
                                 struct vec3 *out)
{
    struct vec3 w = vec_sub(cone->apex, cone->base);
    *out = vec_normalize(vec_cross(w, random_vector(random, 1)));
    double radius = cone->base_radius + s * (cone->apex_radius - cone->base_radius);
    return vec_add_scaled(vec_add_scaled(cone->base, w, s), *out, r * radius);
}

/* Where rounding has put the origin beside a solid, the ray leaves it at once, whatever the size of the scene. */
static void test_leaving_at_once(void **state)
{
    for (int exponent = -300; exponent <= 300; exponent += 5) {
        double size = ldexp(1, exponent);
        struct cone cone = {.base = {size, 0, size}, .apex = {size, 0, 3 * size}, .capped = 1};
        cone.base_radius = 2 * size;
        cone.apex_radius = size / 2;
        struct ray ray = {.origin = {3 * size, 0, size * (1 - 0x1p-53)},
                          .direction = {-4 * size, 2 * size, -4 * size},
                          .t_max = 1,
                          .from_part = CONE_SIDE};
        assert_true(cone_roots(&cone, &ray, true, true, &exact).t[1] > 0);
    }
}

static void test_points_on_the_side(void **state)
{
    uint64_t random = 5;
    for (int i = 0; i < 40000; i++) {
        struct cone cone = random_cone(&random);
        cone.capped = (uint32_t)i & 1;
        struct vec3 out,
            target = point_of_cone(&cone, &random, random_between(&random, 0.01, 0.99), 1, &out);
        struct ray ray = ray_to(random_vector(&random, 20), target);
        struct vec3 normal = cone_normal(&cone, dd3_of(vec_sub(target, cone.base)), CONE_SIDE);
        assert_near(vec_length(normal), 1, 1e-15);
        assert_true(vec_dot(normal, out) > 0);
        double cosine = vec_dot(vec_normalize(ray.direction), normal);
        if (fabs(cosine) < 0.02) continue;
        struct crossings found = cone_crossings(&cone, &ray, false, &BOTH, &exact);
        unsigned which = cosine < 0 ? 0 : 1;
        assert_near(found.t[which], 1, 1e-9);
        assert_int_equal(found.part[which], CONE_SIDE);
        struct ray outward = ray_along(target, normal), inward = ray_along(target, vec_neg(normal));
        found = cone_crossings(&cone, &outward, true, &ALL_CROSSINGS, &exact);
        assert_int_equal(count_ahead(&found), 0);
        found = cone_crossings(&cone, &inward, true, &ALL_CROSSINGS, &exact);
        if (cone.capped) assert_int_equal(count_ahead(&found), 1);
    }
}

/* Rays through inner points and exactly through rims: a ray that enters also leaves. */
static void test_capped_is_closed(void **state)
{
    uint64_t random = 6;
    for (int i = 0; i < 40000; i++) {
        struct cone cone = random_cone(&random);
        struct vec3 out;
        bool rim = i & 1;
        double s = rim ? (double)(i / 2 % 2) : random_between(&random, 0.01, 0.99);
        struct vec3 target =
            point_of_cone(&cone, &random, s, rim ? 1 : random_between(&random, 0, 0.99), &out);
        struct ray ray =
            ray_to(vec_add(cone.base, vec_scale(random_vector(&random, 1), 50)), target);
        struct crossings found = cone_crossings(&cone, &ray, false, &BOTH, &exact);
        assert_true((found.t[0] == NOT_CROSSED) == (found.t[1] == NOT_CROSSED));
        assert_true(found.t[0] <= found.t[1]);
        if (!rim) assert_true(found.t[0] < 1 && found.t[1] > 1);
    }
}

static void test_distant_cylinder(void **state)
{
    for (double distance = 1e3; distance <= 1e12; distance *= 1e3) {
        struct ray ray = ray_along(vec3(-distance, 0.6, 1), vec3(1, 0, 0));
        struct crossings found = cone_crossings(&rod, &ray, false, &BOTH, &exact);
        assert_near(found.t[0], distance - 0.8, 4 * 0x1p-52 * distance);
        ray.origin.y = 1.000001;
        found = cone_crossings(&rod, &ray, false, &BOTH, &exact);
        assert_int_equal(count_ahead(&found), 0);
    }
}

/* A ray almost along the axis of a long thin cylinder. */
static void test_small_angle(void **state)
{
    struct cone needle = {.apex = {0, 0, 1e12}, .base_radius = 1, .apex_radius = 1};
    for (double angle = 1e-3; angle > 1e-11; angle /= 8) {
        struct ray ray = ray_along(vec3(0, 0, 1), vec3(angle, 0, 1));
        struct crossings found = cone_crossings(&needle, &ray, false, &BOTH, &exact);
        assert_near(found.t[1], 1 / angle, 8 * 0x1p-52 / angle);
    }
}

static void test_normals(void **state)
{
    assert_vector_near(cone_normal(&rod, dd3_of(vec3(0.5, 0, 2)), CONE_APEX_CAP), vec3(0, 0, 1), 0);
    assert_vector_near(cone_normal(&rod, dd3_of(vec3(0.5, 0, 0)), CONE_BASE_CAP), vec3(0, 0, -1),
                       0);
    assert_vector_near(cone_normal(&rod, dd3_of(vec3(0, 1, 1)), CONE_SIDE), vec3(0, 1, 0), 1e-15);
    double root = sqrt(5);
    assert_vector_near(cone_normal(&hat, dd3_of(vec3(0, 0.5, 1)), CONE_SIDE),
                       vec3(0, 2 / root, 1 / root), 1e-15);
    assert_vector_near(cone_normal(&hat, dd3_of(vec3(0, 0, 2)), CONE_SIDE), vec3(0, 0, 1), 0);
}

/* Scaling a cone and its position by a power of two leaves its normals the same to the bit. */
static void test_normals_of_all_sizes(void **state)
{
    const struct cone cone = {
        .base = {0.5, 1, 2}, .apex = {0.25, 2, 4}, .base_radius = 1.5, .apex_radius = 0.75};
    const struct vec3 p = vec3(1.25, 0.5, 0.75);
    for (uint32_t part = CONE_SIDE; part <= CONE_APEX_CAP; part++) {
        struct vec3 normal = cone_normal(&cone, dd3_of(p), part);
        for (int exponent = -950; exponent <= 1000; exponent += 50) {
            struct cone scaled = {.base = vec_scale_exactly(cone.base, exponent),
                                  .apex = vec_scale_exactly(cone.apex, exponent),
                                  .base_radius = ldexp(cone.base_radius, exponent),
                                  .apex_radius = ldexp(cone.apex_radius, exponent)};
            struct vec3 n = cone_normal(&scaled, dd3_of(vec_scale_exactly(p, exponent)), part);
            assert_true(n.x == normal.x && n.y == normal.y && n.z == normal.z);
        }
    }
    struct vec3 normal = cone_normal(&rod, dd3_of(vec3(0, 1, 1)), CONE_SIDE);
    for (int exponent = -1000; exponent <= 0; exponent += 50) {
        struct cone far = {.base = {1e30, 0, 0},
                           .apex = {1e30, 0, ldexp(rod.apex.z - rod.base.z, exponent)},
                           .base_radius = ldexp(rod.base_radius, exponent),
                           .apex_radius = ldexp(rod.apex_radius, exponent)};
        struct vec3 on_side = vec3(0, ldexp(1, exponent), ldexp(1, exponent));
        struct vec3 n = cone_normal(&far, dd3_of(on_side), CONE_SIDE);
        assert_true(n.x == normal.x && n.y == normal.y && n.z == normal.z);
    }
}

static void test_bounds(void **state)
{
    struct bounds bounds = cone_bounds(&bucket);
    assert_vector_near(vec3(bounds.min[0], bounds.min[1], bounds.min[2]), vec3(-2, -2, 0), 0);
    assert_vector_near(vec3(bounds.max[0], bounds.max[1], bounds.max[2]), vec3(2, 2, 4), 0);
    uint64_t random = 7;
    for (int i = 0; i < 10000; i++) {
        struct cone cone = random_cone(&random);
        struct vec3 out, p = point_of_cone(&cone, &random, random_between(&random, 0, 1), 1, &out);
        bounds = cone_bounds(&cone);
        for (unsigned axis = 0; axis < 3; axis++) {
            assert_true(vec_component(&p, axis) >= bounds.min[axis] - 1e-14);
            assert_true(vec_component(&p, axis) <= bounds.max[axis] + 1e-14);
        }
    }
}

/* The box of each piece contains the points of the cone at its heights, leaves no gap to the box of the next piece,
 * and lies inside the box of the whole cone. */
static void test_piece_bounds(void **state)
{
    uint64_t random = 8;
    for (uint32_t i = 0; i < 10000; i++) {
        uint32_t count = 2 + i % 31, piece = i / 31 % count;
        struct cone cone = random_cone(&random);
        double height = (piece + random_between(&random, 0, 1)) / count;
        struct vec3 out, p = point_of_cone(&cone, &random, height, 1, &out);
        struct bounds bounds = cone_piece_bounds(&cone, piece, count), all = cone_bounds(&cone);
        for (unsigned axis = 0; axis < 3; axis++) {
            assert_true(vec_component(&p, axis) >= bounds.min[axis] - 1e-14);
            assert_true(vec_component(&p, axis) <= bounds.max[axis] + 1e-14);
            assert_true(bounds.min[axis] >= all.min[axis] - 1e-14);
            assert_true(bounds.max[axis] <= all.max[axis] + 1e-14);
        }
        if (piece + 1 == count) continue;
        struct bounds next = cone_piece_bounds(&cone, piece + 1, count);
        for (unsigned axis = 0; axis < 3; axis++) {
            assert_true(next.min[axis] <= bounds.max[axis]);
            assert_true(next.max[axis] >= bounds.min[axis]);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cylinder_side),
        cmocka_unit_test(test_cylinder_caps),
        cmocka_unit_test(test_from_inside),
        cmocka_unit_test(test_from_the_floor_far_away),
        cmocka_unit_test(test_tangent),
        cmocka_unit_test(test_cone_side),
        cmocka_unit_test(test_cone_generator),
        cmocka_unit_test(test_leaving),
        cmocka_unit_test(test_leaving_at_once),
        cmocka_unit_test(test_way_out_spans),
        cmocka_unit_test(test_leaving_a_cone_downwards),
        cmocka_unit_test(test_points_on_the_side),
        cmocka_unit_test(test_capped_is_closed),
        cmocka_unit_test(test_distant_cylinder),
        cmocka_unit_test(test_small_angle),
        cmocka_unit_test(test_normals),
        cmocka_unit_test(test_normals_of_all_sizes),
        cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_piece_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
