/* Tests of duplicates: primitives that coincide with an earlier one are left out, which changes no picture. */
#include "test/scene_fixture.h"

#include "test/view_fixture.h"

#define EDGE 24u

/* ---- what is left out ---- */

/* Adds copies of a face, with corners in another order and with other indices, and equal balls of two materials. */
static void add_some_twice(struct builder *builder, uint32_t matt, uint32_t other)
{
    uint32_t v[6];
    for (unsigned i = 0; i < 6; i++)
        v[i] = add_vertex(builder, vec3(i % 3 == 1, i % 3 == 2, 0));
    const struct triangle faces[] = {{{v[0], v[1], v[2]}, matt},
                                     {{v[2], v[1], v[0]}, other},
                                     {{v[0], v[1], v[1]}, matt},
                                     {{v[3], v[4], v[3]}, matt},
                                     {{v[4], v[5], v[3]}, matt}};
    const struct sphere balls[] = {{{1, 2, 3}, 3, matt, 0},
                                   {{1, 2, 3}, 4, matt, 0},
                                   {{1, 2, 3}, 4, other, 0},
                                   {{1, 2, 3}, 4, matt, 1}};
    for (size_t i = 0; i < sizeof faces / sizeof *faces; i++)
        assert_added(builder_add_triangle(builder, &faces[i]));
    for (size_t i = 0; i < sizeof balls / sizeof *balls; i++)
        assert_added(builder_add_sphere(builder, &balls[i]));
    assert_int_equal(builder_primitive_count(builder), 9);
}

static struct scene *some_twice(uint32_t variant, uint32_t formulas, double transmission)
{
    struct builder *builder = builder_create();
    uint32_t matt = add_material(builder, vec3(1, 1, 1), 0),
             other = add_material(builder, vec3(1, 0, 0), transmission);
    add_some_twice(builder, matt, other);
    struct view view = small_view(EDGE);
    view.variant = variant;
    view.formulas = formulas;
    struct scene *scene = finish_in_view(builder, &view);
    const char *why = "";
    if (!scene_valid(scene, scene->bytes, &why)) fail_msg("%s", why);
    return scene;
}

static void test_the_first_of_equals_is_left(void **state)
{
    struct scene *scene = some_twice(VARIANT_AUTO, FORMULAS_EXACT, 0);
    const struct triangle *faces = scene_triangles(scene);
    const struct sphere *balls = scene_spheres(scene);
    assert_int_equal(scene->primitives[PRIMITIVE_TRIANGLE].count, 3);
    assert_int_equal(scene->primitives[PRIMITIVE_SPHERE].count, 3);
    assert_int_equal(scene->materials.count, 1);
    assert_int_equal(scene->vertices.count, 5);
    assert_int_equal(faces[0].vertex[2], 2);
    assert_int_equal(faces[1].vertex[2], 1);
    assert_true(scene_vertices(scene)[faces[2].vertex[1]].x == 1);
    assert_true(balls[0].radius == 3 && balls[1].radius == 4 && balls[2].inside_only);
    free(scene);
}

/* Where light passes, by the paper's formulas, and where nothing is to be left out. */
static void test_all_are_left(void **state)
{
    struct scene *scene = some_twice(VARIANT_AUTO, FORMULAS_EXACT, 0.5);
    assert_int_equal(scene->primitives[PRIMITIVE_TRIANGLE].count, 4);
    assert_int_equal(scene->primitives[PRIMITIVE_SPHERE].count, 4);
    free(scene);
    scene = some_twice(VARIANT_FULL, FORMULAS_EXACT, 0);
    assert_int_equal(scene_primitive_count(scene), 9);
    free(scene);
    scene = some_twice(VARIANT_AUTO, FORMULAS_PAPER, 0);
    assert_int_equal(scene_primitive_count(scene), 9);
    free(scene);
}

