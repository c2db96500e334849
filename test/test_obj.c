/* Tests of OBJ and MTL files, and of the normals that `smooth` computes. */
#include "test/random.h"
#include "test/scratch.h"

#include <math.h>
#include <sys/stat.h>

#define INI           "[light]\nposition = 1 2 3\n[mesh m]\nfile = mesh.obj\n"
#define SQUARE        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
#define MESH_MATERIAL "material = base\n[material base]\nshininess = 77\n"

static struct scene *loaded(void **state, const char *obj, const char *more)
{
    char text[1024];
    snprintf(text, sizeof text, INI "%s", more);
    write_text("scene.ini", text);
    write_text("mesh.obj", obj);
    return scratch_scene(*state, "scene.ini", NULL);
}

static void refused(void **state, const char *obj, const char *line)
{
    write_text("scene.ini", INI);
    write_text("mesh.obj", obj);
    scratch_refused(*state, "scene.ini", NULL, line);
}

static uint64_t triangles_of(const struct scene *scene)
{
    return scene->primitives[PRIMITIVE_TRIANGLE].count;
}

static uint64_t patches_of(const struct scene *scene)
{
    return scene->primitives[PRIMITIVE_PATCH].count;
}

static void test_faces(void **state)
{
    struct scene *scene = loaded(state,
                                 SQUARE "v 0.5 0.5 0 1.0\nv 2 2 0 0.5 0.5 0.5\nvt 0 0\nvn 0 0 2\n"
                                        "f 1 2 3 4\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\n"
                                        "f 1/1/1 2/1/1 3/1/-1\nf -6 -5 -4\nf 1 2 5 3 4\n",
                                 "");
    assert_int_equal(triangles_of(scene), 2 + 1 + 1 + 3);
    assert_int_equal(patches_of(scene), 2);
    assert_int_equal(scene->vertices.count, 6);
    assert_true(scene_normals(scene)->z == 1);
    const struct triangle *t = scene_triangles(scene);
    assert_int_equal(t[3].vertex[0], 0);
    assert_int_equal(t[3].vertex[2], 2);
    free(scene);
}

/* Up to four numbers may follow a vertex: a weight, a colour, or both. */
static void test_numbers_behind_vertices(void **state)
{
    struct scratch *s = *state;
    struct scene *scene =
        loaded(state, "v 0 0 0\nv 1 0 0 1\nv 1 1 0 .5 .5 .5\nv 0 1 0 1 .5 .5 .5\nf 1 2 3 4\n", "");
    assert_int_equal(triangles_of(scene), 2);
    assert_true(scene_vertices(scene)[3].x == 0 && scene_vertices(scene)[3].y == 1);
    assert_string_equal(s->said, "");
    free(scene);
}

/* An index may be missing after its slash, also at the end of the file. */
static void test_empty_indices(void **state)
{
    struct scratch *s = *state;
    struct scene *scene = loaded(state,
                                 SQUARE "vt 0 0\nvn 0 0 1\nf 1// 2// 3//\nf 1/ 2/ 3/ 4/\n"
                                        "f 1/1/ 2/-1/\\\n3/1/\r\nf 1/1/1 2//1 3//1\n"
                                        "f 1 2/ 3/1/1\nf 1// 2//1 3//\nf 1//1 2//1 3",
                                 "");
    assert_int_equal(triangles_of(scene), 1 + 2 + 1 + 1 + 1 + 1);
    assert_int_equal(patches_of(scene), 1);
    assert_string_equal(s->said, "");
    free(scene);
}

/* A bow tie is warned of once. */
static void test_crossing_polygons(void **state)
{
    struct scratch *s = *state;
    struct scene *scene = loaded(state, SQUARE "f 1 2 4 3\nf 1 2 4 3\n", "");
    assert_int_equal(triangles_of(scene), 4);
    assert_string_equal(
        s->said,
        "mesh.obj:5: warning: a polygon crosses itself or is bent so far that its triangles "
        "overlap, which may look wrong\n");
    free(scene);
}

static void test_text_form(void **state)
{
    struct scene *scene =
        loaded(state,
               "\xef\xbb\xbf# a mesh\r\no thing\r\ng a b\\\n c\r\ns off\r\n"
               "v 0 \\\r\n 0 0\r\n  v\t1 0 0 # x\r\nv 1 1 0\r\nf 1 2\\\n3\r\nf 1 2 3",
               "");
    assert_int_equal(triangles_of(scene), 2);
    free(scene);
    write_text("mesh.obj", "v 0 0 0\nv 1 0\\\n 0\nv 1 1 x\n");
    scratch_refused(*state, "scene.ini", NULL, "mesh.obj:4: 'v' needs three finite numbers");
}

static const struct material *material_of(const struct scene *scene, int triangle)
{
    return &scene_materials(scene)[scene_triangles(scene)[triangle].material];
}

/* A backslash at the end of a line continues it, also within the names of material files and materials. */
static void test_names_on_two_lines(void **state)
{
    struct scratch *s = *state;
    write_text("one.mtl", "newmtl red\nKd 0.5 0.25 0\n");
    write_text("two.mtl", "newmtl dark blue\nKd 0 0 1\n");
    struct scene *scene = loaded(state,
                                 "mtllib one.mtl \\\n two.mtl\n" SQUARE "usemtl \\\r\n red\n"
                                 "f 1 2 3\nusemtl dark\\\nblue \\\n\nf 1 3 4\n",
                                 "");
    assert_int_equal(triangles_of(scene), 2);
    assert_true(material_of(scene, 0)->color.x == 0.5 && material_of(scene, 1)->color.z == 1);
    assert_string_equal(s->said, "");
    free(scene);
    refused(state, "mtllib \\\n\n", "mesh.obj:2: 'mtllib' needs the name of a file");
}

/* Files without any LF, the material file included. */
static void test_lines_that_end_by_cr(void **state)
{
    struct scratch *s = *state;
    write_text("paint.mtl", "# paints\rnewmtl red\rKd 0.5 0.25 0\rnewmtl blue\rKd 0 0 1\r");
    struct scene *scene =
        loaded(state,
               "# a mesh\rmtllib paint.mtl\ro thing\rv 0 0 0\rv 1 0 \\\r 0\rv 1 1 0\r"
               "usemtl red\rf 1 2 3",
               "");
    assert_int_equal(triangles_of(scene), 1);
    const struct vec3 *color = &material_of(scene, 0)->color;
    assert_true(color->x == 0.5 && color->y == 0.25 && color->z == 0);
    assert_string_equal(s->said, "");
    free(scene);
    refused(state, "v 0 0 0\rv 1 0 x\r", "mesh.obj:2: 'v' needs three finite numbers");
}

static void test_statements_left_out(void **state)
{
    struct scratch *s = *state;
    free(loaded(state, SQUARE "l 1 2\np 1\ncurv 0 1\nf 1 2 3\nfacet 1 2 3\nF 1 2 3\n", ""));
    assert_string_equal(
        s->said,
        "mesh.obj:5: warning: 'l' is left out: lines, points, curves and curved surfaces are not "
        "rendered\n"
        "mesh.obj:9: warning: unknown statement 'facet' is left out, as are others after it\n");
}

