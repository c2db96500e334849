/* INI files: what they give, and the one line that each kind of mistake gives. */
#include "test/scratch.h"

#include <math.h>
#include <sys/stat.h>

#include "master/ini_source.h"
#include "master/placement.h"

#define LIGHT "[light]\nposition = 1 2 3\n"

/* The text as CONFIG scene.ini has to fail with this line. */
static void refused(void **state, const char *text, const char *line)
{
    write_text("scene.ini", text);
    scratch_refused(*state, "scene.ini", NULL, line);
}

static struct scene *loaded(void **state, const char *text)
{
    write_text("scene.ini", text);
    return scratch_scene(*state, "scene.ini", NULL);
}

static void test_form(void **state)
{
    write_text("form.ini", "\xef\xbb\xbf# comment\r\n"
                           "  [ sphere   big ball ]  ; comment\r\n"
                           "\tcenter = 1 2 3 ; comment\r\n"
                           "   radius: 4;5\n"
                           "\n"
                           "[empty]\n"
                           "[empty]\n"
                           "file = a = b");
    struct ini ini;
    assert_true(ini_load("form.ini", &ini));
    assert_int_equal(ini.count, 3);
    assert_string_equal(ini.sections[0].kind, "sphere");
    assert_string_equal(ini.sections[0].name, "big ball");
    assert_int_equal(ini.sections[0].line, 2);
    assert_string_equal(ini_entry(&ini.sections[0], "center")->value, "1 2 3");
    assert_int_equal(ini_entry(&ini.sections[0], "center")->line, 3);
    assert_string_equal(ini_entry(&ini.sections[0], "radius")->value, "4;5");
    assert_int_equal(ini.sections[1].count, 0);
    assert_int_equal(ini.sections[2].line, 7);
    assert_string_equal(ini_entry(&ini.sections[2], "file")->value, "a = b");
    ini_free(&ini);
}

static void test_form_mistakes(void **state)
{
    refused(state, "[image\nwidth = 3\n",
            "scene.ini:1: a section without its ']', expected [kind] or [kind name]");
    refused(state, "[image]\n\nwidth 3\n",
            "scene.ini:3: expected 'key = value', a [section] or a comment");
    refused(state, "[image]\nwidth 3",
            "scene.ini:2: expected 'key = value', a [section] or a comment");
    refused(state, "[image] width = 3\n",
            "scene.ini:1: text after the section's ']', expected the end of the line");
    refused(state, "width = 3\n",
            "scene.ini:1: a key outside of any section, expected a [section] first");
    refused(state, "[image]\n= 3\n", "scene.ini:2: a value without a key, expected 'key = value'");
    refused(state, "[image]\nwidth = 3\nheight = 4\nwidth = 5\n",
            "scene.ini:4: width is already set in line 2, expected it once");
    refused(state, "[image]\nwidth = 3\n[image]\n",
            "scene.ini:3: [image] is already in line 1, expected it once");
    refused(state, "[light a]\nposition = 1 2 3\n[light  a]\nposition = 1 2 3\n",
            "scene.ini:3: [light a] is already in line 1, expected another name");

    char text[400], name[64];
    memset(name, 'x', sizeof name);
    snprintf(text, sizeof text, "[%.50s]\n", name);
    refused(state, text,
            "scene.ini:1: the section is too long, expected at most 49 bytes between [ and ]");
    char *long_text = allocate(5000, 1);
    snprintf(long_text, 5000, "[image]\nwidth = %4200d\n", 5);
    refused(state, long_text, "scene.ini:2: the line is too long, expected at most 4096 bytes");
    snprintf(long_text, 5000, "[image]\n%0300d = 5\n", 5);
    refused(state, long_text, "scene.ini:2: the key's name is too long, expected at most 49 bytes");
    snprintf(long_text, 5000, "[image]\nwidth 5 ; = %300d\n", 5);
    refused(state, long_text, "scene.ini:2: expected 'key = value', a [section] or a comment");
    snprintf(long_text, 5000, "[image]\n = %0300d\n", 5);
    refused(state, long_text, "scene.ini:2: a value without a key, expected 'key = value'");
    free(long_text);
    write_bytes("scene.ini", "[image]\nwid\0th = 3\n", 19);
    scratch_refused(*state, "scene.ini", NULL, "scene.ini:2: a NUL byte, expected plain text");
}

