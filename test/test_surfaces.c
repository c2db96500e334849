/* Tests of the surface at a hit, and of rays that start there where surfaces touch. */
#include "scene_fixture.h"

/* ---- surfaces ---- */

static struct surface surface_of(const struct scene *scene, const struct ray *ray)
{
    struct bvh *bvh = build_tree(scene);
    struct hit hit = nearest_of(scene, bvh, ray);
    struct surface surface;
    assert_true(hit.primitive != PRIMITIVE_NONE);
    surface_at(scene, ray, &hit, &surface);
    free(bvh);
    return surface;
}

static void test_surface_of_solids(void **state)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    uint32_t material = add_material(builder, vec3(1, 1, 1), 0);
    add_sphere(builder, vec3(0, 0, 0), 1, material);
    add_box(builder, vec3(4, -1, -1), vec3(6, 1, 1), 0);
    struct cone rod = {{10, 0, -1}, {10, 0, 1}, 1, 1, 0, 1};
    struct disc disc = {{20, 0, 0}, {0, 0, -1}, 1, 0, 0};
    assert_added(builder_add_cone(builder, &rod));
    assert_added(builder_add_disc(builder, &disc));
    struct scene *scene = finish_scene(builder);
    const struct vec3 normals[] = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, -1}};
    const double x[] = {0, 5, 10, 20}, z[] = {1, 1, 1, 0};
    for (int i = 0; i < 4; i++) {
        struct ray ray = ray_along(vec3(x[i], 0, 5), vec3(0, 0, -2));
        struct surface surface = surface_of(scene, &ray);
        assert_vector_near(surface.point, vec3(x[i], 0, z[i]), 4 * 0x1p-53 * fmax(x[i], 1));
        assert_true(surface.point.z > z[i]); /* where the ray came from */
        assert_vector_near(surface.geometric, normals[i], 1e-15);
        assert_vector_near(surface.shading, normals[i], 1e-15);
        assert_int_equal(surface.material, i == 0 ? material : 0);
    }
    struct ray side = ray_along(vec3(10, 5, 0), vec3(0, -1, 0));
    assert_vector_near(surface_of(scene, &side).geometric, vec3(0, 1, 0), 1e-15);
    struct ray inside = ray_along(vec3(0, 0, 0), vec3(0, 1, 0));
    assert_vector_near(surface_of(scene, &inside).geometric, vec3(0, 1, 0), 1e-15);
    free(scene);
}

static struct scene *one_patch(struct vec3 second_normal)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    const struct vec3 corners[3] = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    struct patch patch = {.material = 0};
    for (unsigned k = 0; k < 3; k++) {
        patch.vertex[k] = add_vertex(builder, corners[k]);
        patch.normal[k] = add_normal(builder, k == 1 ? second_normal : vec3(0, 0, 1));
    }
    assert_added(builder_add_patch(builder, &patch));
    return finish_scene(builder);
}

static void test_surface_of_patch(void **state)
{
    struct ray ray = ray_along(vec3(2, 0.5, 3), vec3(0, 0, -1)); /* weights 3/8, 1/2, 1/8 */
    struct scene *scene = one_patch(vec3(1, 0, 0));
    struct surface surface = surface_of(scene, &ray);
    assert_vector_near(surface.geometric, vec3(0, 0, 1), 0);
    assert_vector_near(surface.shading, vec3(sqrt(0.5), 0, sqrt(0.5)), 1e-15);
    free(scene);
    scene = one_patch(vec3(0, 0, -1)); /* normals that cancel */
    surface = surface_of(scene, &ray);
    assert_vector_near(surface.shading, vec3(0, 0, 1), 0);
    free(scene);
}

/* The point of a hit from far away lies on the surface, more accurately than the distance is known. */
static void test_surface_from_far_away(void **state)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_triangle(builder, vec3(0, 0, 1), vec3(1, 0, 0), vec3(0, 1, 0), 0);
    add_sphere(builder, vec3(-3, 0, 0), 1, 0);
    struct scene *scene = finish_scene(builder);
    struct vec3 eye = vec3(3e9, 2e9, 1e9);
    struct ray ray = ray_to(eye, vec3(0.3, 0.3, 0.4));
    struct surface surface = surface_of(scene, &ray);
    assert_near(surface.point.x + surface.point.y + surface.point.z, 1, 1e-15);
    ray = ray_to(eye, vec3(-3, 0, 0));
    surface = surface_of(scene, &ray);
    struct vec3 radius = vec_sub(surface.point, vec3(-3, 0, 0));
    assert_near(vec_length(radius), 1, 1e-15);
    assert_vector_near(surface.geometric, radius, 1e-15);
    free(scene);
}

