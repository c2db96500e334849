/*
 * Tests of jobs with files in many folders: nothing outside of CONFIG's folder is read unless that is allowed or the
 * file is named on the command line.
 */
#include "test/scratch.h"

#include <sys/stat.h>

#define LIGHT "[light]\nposition = 0 0 9\n"
#define BALL  "[sphere]\ncenter = 0 0 0\nradius = 1\n"
#define FACE  "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

/* scene/ is CONFIG's folder; scenery/ begins with the same letters. */
static int make_folders(void **state)
{
    if (scratch_open(state)) return 1;
    mkdir("scene", 0700);
    mkdir("scene/parts", 0700);
    mkdir("scenery", 0700);
    write_text("ball.ini", BALL);
    write_text("scenery/ball.ini", BALL);
    write_text("scenery/ball.nff", "s 0 0 0 1\n");
    write_text("scenery/face.obj", FACE);
    write_text("scenery/red.mtl", "newmtl red\nKd 1 0 0\n");
    write_text("scenery/red.obj", "mtllib red.mtl\nusemtl red\n" FACE);
    write_text("scene/ball.ini", BALL);
    write_text("scene/parts/up.ini", "[include]\nfile = ../ball.ini\n");
    return symlink("../scenery/face.obj", "scene/link.obj") != 0;
}

/* Asserts that loading this text gives the message for a file outside. where: the place that names it; path: the file's
 * path in the message. */
static void outside(void **state, const char *text, const char *where, const char *path)
{
    struct scratch *s = *state;
    char line[1024];
    struct job job;
    write_text("scene/scene.ini", text);
    snprintf(line, sizeof line,
             "%s: '%s' lies outside of the scene's folder %s/scene, expected a file in it "
             "(farm --allow-outside reads any)",
             where, path, s->folder);
    scratch_refused(s, "scene/scene.ini", NULL, line);
    s->reach = REACH_ANYWHERE;
    bool good = scratch_load(s, "scene/scene.ini", NULL, &job);
    s->reach = REACH_FOLDER;
    assert_true(good);
    job_free(&job);
}

static void test_outside(void **state)
{
    struct scratch *s = *state;
    char text[256], path[128];
    outside(state, "[include]\nfile = ../ball.ini\n" LIGHT, "scene/scene.ini:2: [include]",
            "scene/../ball.ini");
    outside(state, "[include a]\nfile = ../scenery/ball.nff\n", "scene/scene.ini:2: [include a]",
            "scene/../scenery/ball.nff");
    outside(state, "[mesh]\nfile = parts/../../scenery/face.obj\n", "scene/scene.ini:2: [mesh]",
            "scene/parts/../../scenery/face.obj");
    outside(state, "[mesh]\nfile = link.obj\n", "scene/scene.ini:2: [mesh]", "scene/link.obj");
    snprintf(path, sizeof path, "%s/scenery/face.obj", s->folder);
    snprintf(text, sizeof text, "[mesh]\nfile = %s\n", path);
    outside(state, text, "scene/scene.ini:2: [mesh]", path);
}

static void test_outside_of_a_part(void **state)
{
    write_text("scene/parts/out.ini", "[include]\nfile = ../../scenery/ball.ini\n");
    outside(state, "[include]\nfile = parts/out.ini\n", "scene/parts/out.ini:2: [include]",
            "scene/parts/../../scenery/ball.ini");
    write_text("scene/parts/out.obj", "mtllib ../../scenery/red.mtl\n" FACE);
    outside(state, "[mesh]\nfile = parts/out.obj\n", "scene/parts/out.obj:1",
            "scene/parts/../../scenery/red.mtl");
}

static void test_inside(void **state)
{
    struct scratch *s = *state;
    char text[256];
    snprintf(text, sizeof text,
             "[include]\nfile = parts/up.ini\n[include]\nfile = parts/../ball.ini\n"
             "[include]\nfile = %s/scene/ball.ini\n" LIGHT,
             s->folder);
    write_text("scene/scene.ini", text);
    struct scene *scene = scratch_scene(s, "scene/scene.ini", NULL);
    assert_int_equal(scene->primitives[PRIMITIVE_SPHERE].count, 3);
    free(scene);
    /* From within the folder, and for a scene file as CONFIG. */
    assert_int_equal(chdir("scene"), 0);
    free(scratch_scene(s, "scene.ini", NULL));
    assert_int_equal(chdir(".."), 0);
    free(scratch_scene(s, "scenery/red.obj", NULL));
    free(scratch_scene(s, "scenery/../scenery/ball.nff", NULL));
}

/* A file that an argument names may be anywhere, and so may files in its folder. */
static void test_arguments(void **state)
{
    struct scratch *s = *state;
    write_text("scene/scene.ini", "[mesh m]\nfile = none.obj\n" LIGHT);
    free(scratch_scene(s, "scene/scene.ini", "mesh m.file=scenery/red.obj"));
    write_text("scene/scene.ini", "[include p]\nfile = none.ini\n" LIGHT);
    write_text("scenery/up.ini", "[include]\nfile = ../ball.ini\n");
    char line[512];
    snprintf(
        line, sizeof line,
        "scenery/up.ini:2: [include]: 'scenery/../ball.ini' lies outside of the scene's folder "
        "%s/scenery, expected a file in it (farm --allow-outside reads any)",
        s->folder);
    scratch_refused(s, "scene/scene.ini", "include p.file=scenery/up.ini", line);
}

/* A file that does not exist is reported as missing, wherever it would be; the message also says that it could not be
 * read there. */
static void test_missing_outside(void **state)
{
    struct scratch *s = *state;
    write_text("scene/scene.ini", "[mesh]\nfile = ../none.obj\n");
    char line[1024];
    snprintf(
        line, sizeof line,
        "scene/scene.ini:2: [mesh]: cannot open scene/../none.obj: No such file or directory; that "
        "is outside of the scene's folder %s/scene, too, expected a file in it (farm "
        "--allow-outside reads any)",
        s->folder);
    scratch_refused(s, "scene/scene.ini", NULL, line);
    s->reach = REACH_ANYWHERE;
    scratch_refused(s, "scene/scene.ini", NULL,
                    "scene/scene.ini:2: [mesh]: cannot open scene/../none.obj: No such file or "
                    "directory");
    s->reach = REACH_FOLDER;
    static const char *const inside[] = {"none.obj", "parts/none.obj", "../scene/none.obj",
                                         "nowhere/none.obj"};
    for (size_t i = 0; i < sizeof inside / sizeof *inside; i++) {
        char text[128];
        snprintf(text, sizeof text, "[mesh]\nfile = %s\n", inside[i]);
        write_text("scene/scene.ini", text);
        snprintf(line, sizeof line,
                 "scene/scene.ini:2: [mesh]: cannot open scene/%s: No such file or directory",
                 inside[i]);
        scratch_refused(s, "scene/scene.ini", NULL, line);
    }
    write_text("scene/lost.obj", "mtllib ../none.mtl\n" FACE);
    free(scratch_scene(s, "scene/lost.obj", NULL));
    assert_string_equal(s->said,
                        "scene/lost.obj:1: warning: the material file '../none.mtl' is missing\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_outside),         cmocka_unit_test(test_outside_of_a_part),
        cmocka_unit_test(test_inside),          cmocka_unit_test(test_arguments),
        cmocka_unit_test(test_missing_outside),
    };
    return cmocka_run_group_tests(tests, make_folders, scratch_close);
}
