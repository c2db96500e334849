/* Tests of the builder: what it accepts and refuses, and the block that it makes. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "master/builder.h"
#include "master/load.h"
#include "master/outline.h"
#include "test/unit.h"

static struct material plain(void)
{
    return (struct material){.color = {0.5, 0.5, 0.5}, .diffuse = 1, .shininess = 10, .ior = 1};
}

static uint32_t add_material(struct builder *builder, double reflection)
{
    struct material material = plain();
    material.reflection = reflection;
    uint32_t index;
    assert_null(builder_add_material(builder, &material, &index));
    return index;
}

static struct view some_view(void)
{
    struct settings settings;
    settings_init(&settings);
    settings.camera.eye = vec3(0, 0, 5);
    struct view view = settings_view(&settings);
    settings_free(&settings);
    return view;
}

/* A builder with one of everything, and an unused material among the used ones. */
static struct builder *fill(void)
{
    struct builder *b = builder_create();
    uint32_t matt = add_material(b, 0), unused = add_material(b, 0.5),
             mirror = add_material(b, 0.7);
    assert_int_equal(unused, 1);
    uint32_t v[3], n;
    for (int i = 0; i < 3; i++)
        assert_null(builder_add_vertex(b, vec3(i == 1, i == 2, 0), &v[i]));
    assert_null(builder_add_normal(b, vec3(0, 0, 3), &n));
    struct triangle triangle = {{v[0], v[1], v[2]}, mirror};
    struct patch patch = {{v[0], v[1], v[2]}, {n, n, n}, matt};
    struct sphere sphere = {.center = {5, 0, 0}, .radius = 2, .material = mirror};
    struct plane plane = {.normal = {0, 2, 0}, .material = matt};
    struct disc disc = {.normal = {0, 0, -3}, .radius = 1, .material = matt};
    struct box box = {.min = {-3, -1, -1}, .max = {-2, 1, 1}, .material = matt};
    struct cone cone = {.base = {0, 0, 0}, .apex = {0, 9, 0}, .base_radius = 1, .material = matt};
    struct light light = {{1, 2, 3}, {1, 1, 1}};
    assert_null(builder_add_triangle(b, &triangle));
    assert_null(builder_add_patch(b, &patch));
    assert_null(builder_add_sphere(b, &sphere));
    assert_null(builder_add_plane(b, &plane));
    assert_null(builder_add_disc(b, &disc));
    assert_null(builder_add_box(b, &box));
    assert_null(builder_add_cone(b, &cone));
    assert_null(builder_add_light(b, &light));
    return b;
}

static void test_block_holds_what_was_added(void **state)
{
    struct builder *builder = fill();
    struct view view = some_view();
    struct scene *scene = builder_finish(builder, &view);
    const char *why = "";
    if (!scene_valid(scene, scene->bytes, &why)) fail_msg("%s", why);
    assert_int_equal(scene_primitive_count(scene), 7);
    assert_int_equal(scene->materials.count, 2);
    assert_true(scene_materials(scene)[1].reflection == 0.7);
    assert_int_equal(scene_triangles(scene)->material, 1);
    assert_int_equal(scene_patches(scene)->material, 0);
    assert_true(scene_planes(scene)->normal.y == 1);
    assert_true(scene_discs(scene)->normal.z == -1);
    assert_true(scene_normals(scene)->z == 1);
    assert_int_equal(primitive_material(scene, primitive_id(PRIMITIVE_SPHERE, 0)), 1);
    assert_int_equal(primitive_material(scene, primitive_id(PRIMITIVE_PLANE, 0)), 0);
    free(scene);
    builder_destroy(builder);
}

static void add_needless(struct builder *b)
{
    struct light black = {{1, 2, 3}, {0, 0, 0}};
    uint32_t lonely, n;
    assert_null(builder_add_light(b, &black));
    assert_null(builder_add_vertex(b, vec3(7, 7, 7), &lonely));
    assert_null(builder_add_normal(b, vec3(1, 0, 0), &n));
    struct triangle last = {{0, 1, 0}, 0};
    assert_null(builder_add_vertex(b, vec3(8, 8, 8), &last.vertex[2]));
    assert_null(builder_add_triangle(b, &last));
}

/* Unused vertices and normals, and black lights, are left out with VARIANT_AUTO. */
static void test_what_nothing_needs_is_not_sent(void **state)
{
    for (uint32_t variant = VARIANT_AUTO; variant <= VARIANT_FULL; variant++) {
        struct builder *builder = fill();
        struct view view = some_view();
        view.variant = variant;
        add_needless(builder);
        struct scene *scene = builder_finish(builder, &view);
        bool full = variant == VARIANT_FULL;
        const char *why = "";
        if (!scene_valid(scene, scene->bytes, &why)) fail_msg("%s", why);
        assert_int_equal(scene->vertices.count, full ? 5 : 4);
        assert_int_equal(scene->normals.count, full ? 2 : 1);
        assert_int_equal(scene->lights.count, full ? 2 : 1);
        const struct triangle *last = &scene_triangles(scene)[1];
        assert_true(scene_vertices(scene)[last->vertex[2]].x == 8);
        assert_true(scene_vertices(scene)[last->vertex[1]].x == 1);
        free(scene);
        builder_destroy(builder);
    }
}

