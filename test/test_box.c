#include "scene_fixture.h"

#include "worker/box.h"

static uint64_t exact; /* counts what the tests do not look at */

static const struct box brick = {.min = {0, 0, 0}, .max = {4, 2, 1}};

static void assert_crossings(struct ray ray, double enter, uint32_t enter_part, double leave,
                             uint32_t leave_part)
{
    struct crossings found = box_crossings(&brick, &ray, false, &exact);
    assert_same(found.t[0], enter);
    assert_same(found.t[1], leave);
    assert_int_equal(found.part[0], enter_part);
    assert_int_equal(found.part[1], leave_part);
}

static void assert_missed(struct ray ray)
{
    struct crossings found = box_crossings(&brick, &ray, false, &exact);
    assert_int_equal(count_ahead(&found), 0);
}

static void test_faces(void **state)
{
    assert_crossings(ray_along(vec3(-2, 1, 0.5), vec3(2, 0, 0)), 1, 0, 3, 1);
    assert_crossings(ray_along(vec3(6, 1, 0.5), vec3(-2, 0, 0)), 1, 1, 3, 0);
    assert_crossings(ray_along(vec3(1, -1, 0.5), vec3(0, 1, 0)), 1, 2, 3, 3);
    assert_crossings(ray_along(vec3(1, 1, 3), vec3(0, 0, -1)), 2, 5, 3, 4);
    assert_crossings(ray_along(vec3(-1, 1, 0.5), vec3(1, 0.5, 0)), 1, 0, 2, 3);
}

static void test_inside_behind_beside(void **state)
{
    assert_crossings(ray_along(vec3(1, 1, 0.5), vec3(1, 0, 0)), -1, 0, 3, 1);
    assert_missed(ray_along(vec3(5, 1, 0.5), vec3(1, 0, 0)));
    assert_missed(ray_along(vec3(-1, 3, 0.5), vec3(1, 0, 0)));
    assert_missed(ray_along(vec3(-1, 3, 0.5), vec3(1, 0.1, 0)));
}

/* Axis-aligned rays in a face, with zeros of both signs: the box is closed, and t is never NaN. */
static void test_rays_in_faces(void **state)
{
    const double zeros[] = {0.0, -0.0};
    for (int i = 0; i < 4; i++) {
        double y = zeros[i & 1], z = zeros[i >> 1];
        assert_crossings(ray_along(vec3(-1, 0, 0.5), vec3(1, y, z)), 1, 0, 5, 1);
        assert_crossings(ray_along(vec3(-1, 2, 0.5), vec3(1, y, z)), 1, 0, 5, 1);
        assert_crossings(ray_along(vec3(-1, 2, 1), vec3(1, y, z)), 1, 0, 5, 1);
        assert_missed(ray_along(vec3(-1, nextafter(2, 3), 1), vec3(1, y, z)));
        assert_missed(ray_along(vec3(-1, -0x1p-1070, 1), vec3(1, y, z)));
    }
}

static void test_tiny_direction(void **state)
{
    assert_crossings(ray_along(vec3(-0x1p-30, 1, 0.5), vec3(0x1p-1060, 0, 0)), INFINITE, 0,
                     INFINITE, 0);
    struct ray ray = ray_along(vec3(-1, 1, 0.5), vec3(1, 0x1p-1060, 0));
    assert_crossings(ray, 1, 0, 5, 1);
}

static void test_leaving(void **state)
{
    struct ray ray = ray_along(vec3(0, 1, 0.5), vec3(1, 0, 0));
    ray.from_part = 0;
    struct crossings found = box_crossings(&brick, &ray, true, &exact);
    assert_int_equal(count_ahead(&found), 1);
    assert_same(found.t[1], 4);
    assert_int_equal(found.part[1], 1);
    ray.direction.x = -1;
    found = box_crossings(&brick, &ray, true, &exact);
    assert_int_equal(count_ahead(&found), 0);
    ray.direction = vec3(0, 1, 0);
    found = box_crossings(&brick, &ray, true, &exact);
    assert_int_equal(count_ahead(&found), 0);
}

/* The origin of a ray that leaves a face may have been rounded to either side of the face. */
static void test_leaving_is_not_an_epsilon(void **state)
{
    for (double x = nextafter(4, 0); x <= nextafter(4, 5); x = nextafter(x, 5)) {
        struct ray out = ray_along(vec3(x, 1, 0.5), vec3(1, 0, 0));
        out.from_part = 1;
        struct crossings found = box_crossings(&brick, &out, true, &exact);
        assert_int_equal(count_ahead(&found), 0);
        struct ray in = ray_along(vec3(x, 1, 0.5), vec3(-1, 0, 0));
        in.from_part = 1;
        found = box_crossings(&brick, &in, true, &exact);
        assert_int_equal(count_ahead(&found), 1);
        assert_near(found.t[1], 4, 1e-15);
        assert_int_equal(found.part[1], 0);
    }
}

static void test_sheet(void **state)
{
    struct box sheet = {.min = {0, 1, 0}, .max = {4, 1, 4}};
    struct ray ray = ray_along(vec3(1, 3, 1), vec3(0, -1, 0));
    struct crossings found = box_crossings(&sheet, &ray, false, &exact);
    assert_int_equal(count_ahead(&found), 1);
    assert_same(found.t[0], 2);
    assert_int_equal(found.part[0], 3);
    ray = ray_along(vec3(1, 1, 1), vec3(0, -1, 0));
    ray.from_part = 3;
    found = box_crossings(&sheet, &ray, true, &exact);
    assert_int_equal(count_ahead(&found), 0);
}

static void test_normals(void **state)
{
    assert_vector_near(box_normal(0), vec3(-1, 0, 0), 0);
    assert_vector_near(box_normal(3), vec3(0, 1, 0), 0);
    assert_vector_near(box_normal(4), vec3(0, 0, -1), 0);
}

static void test_in_and_out_together(void **state)
{
    uint64_t random = 4;
    for (int i = 0; i < 20000; i++) {
        struct ray ray =
            ray_to(vec3(-10, random_between(&random, -9, 9), 8), random_vector(&random, 5));
        struct crossings found = box_crossings(&brick, &ray, false, &exact);
        if (count_ahead(&found) == 0) continue;
        assert_int_equal(count_ahead(&found), 2);
        struct vec3 middle =
            vec_add_scaled(ray.origin, ray.direction, (found.t[0] + found.t[1]) / 2);
        assert_near(middle.x, 2, 2 + 1e-12);
        assert_near(middle.y, 1, 1 + 1e-12);
        assert_near(middle.z, 0.5, 0.5 + 1e-12);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_faces),
        cmocka_unit_test(test_inside_behind_beside),
        cmocka_unit_test(test_rays_in_faces),
        cmocka_unit_test(test_tiny_direction),
        cmocka_unit_test(test_leaving),
        cmocka_unit_test(test_leaving_is_not_an_epsilon),
        cmocka_unit_test(test_sheet),
        cmocka_unit_test(test_normals),
        cmocka_unit_test(test_in_and_out_together),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