/* Lines around the length that inih takes, and the longest ones: all are read alike. */
static void test_long_lines(void **state)
{
    char text[20000], name[50], value[4200];
    memset(name, 'n', 47);
    name[47] = '\0';
    for (int length = 180; length <= 4092; length += length < 210 ? 1 : 647) {
        memset(value, 'v', sizeof value);
        value[length] = '\0';
        /* Not a comment, and not a key and value of their own. */
        memcpy(value + 100, ";=:", 3);
        snprintf(
            text, sizeof text,
            "[a %s] ; %.3000s\n     k = %s     \nshort = %.100s ; %.*s\n; %s\nlast: %.100s;%.50s\n",
            name, value, value, value, length - 150, value, value, value, value);
        write_text("long.ini", text);
        struct ini ini;
        assert_true(ini_load("long.ini", &ini));
        assert_string_equal(ini.sections[0].name, name);
        const struct ini_section *section = &ini.sections[0];
        assert_string_equal(ini_entry(section, "k")->value, value);
        assert_int_equal(strlen(ini_entry(section, "short")->value), 100);
        assert_int_equal(ini_entry(section, "last")->line, 5);
        assert_int_equal(strlen(ini_entry(section, "last")->value), 151);
        ini_free(&ini);
    }
}

/* The longest keys, whatever blanks follow them, the longest names, and the most keys of a section. */
static void test_limits(void **state)
{
    char text[8000], name[51], value[301];
    struct ini ini;
    memset(name, 'n', sizeof name);
    name[50] = value[300] = '\0';
    memset(value, 'v', sizeof value - 1);
    snprintf(text, sizeof text, "[a]\n%s%100s= %s\n%s = v\n", name + 1, "", value, name + 2);
    write_text("limits.ini", text);
    assert_true(ini_load("limits.ini", &ini));
    assert_string_equal(ini_entry(&ini.sections[0], name + 1)->value, value);
    ini_free(&ini);
    size_t length = (size_t)snprintf(text, sizeof text, "[a]\n");
    for (int i = 0; i < 100; i++)
        length += (size_t)snprintf(text + length, sizeof text - length, "k%d = %d\n", i, i);
    write_text("limits.ini", text);
    assert_true(ini_load("limits.ini", &ini));
    assert_int_equal(ini.sections[0].count, 100);
    ini_free(&ini);
    snprintf(text + length, sizeof text - length, "k = 0\n");
    refused(state, text, "scene.ini:102: too many keys in one section");
    /* What is printed can be read again. */
    assert_true(ini_can_name("a", name + 3) && !ini_can_name("a", name + 2));
    assert_true(ini_can_hold("k", "a b") && ini_can_hold("k", ""));
    assert_false(ini_can_hold("k", " a"));
    assert_false(ini_can_hold("k", "a\t"));
}

/* The same texts as short lines and as ones that inih does not see whole. */
static void test_comments_in_long_lines(void **state)
{
    static const char *const values[] = {"a;b", "a ;b",  "a\t; b", ";b",   " ;b",
                                         "a;",  "a = b", "",       "\"a\""};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        char text[2000];
        snprintf(text, sizeof text, "[a]\nk =%s\n[b]\nk =%s%300s; %0300d\n", values[i], values[i],
                 "", 0);
        write_text("long.ini", text);
        struct ini ini;
        assert_true(ini_load("long.ini", &ini));
        assert_string_equal(ini_entry(&ini.sections[0], "k")->value,
                            ini_entry(&ini.sections[1], "k")->value);
        assert_true(ini_can_hold("k", ini_entry(&ini.sections[0], "k")->value) ||
                    values[i][0] == ';');
        ini_free(&ini);
    }
}