/* A comment may follow a number at once, also one that ends in a point. */
static void test_comments_behind_numbers(void **state)
{
    struct scratch *s = *state;
    write_text("paint.mtl", "newmtl red\nKd 1 0 1.#z\nNs 1.#\n");
    struct scene *scene = loaded(state,
                                 "mtllib paint.mtl\nv 0 0 1.#z\nv 1 0 1.# INF\nv 1 1 -1.#i\n"
                                 "v 1 1 2.#INF\nv 1 1 1.0#INF\nusemtl red\nf 1 2 3\n",
                                 "");
    assert_true(material_of(scene, 0)->shininess == 1);
    assert_true(material_of(scene, 0)->color.z == 1);
    assert_string_equal(s->said, "");
    free(scene);
}

/* Programs write glass whose shares are above 1 together, in files of hundreds of materials. */
static void test_gain_is_told_once(void **state)
{
    struct scratch *s = *state;
    write_text("gain.mtl", "newmtl a\nKs 0.5 0.5 0.5\nd 0.25\nillum 4\nKd 2 1 1\n"
                           "newmtl b\nKs 0.75 0.5 0.5\nd 0.25\nillum 4\nKd 1 2 1\n");
    free(loaded(state, "mtllib gain.mtl\n" SQUARE "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n", ""));
    assert_string_equal(s->said,
                        "gain.mtl:1: warning: reflection and transmission together are 1.25, more "
                        "than 1: the surface gives off more light than it gets, as may others "
                        "after it\n"
                        "gain.mtl:5: warning: a component of the color is more than 1: the surface "
                        "may give off more light than it gets (full white is 1 1 1), as may others "
                        "after it\n");
}

/* What other programs store beside a mesh. */
static void test_attributes_say_nothing(void **state)
{
    struct scratch *s = *state;
    free(loaded(state,
                SQUARE "vt 0 0\nvp 0\no a\ng b c\ns off\nmg 1 0.5\nbevel on\nc_interp off\n"
                       "d_interp off\nlod 3\nshadow_obj a.obj\ntrace_obj a.obj\nctech cparm 1\n"
                       "stech cparma 1 1\nmaplib a.map\nusemap a\nusemap off\nf 1 2 3\n",
                ""));
    assert_string_equal(s->said, "");
}

/* Some programs write no numbers as the normals of faces without an area. */
static void test_normals_that_are_no_numbers(void **state)
{
    static const char *const spellings[] = {
        "nan",       "NaN",   "-nan",    "inf",      "-Infinity", "+1.#QNAN",    "-1.#IND0",
        "-nan(ind)", "inf()", "nan\\\n", "1.#snan1", "1.#NAN",    "1.#INF\\\r\n"};
    struct scratch *s = *state;
    for (size_t i = 0; i < sizeof spellings / sizeof *spellings; i++) {
        char text[256];
        snprintf(text, sizeof text,
                 SQUARE "vn 0 0 1\nvn 0 %s 0\nvn %s 0 nan # x\nf 1//1 2//1 3//1\n"
                        "f 1//2 2//2 3//1\nf 2//3 3//3 4//3\n",
                 spellings[i], spellings[i]);
        struct scene *scene = loaded(state, text, "");
        assert_int_equal(patches_of(scene), 1);
        assert_int_equal(triangles_of(scene), 2);
        assert_string_equal(
            s->said,
            strchr(spellings[i], '\n')
                ? "mesh.obj:7: warning: normals that are not finite count as none, the first one "
                  "here\n"
                : "mesh.obj:6: warning: normals that are not finite count as none, the first "
                  "one here\n");
        free(scene);
    }
    static const char *const others[] = {
        "nancy",       "information", "nan(", "nan(x", "nan(x)y", "(nan)",  "--nan",
        "infinity(x)", "infinite",    "1.#",  "1.#x",  "1.#i",    "2.#INF", "1#INF"};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        char text[64];
        snprintf(text, sizeof text, "vn nan 0 %s\n", others[i]);
        refused(state, text,
                strchr(others[i], '#')
                    ? "mesh.obj:1: warning: normals that are not finite count as none, the first "
                      "one here\n"
                      "mesh.obj: has no faces, expected a mesh with at least one 'f'"
                    : "mesh.obj:1: 'vn' needs three finite numbers");
    }
    refused(state, "vn 0 0 nan 1\n", "mesh.obj:1: 'vn' needs three finite numbers");
    refused(state, "vn 0 nan\n", "mesh.obj:1: 'vn' needs three finite numbers");
    refused(state, "vn 0 nan x\n", "mesh.obj:1: 'vn' needs three finite numbers");
    refused(state, "vn nan 0 1e999\n",
            "mesh.obj:1: a number is out of range, expected none beyond 1.79e308");
}

/* Blender writes no name for faces without a material, TrenchBroom for those of a material that has none. */
static void test_material_without_a_name(void **state)
{
    struct scratch *s = *state;
    write_text("blank.mtl", "newmtl\nKd 0 0 1\n");
    struct scene *scene = loaded(
        state, SQUARE "usemtl red\nf 1 2 3\nusemtl\nf 1 3 4\nmtllib blank.mtl\nusemtl \nf 1 2 4\n",
        "material = own\n[material own]\ncolor = 0.5 0 0\n[material red]\ncolor = 1 0 0\n");
    assert_int_equal(triangles_of(scene), 3);
    assert_true(material_of(scene, 0)->color.x == 1 && material_of(scene, 1)->color.x == 0.5 &&
                material_of(scene, 2)->color.z == 1);
    assert_string_equal(s->said, "");
    free(scene);
}