static void test_many_of_each_kind(void **state)
{
    struct builder *builder = builder_create();
    uint32_t material = add_material(builder, vec3(1, 1, 1), 0);
    for (uint32_t i = 0; i < 5000; i++) {
        double x = i % 1000;
        struct plane plane = {.point = {x, 0, 0}, .normal = {0, 1, 0}, .material = material};
        struct disc disc = {{x, 0, 0}, {0, 1, 0}, 1, material, 0};
        struct cone cone = {{x, 0, 0}, {x, 1, 0}, 1, 0, material, 1};
        assert_added(builder_add_plane(builder, &plane));
        assert_added(builder_add_disc(builder, &disc));
        assert_added(builder_add_cone(builder, &cone));
        add_box(builder, vec3(x, 0, 0), vec3(x + 1, 1, 1), material);
    }
    struct view view = small_view(EDGE);
    struct scene *scene = finish_in_view(builder, &view);
    for (int kind = PRIMITIVE_BOX; kind < PRIMITIVE_KINDS; kind++)
        assert_int_equal(scene->primitives[kind].count, 1000);
    for (uint32_t i = 0; i < 1000; i++)
        assert_true(scene_planes(scene)[i].point.x == i && scene_cones(scene)[i].base.x == i);
    free(scene);
}

/* A face with vertices of its own; the turn says which of its corners comes first. */
static void add_face(struct builder *builder, uint32_t number, uint32_t turn, uint32_t normal)
{
    uint32_t v[3];
    for (uint32_t i = 0; i < 3; i++) {
        uint32_t corner = (i + turn) % 3;
        v[i] = add_vertex(builder, vec3(number, corner == 1, corner == 2));
    }
    struct triangle triangle = {{v[0], v[1], v[2]}, 0};
    struct patch patch = {{v[0], v[1], v[2]}, {normal, normal, normal}, 0};
    assert_added(builder_add_triangle(builder, &triangle));
    assert_added(builder_add_patch(builder, &patch));
}

/* Each face at once and again after all others, when what has been left out has moved those in between. */
static void test_many_faces(void **state)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    uint32_t normal = add_normal(builder, vec3(1, 0, 0));
    for (uint32_t i = 0; i < 3000; i++)
        add_face(builder, i < 2000 ? i / 2 : i - 2000, i % 3, normal);
    struct view view = small_view(EDGE);
    struct scene *scene = finish_in_view(builder, &view);
    assert_int_equal(scene->primitives[PRIMITIVE_TRIANGLE].count, 1000);
    assert_int_equal(scene->primitives[PRIMITIVE_PATCH].count, 1000);
    for (uint32_t i = 0; i < 1000; i++) {
        assert_true(scene_vertices(scene)[scene_triangles(scene)[i].vertex[0]].x == i);
        assert_true(scene_vertices(scene)[scene_patches(scene)[i].vertex[0]].x == i);
    }
    free(scene);
}

/* ---- pictures ---- */

/* 2^64 / the golden ratio: turns consecutive numbers into unrelated states of random_below(). */
#define SPREAD UINT64_C(0x9e3779b97f4a7c15)

/* Adds a primitive on a lattice, which depends on `random` alone, so that many are coplanar with others. */
static void add_something(struct builder *builder, uint64_t random, uint32_t material,
                          unsigned turn)
{
    struct vec3 at[3];
    for (int i = 0; i < 3; i++)
        at[i] = vec3(random_below(&random, 5) - 2.0, random_below(&random, 5) - 2.0,
                     random_below(&random, 5) - 2.0);
    struct vec3 away = vec_add(at[0], vec3(1, 1 + random_below(&random, 2), 1));
    struct disc disc = {at[0], {0, 0, 1}, 1, material, 0};
    struct cone cone = {
        at[0], away, 0.5, 0.25 * random_below(&random, 3), material, random_below(&random, 2)};
    struct plane plane = {.point = {0, -2, 0}, .normal = {0, 1, 0}, .material = material};
    struct patch patch = {.material = material};
    switch (random_below(&random, PRIMITIVE_KINDS)) {
    case PRIMITIVE_TRIANGLE:
        add_triangle(builder, at[turn % 3], at[(turn + 1 + turn / 3) % 3],
                     at[(turn + 2 - turn / 3) % 3], material);
        break;
    case PRIMITIVE_PATCH:
        for (unsigned i = 0; i < 3; i++) {
            patch.vertex[i] = add_vertex(builder, at[(i + turn) % 3]);
            patch.normal[i] = add_normal(builder, vec3(0.1 * turn, 0.2 * i, 1));
        }
        assert_added(builder_add_patch(builder, &patch));
        break;
    case PRIMITIVE_SPHERE:
        add_sphere(builder, at[0], 1, material);
        break;
    case PRIMITIVE_BOX:
        add_box(builder, at[0], away, material);
        break;
    case PRIMITIVE_CONE:
        assert_added(builder_add_cone(builder, &cone));
        break;
    case PRIMITIVE_DISC:
        assert_added(builder_add_disc(builder, &disc));
        break;
    default:
        assert_added(builder_add_plane(builder, &plane));
    }
}

