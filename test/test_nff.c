/* Tests of NFF files: every statement, the view, and errors. */
#include "test/scratch.h"

#include <math.h>

#define VIEW  "v\nfrom 2 1 1\nat 0 0 0\nup 0 0 1\nangle 45\nhither 1\nresolution 256 128\n"
#define LIGHT "l 1 2 3\n"

static void refused(void **state, const char *text, const char *line)
{
    write_text("scene.nff", text);
    scratch_refused(*state, "scene.nff", NULL, line);
}

static struct scene *loaded(void **state, const char *text, const char *override)
{
    write_text("scene.nff", text);
    return scratch_scene(*state, "scene.nff", override);
}

static double fov_of(const struct scene *scene)
{
    return atan(vec_length(scene->view.camera.down)) * 2 * 180 / 3.14159265358979323846;
}

static void test_view(void **state)
{
    struct scene *scene = loaded(state, "b 0.1 0.2 0.3\n" VIEW LIGHT, NULL);
    assert_int_equal(scene->view.width, 256);
    assert_int_equal(scene->view.height, 128);
    assert_true(scene->view.camera.eye.x == 2);
    assert_true(scene->view.background_up.z == 1);
    assert_true(scene->view.background_top.y == 0.2 && scene->view.background_bottom.z == 0.3);
    /* The centre of the first row lies 127/128 of the half height from the middle. */
    double row = vec_length(scene->view.camera.down) * 127 / 128;
    assert_true(fabs(row - tan(22.5 * 3.14159265358979323846 / 180)) < 1e-14);
    free(scene);
    scene = loaded(state, VIEW LIGHT, "image.height=1");
    assert_true(fabs(fov_of(scene) - 45) < 1e-12);
    assert_true(vec_is_zero(scene->view.background_top));
    free(scene);
    scene = loaded(state, "b 0.25 0 0\n" LIGHT "s 0 0 0 0.5\n", NULL); /* without a view */
    assert_true(scene->view.background_top.x == 0.25 && scene->view.background_top.z == 0);
    assert_int_equal(scene_spheres(scene)->inside_only, 0);
    free(scene);
    scene = loaded(state, LIGHT "s 0 0 0 1\n", NULL); /* with neither, the default one */
    assert_true(scene->view.background_top.x == 0.2 && scene->view.background_bottom.x == 0.04);
    free(scene);
    scene = loaded(state,
                   "v\nfrom 2 1 1\nat 0 0 0\nup 0 0 1\nangle 45\nresolution "
                   "000000000000000000000000000000640 4\n" LIGHT,
                   NULL);
    assert_int_equal(scene->view.width, 640);
    free(scene);
    scene = loaded(state, VIEW LIGHT, "camera.fov=30");
    assert_true(fabs(fov_of(scene) - 30) < 1e-12);
    free(scene);
}

static void test_ini_wins_over_the_view(void **state)
{
    write_text("scene.nff", "b 1 0 0\n" VIEW LIGHT "s 0 0 0 1\n");
    write_text("scene.ini", "[include]\nfile = scene.nff\n[camera]\neye = 5 5 5\n"
                            "[background]\ncolor = 0 1 0\n");
    struct scene *scene = scratch_scene(*state, "scene.ini", NULL);
    assert_true(scene->view.camera.eye.x == 5 && scene->view.background_top.y == 1);
    assert_int_equal(scene->view.height, 128);
    free(scene);
    write_text("scene.ini", "[include]\nfile = scene.nff\ntranslate = 0 0 7\n");
    scene = scratch_scene(*state, "scene.ini", NULL);
    assert_true(scene->view.camera.eye.z == 8 && scene->view.background_top.x == 1);
    assert_true(scene_lights(scene)->position.z == 10 && scene_spheres(scene)->center.z == 7);
    free(scene);
    /* Of two files the first one sets the view and the background. */
    write_text("other.nff", "b 0 0 1\nv\nfrom 9 9 9\nat 0 0 0\nup 0 0 1\nangle 30\n");
    write_text("scene.ini", "[include]\nfile = scene.nff\n[include]\nfile = other.nff\n");
    scene = scratch_scene(*state, "scene.ini", NULL);
    assert_true(scene->view.camera.eye.x == 2 && scene->view.background_top.x == 1);
    free(scene);
}