static void test_mistakes(void **state)
{
#define FOUR "that is not there, only 4 are defined so far"
#define CORNER                                                                                     \
    "is no corner of a face, expected indices of defined vertices such as 1, 1/2, 1//3 or 1/2/3"
    refused(state, "v 1 2\n", "mesh.obj:1: 'v' needs three finite numbers");
    refused(state, "v 1 2 3 4 5 6 7 8\n", "mesh.obj:1: 'v' needs three to seven finite numbers");
    refused(state, "v 1 2 nan\n", "mesh.obj:1: 'v' needs three finite numbers");
    refused(state, "v 1 2 1.#QNAN\n", "mesh.obj:1: 'v' needs three finite numbers");
    refused(state, "v 1 2 -1.#IND 1\n", "mesh.obj:1: 'v' needs three finite numbers");
    refused(state, "vn 0 1\n", "mesh.obj:1: 'vn' needs three finite numbers");
    refused(state, SQUARE "f 1 2\n", "mesh.obj:5: 'f' needs at least three corners");
    refused(state, SQUARE "f\n", "mesh.obj:5: 'f' needs at least three corners");
    refused(state, SQUARE "f 1 2 5\n", "mesh.obj:5: '5' names a vertex " FOUR);
    refused(state, SQUARE "f 1 2 0\n", "mesh.obj:5: '0' " CORNER);
    refused(state, SQUARE "f 1 2 -5\n", "mesh.obj:5: '-5' names a vertex " FOUR);
    refused(state, SQUARE "f 1 2 4294967297\n", "mesh.obj:5: '4294967297' names a vertex " FOUR);
    refused(state, SQUARE "f 1 2 99999999999999999999999\n",
            "mesh.obj:5: '99999999999999999999999' names a vertex " FOUR);
    /* modulo 2^64 it would be 3 */
    refused(state, SQUARE "f 1 2 18446744073709551619\n",
            "mesh.obj:5: '18446744073709551619' names a vertex " FOUR);
    refused(state, SQUARE "f 1 2 3//1\n",
            "mesh.obj:5: '3//1' names a normal that is not there, only 0 are defined so far");
    refused(state, "v 0 0 0\nf 1 2/1 3\n",
            "mesh.obj:2: '2/1' names a vertex that is not there, only 1 is defined so far");
    refused(state, SQUARE "f 1 2 5.0\n", "mesh.obj:5: '5.0' " CORNER);
    refused(state, SQUARE "f 1 2 3///\n", "mesh.obj:5: '3///' " CORNER);
    refused(state, SQUARE "f 1 2 3/-\n", "mesh.obj:5: '3/-' " CORNER);
    refused(state, SQUARE "f 1 2 3//-\n", "mesh.obj:5: '3//-' " CORNER);
    refused(state, SQUARE "f 1 2 3/x\n", "mesh.obj:5: '3/x' " CORNER);
    refused(state, SQUARE "f 1 2 /\n", "mesh.obj:5: '/' " CORNER);
    refused(state, "v 1e400 0 0\n",
            "mesh.obj:1: a number is out of range, expected none beyond 1.79e308");
    refused(state, "v 0 0 0\nvn 0 -1e999 0\n",
            "mesh.obj:2: a number is out of range, expected none beyond 1.79e308");
    refused(state, "", "mesh.obj: has no faces, expected a mesh with at least one 'f'");
    refused(state, "solid ball\n",
            "mesh.obj:1: warning: unknown statement 'solid' is left out, as are others after it\n"
            "mesh.obj: has no faces, expected a mesh with at least one 'f'");
    refused(state, "mtllib .\n",
            "mesh.obj:1: '.' is no regular file, expected a file of materials");
    refused(state, SQUARE "f 1 2 3.0\n", "mesh.obj:5: '3.0' " CORNER);
    refused(state, SQUARE "mtllib\n", "mesh.obj:5: 'mtllib' needs the name of a file");
}

static void test_materials(void **state)
{
    struct scratch *s = *state;
    write_text("a b.mtl", "# comment\nignored 1\nnewmtl red\nKa 1 1 1\nKd 1 0 0\nKs 0.2 0.4 0.3\n"
                          "Ns 50\nd 0.75\nNi 1.4\nillum 3\nmap_Kd x.png\n"
                          "newmtl dull\nKd 0.5\nKs 1 1 1\nTr 0.25\nillum 2\n");
    write_text("c.mtl", "newmtl green\nKd 0 1 0\nKs 2 2 2\nillum 3\n");
    struct scene *scene =
        loaded(state,
               "mtllib a b.mtl\nmtllib c.mtl\n" SQUARE
               "f 1 2 3\nusemtl red\nf 1 2 3\nusemtl dull\nf 2 3 4\n"
               "usemtl green\nf 1 2 3\nusemtl ours\nf 1 2 3\nusemtl none\nf 1 2 3\n"
               "usemtl red\nf 1 3 4\nusemtl none\nf 1 2 3\n",
               MESH_MATERIAL "[material ours]\nshininess = 88\n");
    assert_true(material_of(scene, 0)->shininess == 77);
    const struct material *red = material_of(scene, 1);
    assert_true(red->color.x == 1 && red->color.y == 0);
    assert_true(red->diffuse == 0.75 && red->ambient == 0.1 * 0.75);
    assert_true(red->specular == 0.4 && red->reflection == 0.4 && red->shininess == 50);
    assert_true(red->transmission == 0.25 && red->ior == 1.4);
    const struct material *dull = material_of(scene, 2);
    assert_true(dull->color.z == 0.5 && dull->reflection == 0 && dull->transmission == 0.25);
    assert_true(dull->diffuse == 0.75 && dull->specular == 1);
    const struct material *green = material_of(scene, 3);
    assert_true(green->transmission == 0 && green->diffuse == 1 && green->ambient == 0.1);
    /* No mirror reflects more light than it gets. */
    assert_true(material_of(scene, 3)->color.y == 1 && material_of(scene, 3)->reflection == 1);
    assert_true(material_of(scene, 4)->shininess == 88);
    assert_true(material_of(scene, 5)->shininess == 77);
    assert_ptr_equal(material_of(scene, 6), red);
    assert_string_equal(s->said,
                        "a b.mtl:11: warning: 'map_Kd' is left out: textures are not read, "
                        "the color is used alone\n"
                        "mesh.obj:16: warning: no material is called 'none', the mesh's "
                        "own is used, expected one of base ours red dull green\n");
    free(scene);
}

/* A material library applies from the line where it is named. */
static void test_library_between_uses(void **state)
{
    struct scratch *s = *state;
    write_text("one.mtl", "newmtl red\nKd 1 0 0\nnewmtl other\nKd 0 0 1\n");
    write_text("two.mtl", "newmtl red\nKd 0 1 0\n");
    struct scene *scene =
        loaded(state,
               SQUARE "usemtl red\nf 1 2 3\nmtllib one.mtl\nf 1 2 3\nusemtl red\nf 1 2 3\n"
                      "usemtl other\nf 1 2 3\nmtllib two.mtl\nusemtl red\nf 1 2 3\n"
                      "usemtl other\nf 1 2 3\n",
               MESH_MATERIAL);
    assert_true(material_of(scene, 0)->shininess == 77 && material_of(scene, 1)->shininess == 77);
    assert_true(material_of(scene, 2)->color.x == 1 && material_of(scene, 3)->color.z == 1);
    assert_true(material_of(scene, 4)->color.x == 0 && material_of(scene, 4)->color.y == 1);
    assert_true(material_of(scene, 5)->color.z == 1);
    assert_string_equal(s->said,
                        "mesh.obj:5: warning: no material is called 'red', the mesh's own is "
                        "used, expected one of base\n");
    free(scene);
}

/* What stands before the first material of a file belongs to none, not to the last one of the file before, whose
 * materials are complete. */
static void test_statements_before_materials(void **state)
{
    struct scratch *s = *state;
    write_text("one.mtl", "newmtl glass\nKd 1 0 0\nd 0.5\n");
    write_text("two.mtl", "Kd 0 1 0\nd 0\nnewmtl blue\nKd 0 0 1\n");
    struct scene *scene = loaded(state,
                                 "mtllib one.mtl\nmtllib two.mtl\n" SQUARE
                                 "usemtl glass\nf 1 2 3\nusemtl blue\nf 1 3 4\n",
                                 "");
    const struct material *glass = material_of(scene, 0);
    assert_true(glass->color.x == 1 && glass->color.y == 0 && glass->transmission == 0.5);
    assert_true(glass->diffuse == 0.5 && glass->ambient == 0.05);
    assert_true(material_of(scene, 1)->color.z == 1 && material_of(scene, 1)->transmission == 0);
    assert_string_equal(s->said, "");
    free(scene);
}