static void test_unknown_names(void **state)
{
    refused(state, "[sphere ball]\ncenter = 0 0 0\nradus = 1\n",
            "scene.ini:3: unknown key 'radus' in [sphere ball], did you mean 'radius'?");
    refused(state, "[sphere]\ncentre_of_it = 0 0 0\n",
            "scene.ini:2: unknown key 'centre_of_it' in [sphere], expected one of center radius "
            "material");
    refused(state, "[image]\nhieght = 3\n",
            "scene.ini:2: unknown key 'hieght' in [image], did you mean 'height'?");
    refused(state, "[shpere ball]\nradius = 1\n",
            "scene.ini:1: unknown section [shpere], did you mean 'sphere'?");
    refused(state, "[SPHERE ball]\nradius = 1\n",
            "scene.ini:1: unknown section [SPHERE], did you mean 'sphere'?");
    refused(state, "[camera]\nFOV = 45\n",
            "scene.ini:2: unknown key 'FOV' in [camera], did you mean 'fov'?");
    refused(state, "[balloon]\n",
            "scene.ini:1: unknown section [balloon], expected one that 'farm --help' lists");
    refused(state, "[background]\ntexture = x\n",
            "scene.ini:2: unknown key 'texture' in [background], expected one of color bottom top");
    refused(state, "[image]\nsamples = 4\n",
            "scene.ini:2: unknown key 'samples' in [image], it belongs to [sampling]");
    refused(state, "[mesh ball]\ncolor = 1 0 0\n",
            "scene.ini:2: unknown key 'color' in [mesh ball], it belongs to [material]");
    refused(state,
            "[material glass]\n[disc]\ncenter = 0 0 0\nnormal = 0 1 0\nradius = 1\n"
            "material = glas\n",
            "scene.ini:6: [disc]: there is no [material glas], did you mean 'glass'?");
    refused(state,
            "[material stone]\n[material gold]\n[sphere]\ncenter = 0 0 0\nradius = 1\n"
            "material = mirror\n",
            "scene.ini:6: [sphere]: there is no [material mirror], expected one of gold stone");
    refused(state, "[sphere]\ncenter = 0 0 0\nradius = 1\nmaterial = mirror\n",
            "scene.ini:4: [sphere]: there is no [material mirror], expected the name of one");
    refused(state, "[material a]\n[sphere]\ncenter = 0 0 0\nradius = 1\nmaterial = a # red\n",
            "scene.ini:5: [sphere]: there is no [material a # red], expected one of a; a comment "
            "behind a value begins with ' ;'");
    refused(state, "[camera main]\n", "scene.ini:1: [camera] takes no name, expected [camera]");
    refused(state, "[material]\n",
            "scene.ini:1: [material]: a material needs a name, expected [material NAME]");
}

static void test_bad_values(void **state)
{
    refused(state, "[sphere ball]\ncenter = 0 0 0\n",
            "scene.ini:1: [sphere ball] has no radius, expected a finite number > 0");
    refused(state, "[sphere ball]\n",
            "scene.ini:1: [sphere ball] has no center, expected three finite numbers separated by "
            "spaces");
    refused(
        state, "[sphere]\ncenter = 0 0\n",
        "scene.ini:2: center = 0 0 in [sphere], expected three finite numbers separated by spaces");
    refused(state, "[sphere]\ncenter = 0 0 0\nradius = -1\n",
            "scene.ini:3: radius = -1 in [sphere], expected a finite number > 0");
    refused(state, "[sphere]\ncenter = 0 0 nan\n",
            "scene.ini:2: center = 0 0 nan in [sphere], expected three finite numbers separated by "
            "spaces");
    refused(state, "[plane]\npoint = 0 0 0\nnormal = 0 0 0\n",
            "scene.ini:1: [plane]: the normal is zero or not finite, expected a direction");
    refused(state, "[box b]\nmin = 0 0 0\nmax = 1 0 1\n",
            "scene.ini:1: [box b]: the box has no volume, expected min < max in every component");
    refused(state, "[triangle]\na = 0 0 0\nb = 1 1 1\nc = 2 2 2\n",
            "scene.ini:1: [triangle]: the corners lie on a line, expected a triangle with an area");
    refused(state, "[triangle]\na = -1e308 0 0\nb = 1e308 0 0\nc = 0 1e308 0\n",
            "scene.ini:1: [triangle]: two corners are too far apart, expected finite distances");
    refused(
        state, "[mesh]\nfile = a.obj # a mesh\n",
        "scene.ini:2: [mesh]: the name of a mesh has to end with .obj; a comment behind a value "
        "begins with ' ;'");
    refused(state, "[include]\nfile = part.ini # leaves\n",
            "scene.ini:2: [include]: cannot open part.ini # leaves: No such file or directory; a "
            "comment behind a value begins with ' ;'");
    refused(state, "[output]\nimage = a.png # a picture\n",
            "scene.ini:2: image has an unknown extension, expected .png, .hdr or .pfm; a comment "
            "behind a value begins with ' ;'");
    refused(state, "[cylinder]\nbase = 0 1 0\napex = 0 1 0\nradius = 1\n",
            "scene.ini:1: [cylinder]: base and apex are the same point, expected two different "
            "points");
    refused(state, "[cone]\nbase = 0 1 0\napex = 0 0 0\nbase_radius = 0\n",
            "scene.ini:1: [cone]: both radii are 0, expected at least one > 0");
    refused(state, "[material m]\nreflection = 1.1\n",
            "scene.ini:2: reflection = 1.1 in [material m], expected a number from 0 to 1; "
            "reflection: share of light that is mirrored");
    refused(state, "[light]\nposition = 0 0 0\ncolor = 1 -1 1\n",
            "scene.ini:3: color = 1 -1 1 in [light], expected a colour: three finite numbers >= 0 "
            "separated by spaces; color: its strength, the same at any distance");
    refused(state, "[material glass]\nior = 0\n",
            "scene.ini:2: ior = 0 in [material glass], expected a finite number > 0; ior: index "
            "of refraction (water 1.33, glass 1.5; the world outside has 1)");
}

