#include "scene_fixture.h"

#include "worker/sphere.h"

static uint64_t exact; /* counts what the tests do not look at */

static const struct sphere unit = {.radius = 1};

static struct vec3 normal_at(const struct sphere *sphere, const struct ray *ray, double t)
{
    return vec_normalize(dd3_round(sphere_point(sphere, ray, t)));
}

static void test_through_the_centre(void **state)
{
    struct ray ray = ray_along(vec3(-3, 0, 0), vec3(0.5, 0, 0));
    struct crossings found = sphere_crossings(&unit, &ray, false, &ALL_CROSSINGS, &exact);
    assert_same(found.t[0], 4);
    assert_same(found.t[1], 8);
}

static void test_off_centre(void **state)
{
    struct sphere sphere = {.center = {1, 2, 3}, .radius = 5};
    struct ray ray = ray_along(vec3(1, 5, -7), vec3(0, 0, 2));
    struct crossings found = sphere_crossings(&sphere, &ray, false, &ALL_CROSSINGS, &exact);
    assert_same(found.t[0], 3); /* chord at height 3 of radius 5: 10 -+ 4 */
    assert_same(found.t[1], 7);
}

static void test_from_inside_and_behind(void **state)
{
    struct ray inside = ray_along(vec3(0.5, 0, 0), vec3(1, 0, 0));
    struct crossings found = sphere_crossings(&unit, &inside, false, &ALL_CROSSINGS, &exact);
    assert_same(found.t[0], -1.5);
    assert_same(found.t[1], 0.5);
    struct ray behind = ray_along(vec3(3, 0, 0), vec3(1, 0, 0));
    found = sphere_crossings(&unit, &behind, false, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
}

static void test_tangent(void **state)
{
    struct ray touching = ray_along(vec3(-5, 1, 0), vec3(1, 0, 0));
    struct crossings found = sphere_crossings(&unit, &touching, false, &ALL_CROSSINGS, &exact);
    assert_same(found.t[0], 5);
    assert_same(found.t[1], 5);
    struct ray above = ray_along(vec3(-5, nextafter(1, 2), 0), vec3(1, 0, 0));
    found = sphere_crossings(&unit, &above, false, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
    struct ray below = ray_along(vec3(-5, nextafter(1, 0), 0), vec3(1, 0, 0));
    found = sphere_crossings(&unit, &below, false, &ALL_CROSSINGS, &exact);
    assert_true(found.t[0] < found.t[1]);
    assert_near(found.t[1] - found.t[0], 2 * sqrt(0x1p-52), 1e-15);
    /* It passes by at a distance from the sphere whose square is too small for a double. */
    struct ray beside = ray_along(vec3(1, 0x1p-600, -5), vec3(0, 0, 1));
    found = sphere_crossings(&unit, &beside, false, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
    struct ray at_contact = ray_along(vec3(0, 1, 0), vec3(1, 0, 0));
    found = sphere_crossings(&unit, &at_contact, false, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
}

static void test_leaving(void **state)
{
    struct ray out = ray_along(vec3(1, 0, 0), vec3(1, 1, 0));
    struct crossings found = sphere_crossings(&unit, &out, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
    struct ray in = ray_along(vec3(1, 0, 0), vec3(-1, 1, 0));
    found = sphere_crossings(&unit, &in, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 1);
    assert_same(found.t[1], 1);
    struct ray along = ray_along(vec3(1, 0, 0), vec3(0, 1, 0));
    found = sphere_crossings(&unit, &along, true, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
}

/* Origins that are rounded to either side of the surface: an outgoing ray does not hit the sphere again. */
static void test_leaving_is_not_an_epsilon(void **state)
{
    uint64_t random = 1;
    for (int i = 0; i < 10000; i++) {
        struct sphere sphere = {.center = random_vector(&random, 1e6),
                                .radius = random_between(&random, 1e-3, 10)};
        struct vec3 normal = vec_normalize(random_vector(&random, 1));
        struct ray ray = ray_along(vec_add_scaled(sphere.center, normal, sphere.radius),
                                   vec_normalize(random_vector(&random, 1)));
        double cosine = vec_dot(ray.direction, normal);
        if (fabs(cosine) < 1e-5) continue; /* centre's rounding against the smallest radius */
        struct crossings found = sphere_crossings(&sphere, &ray, true, &ALL_CROSSINGS, &exact);
        assert_int_equal(count_ahead(&found), cosine < 0);
        if (cosine < 0) assert_near(found.t[1], -2 * cosine * sphere.radius, 1e-9);
    }
}

static void test_inside_only(void **state)
{
    struct sphere shell = {.radius = 1, .inside_only = 1};
    struct ray ray = ray_along(vec3(-3, 0, 0), vec3(1, 0, 0));
    struct crossings found = sphere_crossings(&shell, &ray, false, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 1);
    assert_same(found.t[1], 4);
}

/* An eye on a planet; a plain |f|^2 - r^2 would lose all digits at the larger radii. */
static void test_ground_sphere(void **state)
{
    for (double radius = 1e3; radius <= 1e12; radius *= 1e3) {
        struct sphere ground = {.center = {0, -radius, 0}, .radius = radius};
        struct ray down = ray_along(vec3(0, 2, 0), vec3(0, -1, 0));
        struct crossings found = sphere_crossings(&ground, &down, false, &ALL_CROSSINGS, &exact);
        assert_near(found.t[0], 2, 2 * 0x1p-52);
        struct ray low = ray_along(vec3(0, 0.3, 0), vec3(0, -1, 0)); /* o - center is rounded */
        found = sphere_crossings(&ground, &low, false, &ALL_CROSSINGS, &exact);
        assert_near(found.t[0], 0.3, 4 * 0x1p-54);
        /* t = c / (b + sqrt(b^2 - a c)) for a slanted ray */
        struct ray slanted = ray_along(vec3(0, 2, 0), vec3(3, -1, 0));
        double b = radius + 2, c = 4 * radius + 4;
        double t = c / (b + sqrt(b * b - 10 * c));
        found = sphere_crossings(&ground, &slanted, false, &ALL_CROSSINGS, &exact);
        assert_near(found.t[0], t, 1e-14 * t);
    }
}

static void test_distant_sphere(void **state)
{
    for (double distance = 1e3; distance <= 1e15; distance *= 1e3) {
        struct ray ray = ray_along(vec3(-distance, 0.6, 0), vec3(1, 0, 0));
        struct crossings found = sphere_crossings(&unit, &ray, false, &ALL_CROSSINGS, &exact);
        assert_near(found.t[0], distance - 0.8, 2 * 0x1p-52 * distance);
        struct vec3 normal = normal_at(&unit, &ray, found.t[0]);
        assert_vector_near(normal, vec3(-0.8, 0.6, 0), 1e-15);
        normal = normal_at(&unit, &ray, found.t[1]);
        assert_vector_near(normal, vec3(0.8, 0.6, 0), 1e-15);
        ray.origin.y = 1.0000001;
        found = sphere_crossings(&unit, &ray, false, &ALL_CROSSINGS, &exact);
        assert_int_equal(count_ahead(&found), 0);
    }
}

static void test_direction_length(void **state)
{
    struct vec3 origin = vec3(-3, 0.3, 0.2), direction = vec3(1, 0.01, -0.02);
    struct ray ray = ray_along(origin, direction);
    struct crossings found = sphere_crossings(&unit, &ray, false, &ALL_CROSSINGS, &exact);
    for (int k = -60; k <= 60; k += 15) {
        struct ray scaled = ray_along(origin, vec_scale(direction, ldexp(1, k)));
        struct crossings other = sphere_crossings(&unit, &scaled, false, &ALL_CROSSINGS, &exact);
        assert_same(other.t[0], ldexp(found.t[0], -k));
        assert_same(other.t[1], ldexp(found.t[1], -k));
    }
}

static void test_points_on_the_surface(void **state)
{
    uint64_t random = 2;
    for (int i = 0; i < 20000; i++) {
        struct sphere sphere = {.center = random_vector(&random, 10),
                                .radius = random_between(&random, 0.01, 10)};
        struct vec3 normal = vec_normalize(random_vector(&random, 1));
        struct vec3 target = vec_add_scaled(sphere.center, normal, sphere.radius);
        struct ray ray = ray_to(random_vector(&random, 30), target);
        double cosine = vec_dot(vec_normalize(ray.direction), normal);
        if (fabs(cosine) < 0.01) continue;
        struct crossings found = sphere_crossings(&sphere, &ray, false, &ALL_CROSSINGS, &exact);
        double t = found.t[cosine < 0 ? 0 : 1];
        assert_near(t, 1, 1e-11);
        assert_vector_near(normal_at(&sphere, &ray, t), normal, 1e-10);
    }
}

static void test_bounds(void **state)
{
    struct sphere sphere = {.center = {1, 2, 3}, .radius = 0.5};
    struct bounds bounds = sphere_bounds(&sphere);
    assert_same(bounds.min[0], 0.5);
    assert_same(bounds.max[2], 3.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_through_the_centre),
        cmocka_unit_test(test_off_centre),
        cmocka_unit_test(test_from_inside_and_behind),
        cmocka_unit_test(test_tangent),
        cmocka_unit_test(test_leaving),
        cmocka_unit_test(test_leaving_is_not_an_epsilon),
        cmocka_unit_test(test_inside_only),
        cmocka_unit_test(test_ground_sphere),
        cmocka_unit_test(test_distant_sphere),
        cmocka_unit_test(test_direction_length),
        cmocka_unit_test(test_points_on_the_surface),
        cmocka_unit_test(test_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
