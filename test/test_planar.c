#include "scene_fixture.h"

#include "worker/planar.h"

static uint64_t exact; /* counts what the tests do not look at */

static const struct plane ground = {.point = {5, 2, 7}, .normal = {0, 1, 0}};
static const struct disc coin = {.center = {1, 0, 0}, .normal = {0, 0, 1}, .radius = 2};

static void test_plane_from_both_sides(void **state)
{
    struct ray down = ray_along(vec3(0, 6, 0), vec3(1, -2, 0));
    assert_same(plane_crossings(&ground, &down).t[0], 2);
    struct ray up = ray_along(vec3(0, -6, 0), vec3(0, 4, 0));
    assert_same(plane_crossings(&ground, &up).t[0], 2);
    struct ray away = ray_along(vec3(0, 6, 0), vec3(0, 4, 0));
    assert_same(plane_crossings(&ground, &away).t[0], -1);
}

static void test_parallel(void **state)
{
    for (double height = 1; height <= 3; height++) {
        for (double zero = 0; signbit(zero) == 0; zero = -zero) {
            struct ray ray = ray_along(vec3(0, height, 0), vec3(1, zero, 0));
            struct crossings found = plane_crossings(&ground, &ray);
            assert_int_equal(count_ahead(&found), 0);
            ray.direction.y = -zero;
            found = plane_crossings(&ground, &ray);
            assert_int_equal(count_ahead(&found), 0);
        }
    }
    for (double height = -1; height <= 1; height++) {
        struct ray ray = ray_along(vec3(-5, 0, height), vec3(1, 0, 0));
        struct crossings found = disc_crossings(&coin, &ray, &ALL_CROSSINGS, &exact);
        assert_int_equal(count_ahead(&found), 0);
    }
}

static void test_disc_rim(void **state)
{
    struct ray ray = ray_along(vec3(3, 0, 4), vec3(0, 0, -1));
    assert_same(disc_crossings(&coin, &ray, &ALL_CROSSINGS, &exact).t[0], 4);
    ray.origin.x = nextafter(3, 4);
    struct crossings found = disc_crossings(&coin, &ray, &ALL_CROSSINGS, &exact);
    assert_int_equal(count_ahead(&found), 0);
    ray.origin.x = nextafter(-1, 0);
    assert_same(disc_crossings(&coin, &ray, &ALL_CROSSINGS, &exact).t[0], 4);
}

/* The last bit decides along every axis, also where the disc is oblique to the other two. */
static void test_disc_rim_along_axes(void **state)
{
    static const double normals[][2] = {{0, 1}, {1, 0}, {0.6, 0.8}};
    for (unsigned k = 0; k < 9; k++) {
        unsigned a = k % 3, b = (a + 1) % 3, c = (a + 2) % 3;
        double normal[3] = {0}, at[3] = {4, 4, 4}, way[3] = {-1, -1, -1};
        normal[b] = normals[k / 3][0];
        normal[c] = normals[k / 3][1];
        at[a] = 2;
        way[a] = 0;
        struct disc disc = {.normal = vec3(normal[0], normal[1], normal[2]), .radius = 2};
        struct ray ray = ray_along(vec3(at[0], at[1], at[2]), vec3(way[0], way[1], way[2]));
        assert_same(disc_crossings(&disc, &ray, &ALL_CROSSINGS, &exact).t[0], 4);
        at[a] = nextafter(2, 3);
        ray.origin = vec3(at[0], at[1], at[2]);
        struct crossings found = disc_crossings(&disc, &ray, &ALL_CROSSINGS, &exact);
        assert_int_equal(count_ahead(&found), 0);
    }
}

static void test_disc_slanted(void **state)
{
    uint64_t random = 3;
    for (int i = 0; i < 20000; i++) {
        struct vec3 normal = vec_normalize(random_vector(&random, 1));
        struct disc disc = {.center = random_vector(&random, 5), .normal = normal, .radius = 2};
        struct vec3 side = vec_normalize(vec_cross(normal, random_vector(&random, 1)));
        double distance = random_between(&random, 0, 4);
        if (fabs(distance - 2) < 1e-6) continue;
        struct ray ray =
            ray_to(random_vector(&random, 20), vec_add_scaled(disc.center, side, distance));
        if (fabs(vec_dot(vec_normalize(ray.direction), normal)) < 1e-3) continue;
        struct crossings found = disc_crossings(&disc, &ray, &ALL_CROSSINGS, &exact);
        assert_int_equal(count_ahead(&found), distance < 2);
        if (distance < 2) assert_near(found.t[0], 1, 1e-10);
    }
}

/* What is left out for a purpose does not matter for it. */
static void test_disc_for_a_purpose(void **state)
{
    uint64_t random = 17;
    unsigned count = 100000, met = 0;
    for (unsigned i = 0; i < count; i++) {
        double size = ldexp(1, random_below(&random, 4) ? 0 : random_exponent(&random, -390, 390));
        struct disc disc = {.center = random_vector(&random, size),
                            .normal = vec_normalize(random_vector(&random, 1)),
                            .radius = size};
        struct vec3 aside = vec_cross(disc.normal, random_vector(&random, 1));
        double height = random_between(&random, -1, 1) * pow(10, -random_between(&random, 0, 17));
        struct vec3 at = vec_add_scaled(disc.center, aside, size);
        at = vec_add_scaled(at, disc.normal, size * height);
        struct ray ray = ray_along(at, random_vector(&random, 1));
        double t = disc_crossings(&disc, &ray, &ALL_CROSSINGS, &exact).t[0];
        double off = random_between(&random, -1, 1) * pow(10, -random_between(&random, 0, 17));
        struct purpose purpose = {random_below(&random, 2), fabs(t) * (1 + off)};
        bool counts = t > 0 && t < purpose.farthest;
        double found = disc_crossings(&disc, &ray, &purpose, &exact).t[0];
        assert_true(counts == (found > 0 && found < purpose.farthest));
        if (counts && !purpose.any) assert_same(found, t);
        met += counts;
    }
    assert_true(met > count / 20);
}

static void test_disc_bounds(void **state)
{
    struct bounds bounds = disc_bounds(&coin);
    assert_same(bounds.min[0], -1);
    assert_same(bounds.max[0], 3);
    assert_same(bounds.min[2], 0);
    assert_same(bounds.max[2], 0);
    struct disc slanted = {.normal = {0.6, 0.8, 0}, .radius = 10};
    bounds = disc_bounds(&slanted);
    assert_near(bounds.max[0], 8, 1e-14);
    assert_near(bounds.max[1], 6, 1e-14);
    assert_near(bounds.max[2], 10, 1e-14);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plane_from_both_sides),
        cmocka_unit_test(test_parallel),
        cmocka_unit_test(test_disc_rim),
        cmocka_unit_test(test_disc_rim_along_axes),
        cmocka_unit_test(test_disc_slanted),
        cmocka_unit_test(test_disc_for_a_purpose),
        cmocka_unit_test(test_disc_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