static void test_placed(void **state)
{
    write_text("scene.nff", "v\nfrom 1 0 5\nat 1 0 0\nup 1 0 0\nangle 45\nhither 1\n" LIGHT
                            "s 1 0 0 1.5\nc\n1 0 0 3\n2 0 0 4\n"
                            "pp 3\n0 0 0 1 0 0\n1 0 0 1 0 0\n0 1 0 1 0 0\n");
    write_text("scene.ini", "[include]\nfile = scene.nff\ntranslate = 10 20 30\nscale = 2\n"
                            "rotate = 0 0 90\n");
    struct scene *scene = scratch_scene(*state, "scene.ini", NULL);
    const struct camera *camera = &scene->view.camera;
    assert_true(camera->eye.y == 22 && camera->eye.z == 40 && camera->forward.z == -1);
    assert_true(camera->down.y < -0.4 && fabs(camera->down.x) < 1e-15);
    assert_true(scene_spheres(scene)->radius == 3);
    const struct cone *cone = scene_cones(scene);
    assert_true(cone->base.y == 22 && cone->base_radius == 6 && cone->apex_radius == 8);
    for (uint64_t i = 0; i < scene->normals.count; i++)
        assert_true(scene_normals(scene)[i].y == 1);
    free(scene);
}

static void test_lights(void **state)
{
    struct scene *scene =
        loaded(state, VIEW "l 1 2 3\nl 4 5 6\nl 7 8 9 1 0.5 0\nl 0 0 0 0 0 0.25\n", NULL);
    const struct light *lights = scene_lights(scene);
    assert_int_equal(scene->lights.count, 4);
    assert_true(lights[0].color.x == 0.5 && lights[1].color.z == 0.5);
    assert_true(lights[2].color.y == 0.5 && lights[2].color.z == 0 && lights[2].position.x == 7);
    assert_true(lights[3].color.x == 0 && lights[3].color.y == 0 && lights[3].color.z == 0.25);
    free(scene);
}

static void test_no_light(void **state)
{
    struct scratch *s = *state;
    write_text("scene.nff", "s 0 0 0 1\n");
    free(scratch_scene(s, "scene.nff", NULL));
    assert_string_equal(
        s->said, "scene.nff: warning: the scene has no light: surfaces show no more than what "
                 "they mirror or let through, until an 'l' lights them\n");
}

static void test_materials(void **state)
{
    struct scene *scene = loaded(state,
                                 VIEW LIGHT "s 0 0 0 1\nf 1 0.5 0.25 0.8 0.1 30 0.4 1.3\n"
                                            "s 0 0 0 1 # comment\nf 1 1 1 1 0 9 0 0\ns 0 0 0 1\n",
                                 NULL);
    const struct material *m = &scene_materials(scene)[scene_spheres(scene)[1].material];
    assert_true(m->color.y == 0.5 && m->diffuse == 0.8 && m->specular == 0.1 && m->ambient == 0);
    assert_true(m->reflection == 0.1 && m->shininess == 30 && m->transmission == 0.4);
    assert_true(m->ior == 1.3);
    m = &scene_materials(scene)[scene_spheres(scene)[2].material];
    assert_true(m->ior == 1);
    assert_int_equal(scene->materials.count, 3);
    free(scene);
    scene = loaded(state, VIEW LIGHT "f 1 1 1 0 1 9 0 1\ns 0 0 0 1\n", NULL); /* a perfect mirror */
    m = &scene_materials(scene)[scene_spheres(scene)->material];
    assert_true(m->reflection == 1 && m->specular == 1);
    free(scene);
}

static void test_one_warning_of_gain(void **state)
{
    struct scratch *s = *state;
    free(loaded(state,
                VIEW LIGHT "f 200 0 0 1 0 1 0 1\ns 0 0 0 1\nf 0 200 0 1 0.5 1 0.6 1\ns 0 0 0 1\n",
                NULL));
    assert_string_equal(s->said, "scene.nff:9: warning: a component of the color is more than 1: "
                                 "the surface may give off more light than it gets (full white "
                                 "is 1 1 1)\n");
    /* What gives off more light than it gets is told of once, too, whatever its colour. */
    free(loaded(state, VIEW LIGHT "f 1 0 0 1 0.5 1 0.6 1\nf 0 1 0 1 0.5 1 0.6 1\ns 0 0 0 1\n",
                NULL));
    assert_string_equal(s->said, "scene.nff:9: warning: reflection and transmission together are "
                                 "1.1, more than 1: the surface "
                                 "gives off more light than it gets\n");
    /* A sum above 1 by rounding alone is not warned of, and does not prevent a warning of another material. */
    free(loaded(state, VIEW LIGHT "f 1 0 0 1 0.5 1 0.50000001 1\nf 255 0 0 1 0 1 0 1\ns 0 0 0 1\n",
                NULL));
    assert_string_equal(s->said, "scene.nff:10: warning: a component of the color is more than 1: "
                                 "the surface may give off more light than it gets (full white "
                                 "is 1 1 1)\n");
}

