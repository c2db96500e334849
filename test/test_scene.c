/* Tests of scene_valid() with blocks that are invalid in one place, and of the features of scenes. */
#include "test/scratch.h"

#include <math.h>

static const char text[] = "[camera]\neye = 0 0 9\nlook_at = 0 0 0\n"
                           "[light a]\nposition = 1 2 3\n"
                           "[material m]\nreflection = 0.5\n"
                           "[sphere]\ncenter = 0 0 0\nradius = 1\nmaterial = m\n"
                           "[plane]\npoint = 0 0 0\nnormal = 0 1 0\n"
                           "[disc]\ncenter = 0 0 0\nnormal = 0 1 0\nradius = 1\n"
                           "[box]\nmin = 0 0 0\nmax = 1 1 1\n"
                           "[cone]\nbase = 0 0 0\napex = 0 1 0\nbase_radius = 1\n"
                           "[include p]\nfile = patch.nff\n";
static const char patch[] =
    "pp 3\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\np 3\n0 0 0\n1 0 0\n0 1 0\n";

/* The block, in memory that can be changed; the caller frees it. */
static struct scene *make(void **state)
{
    write_text("scene.ini", text);
    write_text("patch.nff", patch);
    return scratch_scene(*state, "scene.ini", NULL);
}

static void *at(struct scene *scene, const struct scene_span *span)
{
    return (char *)scene + span->offset;
}

static void test_good(void **state)
{
    struct scene *scene = make(state);
    const char *why = "unchanged";
    assert_true(scene_valid(scene, scene->bytes, &why));
    assert_string_equal(why, "unchanged");
    assert_true(scene_valid(scene, scene->bytes, NULL));
    assert_int_equal(scene_primitive_count(scene), 7);
    free(scene);
}

static void test_sizes(void **state)
{
    struct scene *scene = make(state);
    const char *why = NULL;
    assert_false(scene_valid(scene, scene->bytes - 1, &why));
    assert_non_null(why);
    assert_false(scene_valid(scene, 0, NULL));
    assert_false(scene_valid(scene, sizeof *scene - 1, NULL));
    free(scene);
}

/* Changes one place, expects a refusal, and puts it back. */
#define REFUSED(place, value)                                                                      \
    do {                                                                                           \
        __typeof__(place) *p_ = &(place), old_ = *p_;                                              \
        *p_ = (value);                                                                             \
        const char *why_ = NULL;                                                                   \
        assert_false(scene_valid(scene, scene->bytes, &why_));                                     \
        assert_non_null(why_);                                                                     \
        *p_ = old_;                                                                                \
        assert_true(scene_valid(scene, scene->bytes, NULL));                                       \
    } while (0)

static void test_header_and_view(void **state)
{
    struct scene *scene = make(state);
    REFUSED(scene->magic, 0);
    REFUSED(scene->version, 99);
    REFUSED(scene->vertices.offset, scene->vertices.offset + 1);
    REFUSED(scene->vertices.offset, UINT64_MAX - 7);
    REFUSED(scene->vertices.offset, 0);
    REFUSED(scene->vertices.count, UINT64_MAX / 24 + 2);
    REFUSED(scene->materials.count, scene->materials.count + 1000);
    REFUSED(scene->lights.offset, scene->bytes + 8);
    REFUSED(scene->primitives[PRIMITIVE_PATCH].count, UINT64_C(1) << 62);
    REFUSED(scene->view.width, 0);
    REFUSED(scene->view.width, 65536);
    REFUSED(scene->view.height, 0);
    REFUSED(scene->view.height, 65536);
    REFUSED(scene->view.region_x, 640);
    REFUSED(scene->view.region_w, 0);
    REFUSED(scene->view.region_w, 641);
    REFUSED(scene->view.region_w, UINT32_MAX);
    REFUSED(scene->view.region_y, 480);
    REFUSED(scene->view.region_h, 0);
    REFUSED(scene->view.region_h, 481);
    REFUSED(scene->view.min_samples, 0);
    REFUSED(scene->view.min_samples, scene->view.max_samples + 1);
    REFUSED(scene->view.max_samples, 65537);
    REFUSED(scene->view.max_depth, 1000001);
    REFUSED(scene->view.shadows, 2);
    REFUSED(scene->view.formulas, 2);
    REFUSED(scene->view.reserved, 1);
    REFUSED(scene->view.processor, PROCESSOR_LEVELS);
    REFUSED(scene->view.variant, 2);
    REFUSED(scene->view.cutoff, -1);
    REFUSED(scene->view.cutoff, nan(""));
    REFUSED(scene->view.camera.eye.x, HUGE_VAL);
    REFUSED(scene->view.camera.forward.z, -1.001);
    REFUSED(scene->view.camera.right, vec3(0, 0, 0));
    REFUSED(scene->view.camera.right.x, HUGE_VAL);
    REFUSED(scene->view.camera.down, vec3(0, 0, 0));
    REFUSED(scene->view.camera.down.y, nan(""));
    REFUSED(scene->view.background_top.y, -0.1);
    REFUSED(scene->view.background_bottom.z, HUGE_VAL);
    REFUSED(scene->view.background_up.y, nan(""));
    free(scene);
}