static void test_bad_combinations(void **state)
{
    refused(state, "[image]\nwidth = 65535\nheight = 65535\n",
            "scene.ini:2: the picture has 4294836225 pixels, expected width x height <= 2^28");
    refused(
        state, "[image]\nwidth = 10\nheight = 10\nregion = 5 0 6 10\n",
        "scene.ini:4: the region reaches out of the picture, expected a part of 10 x 10 pixels");
    refused(
        state, "[image]\nwidth = 10\nheight = 10\nregion = 0 5 10 6\n",
        "scene.ini:4: the region reaches out of the picture, expected a part of 10 x 10 pixels");
    refused(
        state, "[image]\nregion = 4294967295 0 2 10\n",
        "scene.ini:2: the region reaches out of the picture, expected a part of 640 x 480 pixels");
    refused(state, "[camera]\neye = 1 2 3\nlook_at = 1 2 3\n",
            "scene.ini:2: eye and look_at are the same point, expected two different ones");
    refused(state, "[camera]\neye = 0 5 0\nlook_at = 0 0 0\n",
            "scene.ini:2: up, 0 1 0 unless it is set, lies along the direction of view, expected "
            "another direction, such as up = 0 0 -1");
    refused(state, "[camera]\neye = 0 5 0\nlook_at = 0 0 0\nup = 0 3 0\n",
            "scene.ini:4: up lies along the direction of view, expected another direction");
    /* So close to it that a picture would be all rounding errors. */
    refused(state, "[camera]\neye = 1 5 0\nlook_at = 0 0 0\nup = 1.000000000000002 5 0\n",
            "scene.ini:4: up lies along the direction of view, expected another direction");
    refused(state, "[camera]\neye = 0 0 0\n",
            "scene.ini:2: eye and look_at, the middle of the scene unless it is set, are the same "
            "point, expected two different ones");
    refused(state, "[camera]\neye = 0 0 5\nlook_at = 0 0 0\nup = 0 0 0\n",
            "scene.ini:4: up is zero or not finite, expected a direction");
    refused(state, "[camera]\neye = 1e308 0 0\nlook_at = -1e308 0 0\n",
            "scene.ini:2: eye and look_at are too far apart, expected a finite distance");
    refused(state, "[background]\ncolor = 0 0 0\ntop = 1 1 1\n",
            "scene.ini:2: [background] has a color as well as bottom or top, expected one or the "
            "other");
    refused(state, "[output]\nimage = a.gif\n",
            "scene.ini:2: image has an unknown extension, expected .png, .hdr or .pfm");
    refused(state, "[output]\nimage = \"a b.png\"\n",
            "scene.ini:2: image has an unknown extension, expected .png, .hdr or .pfm; a name "
            "stands without quotes");
    refused(state, "[output]\nimage =\n",
            "scene.ini:2: image is empty, expected the name of a file");
}

/* What a file makes us say cannot steer the terminal: C0 and C1 controls, stray bytes. */
static void test_messages_are_printable(void **state)
{
    refused(state,
            "[sphere]\n\x1b[1m\xc2\x9b_\xc3\xa4_\xe2\x82\xac_\xf0\x9f\x8c\x8d_\x9b_\xc3(_"
            "\xed\xa0\x80_\xe2\x82 = 1\n",
            "scene.ini:2: unknown key "
            "'?[1m??_\xc3\xa4_\xe2\x82\xac_\xf0\x9f\x8c\x8d_?_?(_\?\?\?_\?\?' in "
            "[sphere], expected one of center radius material");
}