/* For a ground sphere of the size of a planet, the point is more accurate if computed from the eye. */
static void test_surface_of_ground_sphere(void **state)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_sphere(builder, vec3(0, -1e9, 0), 1e9, 0);
    struct scene *scene = finish_scene(builder);
    struct ray ray = ray_along(vec3(0, 2, 0), vec3(1, -1, 0));
    struct surface surface = surface_of(scene, &ray);
    /* x^2 + (y + R)^2 = R^2 on y = 2 - x: x = 2 + 2e-9 to first order in 1 / R */
    assert_near(surface.point.x, 2 + 2e-9, 1e-14);
    assert_near(surface.point.y, -2e-9, 1e-14);
    free(scene);
}

static struct scene *one_triangle(const struct vec3 corners[3], int exponent)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_triangle(builder, vec_scale_exactly(corners[0], exponent),
                 vec_scale_exactly(corners[1], exponent), vec_scale_exactly(corners[2], exponent),
                 0);
    return finish_scene(builder);
}

/* A triangle that is larger than the way to it has a point with the same bits at any scale. */
static void test_surface_of_scaled_triangle(void **state)
{
    static const int exponents[] = {-900, -500, -360, 400, 900};
    uint64_t random = 1;
    for (int i = 0; i < 1000; i++) {
        struct vec3 at[3] = {random_vector(&random, 1), random_vector(&random, 1),
                             random_vector(&random, 1)};
        double u = random_between(&random, 0, 1), v = random_between(&random, 0, 1 - u);
        struct vec3 way = random_vector(&random, 0.1), to = vec_scale(at[0], 1 - u - v);
        to = vec_add_scaled(vec_add_scaled(to, at[1], u), at[2], v);
        struct ray ray = ray_along(vec_sub(to, way), vec_normalize(way));
        struct hit hit = {vec_length(way), u, v, primitive_id(PRIMITIVE_TRIANGLE, 0), 0, 0};
        struct surface here, there;
        struct scene *scene = one_triangle(at, 0);
        surface_at(scene, &ray, &hit, &here);
        free(scene);
        int exponent = exponents[i % 5];
        scene = one_triangle(at, exponent);
        ray.origin = vec_scale_exactly(ray.origin, exponent);
        hit.t = ldexp(hit.t, exponent);
        surface_at(scene, &ray, &hit, &there);
        free(scene);
        assert_vector_near(vec_scale_exactly(there.point, -exponent), here.point, 0);
        assert_vector_near(there.geometric, here.geometric, 0);
    }
}

/* Some have coordinates that overflow at the size of 1, or become 0. */
static void test_surface_of_extreme_triangle(void **state)
{
    (void)state;
    const struct vec3 corners[][3] = {
        {{1e160, -1e-160, -1e-160}, {1e160, 1e-160, -1e-160}, {1e160, 0, 1e-160}},
        {{0, 0, 0}, {0, 1e200, 0}, {0, 0, 1e-130}}};
    const struct hit hit = {1, 0.25, 0.25, primitive_id(PRIMITIVE_TRIANGLE, 0), 0, 0};
    for (int i = 0; i < 2; i++) {
        struct ray ray = ray_along(vec3(corners[i][0].x - 1, 0, 0), vec3(1, 0, 0));
        struct surface surface;
        struct scene *scene = one_triangle(corners[i], 0);
        surface_at(scene, &ray, &hit, &surface);
        assert_near(surface.point.x, corners[i][0].x, 1e185);
        assert_vector_near(surface.geometric, vec3(1, 0, 0), 0);
        free(scene);
    }
}

/* ---- surfaces that touch ---- */

static struct ray going_on(const struct scene *scene, const struct ray *ray, const struct hit *hit,
                           struct vec3 direction)
{
    struct surface surface;
    surface_at(scene, ray, hit, &surface);
    return ray_going_on(surface.point, hit, direction);
}

/* A ray through the common edge of two triangles, at any angle between them, is one passage. */
static void test_one_passage_at_an_edge(void **state)
{
    uint64_t random = 17;
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 1);
    const struct vec3 corners[4] = {{0, 0, 2}, {1, 0, 2}, {1, 1, 2}, {0, 1, 2}};
    for (unsigned k = 0; k < 4; k++)
        add_vertex(builder, corners[k]);
    assert_added(builder_add_triangle(builder, &(struct triangle){{0, 1, 2}, 0}));
    assert_added(builder_add_triangle(builder, &(struct triangle){{0, 2, 3}, 0}));
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    for (int i = 0; i < 2000; i++) {
        double along = random_between(&random, 0.1, 0.9);
        struct ray ray = ray_along(vec3(along, along, 0), vec3(0, 0, 1));
        struct hit hit = nearest_of(scene, bvh, &ray);
        assert_true(hit.primitive != PRIMITIVE_NONE);
        struct vec3 bent = random_vector(&random, 1);
        ray = going_on(scene, &ray, &hit, vec3(bent.x, bent.y, 0.1 + fabs(bent.z)));
        assert_int_equal(nearest_of(scene, bvh, &ray).primitive, PRIMITIVE_NONE);
    }
    free(bvh);
    free(scene);
}