static void test_warnings_of_gain(void **state)
{
    struct scratch *s = *state;
    write_text("gain.mtl", "newmtl glass\nillum 7\nKs 1 1 1\nd 0.1\n"
                           "newmtl red\nKd 255 0 0\nnewmtl mirror\nillum 3\nKs 1 1 1\n");
    free(loaded(state,
                "mtllib gain.mtl\n" SQUARE "usemtl glass\nf 1 2 3\nusemtl red\nf 1 2 3\n"
                "usemtl glass\nf 2 3 4\nmtllib gain.mtl\n",
                ""));
    assert_string_equal(s->said,
                        "gain.mtl:1: warning: reflection and transmission together are 1.9, more "
                        "than 1: the surface gives off more light than it gets, as may others "
                        "after it\n"
                        "gain.mtl:6: warning: a component of the color is more than 1: the "
                        "surface may give off more light than it gets (full white is 1 1 1), as "
                        "may others after it\n");
}

static void test_one_warning_of_textures(void **state)
{
    struct scratch *s = *state;
    write_text("bark.mtl", "newmtl bark\nKd 1 0 0\nmap_Kd bark.png\nbump -bm 1 bark_n.png\n"
                           "newmtl leaf\nKd 0 1 0\nmap_d leaf.png\n");
    write_text("leaf.mtl", "newmtl twig\nKe 0 0 0\nBump twig.png\n");
    struct scene *scene =
        loaded(state, "mtllib bark.mtl leaf.mtl\n" SQUARE "usemtl leaf\nf 1 2 3\n", "");
    assert_true(material_of(scene, 0)->color.y == 1 && material_of(scene, 0)->color.x == 0);
    assert_string_equal(s->said,
                        "bark.mtl:3: warning: 'map_Kd' is left out: textures are not read, the "
                        "color is used alone\n"
                        "leaf.mtl:3: warning: 'Bump' is left out: textures are not read, the color "
                        "is used alone\n");
    free(scene);
}

/* Emission is warned of once; emission of zero is not warned of, nor is an invalid colour. */
static void test_one_warning_of_emission(void **state)
{
    struct scratch *s = *state;
    write_text("lamp.mtl", "newmtl wall\nKe 0 0 0\nKe 0\nKe red\nKe spectral a.rfl\n"
                           "newmtl lamp\nKe 0 0.5 0\nnewmtl fire\nKe 2\n");
    free(loaded(state, "mtllib lamp.mtl\n" SQUARE "usemtl lamp\nf 1 2 3\n", ""));
    assert_string_equal(s->said,
                        "lamp.mtl:7: warning: 'Ke' is left out: surfaces give off no light "
                        "of their own, lights alone do\n");
}

/* Keys are case-sensitive; values of keys in another case are ignored. */
static void test_keys_in_another_case(void **state)
{
    struct scratch *s = *state;
    write_text("case.mtl", "newmtl a\nkd 1 0 0\nKD 1 0 0\nka 1 1 1\n");
    struct scene *scene = loaded(state, "mtllib case.mtl\n" SQUARE "usemtl a\nf 1 2 3\n", "");
    assert_true(material_of(scene, 0)->color.y == 0.8);
    assert_string_equal(s->said, "case.mtl:2: warning: 'kd' is left out, did you mean 'Kd'?\n");
    free(scene);
    write_text("case.mtl", "Kd 1 1 1\nNewMtl a\n");
    free(loaded(state, "mtllib case.mtl\n" SQUARE "f 1 2 3\n", ""));
    assert_string_equal(s->said,
                        "case.mtl:2: warning: 'NewMtl' is left out, did you mean 'newmtl'?\n");
}

/* A name that is defined twice is listed once in the hint. */
static void test_unknown_name_of_a_material(void **state)
{
    struct scratch *s = *state;
    write_text("metals.mtl", "newmtl gold\nKd 1 1 0\nnewmtl gold\nnewmtl tin\n");
    free(loaded(state, "mtllib metals.mtl\n" SQUARE "usemtl gld\nf 1 2 3\n", ""));
    assert_string_equal(s->said,
                        "metals.mtl:3: warning: material 'gold' is defined in line 1, too; the "
                        "last one counts\n"
                        "mesh.obj:6: warning: no material is called 'gld', grey is used, "
                        "did you mean 'gold'?\n");
    free(loaded(state, SQUARE "usemtl gld\nf 1 2 3\n", ""));
    assert_string_equal(s->said,
                        "mesh.obj:5: warning: no material is called 'gld', grey is used\n");
    free(
        loaded(state, "mtllib metals.mtl\n" SQUARE "usemtl silver\nf 1 2 3\n", "[material tin]\n"));
    assert_string_equal(s->said,
                        "metals.mtl:3: warning: material 'gold' is defined in line 1, too; the "
                        "last one counts\n"
                        "mesh.obj:6: warning: no material is called 'silver', grey is used, "
                        "expected one of tin gold\n");
}

static void test_missing_library(void **state)
{
    struct scratch *s = *state;
    free(loaded(state, "mtllib none.mtl\n" SQUARE "usemtl red\nf 1 2 3\n", ""));
    assert_string_equal(s->said, "mesh.obj:1: warning: the material file 'none.mtl' is missing\n");
    write_text("bad.mtl", "newmtl red\nKd 1 x 0\n");
    refused(state, "mtllib bad.mtl\n",
            "bad.mtl:2: 'Kd' needs a colour: three numbers >= 0, or one for all three");
}

/* One that may not be read: root, who may read all, takes another user's rights meanwhile. */
static void test_closed_library(void **state)
{
    uid_t user = geteuid();
    write_text("closed.mtl", "newmtl red\n");
    write_text("scene.ini", INI);
    write_text("mesh.obj", SQUARE "mtllib closed.mtl\n");
    assert_int_equal(chmod("closed.mtl", 0), 0);
    assert_int_equal(chmod(".", 0755), 0);
    if (user == 0) assert_int_equal(seteuid(65534), 0);
    scratch_refused(*state, "scene.ini", NULL,
                    "mesh.obj:5: cannot open closed.mtl: Permission denied");
    assert_int_equal(seteuid(user), 0);
}

/* A '#' may begin the name of a library. After other words it begins a comment, unless a file has that name. */
static void test_comment_behind_a_library(void **state)
{
    struct scratch *s = *state;
    write_text("one.mtl", "newmtl red\nKd 1 0 0\n");
    write_text("#2.mtl", "newmtl blue\nKd 0 0 1\n");
    struct scene *scene = loaded(state,
                                 "mtllib one.mtl #2.mtl\nmtllib one.mtl # my paints\n" SQUARE
                                 "usemtl blue\nf 1 2 3\nusemtl gren\nf 2 3 4\n",
                                 "");
    assert_true(material_of(scene, 0)->color.z == 1);
    assert_string_equal(s->said, "mesh.obj:9: warning: no material is called 'gren', grey is used, "
                                 "did you mean 'red'?\n");
    free(scene);
    free(loaded(state, "mtllib #3.mtl\n" SQUARE "f 1 2 3\n", ""));
    assert_non_null(
        strstr(s->said, "mesh.obj:1: warning: the material file '#3.mtl' is missing\n"));
}