static void test_files_that_are_none(void **state)
{
    scratch_refused(*state, "none.ini", NULL,
                    "none.ini: cannot be opened: No such file or directory");
    scratch_refused(*state, "none.obj", NULL,
                    "none.obj: cannot be opened: No such file or directory");
    scratch_refused(*state, "none.nff", NULL,
                    "none.nff: cannot be opened: No such file or directory");
    write_text("lantern.ini", "[sphere]\n");
    scratch_refused(*state, "./lanten.ini", NULL,
                    "./lanten.ini: cannot be opened: No such file or directory, did you mean "
                    "'./lantern.ini'?");
    scratch_refused(*state, "lanten.nff", NULL,
                    "lanten.nff: cannot be opened: No such file or directory");
    write_text("caw.obj", "");
    refused(state, "[mesh]\nfile = cow.obj\n",
            "scene.ini:2: [mesh]: cannot open cow.obj: No such file or directory, did you mean "
            "'caw.obj'?");
    refused(state, "[mesh]\nfile = ././cow.obj\n",
            "scene.ini:2: [mesh]: cannot open ././cow.obj: No such file or directory, did you mean "
            "'././caw.obj'?");
    /* A link that leads nowhere is not meant in place of itself, nor is a folder. */
    assert_int_equal(symlink("none.obj", "dangling.obj"), 0);
    refused(state, "[mesh]\nfile = dangling.obj\n",
            "scene.ini:2: [mesh]: cannot open dangling.obj: No such file or directory");
    assert_int_equal(mkdir("parts1.obj", 0700), 0);
    refused(state, "[mesh]\nfile = parts2.obj\n",
            "scene.ini:2: [mesh]: cannot open parts2.obj: No such file or directory");
    /* A sparse file of 3 GB: nobody waits for it to be read. */
    write_text("big.obj", "v 0 0 0\n");
    assert_int_equal(truncate("big.obj", (off_t)3 << 30), 0);
    scratch_refused(*state, "big.obj", NULL, "big.obj:2: a NUL byte, expected plain text");
    unlink("big.obj");
    assert_int_equal(mkdir("folder.ini", 0700), 0);
    scratch_refused(*state, "folder.ini", NULL, "folder.ini: is a folder, expected a file");
    assert_int_equal(mkfifo("pipe.ini", 0600), 0);
    scratch_refused(*state, "pipe.ini", NULL, "pipe.ini: is not a regular file, expected one");
    scratch_refused(
        *state, "scene.in", NULL,
        "scene.in: cannot be opened: No such file or directory; expected a scene: .ini, "
        ".nff or .obj");
    write_text("scene.txt", "");
    scratch_refused(*state, "scene.txt", NULL,
                    "scene.txt: has an unknown extension, expected .ini, .nff or .obj");
    assert_int_equal(mkdir("folder", 0700), 0);
    scratch_refused(*state, "folder", NULL,
                    "folder: is a folder, expected a scene: .ini, .nff or .obj");
    write_text("here.ini", "");
    scratch_refused(*state, "here.ini", NULL,
                    "here.ini: has no sections, expected a scene with at least one");
    write_text("here.ini", "; nothing\n");
    scratch_refused(*state, "here.ini", NULL,
                    "here.ini: has no sections, expected a scene with at least one");
    scratch_refused(*state, "here", NULL, "here: is no scene, did you mean 'here.ini'?");
}

static void test_objects(void **state)
{
    struct scene *scene = loaded(state, "[sphere]\ncenter = 1 2 3\nradius = 4\nmaterial = later\n"
                                        "[cylinder]\nbase = 0 0 0\napex = 0 2 0\nradius = 3\n"
                                        "[cone]\nbase = 0 0 0\napex = 0 2 0\nbase_radius = 3\n"
                                        "[material later]\ncolor = 1 0 0\nior = 1.25\n" LIGHT);
    assert_int_equal(scene->primitives[PRIMITIVE_SPHERE].count, 1);
    assert_true(scene_spheres(scene)->center.z == 3 && scene_spheres(scene)->radius == 4);
    const struct material *material = &scene_materials(scene)[scene_spheres(scene)->material];
    assert_true(material->color.x == 1 && material->ior == 1.25 && material->shininess == 20);
    const struct cone *cones = scene_cones(scene);
    assert_int_equal(scene->primitives[PRIMITIVE_CONE].count, 2);
    assert_true(cones[0].apex_radius == 3 && cones[0].capped == 1 && cones[1].apex_radius == 0);
    material = &scene_materials(scene)[cones[0].material];
    assert_true(material->color.y == 0.8 && material->ambient == 0.1 && material->specular == 0.2);
    assert_true(material->diffuse == 0.7 && material->reflection == 0);
    assert_true(material->transmission == 0);
    free(scene);
}

#define BALL "[sphere]\ncenter = 0 0 0\nradius = 1\n"