static void test_objects(void **state)
{
    struct scene *scene =
        loaded(state,
               VIEW LIGHT "s 1 2 3 -4\nc\n0 0 0 2\n0 0 5 0\n"
                          "p 6\n0 0 0\n2 0 0\n2 1 0\n1 1 0\n1 2 0\n0 2 0\n"
                          "pp 4\n0 0 0 0 0 2\n1 0 0 0 0 1\n1 1 0 0 1 1\n0 1 0 0 0 1\n",
               NULL);
    assert_int_equal(scene_spheres(scene)->inside_only, 1);
    assert_true(scene_spheres(scene)->radius == 4);
    assert_int_equal(scene_cones(scene)->capped, 0);
    assert_true(scene_cones(scene)->base_radius == 2 && scene_cones(scene)->apex.z == 5);
    assert_int_equal(scene->primitives[PRIMITIVE_TRIANGLE].count, 4);
    assert_int_equal(scene->primitives[PRIMITIVE_PATCH].count, 2);
    assert_int_equal(scene->vertices.count, 10);
    assert_int_equal(scene->normals.count, 4);
    /* The corners keep their normals through the triangulation. */
    const struct patch *patches = scene_patches(scene);
    for (int i = 0; i < 6; i++)
        assert_int_equal(patches[i / 3].vertex[i % 3] - 6, patches[i / 3].normal[i % 3]);
    free(scene);
}

/* A negative radius of a cone counts as its size, with one warning. */
static void test_negative_cone(void **state)
{
    struct scratch *s = *state;
    struct scene *scene =
        loaded(state, VIEW LIGHT "c\n0 0 0 -2\n0 0 5 -1\nc\n0 0 0 -2\n0 0 5 0\n", NULL);
    assert_true(scene_cones(scene)[0].base_radius == 2 && scene_cones(scene)[0].apex_radius == 1);
    assert_true(scene_cones(scene)[1].base_radius == 2 && scene_cones(scene)[1].apex_radius == 0);
    assert_string_equal(s->said,
                        "scene.nff:11: warning: a cone with a negative radius is seen from "
                        "outside too\n");
    free(scene);
    free(loaded(state, VIEW LIGHT "c\n0 0 0 2\n0 0 5 -1\n", NULL));
    assert_string_equal(s->said,
                        "scene.nff:11: warning: a cone with a negative radius is seen from "
                        "outside too\n");
}

static void test_extreme_numbers(void **state)
{
    struct scene *scene = loaded(state,
                                 VIEW LIGHT "pp 3\n0 0 0 0 0 1e-320\n1 0 0 0 0 1.7e308\n"
                                            "0 1 0 1.7e308 1.7e308 1.7e308\n",
                                 NULL);
    assert_true(scene_normals(scene)[0].z == 1 && scene_normals(scene)[1].z == 1);
    free(scene);
    free(loaded(state,
                "v\nfrom 1.7e308 1e308 1e308\nat 0 0 0\nup 0 1e-322 1e-321\nangle 45\n" LIGHT
                "s 0 0 0 1\n",
                NULL));
    refused(state, "v\nfrom 0 0 1\nat 0 0 0\nup 0 1 0\nangle 1e-323\nl 1 1 1\n",
            "scene.nff:1: fov is too close to 0 or 180, expected an angle between them");
    refused(state,
            "v\nfrom 0 0 1\nat 0 0 0\nup 0 1 0\nangle 179.99999999999997\nresolution 2 2\n"
            "l 1 1 1\n",
            "scene.nff:1: fov is too close to 0 or 180, expected an angle between them");
}