static void test_legal_forms_of_materials(void **state)
{
    struct scratch *s = *state;
    write_text("forms.mtl",
               "newmtl a\nd -halo 0.5\nKd spectral f.rfl 1.0\nKs xyz 1 1 1\nd 0.25\nTr 0.5\n"
               "newmtl b\nTr 0.5\nd 0.25\nKs 0.5 0.5 0.5\nillum 1\n"
               "newmtl c\nKs 0.5 0.5 0.5\nillum 0\nKd xyz 1 1 1\n"
               "newmtl d\nKs 0.5 0.5 0.5\nNi 1.25\n");
    struct scene *scene =
        loaded(state,
               "mtllib forms.mtl\n" SQUARE "usemtl a\nf 1 2 3\nusemtl b\nf 2 3 4\n"
               "usemtl c\nf 1 2 3\nusemtl d\nf 1 2 3\n",
               "");
    const struct material *m = material_of(scene, 0);
    assert_true(m->transmission == 0.75 && m->color.x == 0.8 && m->specular == 0 && m->ior == 1);
    m = material_of(scene, 1);
    assert_true(m->transmission == 0.75 && m->specular == 0);
    m = material_of(scene, 2);
    assert_true(m->specular == 0 && m->color.x == 0.8);
    m = material_of(scene, 3);
    assert_true(m->specular == 0.5 && m->ior == 1.25);
    assert_string_equal(s->said,
                        "forms.mtl:2: warning: '-halo' is left out, 'd' is the same all over\n"
                        "forms.mtl:3: warning: colours given as 'spectral' are left out, only red, "
                        "green and blue are known\n");
    free(scene);
    write_text("bad.mtl", "newmtl a\nKd 1e999 0 0\n");
    refused(state, "mtllib bad.mtl\n",
            "bad.mtl:2: 'Kd': a number is out of range, expected none beyond 1.79e308");
    write_text("bad.mtl", "newmtl a\nKd 1 0 -1\n");
    scratch_refused(*state, "scene.ini", NULL,
                    "bad.mtl:2: 'Kd' needs a colour: three numbers >= 0, or one for all three");
    write_text("bad.mtl", "newmtl a\nNs 1e16\n");
    scratch_refused(*state, "scene.ini", NULL, "bad.mtl:2: 'Ns' needs a number from 0 to 1e15");
    static const char *const models[] = {"-1", "1.5", "11", "nan", "x"};
    for (size_t i = 0; i < sizeof models / sizeof *models; i++) {
        char mtl[64];
        snprintf(mtl, sizeof mtl, "newmtl a\nillum %s\n", models[i]);
        write_text("bad.mtl", mtl);
        scratch_refused(*state, "scene.ini", NULL,
                        "bad.mtl:2: 'illum' needs a whole number from 0 to 10");
    }
    write_text("bad.mtl", "newmtl a\nd -halo 1.5\n");
    scratch_refused(*state, "scene.ini", NULL, "bad.mtl:2: 'd' needs a number from 0 to 1");
}

/* An index of 0 counts as not given, with a warning if the material transmits light. An invalid index is still an
 * error. */
static void test_index_of_refraction_of_0(void **state)
{
    struct scratch *s = *state;
    write_text("zero.mtl", "newmtl a\nNi 0.000000\nd 1\n");
    struct scene *scene = loaded(state, "mtllib zero.mtl\n" SQUARE "usemtl a\nf 1 2 3\n", "");
    assert_true(material_of(scene, 0)->ior == 1);
    assert_string_equal(s->said, "");
    free(scene);
    write_text("zero.mtl", "newmtl a\nNi 0\nnewmtl b\nNi 1.5\nNi 0\nTr 0.5\n"
                           "newmtl c\nd 0.25\nNi 0\nnewmtl d\nd 0.5\nNi 0\nNi 1.25\n");
    scene = loaded(state, "mtllib zero.mtl\n" SQUARE "usemtl b\nf 1 2 3\nusemtl d\nf 2 3 4\n", "");
    assert_true(material_of(scene, 0)->ior == 1 && material_of(scene, 1)->ior == 1.25);
    assert_string_equal(s->said,
                        "zero.mtl:5: warning: 'Ni' is 0 and counts as not given: light that "
                        "is let through is not bent\n");
    free(scene);
    write_text("zero.mtl", "newmtl d\nd 0.5\nNi 0\nNi 1.25\n"); /* given after all */
    free(loaded(state, "mtllib zero.mtl\n" SQUARE "usemtl d\nf 1 2 3\n", ""));
    assert_string_equal(s->said, "");
    static const char *const mistakes[] = {"-1", "nan", "-1e-300", "inf", "x"};
    for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; i++) {
        char mtl[64];
        snprintf(mtl, sizeof mtl, "newmtl a\nNi %s\n", mistakes[i]);
        write_text("bad.mtl", mtl);
        refused(state, "mtllib bad.mtl\n",
                "bad.mtl:2: 'Ni' needs an index of refraction, a number >= 0");
    }
}

/* The latest definition of a name counts, with a warning where it is in the same file, one per file; a file named again
 * is not read again. */
static void test_libraries_and_names(void **state)
{
    struct scratch *s = *state;
    const char *twice =
        "one.mtl:3: warning: material 'm' is defined in line 1, too; the last one counts\n";
    write_text("one.mtl", "newmtl m\nKd 1 0 0\nnewmtl m\nKd 0 1 0\nnewmtl m\nKd 0 1 0\n");
    write_text("two.mtl", "newmtl m\nKd 0 0 1\n");
    struct scene *scene = loaded(state, "mtllib one.mtl\n" SQUARE "usemtl m\nf 1 2 3\n", "");
    assert_true(material_of(scene, 0)->color.y == 1 && material_of(scene, 0)->color.x == 0);
    assert_string_equal(s->said, twice);
    free(scene);
    scene = loaded(state,
                   "mtllib one.mtl\nmtllib two.mtl\nmtllib one.mtl\nmtllib gone.mtl\n"
                   "mtllib gone.mtl\nmtllib ./one.mtl\n" SQUARE "usemtl m\nf 1 2 3\n",
                   "");
    assert_true(material_of(scene, 0)->color.z == 1);
    assert_ptr_equal(strstr(s->said, twice), s->said);
    assert_string_equal(s->said + strlen(twice),
                        "mesh.obj:4: warning: the material file 'gone.mtl' is missing\n");
    free(scene);

    enum { NAMES = 3000 };
    size_t size = NAMES * 64, used = 0;
    char *mtl = allocate(size, 1), *obj = allocate(size, 1);
    for (int i = 0; i < NAMES; i++)
        used += (size_t)snprintf(mtl + used, size - used, "newmtl n%d\nNs %d\n", i, i);
    write_text("many.mtl", mtl);
    used = (size_t)snprintf(obj, size, "mtllib many.mtl\n" SQUARE);
    for (int i = 0; i < NAMES; i++)
        used += (size_t)snprintf(obj + used, size - used, "usemtl n%d\nf 1 2 3\n", i + 10);
    scene = loaded(state, obj, "");
    for (int i = 0; i < NAMES - 10; i++)
        assert_true(material_of(scene, i)->shininess == i + 10);
    const char *rest = "mesh.obj: warning: 5 more names of materials are not known\n";
    assert_non_null(strstr(s->said, "'n3004'"));
    assert_null(strstr(s->said, "'n3005'"));
    assert_string_equal(s->said + strlen(s->said) - strlen(rest), rest);
    free(scene);
    free(mtl);
    free(obj);
}