/* Rounded distances decide which face of a far box is entered near its edge; the point must be on the box
 * nevertheless. */
static void test_edge_of_a_far_box(void **state)
{
    const struct vec3 min = {0x1p40 + 2, -4, -3}, max = {0x1p40 + 3, -2, -1};
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_box(builder, min, max, 0);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    const struct ray ray =
        ray_along(vec3(806973078284459.75, -805873566654852.5, -402936783327793.69),
                  vec3(-2199023255559, 2199023255554, 1099511627778));
    struct hit hit = nearest_of(scene, bvh, &ray);
    assert_int_equal(hit.primitive, primitive_id(PRIMITIVE_BOX, 0));
    struct surface surface;
    surface_at(scene, &ray, &hit, &surface);
    assert_true(fabs(surface.point.x - max.x) <= 0x1p-11);
    assert_true(surface.point.y >= min.y && surface.point.y <= max.y);
    assert_true(surface.point.z >= min.z && surface.point.z <= max.z);
    free(bvh);
    free(scene);
}

/* A box of glass on a floor with a plane and one of triangles: out of the box, then the floor; up
 * from the floor nothing but the box's way out. */
static void test_box_on_a_floor(void **state)
{
    uint64_t random = 18;
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 1);
    add_box(builder, vec3(-1, 0, -1), vec3(1, 1, 1), 0);
    struct plane plane = {.normal = {0, 1, 0}};
    assert_added(builder_add_plane(builder, &plane));
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    uint32_t box = primitive_id(PRIMITIVE_BOX, 0), floor = primitive_id(PRIMITIVE_PLANE, 0);
    for (int i = 0; i < 2000; i++) {
        struct vec3 target =
            vec3(random_between(&random, -0.9, 0.9), 0, random_between(&random, -0.9, 0.9));
        struct ray ray = ray_to(vec_add(target, vec3(0.05, 2, 0.03)), target);
        struct vec3 down = ray.direction;
        struct hit hit = nearest_of(scene, bvh, &ray);
        assert_int_equal(hit.primitive, box);
        ray = going_on(scene, &ray, &hit, down);
        hit = nearest_of(scene, bvh, &ray);
        assert_int_equal(hit.primitive, box);
        ray = going_on(scene, &ray, &hit, down);
        hit = nearest_of(scene, bvh, &ray);
        assert_int_equal(hit.primitive, floor);
        ray = going_on(scene, &ray, &hit, vec_neg(down));
        hit = nearest_of(scene, bvh, &ray);
        assert_int_equal(hit.primitive, box);
        assert_near(hit.t, 0.5, 1e-14);
    }
    free(bvh);
    free(scene);
}

/* Surfaces closer to each other than the rounding of distances have their exact order. */
static void test_order_of_near_surfaces(void **state)
{
    uint64_t random = 19;
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (int i = 0; i < 8; i++) {
        struct disc disc = {.normal = {0, 0, 1}, .center = {0, 0, (7 - i) * 0x1p-60}, .radius = 1};
        assert_added(builder_add_disc(builder, &disc));
    }
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    for (int i = 0; i < 2000; i++) {
        struct vec3 eye = random_vector(&random, 9);
        if (eye.z == 0) continue;
        struct ray ray = ray_along(eye, vec_neg(vec_scale(eye, random_between(&random, 0.1, 3))));
        uint32_t first = primitive_id(PRIMITIVE_DISC, eye.z > 0 ? 0 : 7);
        assert_int_equal(nearest_of(scene, bvh, &ray).primitive, first);
    }
    free(bvh);
    free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_surface_of_solids),
        cmocka_unit_test(test_surface_of_patch),
        cmocka_unit_test(test_surface_from_far_away),
        cmocka_unit_test(test_surface_of_ground_sphere),
        cmocka_unit_test(test_surface_of_scaled_triangle),
        cmocka_unit_test(test_surface_of_extreme_triangle),
        cmocka_unit_test(test_one_passage_at_an_edge),
        cmocka_unit_test(test_box_on_a_floor),
        cmocka_unit_test(test_edge_of_a_far_box),
        cmocka_unit_test(test_order_of_near_surfaces),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