/* Faces without an area are warned of once, and are no error. */
static void test_flat_faces(void **state)
{
    struct scratch *s = *state;
    free(loaded(state,
                VIEW LIGHT
                "p 3\n0 0 0\n1 0 0\n0 1 0\np 3\n0 0 0\n1 1 1\n2 2 2\n"
                "p 4\n0 0 0\n1 0 0\n2 0 0\n3 0 0\np 5\n1 0 0\n1 0 0\n1 0 0\n1 0 0\n1 0 0\n",
                NULL));
    assert_string_equal(s->said,
                        "scene.nff:16: warning: faces without an area, whose corners lie on a "
                        "line, are never seen: 3 of 4, the first one here\n");
}

/* A bow tie is warned of once. */
static void test_crossing_polygons(void **state)
{
    struct scratch *s = *state;
    struct scene *scene = loaded(state,
                                 VIEW LIGHT "p 4\n0 0 0\n2 0 0\n0 1 0\n1 1 0\n"
                                            "p 4\n0 0 0\n2 0 0\n0 1 0\n1 1 0\n",
                                 NULL);
    assert_int_equal(scene->primitives[PRIMITIVE_TRIANGLE].count, 4);
    assert_string_equal(s->said,
                        "scene.nff:13: warning: a polygon crosses itself or is bent so far "
                        "that its triangles overlap, which may look wrong\n");
    free(scene);
}

static void test_line_ends_and_comments(void **state)
{
    struct scene *scene = loaded(state,
                                 "# first\r\n\r\nv\r\nfrom 2 1 1\r\nat 0 0 0\r\nup 0 0 1\r\n"
                                 "angle 45\r\n  l 1 2 3\r\n\t s 0 0 0 1\r\np 3 # three\r\n\r\n"
                                 "0 0 0\r\n# between\r\n1 0 0\r\n0 1 0",
                                 NULL);
    assert_int_equal(scene->primitives[PRIMITIVE_TRIANGLE].count, 1);
    assert_int_equal(scene->view.width, 640);
    free(scene);
}

static void test_mistakes_of_statements(void **state)
{
    refused(state, "b 1 1\n", "scene.nff:1: 'b' needs a colour: three numbers >= 0");
    refused(state, "b 1 1 -1\n", "scene.nff:1: 'b' needs a colour: three numbers >= 0");
    refused(state, "b 1 -1 1\n", "scene.nff:1: 'b' needs a colour: three numbers >= 0");
    refused(state, "b -1 1 1\n", "scene.nff:1: 'b' needs a colour: three numbers >= 0");
    refused(state, "\nx 1 1\n",
            "scene.nff:2: unknown statement 'x', expected v, b, l, f, s, c, p or pp");
    refused(state, "", "scene.nff: has no statements, expected at least one");
    refused(state, "# a comment\n\n", "scene.nff: has no statements, expected at least one");
}

static void test_mistakes_of_the_view(void **state)
{
    refused(state, "from 1 2 3\n",
            "scene.nff:1: a line of a view without 'v', expected 'v' before it");
    refused(state, "v\nfrom 1 2 3\nat 0 0 0\nup 0 0 1\n",
            "scene.nff:1: the view is not complete, expected from, at, up and angle");
    refused(state, "v\nfrom 1 2 3\nfrom 1 2 3\n",
            "scene.nff:3: a part of the view twice, expected it once");
    refused(state, VIEW "v\n", "scene.nff:8: a second view, expected one");
    refused(state, "b 0 0 0\nb 1 1 1\n", "scene.nff:2: a second background, expected one");
    refused(state, "v\nangle 180\n", "scene.nff:2: 'angle' needs a number > 0 and < 180");
    refused(state, "v\nresolution 4294967297 5\n",
            "scene.nff:2: 'resolution' needs two whole numbers from 1 to 65535");
    refused(state, "v\nresolution 0 5\n",
            "scene.nff:2: 'resolution' needs two whole numbers from 1 to 65535");
    refused(state, "v\nfrom 0 0 1\nat 0 0 0\nup 0 0 1\nangle 45\nl 1 1 1\n",
            "scene.nff:1: up lies along the direction of view, expected another direction");
}