/* Every mesh has its own vertices and normals, independent of the meshes before it. */
static void test_several_smooth_meshes(void **state)
{
    write_text("mesh.obj", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 1 2 0\nv 0 2 0\n"
                           "f 2 3 4 5\nf 5 4 6 7\n");
    write_text("scene.ini", INI "smooth = 180\n[mesh b]\nfile = mesh.obj\nsmooth = 180\n"
                                "rotate = 0 0 90\n");
    struct scene *scene = scratch_scene(*state, "scene.ini", NULL);
    assert_int_equal(patches_of(scene), 8);
    assert_int_equal(scene->vertices.count, 14);
    const struct patch *patches = scene_patches(scene);
    const struct vec3 *normals = scene_normals(scene);
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++) {
            struct vec3 a = normals[patches[i].normal[k]], b = normals[patches[i + 4].normal[k]];
            assert_int_equal(patches[i + 4].vertex[k], patches[i].vertex[k] + 7);
            assert_true(b.x == -a.y && b.y == a.x && b.z == a.z);
        }
    free(scene);
}

/* A grid of quads whose corners were moved up and down at random keeps all its triangles. */
static void test_bumpy_grid(void **state)
{
    enum { EDGE = 40 };
    size_t size = 200000, used = 0;
    char *obj = allocate(size, 1);
    uint64_t random = 1;
    for (int i = 0; i < EDGE * EDGE; i++) {
        used += (size_t)snprintf(obj + used, size - used, "v %d %d %.9f\n", i % EDGE, i / EDGE,
                                 random_between(&random, 0, 2));
    }
    for (int i = 0; i < EDGE * EDGE; i++)
        if (i % EDGE + 1 < EDGE && i / EDGE + 1 < EDGE)
            used += (size_t)snprintf(obj + used, size - used, "f %d %d %d %d\n", i + 1, i + 2,
                                     i + EDGE + 2, i + EDGE + 1);
    struct scene *scene = loaded(state, obj, "");
    assert_int_equal(triangles_of(scene), 2 * (EDGE - 1) * (EDGE - 1));
    free(scene);
    free(obj);
}

static void test_placement(void **state)
{
    struct scene *scene = loaded(state, "v 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nf 1//1 2//1 3//1\n",
                                 "rotate = 90 0 90\nscale = 2\ntranslate = 10 20 30\n");
    const struct vec3 *v = scene_vertices(scene);
    /* About x: z goes to -y; then about z: -y goes to x. */
    assert_true(v[0].x == 10 && v[0].y == 22 && v[0].z == 30);
    assert_true(v[2].x == 12 && v[2].y == 20 && v[2].z == 30);
    assert_true(scene_normals(scene)->x == 1);
    free(scene);
}

/* A roof: two faces that meet at a right angle. */
#define ROOF "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 1 2 0\nv 0 2 0\nf 1 2 3 4\nf 4 3 5 6\n"

static void test_crease_angle(void **state)
{
    static const struct {
        const char *smooth;
        uint64_t patches;
    } cases[] = {{"", 0},
                 {"smooth = no\n", 0},
                 {"smooth = yes\n", 0},
                 {"smooth = 89\n", 0},
                 {"smooth = 91\n", 4},
                 {"smooth = 0\n", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct scene *scene = loaded(state, ROOF, cases[i].smooth);
        assert_int_equal(patches_of(scene), cases[i].patches);
        assert_int_equal(triangles_of(scene) + patches_of(scene), 4);
        free(scene);
    }
    struct scene *scene = loaded(state, ROOF, "smooth = 180\n");
    double half = sqrt(0.5);
    for (uint64_t i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++) {
            struct vec3 p = scene_vertices(scene)[scene_patches(scene)[i].vertex[k]];
            struct vec3 n = scene_normals(scene)[scene_patches(scene)[i].normal[k]];
            double y = p.z == 1 ? 0 : p.y == 0 ? -half : half;
            assert_true(fabs(n.y - y) < 1e-15 && n.x == 0 && n.z > 0);
        }
    free(scene);
}

/* An angle above 90 degrees is a limit, too: the edge of a prism of three sides is sharp below 120. A face without an
 * area does not make it smooth. */
static void test_obtuse_crease_angle(void **state)
{
#define WEDGE "v 0 0 0\nv 1 0 0\nv .5 0 0\nv 0 1 0\nv 0 .5 .8660254\n"
    static const struct {
        const char *obj, *smooth;
        uint64_t patches;
    } cases[] = {{WEDGE "f 1 2 4\nf 2 1 5\n", "smooth = 119\n", 0},
                 {WEDGE "f 1 2 4\nf 2 1 5\n", "smooth = 121\n", 2},
                 {WEDGE "f 1 2 4\nf 2 1 3\nf 3 1 5\nf 2 3 5\n", "smooth = 119\n", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct scene *scene = loaded(state, cases[i].obj, cases[i].smooth);
        assert_int_equal(patches_of(scene), cases[i].patches);
        free(scene);
    }
}

/* Normals do not depend on the size of a mesh, be it so large or small that areas cannot be represented. */
static void test_crease_angle_of_any_size(void **state)
{
    static const char *const sizes[] = {"scale = 1e-170\n", "scale = 1e160\n"};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        char smooth[64];
        snprintf(smooth, sizeof smooth, "smooth = 91\n%s", sizes[i]);
        struct scene *scene = loaded(state, ROOF, smooth);
        assert_int_equal(patches_of(scene), 4);
        for (uint64_t k = 0; k < scene->normals.count; k++)
            assert_true(scene_normals(scene)[k].z > 0.7);
        free(scene);
    }
}

/* Of two faces in one plane and a third at an angle, around one vertex: all of them are curved, the one that does not
 * touch the third at that vertex alone, whichever of its corners that is. */
static void test_curved_at_one_corner(void **state)
{
#define AROUND "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 .2\nf 3 4 1\nf 4 5 1\n"
    static const char *const meshes[] = {AROUND "f 1 2 3\n", AROUND "f 2 3 1\n",
                                         AROUND "f 3 1 2\n"};
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
        struct scene *scene = loaded(state, meshes[i], "smooth = yes\n");
        assert_int_equal(patches_of(scene), 3);
        free(scene);
    }
}

static void test_normals_of_the_file(void **state)
{
    const char *obj = SQUARE "vn 0 0 1\nvn 0 0 0\nvn 0 1 1\nf 1//1 2//1 3//3\nf 1//1 3//2 4//1\n";
    struct scene *scene = loaded(state, obj, "");
    assert_int_equal(patches_of(scene), 1);
    assert_int_equal(triangles_of(scene), 1);
    free(scene);
    scene = loaded(state, obj, "smooth = 180\n");
    assert_int_equal(patches_of(scene), 1);
    assert_true(scene_normals(scene)[scene_patches(scene)->normal[2]].y > 0.7);
    free(scene);
    scene = loaded(state, obj, "smooth = no\n");
    assert_int_equal(triangles_of(scene), 2);
    assert_int_equal(scene->normals.count, 0);
    free(scene);
}