static void test_warnings(void **state)
{
    struct scratch *s = *state;
    free(loaded(state, BALL));
    assert_string_equal(
        s->said, "scene.ini: warning: the scene has no light: surfaces show no more than their "
                 "ambient light and what they mirror or let through, until a [light] "
                 "lights them\n");
    /* Without objects it does not matter that no light is there. */
    free(loaded(state, "[image]\nwidth = 9\n"));
    assert_string_equal(s->said, "scene.ini: warning: the scene has no objects, the picture shows "
                                 "the background\n");
    free(loaded(state, LIGHT));
    assert_string_equal(s->said, "scene.ini: warning: the scene has no objects, the picture shows "
                                 "the background\n");
    free(loaded(state, LIGHT BALL "[material m]\nreflection = 0.5\ntransmission = 0.6\n"));
    assert_string_equal(s->said,
                        "scene.ini:8: warning: reflection and transmission together are 1.1, "
                        "more than 1: the surface gives off more light than it gets\n");
    free(loaded(state, LIGHT BALL "[material m]\ncolor = 1 0.5 255\n"));
    assert_string_equal(s->said, "scene.ini:7: warning: a component of the color is more than 1: "
                                 "the surface may give off more light than it gets (full white "
                                 "is 1 1 1)\n");
    free(scratch_scene(s, "scene.ini", "material m.color=0 1.5 0"));
    assert_string_equal(s->said, "material m.color=0 1.5 0: warning: a component of the color is "
                                 "more than 1: the surface may give off more light than it "
                                 "gets (full white is 1 1 1)\n");
    free(loaded(state, LIGHT BALL "[material m]\nreflection = 0.1\ntransmission = 0.9\n"));
    assert_string_equal(s->said, "");
}

static void test_includes(void **state)
{
    write_text("part.ini", "[material own]\ncolor = 0 1 0\n"
                           "[box]\nmin = 0 0 0\nmax = 1 2 3\nmaterial = own\n"
                           "[sphere]\ncenter = 1 0 0\nradius = 1\nmaterial = outer\n");
    struct scene *scene =
        loaded(state, "[material outer]\ncolor = 1 0 0\n"
                      "[material own]\ncolor = 0 0 1\n"
                      "[include a]\nfile = part.ini\ntranslate = 10 0 0\nscale = 2\n"
                      "rotate = 0 0 90\n"
                      "[include b]\nfile = part.ini\nrotate = 0 30 0\n" LIGHT);
    assert_int_equal(scene->primitives[PRIMITIVE_BOX].count, 1);
    const struct box *box = scene_boxes(scene);
    assert_true(box->min.x == 6 && box->max.x == 10 && box->min.y == 0 && box->max.y == 2 &&
                box->max.z == 6);
    assert_int_equal(scene->primitives[PRIMITIVE_TRIANGLE].count, 12);
    const struct material *materials = scene_materials(scene);
    assert_true(materials[box->material].color.y == 1);
    assert_true(materials[scene_spheres(scene)->material].color.x == 1);
    assert_true(scene_spheres(scene)->center.x == 10 && scene_spheres(scene)->center.y == 2);
    assert_true(scene_spheres(scene)->radius == 2);
    free(scene);
}

/* Inner first, then outer: each shift is scaled and turned by what lies around it. */
static void test_nested_placement(void **state)
{
    write_text("leaf.ini", "[sphere]\ncenter = 1 2 3\nradius = 1\n");
    write_text("middle.ini", "[include]\nfile = leaf.ini\ntranslate = 10 0 0\nscale = 3\n"
                             "rotate = 0 0 90\n");
    struct scene *scene = loaded(state, "[include]\nfile = middle.ini\ntranslate = 0 100 0\n"
                                        "scale = 2\nrotate = 90 0 0\n" LIGHT);
    /* (1 2 3) -> (-2 1 3) * 3 + (10 0 0) = (4 3 9) -> (4 -9 3) * 2 + (0 100 0) */
    const struct sphere *sphere = scene_spheres(scene);
    assert_true(sphere->center.x == 8 && sphere->center.y == 82 && sphere->center.z == 6);
    assert_true(sphere->radius == 6);
    free(scene);
}

/* Quarter turns are exact, also backwards and beyond a whole turn. */
static void test_quarter_turns(void **state)
{
    static const double sines[4] = {0, 1, 0, -1};
    for (int quarters = -7; quarters <= 7; quarters++) {
        double sine = sines[(quarters + 8) % 4], cosine = sines[(quarters + 9) % 4];
        struct placement turned = placement_make(vec3(0, 0, 90 * quarters), 1, vec3(0, 0, 0));
        assert_true(
            vec_is_same(placement_direction(&turned, vec3(1, 0, 0)), vec3(cosine, sine, 0)));
        assert_true(
            vec_is_same(placement_direction(&turned, vec3(0, 1, 0)), vec3(-sine, cosine, 0)));
        assert_true(placement_keeps_axes(&turned));
    }
}