/* Some primitives, each up to three times, in random order and of another material each time. */
static struct builder *things_again(uint64_t seed)
{
    struct builder *builder = builder_create();
    uint32_t materials[4];
    for (unsigned i = 0; i < 4; i++) {
        struct material material = {.color = {0.9, 0.9 - 0.2 * i, 0.2 + 0.2 * i},
                                    .ambient = 0.1,
                                    .diffuse = 0.5,
                                    .specular = 0.2,
                                    .shininess = 20,
                                    .reflection = i % 2 ? 0.6 : 0,
                                    .transmission = i == 3 ? 0.4 : 0,
                                    .ior = 1.5};
        assert_added(builder_add_material(builder, &material, &materials[i]));
    }
    uint64_t random = seed * SPREAD;
    for (unsigned i = 0; i < 40; i++) {
        uint64_t thing = seed * 16 + random_below(&random, 16);
        uint32_t material = materials[random_below(&random, 4)];
        add_something(builder, thing * SPREAD, material, random_below(&random, 6));
    }
    struct light lights[] = {{{3, 5, 6}, {0.7, 0.7, 0.7}}, {{-2, 2, 4}, {0.3, 0.3, 0.3}}};
    assert_added(builder_add_light(builder, &lights[0]));
    assert_added(builder_add_light(builder, &lights[1]));
    return builder;
}

/* What pruning leaves out depends on what could be seen, which a duplicate must not change. */
static uint64_t render_things(uint64_t seed, uint32_t variant, float *rgb, double *truncation)
{
    struct builder *builder = things_again(seed);
    struct view view = small_view(EDGE);
    view.variant = variant;
    view.max_depth = 6;
    view.cutoff = (double)(seed % 3) / 32;
    struct scene *scene = builder_finish(builder, &view);
    struct bvh *bvh = build_tree(scene);
    struct renderer *renderer = renderer_create(scene, bvh);
    struct tile tile = {.w = EDGE, .h = EDGE, .step = 1};
    struct render_counts counts;
    uint64_t count = scene_primitive_count(scene);
    renderer_tile(renderer, &tile, rgb, &counts);
    *truncation = counts.truncation;
    renderer_destroy(renderer);
    free(bvh);
    free(scene);
    builder_destroy(builder);
    return count;
}

static void test_pictures_are_the_same(void **state)
{
    static float all[EDGE * EDGE * 3], some[EDGE * EDGE * 3];
    uint64_t dropped = 0;
    for (uint64_t seed = 1; seed <= 150; seed++) {
        double all_lack, some_lack;
        uint64_t added = render_things(seed, VARIANT_FULL, all, &all_lack);
        dropped += added - render_things(seed, VARIANT_AUTO, some, &some_lack);
        if (memcmp(all, some, sizeof all) != 0 || all_lack != some_lack)
            fail_msg("scene %d", (int)seed);
    }
    assert_true(dropped > 150 * 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_first_of_equals_is_left), cmocka_unit_test(test_all_are_left),
        cmocka_unit_test(test_many_of_each_kind),           cmocka_unit_test(test_many_faces),
        cmocka_unit_test(test_pictures_are_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