/* A sphere of latitude and longitude: smooth normals point away from its centre. */
static void test_smooth_sphere(void **state)
{
    enum { ROWS = 24, COLUMNS = 48 };
    size_t size = 200000, used = 0;
    char *obj = allocate(size, 1);
    double pi = 3.14159265358979323846;
    for (int i = 1; i < ROWS; i++)
        for (int j = 0; j < COLUMNS; j++) {
            double a = pi * i / ROWS, b = 2 * pi * j / COLUMNS;
            used += (size_t)snprintf(obj + used, size - used, "v %.17g %.17g %.17g\n",
                                     sin(a) * cos(b), sin(a) * sin(b), cos(a));
        }
    used += (size_t)snprintf(obj + used, size - used, "v 0 0 1\nv 0 0 -1\n");
    int top = (ROWS - 1) * COLUMNS + 1, bottom = top + 1, last = (ROWS - 2) * COLUMNS;
    for (int j = 0; j < COLUMNS; j++) {
        int next = (j + 1) % COLUMNS;
        used += (size_t)snprintf(obj + used, size - used, "f %d %d %d\nf %d %d %d\n", top, j + 1,
                                 next + 1, last + next + 1, last + j + 1, bottom);
        for (int i = 0; i < ROWS - 2; i++)
            used += (size_t)snprintf(obj + used, size - used, "f %d %d %d %d\n",
                                     i * COLUMNS + j + 1, (i + 1) * COLUMNS + j + 1,
                                     (i + 1) * COLUMNS + next + 1, i * COLUMNS + next + 1);
    }
    struct scene *scene = loaded(state, obj, "smooth = yes\n");
    free(obj);
    assert_int_equal(patches_of(scene), 2 * COLUMNS * (ROWS - 1));
    assert_int_equal(scene->normals.count, COLUMNS * (ROWS - 1) + 2);
    const struct patch *patches = scene_patches(scene);
    for (uint64_t i = 0; i < patches_of(scene); i++)
        for (int k = 0; k < 3; k++)
            assert_true(vec_dot(scene_vertices(scene)[patches[i].vertex[k]],
                                scene_normals(scene)[patches[i].normal[k]]) > 0.998);
    free(scene);
}

/* Degenerate faces, a vertex of very many faces, and three faces at one edge are accepted. */
static void test_odd_meshes(void **state)
{
    struct scene *scene =
        loaded(state, SQUARE "f 1 1 2\nf 1 2 2 1\nf 1 2 3\nf 2 1 4\nf 1 2 4\n", "smooth = 180\n");
    assert_true(triangles_of(scene) + patches_of(scene) >= 4);
    free(scene);

    enum { SPOKES = 5000 };
    size_t size = 400000, used = 0;
    char *obj = allocate(size, 1);
    used += (size_t)snprintf(obj, size, "v 0 0 1\n");
    for (int i = 0; i < SPOKES; i++)
        used += (size_t)snprintf(obj + used, size - used, "v %.9f %.9f 0\n", cos(i * 0.0012566),
                                 sin(i * 0.0012566));
    for (int i = 0; i + 1 < SPOKES; i++)
        used += (size_t)snprintf(obj + used, size - used, "f 1 %d %d\n", i + 2, i + 3);
    scene = loaded(state, obj, "smooth = yes\n");
    free(obj);
    assert_int_equal(patches_of(scene), SPOKES - 1);
    assert_int_equal(scene->normals.count, SPOKES + 1);
    free(scene);
}

/* Flatness is a property of faces, not of triangles: a polygon with two equal corners has an area. So have small
 * faces. */
static void test_flat_faces(void **state)
{
#define FLAT "faces without an area, whose corners lie on a line, are never seen: "
    struct scratch *s = *state;
    struct scene *scene =
        loaded(state, SQUARE "v 1e-200 0 0\nv 0 1e-200 0\nf 1 5 6\nf 1 1 2 3\nf 1 2 2 3 3 4\n", "");
    assert_string_equal(s->said, "");
    free(scene);
    free(loaded(state, SQUARE "v 2 2 0\nf 1 2 3\nf 1 3 5\nf 1 2 2\nf 1 1 3 5\nf 1 3 5 3 1\n", ""));
    assert_string_equal(s->said, "mesh.obj:7: warning: " FLAT "4 of 5, the first one here\n");
    free(loaded(state, SQUARE "vn 0 0 1\nf 1//1 2//1 1//1\n", "smooth = 180\n"));
    assert_string_equal(s->said, "mesh.obj:6: warning: " FLAT "1 of 1, the first one here\n");
}

/* The normals of the corners of triangular faces, in the order of the file. */
static void corner_normals(void **state, const char *const *faces, size_t count,
                           struct vec3 *normals)
{
    char obj[1024] = "v 0 0 0\nv 0 1 0\nv 1 0 .1\nv 1 1 .1\nv 2 0 0\nv 2 1 0\nv 1 0 2\nv 1 1 2\n";
    for (size_t i = 0; i < count; i++)
        snprintf(obj + strlen(obj), sizeof obj - strlen(obj), "f %s\n", faces[i]);
    struct scene *scene = loaded(state, obj, "smooth = yes\n");
    memset(normals, 0, 3 * count * sizeof *normals);
    for (size_t i = 0; i < count; i++)
        for (uint64_t j = 0; j < patches_of(scene); j++) {
            const struct patch *patch = &scene_patches(scene)[j];
            unsigned a, b, c;
            assert_int_equal(sscanf(faces[i], "%u %u %u", &a, &b, &c), 3);
            if (patch->vertex[0] + 1 != a || patch->vertex[1] + 1 != b || patch->vertex[2] + 1 != c)
                continue;
            for (int k = 0; k < 3; k++)
                normals[3 * i + (size_t)k] = scene_normals(scene)[patch->normal[k]];
        }
    free(scene);
}

static void assert_same_normals(const struct vec3 *a, const struct vec3 *b)
{
    struct vec3 d = vec_sub(*a, *b);
    assert_true(fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z))) < 1e-15);
}

/* More than two faces at an edge: a mesh with two sides, a fin between smooth faces. */
static void test_order_of_faces(void **state)
{
    static const char *const sides[] = {"1 3 4", "4 3 1", "1 4 2", "2 4 1",
                                        "3 5 6", "6 5 3", "3 6 4", "4 6 3"};
    static const char *const sides_apart[] = {"1 3 4", "1 4 2", "3 5 6", "3 6 4",
                                              "4 3 1", "2 4 1", "6 5 3", "4 6 3"};
    static const size_t place[] = {0, 4, 1, 5, 2, 6, 3, 7};
    struct vec3 mixed[24], apart[24];
    corner_normals(state, sides, 8, mixed);
    corner_normals(state, sides_apart, 8, apart);
    for (size_t i = 0; i < 24; i++)
        assert_same_normals(&mixed[i], &apart[3 * place[i / 3] + i % 3]);
    /* The ridge is smooth on both sides. */
    assert_true(fabs(mixed[1].x) < 1e-12 && mixed[1].z > 0.99);
    assert_true(fabs(mixed[4].x) < 1e-12 && mixed[4].z < -0.99);

    static const char *const fin[] = {"1 3 4", "3 7 4", "3 5 4"};
    corner_normals(state, fin, 3, mixed);
    assert_true(fabs(mixed[1].x) < 1e-12 && mixed[1].z > 0.99 && vec_is_zero(mixed[4]));
}