/* The picture of the largest width and height has too many pixels. */
static void test_too_many_pixels(void **state)
{
    struct scene *scene = make(state);
    scene->view.width = PICTURE_MAX_EDGE;
    REFUSED(scene->view.height, PICTURE_MAX_EDGE);
    free(scene);
}

/* No array of the block goes on behind its end, be it by a single element. */
static void test_spans(void **state)
{
    struct scene *scene = make(state);
    struct {
        struct scene_span *span;
        size_t size;
    } spans[5 + PRIMITIVE_KINDS] = {{&scene->vertices, sizeof(struct vec3)},
                                    {&scene->normals, sizeof(struct vec3)},
                                    {&scene->materials, sizeof(struct material)},
                                    {&scene->lights, sizeof(struct light)},
                                    {&scene->duplicates, sizeof(uint32_t)}};
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++) {
        spans[5 + kind].span = &scene->primitives[kind];
        spans[5 + kind].size = primitive_size((enum primitive_kind)kind);
    }
    for (size_t i = 0; i < sizeof spans / sizeof *spans; i++)
        REFUSED(spans[i].span->count, (scene->bytes - spans[i].span->offset) / spans[i].size + 1);
    free(scene);
}

static void test_materials_and_lights(void **state)
{
    struct scene *scene = make(state);
    struct material *materials = at(scene, &scene->materials);
    struct light *lights = at(scene, &scene->lights);
    REFUSED(materials[0].color.x, -1);
    REFUSED(materials[0].ambient, -0.1);
    REFUSED(materials[0].diffuse, nan(""));
    REFUSED(materials[0].specular, -1);
    REFUSED(materials[0].shininess, -1);
    REFUSED(materials[0].reflection, -0.1);
    REFUSED(materials[0].reflection, 1.5);
    REFUSED(materials[0].transmission, -0.1);
    REFUSED(materials[0].transmission, 1.5);
    REFUSED(materials[0].ior, 0);
    REFUSED(lights[0].position.x, nan(""));
    REFUSED(lights[0].color.y, -1);
    free(scene);
}

static void test_triangles(void **state)
{
    struct scene *scene = make(state);
    struct vec3 *vertices = at(scene, &scene->vertices), *normals = at(scene, &scene->normals);
    struct triangle *triangle = at(scene, &scene->primitives[PRIMITIVE_TRIANGLE]);
    struct patch *patches = at(scene, &scene->primitives[PRIMITIVE_PATCH]);
    uint32_t too_many = (uint32_t)scene->materials.count;
    REFUSED(vertices[5].y, nan(""));
    REFUSED(normals[0].z, 1.0001);
    vertices[triangle->vertex[0]].y = vertices[patches->vertex[0]].y = 0x1.8p1023;
    REFUSED(vertices[triangle->vertex[1]].y, -0x1.8p1023);
    REFUSED(vertices[patches->vertex[1]].y, -0x1.8p1023);
    REFUSED(triangle->vertex[2], 6);
    REFUSED(triangle->material, too_many);
    REFUSED(patches->vertex[0], UINT32_MAX);
    REFUSED(patches->normal[1], 3);
    REFUSED(patches->material, too_many);
    free(scene);
}

static void test_solids(void **state)
{
    struct scene *scene = make(state);
    struct sphere *sphere = at(scene, &scene->primitives[PRIMITIVE_SPHERE]);
    struct box *box = at(scene, &scene->primitives[PRIMITIVE_BOX]);
    struct cone *cone = at(scene, &scene->primitives[PRIMITIVE_CONE]);
    uint32_t too_many = (uint32_t)scene->materials.count;
    REFUSED(sphere->center.z, HUGE_VAL);
    REFUSED(sphere->radius, 0);
    REFUSED(sphere->inside_only, 2);
    REFUSED(sphere->material, too_many);
    REFUSED(box->min.x, 2);
    REFUSED(box->min.x, box->max.x);
    REFUSED(box->min.y, -HUGE_VAL);
    REFUSED(box->max.z, HUGE_VAL);
    REFUSED(box->material, too_many);
    REFUSED(cone->apex, cone->base);
    cone->apex.x = 0x1.8p1023;
    REFUSED(cone->base.x, -0x1.8p1023);
    cone->apex.x = 0;
    REFUSED(cone->base.y, HUGE_VAL);
    REFUSED(cone->apex.z, nan(""));
    REFUSED(cone->base_radius, 0);
    cone->apex_radius = 2; /* more than at the base is all right */
    assert_true(scene_valid(scene, scene->bytes, NULL));
    REFUSED(cone->base_radius, -1);
    REFUSED(cone->apex_radius, -0.5);
    REFUSED(cone->capped, 2);
    REFUSED(cone->material, too_many);
    free(scene);
}