/* If no surface shows light, all lights are left out. */
static void test_lights_that_no_surface_shows(void **state)
{
    struct builder *builder = builder_create();
    struct material mirror = {.reflection = 1, .ior = 1};
    struct sphere sphere = {.radius = 1};
    struct light light = {{1, 2, 3}, {1, 1, 1}};
    struct view view = some_view();
    assert_null(builder_add_material(builder, &mirror, &sphere.material));
    assert_null(builder_add_sphere(builder, &sphere));
    assert_null(builder_add_light(builder, &light));
    struct scene *scene = builder_finish(builder, &view);
    assert_int_equal(scene->lights.count, 0);
    assert_false(scene_features(scene) & (FEATURE_LIGHTS | FEATURE_SHADOWS));
    free(scene);
    builder_destroy(builder);
}

/* Directions of subnormal numbers, whose length has few bits, and of the largest numbers. */
static void test_directions_of_any_length(void **state)
{
    const struct vec3 normals[] = {{3e-320, 4e-320, 0},
                                   {5e-324, 5e-324, 5e-324},
                                   {1e-160, 1e-160, 1e-200},
                                   {1e308, 1e308, -1e308}};
    for (size_t i = 0; i < 4; i++) {
        struct builder *builder = fill();
        struct view view = some_view();
        struct plane plane = {.normal = normals[i]};
        assert_null(builder_add_plane(builder, &plane));
        struct scene *scene = builder_finish(builder, &view);
        const char *why = "";
        if (!scene_valid(scene, scene->bytes, &why)) fail_msg("%s", why);
        free(scene);
        builder_destroy(builder);
    }
}

static void test_same_input_same_bytes(void **state)
{
    struct view view = some_view();
    struct scene *blocks[2];
    for (int i = 0; i < 2; i++) {
        struct builder *builder = fill();
        blocks[i] = builder_finish(builder, &view);
        builder_destroy(builder);
    }
    assert_int_equal(blocks[0]->bytes, blocks[1]->bytes);
    assert_memory_equal(blocks[0], blocks[1], blocks[0]->bytes);
    free(blocks[0]);
    free(blocks[1]);
}

static bool bounds_of(const struct builder *builder, struct vec3 *min, struct vec3 *max)
{
    struct outline *outline = outline_create(builder);
    bool any = outline_bounds(outline, min, max);
    outline_destroy(outline);
    return any;
}

static bool support_of(const struct builder *builder, struct vec3 origin,
                       const struct vec3 directions[3], double support[3])
{
    struct outline *outline = outline_create(builder);
    bool any = outline_support(outline, origin, 3, directions, support);
    outline_destroy(outline);
    return any;
}

static void test_bounds(void **state)
{
    struct vec3 min, max;
    struct builder *builder = builder_create();
    assert_false(bounds_of(builder, &min, &max));
    builder_destroy(builder);
    builder = fill();
    assert_true(bounds_of(builder, &min, &max));
    assert_true(min.x == -3 && max.x == 7 && min.y == -2 && max.y == 9 && min.z == -2);
    builder_destroy(builder);
}

/* The ball, the tip of the cone, a corner of the box, and, aside of its normal, the disc. */
static void test_support(void **state)
{
    const struct vec3 directions[] = {{2, 0, 0}, {1, 1, 0}, {-1, -1, 0}};
    double support[3];
    struct builder *builder = fill();
    assert_true(support_of(builder, vec3(1, 0, 0), directions, support));
    assert_true(support[0] == 12 && support[1] == 8 && support[2] == 5);
    builder_destroy(builder);
    builder = builder_create();
    struct disc disc = {
        .normal = {0, 0.6, 0.8}, .radius = 10, .material = add_material(builder, 0)};
    assert_null(builder_add_disc(builder, &disc));
    assert_true(support_of(builder, vec3(0, 1, 0), directions, support));
    assert_true(support[0] == 20 && fabs(support[1] - (sqrt(164) - 1)) < 1e-12);
    builder_destroy(builder);
}

/* Vertices of triangles and patches count, those that nothing uses do not. */
static void test_bounds_of_mesh(void **state)
{
    struct builder *builder = builder_create();
    struct vec3 min, max;
    uint32_t v[5], n, material = add_material(builder, 0);
    for (int i = 0; i < 5; i++)
        assert_null(builder_add_vertex(builder, vec3(i, i * i, 1), &v[i]));
    assert_null(builder_add_normal(builder, vec3(0, 0, 1), &n));
    assert_false(bounds_of(builder, &min, &max));
    assert_null(builder_add_triangle(builder, &(struct triangle){{v[1], v[2], v[3]}, material}));
    assert_true(bounds_of(builder, &min, &max));
    assert_true(min.x == 1 && max.x == 3 && min.y == 1 && max.y == 9 && min.z == 1 && max.z == 1);
    assert_null(
        builder_add_patch(builder, &(struct patch){{v[0], v[1], v[2]}, {n, n, n}, material}));
    assert_true(bounds_of(builder, &min, &max));
    assert_true(min.x == 0 && max.x == 3 && min.y == 0 && max.y == 9);
    builder_destroy(builder);
}