/* The sides of a prism about z, turned by an angle. */
static void put_prism(char *obj, size_t size, int sides, double turn, int digits)
{
    int used = 0;
    for (int z = 0; z <= 1; z++)
        for (int i = 0; i < sides; i++) {
            double angle = 6.283185307179586 * i / sides + turn;
            used += snprintf(obj + used, size - (size_t)used, "v %.*f %.*f %d\n", digits,
                             cos(angle), digits, sin(angle), z);
        }
    for (int i = 1; i <= sides; i++) {
        int next = i % sides + 1;
        used += snprintf(obj + used, size - (size_t)used, "f %d %d %d %d\n", i, next, next + sides,
                         i + sides);
    }
}

/* Sides that meet at exactly the crease angle: the prism is smooth all round, however it is turned and however many
 * digits its corners have. */
static void test_edges_of_the_crease_angle(void **state)
{
    static const struct {
        int sides;
        const char *smooth;
    } cases[] = {
        {4, "smooth = 90\n"}, {6, "smooth = yes\n"}, {6, "smooth = 60\n"}, {8, "smooth = 45\n"}};
    char obj[4096], more[64];
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int turn = 0; turn < 16; turn++) {
            put_prism(obj, sizeof obj, cases[i].sides, 0.1 * turn, turn % 2 ? 6 : 17);
            snprintf(more, sizeof more, "%srotate = 0 %d 0\n", cases[i].smooth, 17 * turn);
            struct scene *scene = loaded(state, obj, more);
            assert_int_equal(patches_of(scene), 2 * cases[i].sides);
            assert_int_equal(scene->normals.count, 2 * cases[i].sides);
            free(scene);
        }
}

/* A flat sheet with a face for either side, all of whose edges are rounded: the normals cancel out, though not to the
 * last bit, and the sheet stays flat. */
static void test_normals_that_cancel_out(void **state)
{
    const char *const obj =
        "v 0 0 0\nv 1 0 .1\nv 1 1 .3\nv 0 1 .2\nf 1 2 3\nf 3 2 1\nf 1 3 4\nf 3 1 4\n";
    for (int turn = 0; turn < 32; turn++) {
        char more[64];
        snprintf(more, sizeof more, "smooth = 180\nrotate = %d %d 0\n", 11 * turn, 17 * turn);
        struct scene *scene = loaded(state, obj, more);
        const struct patch *patches = scene_patches(scene);
        for (uint64_t i = 0; i < patches_of(scene); i++)
            for (int k = 1; k < 3; k++)
                assert_true(fabs(vec_dot(scene_normals(scene)[patches[i].normal[0]],
                                         scene_normals(scene)[patches[i].normal[k]])) > 0.999);
        free(scene);
    }
}

/* Half a turn of faces around one edge, one at each degree: all share a normal or none do, in any order. */
static void test_fan_at_an_edge(void **state)
{
    enum { FACES = 180 };
    char obj[16384];
    for (int stride = 1; stride <= 77; stride += 76) {
        int used = snprintf(obj, sizeof obj, "v 0 0 0\nv 0 0 1\n");
        for (int i = 0; i < FACES; i++)
            used += snprintf(obj + used, sizeof obj - (size_t)used, "v %.9f %.9f 0\n",
                             cos(i * 0.0174532925), sin(i * 0.0174532925));
        for (int i = 0; i < FACES; i++)
            used += snprintf(obj + used, sizeof obj - (size_t)used, "f 1 %d 2\n",
                             3 + i * stride % FACES);
        struct scene *scene = loaded(state, obj, "smooth = 0.9\n");
        assert_int_equal(patches_of(scene), 0);
        free(scene);
        scene = loaded(state, obj, "smooth = 1.1\n");
        assert_int_equal(patches_of(scene), FACES);
        for (int i = 0; i < FACES; i++)
            assert_true(scene_normals(scene)[scene_patches(scene)[i].normal[0]].x > 0.99);
        free(scene);
    }
}

static void test_obj_as_config(void **state)
{
    struct scratch *s = *state;
    write_text("mesh.obj", ROOF);
    struct job job;
    assert_true(scratch_load(s, "mesh.obj", "image.width=100", &job));
    assert_string_equal(s->said, "");
    assert_string_equal(job.settings.output.image, "mesh.png");
    assert_int_equal(builder_light_count(job.builder), 2);
    assert_true(job.settings.camera.eye.y > 1 && job.settings.camera.eye.z > 0.5);
    job_free(&job);
    assert_true(scratch_load(s, "mesh.obj", "camera.eye=7 8 9", &job));
    assert_true(job.settings.camera.look_at.y == 1 && job.settings.camera.look_at.z == 0.5);
    job_free(&job);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_faces),
        cmocka_unit_test(test_numbers_behind_vertices),
        cmocka_unit_test(test_empty_indices),
        cmocka_unit_test(test_crossing_polygons),
        cmocka_unit_test(test_text_form),
        cmocka_unit_test(test_names_on_two_lines),
        cmocka_unit_test(test_lines_that_end_by_cr),
        cmocka_unit_test(test_statements_left_out),
        cmocka_unit_test(test_comments_behind_numbers),
        cmocka_unit_test(test_gain_is_told_once),
        cmocka_unit_test(test_attributes_say_nothing),
        cmocka_unit_test(test_normals_that_are_no_numbers),
        cmocka_unit_test(test_material_without_a_name),
        cmocka_unit_test(test_mistakes),
        cmocka_unit_test(test_materials),
        cmocka_unit_test(test_library_between_uses),
        cmocka_unit_test(test_statements_before_materials),
        cmocka_unit_test(test_warnings_of_gain),
        cmocka_unit_test(test_one_warning_of_textures),
        cmocka_unit_test(test_one_warning_of_emission),
        cmocka_unit_test(test_keys_in_another_case),
        cmocka_unit_test(test_unknown_name_of_a_material),
        cmocka_unit_test(test_missing_library),
        cmocka_unit_test(test_closed_library),
        cmocka_unit_test(test_comment_behind_a_library),
        cmocka_unit_test(test_legal_forms_of_materials),
        cmocka_unit_test(test_index_of_refraction_of_0),
        cmocka_unit_test(test_libraries_and_names),
        cmocka_unit_test(test_several_smooth_meshes),
        cmocka_unit_test(test_bumpy_grid),
        cmocka_unit_test(test_placement),
        cmocka_unit_test(test_crease_angle),
        cmocka_unit_test(test_obtuse_crease_angle),
        cmocka_unit_test(test_edges_of_the_crease_angle),
        cmocka_unit_test(test_normals_that_cancel_out),
        cmocka_unit_test(test_crease_angle_of_any_size),
        cmocka_unit_test(test_curved_at_one_corner),
        cmocka_unit_test(test_normals_of_the_file),
        cmocka_unit_test(test_smooth_sphere),
        cmocka_unit_test(test_odd_meshes),
        cmocka_unit_test(test_flat_faces),
        cmocka_unit_test(test_order_of_faces),
        cmocka_unit_test(test_fan_at_an_edge),
        cmocka_unit_test(test_obj_as_config),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