static void test_discs_and_planes(void **state)
{
    struct scene *scene = make(state);
    struct disc *disc = at(scene, &scene->primitives[PRIMITIVE_DISC]);
    struct plane *plane = at(scene, &scene->primitives[PRIMITIVE_PLANE]);
    uint32_t too_many = (uint32_t)scene->materials.count;
    REFUSED(disc->center.x, nan(""));
    REFUSED(disc->normal.x, 1);
    REFUSED(disc->radius, HUGE_VAL);
    REFUSED(disc->material, too_many);
    REFUSED(plane->point.y, HUGE_VAL);
    REFUSED(plane->normal.y, 0);
    REFUSED(plane->material, too_many);
    free(scene);
}

/* Duplicates are named in order: here the second and the third sphere, and the second plane. */
static void test_duplicates(void **state)
{
    static const char sphere[] = "[sphere]\ncenter = 0 0 0\nradius = 1\n";
    static const char plane[] = "[plane]\npoint = 0 0 0\nnormal = 0 1 0\n";
    char *all =
        format_text("[camera]\neye = 0 0 9\n%s%s%s%s%s", sphere, sphere, sphere, plane, plane);
    write_text("twice.ini", all);
    free(all);
    struct scene *scene = scratch_scene(*state, "twice.ini", NULL);
    uint32_t *ids = at(scene, &scene->duplicates);
    assert_int_equal(scene->duplicates.count, 3);
    assert_int_equal(ids[0], primitive_id(PRIMITIVE_SPHERE, 1));
    assert_int_equal(ids[2], primitive_id(PRIMITIVE_PLANE, 1));
    REFUSED(ids[0], ids[1]);
    REFUSED(ids[1], primitive_id(PRIMITIVE_SPHERE, 3));
    REFUSED(ids[2], primitive_id(PRIMITIVE_KINDS, 0));
    free(scene);
}

static void test_features(void **state)
{
    struct scene *scene = make(state);
    unsigned all_kinds = FEATURE_TRIANGLES | FEATURE_PATCHES | FEATURE_SPHERES | FEATURE_BOXES |
                         FEATURE_CONES | FEATURE_DISCS | FEATURE_PLANES;
    assert_int_equal(scene_features(scene), all_kinds | FEATURE_LIGHTS | FEATURE_SHADOWS |
                                                FEATURE_SPECULAR | FEATURE_REFLECTION);
    free(scene);
    write_text("few.ini", "[material glass]\ntransmission = 1\n[material unused]\nreflection = 1\n"
                          "[sphere]\ncenter = 0 0 0\nradius = 1\nmaterial = glass\n"
                          "[light]\nposition = 1 2 3\n");
    scene = scratch_scene(*state, "few.ini", "render.shadows=no");
    assert_int_equal(scene_features(scene),
                     FEATURE_SPHERES | FEATURE_LIGHTS | FEATURE_SPECULAR | FEATURE_REFRACTION);
    assert_string_equal(scene_feature_name(2), "spheres");
    assert_string_equal(scene_feature_name(11), "refraction");
    free(scene);
    write_text("dull.ini", "[material dull]\nspecular = 0\n[light]\nposition = 1 2 3\n"
                           "[sphere]\ncenter = 0 0 0\nradius = 1\nmaterial = dull\n");
    scene = scratch_scene(*state, "dull.ini", NULL);
    assert_int_equal(scene_features(scene), FEATURE_SPHERES | FEATURE_LIGHTS | FEATURE_SHADOWS);
    struct material *dull = at(scene, &scene->materials);
    dull->specular = 1; /* highlights are those of lights */
    scene->lights.count = 0;
    assert_int_equal(scene_features(scene), FEATURE_SPHERES);
    free(scene);
}

/* Each primitive has its own material, whatever its kind and wherever it is among those of its kind. */
static void test_materials(void **state)
{
    write_text("spheres.ini", "[camera]\neye = 0 0 9\nlook_at = 0 0 0\n"
                              "[material a]\nior = 2\n[material b]\nior = 3\n"
                              "[sphere s]\ncenter = 0 0 0\nradius = 1\nmaterial = a\n"
                              "[sphere t]\ncenter = 0 0 0\nradius = 2\nmaterial = b\n"
                              "[plane p]\npoint = 0 0 0\nnormal = 0 1 0\nmaterial = a\n"
                              "[plane q]\npoint = 0 1 0\nnormal = 0 1 0\nmaterial = b\n");
    struct scene *scene = scratch_scene(*state, "spheres.ini", NULL);
    const struct material *materials = scene_materials(scene);
    const enum primitive_kind kinds[] = {PRIMITIVE_SPHERE, PRIMITIVE_PLANE};
    for (size_t i = 0; i < 4; i++) {
        uint32_t id = primitive_id(kinds[i / 2], i % 2);
        assert_true(materials[primitive_material(scene, id)].ior == (i % 2 ? 3 : 2));
    }
    free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_good),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_header_and_view),
        cmocka_unit_test(test_too_many_pixels),
        cmocka_unit_test(test_spans),
        cmocka_unit_test(test_materials_and_lights),
        cmocka_unit_test(test_triangles),
        cmocka_unit_test(test_solids),
        cmocka_unit_test(test_discs_and_planes),
        cmocka_unit_test(test_duplicates),
        cmocka_unit_test(test_features),
        cmocka_unit_test(test_materials),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