/* A value that becomes infinite or zero by its placement: the message names the place of that, too. */
static void test_placed_too_far(void **state)
{
    write_text("part.ini", "[sphere ball]\ncenter = 1e200 0 0\nradius = 1e-200\n");
    write_text("part.nff", "s 1e200 0 0 1\n");
    write_text("mesh.obj", "v 0 0 0\nv 1e200 0 0\nv 0 1 0\nf 1 2 3\n");
    write_text("outer.ini", "[include]\nfile = part.ini\n");
    refused(state, "[include]\nfile = part.ini\nscale = 1e200\n",
            "part.ini:1: [sphere ball]: the center is not finite, expected three finite numbers "
            "(after scale of scene.ini:3)");
    refused(state, "[include]\nscale = 1e-200\nfile = outer.ini\n",
            "part.ini:1: [sphere ball]: the radius is out of range, expected a finite number > 0 "
            "(after scale of scene.ini:2)");
    refused(state, "[include]\nfile = part.nff\nscale = 1e200\n",
            "part.nff:1: the center is not finite, expected three finite numbers (after scale of "
            "scene.ini:3)");
    write_text("turned.ini", "[include]\nfile = part.ini\nscale = 1\nrotate = 0 90 0\n");
    refused(state, "[include]\nfile = turned.ini\nscale = 1e200\n",
            "part.ini:1: [sphere ball]: the center is not finite, expected three finite numbers "
            "(after scale of scene.ini:3)");
    refused(state, "[mesh]\nfile = mesh.obj\nscale = 1e200\n",
            "mesh.obj:2: a corner is not finite, expected three finite numbers (after scale of "
            "scene.ini:3)");
}

static void test_placed_kinds(void **state)
{
    write_text("part.ini",
               "[light]\nposition = 1 2 3\n"
               "[plane]\npoint = 1 0 0\nnormal = 1 0 0\n"
               "[disc]\ncenter = 1 0 0\nnormal = 1 0 0\nradius = 1.5\n"
               "[cone]\nbase = 1 0 0\napex = 2 0 0\nbase_radius = 3\napex_radius = 4\n");
    struct scene *scene = loaded(state, "[include]\nfile = part.ini\ntranslate = 10 20 30\n"
                                        "scale = 2\nrotate = 0 0 90\n");
    struct vec3 l = scene_lights(scene)->position;
    assert_true(l.x == 6 && l.y == 22 && l.z == 36);
    const struct plane *plane = scene_planes(scene);
    assert_true(plane->point.x == 10 && plane->point.y == 22 && plane->normal.y == 1);
    const struct disc *disc = scene_discs(scene);
    assert_true(disc->center.y == 22 && disc->normal.y == 1 && disc->radius == 3);
    const struct cone *cone = scene_cones(scene);
    assert_true(cone->base.y == 22 && cone->apex.y == 24);
    assert_true(cone->base_radius == 6 && cone->apex_radius == 8);
    free(scene);
}

/* Sixteen levels of two each are as many includes as there may be; one more is refused. */
static void test_include_count_limit(void **state)
{
    for (int i = 0; i < 16; i++) {
        char name[32], text[128];
        snprintf(name, sizeof name, "twice%d.ini", i);
        snprintf(text, sizeof text,
                 "[include]\nfile = twice%d.ini\n[include]\nfile = twice%d.ini\n", i + 1, i + 1);
        write_text(name, text);
    }
    write_text("twice16.ini", "");
    struct scratch *s = *state;
    struct job job;
    assert_false(scratch_load(s, "twice0.ini", NULL, &job));
    assert_non_null(strstr(s->said, "too many files are included, at most 65536 are possible"));
    assert_true(scratch_load(s, "twice4.ini", NULL, &job));
    job_free(&job);
}

/* Directions near the ends of the range of double. */
static void test_extreme_normals(void **state)
{
    static const char *const normals[] = {"0 1e-320 0", "0 4.9e-324 0", "0 1.7e308 0",
                                          "1.7e308 -1.7e308 1.7e308", "1e-160 3e-162 0"};
    for (size_t i = 0; i < sizeof normals / sizeof *normals; i++) {
        char text[300];
        snprintf(text, sizeof text,
                 "[plane]\npoint = 0 0 0\nnormal = %s\n"
                 "[disc]\ncenter = 0 0 0\nradius = 1\nnormal = %s\n" LIGHT,
                 normals[i], normals[i]);
        free(loaded(state, text));
    }
}