static void test_mistakes_of_lights_and_materials(void **state)
{
    refused(state, "l 1 2\n",
            "scene.nff:1: 'l' needs a position and may have a colour: 3 or 6 numbers");
    refused(state, "l 1 2 3 4 5\n",
            "scene.nff:1: 'l' needs a position and may have a colour: 3 or 6 numbers");
    refused(state, "l 1 2 3 1 -1 1\n",
            "scene.nff:1: a light's colour is negative, expected three numbers >= 0");
    refused(state, "l 1 2 3 -1 1 1\n",
            "scene.nff:1: a light's colour is negative, expected three numbers >= 0");
    refused(state, "l 1 2 3 1 1 -1\n",
            "scene.nff:1: a light's colour is negative, expected three numbers >= 0");
    refused(state, "f 1 1 1 1 0 1 0\n",
            "scene.nff:1: 'f' needs eight numbers: R G B Kd Ks Shine T ior");
    refused(state, "f 1 1 1 1 2 1 0 1\n",
            "scene.nff:1: Ks is out of range, expected a number from 0 to 1");
    /* An index of 0 is replaced only where nothing is transmitted. */
    refused(state, "f 1 1 1 1 0 1 0.5 0\n",
            "scene.nff:1: ior is out of range, expected a finite number > 0");
}

static void test_mistakes_of_solids(void **state)
{
    refused(state, "s 1 2 3\n", "scene.nff:1: 's' needs a center and a radius: four numbers");
    refused(state, "s 1 2 3 4 5\n", "scene.nff:1: 's' needs a center and a radius: four numbers");
    refused(state, "s 1 2 3 0.#INF\n",
            "scene.nff:1: the radius is out of range, expected a finite number > 0");
    refused(state, "s 1 2 3 1.#INF\n",
            "scene.nff:1: 's' needs a center and a radius: four numbers");
    refused(state, "s 1 2 3 1e999\n",
            "scene.nff:1: a number is out of range, expected none beyond 1.79e308");
    refused(state, "s 1 2 3 0\n",
            "scene.nff:1: the radius is out of range, expected a finite number > 0");
    refused(state, "c\n0 0 0 1\n",
            "scene.nff:3: 'c' needs two lines more, each with a point and a radius");
    refused(state, "c\n0 0 0 1\n0 0 0 1\n",
            "scene.nff:3: base and apex are the same point, expected two different points");
}

static void test_mistakes_of_polygons(void **state)
{
    refused(state, "p 2\n0 0 0\n1 0 0\n",
            "scene.nff:1: '2' in place of a polygon's number of corners, expected 3 to 20000");
    refused(state, "p\n0 0 0\n1 0 0\n",
            "scene.nff:1: nothing in place of a polygon's number of corners, expected 3 to 20000");
    /* Whatever a file says, an error does not look like a warning. */
    refused(state, "p warning: 3\n",
            "scene.nff:1: 'warning:' in place of a polygon's number of corners, expected 3 to "
            "20000");
    refused(state, "p 3 4\n0 0 0\n",
            "scene.nff:1: text after the number of corners, expected the end of the line");
    refused(state, "p 999999999\n0 0 0\n",
            "scene.nff:1: '999999999' in place of a polygon's number of corners, expected 3 to "
            "20000");
    refused(state, "p 3\n0 0 0\n1 0 0\ns 0 0 0 1\n",
            "scene.nff:4: expected a corner of 'p': three numbers");
    refused(state, "pp 3\n0 0 0 0 0 1\n1 0 0\n",
            "scene.nff:3: expected a corner of 'pp': a point and a normal, six numbers");
    refused(state, "pp 3\n0 0 0 0 0 0\n",
            "scene.nff:2: a normal is zero or not finite, expected a direction");
    refused(state, "p 3\n0 0 0\n1 0 0\n0 1",
            "scene.nff:4: expected a corner of 'p': three numbers");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_placed),
        cmocka_unit_test(test_view),
        cmocka_unit_test(test_ini_wins_over_the_view),
        cmocka_unit_test(test_lights),
        cmocka_unit_test(test_no_light),
        cmocka_unit_test(test_materials),
        cmocka_unit_test(test_one_warning_of_gain),
        cmocka_unit_test(test_objects),
        cmocka_unit_test(test_line_ends_and_comments),
        cmocka_unit_test(test_negative_cone),
        cmocka_unit_test(test_extreme_numbers),
        cmocka_unit_test(test_crossing_polygons),
        cmocka_unit_test(test_flat_faces),
        cmocka_unit_test(test_mistakes_of_statements),
        cmocka_unit_test(test_mistakes_of_the_view),
        cmocka_unit_test(test_mistakes_of_lights_and_materials),
        cmocka_unit_test(test_mistakes_of_solids),
        cmocka_unit_test(test_mistakes_of_polygons),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