static void test_refusals(void **state)
{
    struct builder *b = builder_create();
    uint32_t m = add_material(b, 0), index;
    struct sphere spheres[] = {{.radius = 0},
                               {.radius = -1},
                               {.radius = nan("")},
                               {.radius = HUGE_VAL},
                               {.center = {nan(""), 0, 0}, .radius = 1}};
    for (size_t i = 0; i < 5; i++) {
        spheres[i].material = m;
        assert_non_null(builder_add_sphere(b, &spheres[i]));
    }
    struct plane plane = {.material = m};
    struct disc disc = {.radius = 1, .material = m};
    struct box box = {.max = {1, 0, 1}, .material = m};
    struct cone same_ends = {.base_radius = 1, .material = m};
    struct cone no_radius = {.apex = {0, 1, 0}, .material = m};
    struct cone too_long = {
        .base = {-1.7e308, 0, 0}, .apex = {1.7e308, 0, 0}, .base_radius = 1, .material = m};
    assert_non_null(builder_add_plane(b, &plane));
    assert_non_null(builder_add_disc(b, &disc));
    assert_non_null(builder_add_box(b, &box));
    assert_non_null(builder_add_cone(b, &same_ends));
    assert_non_null(builder_add_cone(b, &no_radius));
    assert_non_null(builder_add_cone(b, &too_long));
    assert_non_null(builder_add_normal(b, vec3(0, 0, 0), &index));
    assert_non_null(builder_add_vertex(b, vec3(0, HUGE_VAL, 0), &index));
    struct light light = {{0, 0, 0}, {-1, 0, 0}};
    assert_non_null(builder_add_light(b, &light));
    builder_destroy(b);
}

/* Each number of a material by itself; all of it may be 1. */
static void test_refused_materials(void **state)
{
    struct builder *b = builder_create();
    struct material bad = plain();
    double *const numbers[] = {&bad.color.x, &bad.color.z,    &bad.ambient,
                               &bad.diffuse, &bad.specular,   &bad.shininess,
                               &bad.ior,     &bad.reflection, &bad.transmission};
    const size_t count = sizeof numbers / sizeof *numbers;
    uint32_t index;
    for (size_t i = 0; i < count; i++) {
        const double wrong[] = {-1, nan(""), HUGE_VAL, 1.5};
        for (size_t k = 0; k < (i < count - 2 ? 3 : 4); k++) {
            bad = plain();
            *numbers[i] = wrong[k];
            assert_non_null(builder_add_material(b, &bad, &index));
        }
        *numbers[i] = 1;
        assert_null(builder_add_material(b, &bad, &index));
    }
    bad = plain();
    bad.ior = 0;
    assert_non_null(builder_add_material(b, &bad, &index));
    builder_destroy(b);
}

/* Edges of triangles, with normals or without, have finite lengths. */
static void test_refused_edges(void **state)
{
    struct builder *b = builder_create();
    uint32_t m = add_material(b, 0), v[3], n;
    for (int i = 0; i < 3; i++)
        assert_null(builder_add_vertex(b, vec3(1.7e308 * (i - 1), i, 0), &v[i]));
    assert_null(builder_add_normal(b, vec3(0, 0, 1), &n));
    assert_non_null(builder_add_triangle(b, &(struct triangle){{v[0], v[1], v[2]}, m}));
    assert_non_null(builder_add_patch(b, &(struct patch){{v[0], v[1], v[2]}, {n, n, n}, m}));
    builder_destroy(b);
}

static void test_many(void **state)
{
    struct builder *b = builder_create();
    for (uint32_t i = 0; i < 10000; i++) {
        uint32_t index;
        assert_null(builder_add_vertex(b, vec3(i, 0, 0), &index));
        assert_int_equal(index, i);
    }
    assert_int_equal(builder_vertex_count(b), 10000);
    assert_true(builder_vertex(b, 9999).x == 9999);
    builder_destroy(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_block_holds_what_was_added),
        cmocka_unit_test(test_what_nothing_needs_is_not_sent),
        cmocka_unit_test(test_lights_that_no_surface_shows),
        cmocka_unit_test(test_directions_of_any_length),
        cmocka_unit_test(test_same_input_same_bytes),
        cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_bounds_of_mesh),
        cmocka_unit_test(test_support),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_refused_materials),
        cmocka_unit_test(test_refused_edges),
        cmocka_unit_test(test_many),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