/* The triangles of a turned box: its volume by the divergence theorem is positive and right. */
static void test_turned_box_faces_outward(void **state)
{
    write_text("part.ini", "[box]\nmin = 1 1 1\nmax = 2 3 4\n");
    struct scene *scene =
        loaded(state, "[include]\nfile = part.ini\nrotate = 10 20 30\nscale = 2\n" LIGHT);
    const struct triangle *t = scene_triangles(scene);
    const struct vec3 *v = scene_vertices(scene);
    double volume = 0;
    for (int i = 0; i < 12; i++)
        volume += vec_dot(v[t[i].vertex[0]], vec_cross(v[t[i].vertex[1]], v[t[i].vertex[2]])) / 6;
    assert_true(fabs(volume - 48) < 1e-9);
    free(scene);
}

static void test_include_mistakes(void **state)
{
    write_text("self.ini", "[include again]\nfile = self.ini\n");
    scratch_refused(*state, "self.ini", NULL,
                    "self.ini:2: [include again]: the file includes itself, expected another one");
    write_text("inner.ini", "[image]\nwidth = 3\n");
    refused(state, "[include]\nfile = inner.ini\n",
            "inner.ini:1: settings such as [image] belong into the file that is rendered, expected "
            "only parts of a scene in an included file");
    refused(state, "[include]\nfile = none.nff\n",
            "scene.ini:2: [include]: cannot open none.nff: No such file or directory");
    refused(state, "[include]\nfile =\n",
            "scene.ini:2: [include]: no file is named, expected an INI or NFF file");
    write_text("x.obj", "");
    refused(state, "[include]\nfile = x.obj\n",
            "scene.ini:2: [include]: an OBJ file is no part to include, expected a [mesh] for it");
    refused(state, "[mesh]\nfile = x.stl\n",
            "scene.ini:2: [mesh]: the name of a mesh has to end with .obj");
    refused(state, "[mesh]\nfile = \"x.obj\"\n",
            "scene.ini:2: [mesh]: the name of a mesh has to end with .obj, without quotes");
    refused(state, "[mesh]\nfile =\n",
            "scene.ini:2: [mesh]: no file is named, expected an OBJ file");
    refused(state, "[mesh]\n", "scene.ini:1: [mesh] has no file, expected an OBJ file");
    refused(state, "[include]\nfile = \"none.ini\"\n",
            "scene.ini:2: [include]: cannot open \"none.ini\": No such file or directory; a name "
            "stands without quotes");
    refused(state, "[sphere]\ncenter = 0 0 0\nradius = 1\nmaterial =\n",
            "scene.ini:4: [sphere]: no material is named, expected the name of a [material]");
    for (int i = 0; i < 20; i++) {
        char name[32], text[64];
        snprintf(name, sizeof name, "deep%d.ini", i);
        snprintf(text, sizeof text, "[include]\nfile = deep%d.ini\n", i + 1);
        write_text(name, text);
    }
    write_text("deep20.ini", LIGHT);
    scratch_refused(
        *state, "deep0.ini", NULL,
        "deep16.ini:2: [include]: includes are nested too deeply, at most 16 levels are "
        "possible");
    free(scratch_scene(*state, "deep4.ini", NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_placed_kinds),
        cmocka_unit_test(test_placed_too_far),
        cmocka_unit_test(test_form),
        cmocka_unit_test(test_form_mistakes),
        cmocka_unit_test(test_limits),
        cmocka_unit_test(test_long_lines),
        cmocka_unit_test(test_comments_in_long_lines),
        cmocka_unit_test(test_unknown_names),
        cmocka_unit_test(test_bad_values),
        cmocka_unit_test(test_bad_combinations),
        cmocka_unit_test(test_messages_are_printable),
        cmocka_unit_test(test_files_that_are_none),
        cmocka_unit_test(test_objects),
        cmocka_unit_test(test_warnings),
        cmocka_unit_test(test_includes),
        cmocka_unit_test(test_turned_box_faces_outward),
        cmocka_unit_test(test_include_mistakes),
        cmocka_unit_test(test_nested_placement),
        cmocka_unit_test(test_quarter_turns),
        cmocka_unit_test(test_include_count_limit),
        cmocka_unit_test(test_extreme_normals),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
