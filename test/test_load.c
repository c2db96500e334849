/* Jobs as a whole: overrides, the names of outputs, the automatic camera, and --print-config. */
#include "test/scratch.h"

#include <math.h>
#include <sys/stat.h>

static const char text[] = "[camera]\neye = 0 0 9\nlook_at = 0 0 0\n"
                           "[background]\nbottom = 1 1 1\ntop = 0 0 0\n"
                           "[output]\nimage = out.hdr\nreport =\n"
                           "[light sun]\nposition = 1 2 3\n"
                           "[material red glass]\nior = 1.5\n"
                           "[sphere]\ncenter = 0 0 0\nradius = 1\nmaterial = red glass\n"
                           "[sphere]\ncenter = 5 0 0\nradius = 1\n";

static struct job load(void **state, const char *name, const char *override)
{
    struct scratch *s = *state;
    struct job job;
    if (!scratch_load(s, name, override, &job)) fail_msg("%s", s->said);
    return job;
}

static void test_overrides(void **state)
{
    write_text("scene.ini", text);
    struct job job = load(state, "scene.ini", "image.width = 100");
    assert_int_equal(job.settings.image.width, 100);
    job_free(&job);
    job = load(state, "scene.ini", "background.color=0.1 0.2 0.3");
    assert_true(job.settings.background.bottom.x == 0.1 && job.settings.background.top.z == 0.3);
    job_free(&job);
    job = load(state, "scene.ini", "background.top=0 0 1");
    assert_true(job.settings.background.bottom.x == 1 && job.settings.background.top.z == 1);
    job_free(&job);
    struct scene *scene = scratch_scene(*state, "scene.ini", "material red glass.ior=1.25");
    assert_true(scene_materials(scene)[scene_spheres(scene)->material].ior == 1.25);
    free(scene);
    scene = scratch_scene(*state, "scene.ini", "light sun.color=1 0 0");
    assert_true(scene_lights(scene)->color.y == 0);
    free(scene);
}

static void test_overrides_in_order(void **state)
{
    write_text("scene.ini", text);
    char first[] = "image.width=10", second[] = "image.width=20";
    char *overrides[] = {first, second};
    struct job job;
    assert_true(load_job("scene.ini", overrides, 2, REACH_FOLDER, &job));
    assert_int_equal(job.settings.image.width, 20);
    job_free(&job);
}

static bool load_two(struct scratch *s, const char *name, const char *first, const char *second,
                     struct job *job)
{
    char *overrides[] = {copy_text(first), copy_text(second)};
    message_capture(s->said, sizeof s->said);
    bool good = load_job(name, overrides, 2, REACH_FOLDER, job);
    message_capture(NULL, 0);
    free(overrides[0]);
    free(overrides[1]);
    return good;
}

/* A background has a color, or bottom and top: of arguments, too, which replace the file's as a whole. */
static void test_backgrounds_of_arguments(void **state)
{
    struct scratch *s = *state;
    struct job job;
    write_text("grey.ini", "[background]\ncolor = 0.5 0.5 0.5\n[light]\nposition = 1 2 3\n"
                           "[sphere]\ncenter = 0 0 0\nradius = 1\n");
    job = load(state, "grey.ini", "background.top=1 1 1");
    assert_true(job.settings.background.bottom.x == 0.04 && job.settings.background.top.x == 1);
    job_free(&job);
    assert_true(load_two(s, "grey.ini", "background.top=1 1 1", "background.bottom=0 1 0", &job));
    assert_true(job.settings.background.top.x == 1 && job.settings.background.bottom.x == 0);
    job_free(&job);
    assert_true(load_two(s, "grey.ini", "background.color=1 1 1", "background.color=0 1 0", &job));
    assert_true(job.settings.background.top.x == 0 && job.settings.background.bottom.y == 1);
    job_free(&job);
    assert_false(load_two(s, "grey.ini", "background.top=1 1 1", "background.color=0 1 0", &job));
    assert_string_equal(s->said, "background.color=0 1 0: [background] has a color as well as "
                                 "bottom or top, expected one or the other\n");
    assert_false(
        load_two(s, "grey.ini", "background.color=0 1 0", "background.bottom=1 1 1", &job));
    assert_string_equal(s->said, "background.bottom=1 1 1: [background] has a color as well as "
                                 "bottom or top, expected one or the other\n");
}

static void test_bad_overrides(void **state)
{
    static const struct {
        const char *override, *line;
    } cases[] = {
        {"image.widht=100",
         "image.widht=100: unknown key 'widht' in [image], did you mean 'width'?"},
        {"image.width=0", "image.width=0: expected a whole number from 1 to 65535; width: pixels "
                          "from left to right"},
        {"light.sun.color=1 1 1",
         "light.sun.color=1 1 1: unknown section 'light.sun', expected a name behind a space, in "
         "quotes: \"light sun.color=...\""},
        {"lihgt.sun.color=1 1 1", "lihgt.sun.color=1 1 1: unknown section 'lihgt.sun', expected "
                                  "one that 'farm --help' lists"},
        {"image x.width=5", "image x.width=5: [image] takes no name, expected image.width=VALUE"},
        {"red glass.ior=2", "red glass.ior=2: unknown section 'red glass', did you mean \"material "
                            "red glass.ior=2\"?"},
        {"imgae.width=5", "imgae.width=5: unknown section 'imgae', did you mean 'image'?"},
        {"width=5", "width=5: is no setting, expected SECTION.KEY=VALUE"},
        {"image.width", "image.width: is no setting, expected SECTION.KEY=VALUE"},
        {"", ": is no setting, expected SECTION.KEY=VALUE"},
        {".=", ".=: is no setting, expected SECTION.KEY=VALUE"},
        {"sphere.radius=2",
         "sphere.radius=2: there are 2 sections [sphere], expected one that has a "
         "name"},
        {"light son.color=1 1 1",
         "light son.color=1 1 1: scene.ini has no section [light son], did "
         "you mean 'sun'?"},
        {"sphere moon.radius=1", "sphere moon.radius=1: scene.ini has no section [sphere moon]"},
        {"light.color=1 1 1",
         "light.color=1 1 1: scene.ini has no section [light] without a name, expected one of sun"},
        {"light moon.color=1 1 1", "light moon.color=1 1 1: scene.ini has no section [light moon], "
                                   "expected one of sun"},
        {"light sun.size=1", "light sun.size=1: unknown key 'size' in [light sun], expected one of "
                             "position color"},
        {"camera.eye=0 0 0", "camera.eye=0 0 0: eye and look_at are the same point, expected two "
                             "different ones"},
        {"camera.look_at=0 0 9", "camera.look_at=0 0 9: eye and look_at are the same point, "
                                 "expected two different ones"},
        {"camera.look_at=0 5 9",
         "camera.look_at=0 5 9: up, 0 1 0 unless it is set, lies along the "
         "direction of view, expected another direction, such as up = 0 0 -1"},
        {"output.image=x.jpg", "output.image=x.jpg: image has an unknown extension, expected .png, "
                               ".hdr or .pfm"},
    };
    write_text("scene.ini", text);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        scratch_refused(*state, "scene.ini", cases[i].override, cases[i].line);
}

/* Of two settings that do not go together the argument is at fault, as CONFIG was right before it. */
static void test_settings_spoilt_by_arguments(void **state)
{
    static const char config[] = "[image]\nwidth = 60000\nheight = 100\n[camera]\n"
                                 "eye = -1.7e308 0 9\nlook_at = -1.6e308 0 0\n";
    write_text("far.ini", config);
    scratch_refused(
        *state, "far.ini", "image.height=65535",
        "image.height=65535: the picture has 3932100000 pixels, expected width x height <= 2^28");
    scratch_refused(*state, "far.ini", "camera.look_at=1.7e308 0 0",
                    "camera.look_at=1.7e308 0 0: eye and look_at are too far apart, expected a "
                    "finite distance");
}

/* What an argument makes of an object is the argument's fault; what the file says is the file's. */
static void test_objects_spoilt_by_arguments(void **state)
{
    static const struct {
        const char *override, *line;
    } cases[] = {
        {"plane floor.normal=0 0 0",
         "plane floor.normal=0 0 0: [plane floor]: the normal is zero or not finite, expected a "
         "direction"},
        {"cylinder post.apex=0 0 0",
         "cylinder post.apex=0 0 0: [cylinder post]: base and apex are the same point, expected "
         "two different points"},
        {"box crate.max=0 1 1", "box crate.max=0 1 1: [box crate]: the box has no volume, expected "
                                "min < max in every component"},
        {"triangle sail.c=2 0 0",
         "triangle sail.c=2 0 0: [triangle sail]: the corners lie on a line, expected a triangle "
         "with an area"},
    };
    write_text("shapes.ini", "[material red]\n[plane floor]\npoint = 0 0 0\nnormal = 0 1 0\n"
                             "[cylinder post]\nbase = 0 0 0\napex = 0 1 0\nradius = 1\n"
                             "[box crate]\nmin = 0 0 0\nmax = 1 1 1\n"
                             "[triangle sail]\na = 0 0 0\nb = 1 0 0\nc = 0 1 0\n");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        scratch_refused(*state, "shapes.ini", cases[i].override, cases[i].line);
    write_text("flat.ini", "[material red]\n[box crate]\nmin = 0 0 0\nmax = 1 0 1\n");
    scratch_refused(*state, "flat.ini", "box crate.material=red",
                    "flat.ini:2: [box crate]: the box has no volume, expected min < max in every "
                    "component");
}

/* Rows that are too many for a message, under the schedules that send rows. */
static void test_rows_sent_at_a_time(void **state)
{
    static const char wide[] = "[image]\nwidth = 2000\nheight = 1000\n[farm]\nschedule = strips\n"
                               "tile = 525\n[light]\nposition = 0 0 0\n";
    struct job job;
    write_text("wide.ini", wide);
    scratch_refused(
        *state, "wide.ini", NULL,
        "wide.ini:6: tile = 525 rows of 2000 pixels are too many at a time, expected at "
        "most 524");
    static const char *const good[] = {"farm.tile=524", "farm.tile=auto", "farm.schedule=tiles",
                                       "image.height=524", "image.region=0 0 1000 1000"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        job = load(state, "wide.ini", good[i]);
        job_free(&job);
    }
    write_text("even.ini", "[image]\nwidth = 1024\nheight = 1024\n[farm]\nschedule = strips\n"
                           "tile = 1024\n[light]\nposition = 0 0 0\n");
    job = load(state, "even.ini", NULL); /* exactly as many as a message may have */
    job_free(&job);
}

static void test_output_names(void **state)
{
    mkdir("sub", 0700);
    write_text("sub/scene.ini", text);
    write_text("sub/bare.v2.ini", "[light]\nposition = 0 0 0\n");
    struct job job = load(state, "sub/scene.ini", NULL);
    assert_string_equal(job.settings.output.image, "sub/out.hdr");
    assert_string_equal(job.settings.output.report, "");
    job_free(&job);
    job = load(state, "sub/scene.ini", "output.image=here.png");
    assert_string_equal(job.settings.output.image, "here.png");
    job_free(&job);
    job = load(state, "sub/bare.v2.ini", NULL);
    assert_string_equal(job.settings.output.image, "bare.v2.png");
    assert_string_equal(job.settings.output.report, "bare.v2.json");
    job_free(&job);
}

/* From where to where in the picture points are: -1 to 1 are its edges. */
struct extent {
    double least, most;
};

static void extend(struct extent *extent, double value)
{
    extent->least = fmin(extent->least, value);
    extent->most = fmax(extent->most, value);
}

/* Of all corners of a box from 100 0 0 to 110 3 1. */
static void box_in_picture(const struct camera *camera, struct extent *x, struct extent *y)
{
    double scale = vec_length(camera->down);
    *x = *y = (struct extent){HUGE_VAL, -HUGE_VAL};
    for (int c = 0; c < 8; c++) {
        struct vec3 corner = vec3(c & 1 ? 110 : 100, c & 2 ? 3 : 0, c & 4 ? 1 : 0);
        struct vec3 d = vec_sub(corner, camera->eye);
        double depth = vec_dot(d, camera->forward);
        assert_true(depth > 0);
        extend(x, vec_dot(d, camera->right) / (scale * scale * depth * 1.5));
        extend(y, vec_dot(d, camera->down) / (scale * scale * depth));
    }
}

static bool is_near(double value, double expected)
{
    return fabs(value - expected) < 1e-9;
}

/* Closer than half a pixel, of 200. */
static bool is_centred(struct extent extent)
{
    return fabs(extent.least + extent.most) < 0.5 / 200;
}

/* The scene is in the middle of the picture, across and up, and its larger extent leaves a tenth of it free; with a
 * look_at that is set it touches the same margin on one side. */
static void test_automatic_camera(void **state)
{
    static const char *const ups[] = {"camera.up=0 1 0", "camera.up=0 0 1", "camera.up=1 0 0",
                                      "camera.up=0 -1 0.1", "camera.look_at=105 1 0"};
    write_text("boxes.ini", "[image]\nwidth = 300\nheight = 200\n[light]\nposition = 9 9 9\n"
                            "[box]\nmin = 100 0 0\nmax = 110 3 1\n"
                            "[plane]\npoint = 0 0 0\nnormal = 0 1 0\n");
    for (size_t i = 0; i < sizeof ups / sizeof *ups; i++) {
        struct extent x, y;
        struct scene *scene = scratch_scene(*state, "boxes.ini", ups[i]);
        box_in_picture(&scene->view.camera, &x, &y);
        struct extent wide = x.most - x.least > y.most - y.least ? x : y;
        assert_true(is_near(fmax(fmax(-x.least, x.most), fmax(-y.least, y.most)), 1 / 1.1));
        if (i < 4) assert_true(is_near(wide.least, -1 / 1.1) && is_near(wide.most, 1 / 1.1));
        if (i < 4) assert_true(is_centred(x) && is_centred(y));
        free(scene);
    }
}

static void test_view_follows_settings(void **state)
{
    write_text("scene.ini", text);
    struct scene *scene = scratch_scene(*state, "scene.ini", "image.region=3 4 50 60");
    const struct view *view = &scene->view;
    assert_int_equal(view->region_x, 3);
    assert_int_equal(view->region_h, 60);
    assert_true(view->camera.forward.z == -1);
    double half = tan(22.5 * 3.14159265358979323846 / 180);
    assert_true(fabs(view->camera.right.x - half) < 1e-15 &&
                fabs(view->camera.down.y + half) < 1e-15);
    assert_int_equal(view->max_depth, 20);
    free(scene);
}

/* What is printed gives the same scene block, and prints the same. */
static void check_round_trip(void **state, const char *name, const char *override)
{
    struct scene *first = scratch_scene(*state, name, override);
    struct job job = load(state, name, override);
    mkdir("elsewhere", 0700);
    char *printed = print_job(&job);
    assert_non_null(printed);
    write_text("elsewhere/printed.ini", printed);
    struct scratch *s = *state;
    s->reach = REACH_ANYWHERE;
    struct scene *second = scratch_scene(*state, "elsewhere/printed.ini", NULL);
    assert_int_equal(first->bytes, second->bytes);
    assert_memory_equal(first, second, first->bytes);
    struct job again = load(state, "elsewhere/printed.ini", NULL);
    s->reach = REACH_FOLDER;
    char *printed_again = print_job(&again);
    assert_string_equal(printed, printed_again);
    free(printed);
    free(printed_again);
    assert_memory_equal(&job.settings.farm, &again.settings.farm, sizeof job.settings.farm);
    job_free(&job);
    job_free(&again);
    free(first);
    free(second);
}

static void test_print_round_trip(void **state)
{
    write_text("scene.ini", text);
    write_text("scene.nff", "b 0.1 0.2 0.3\nv\nfrom 2.1 1.3 1.7\nat 0 0 0\nup 0 0.3 1\nangle 45\n"
                            "hither 1\nresolution 77 55\nl 4 3 2\nl 1 -4 4\ns 0 0 0 0.5\n"
                            "p 3\n0 0 0\n1 0 0\n0 1 0\n");
    write_text("scene.obj", "v 0.1 0 0\nv 1 0.3 0\nv 1 1 0.7\nv 0 1 1\nf 1 2 3 4\nf 4 3 2\n");
    write_text("all.ini", "[include n]\nfile = scene.nff\nrotate = 1 2 3\n"
                          "[mesh m]\nfile = scene.obj\nsmooth = 170\n"
                          "[farm]\nschedule = strips\ntile = 8\n");
    check_round_trip(state, "scene.ini", NULL);
    check_round_trip(state, "scene.ini", "image.region=3 4 50 60");
    check_round_trip(state, "scene.ini", "material red glass.ior=1.1");
    check_round_trip(state, "scene.nff", NULL);
    check_round_trip(state, "scene.obj", "camera.fov=33.3");
    check_round_trip(state, "all.ini", "render.cutoff=1e-7");
}

/* What could not be read back the same is not printed at all. */
static void test_unprintable_values(void **state)
{
    struct scratch *s = *state;
    static const char *const overrides[] = {"output.image=a\t;b.png", "output.image=a ;b.png",
                                            "output.image=/;\r\n.png", "output.image=a\nb.png"};
    write_text("scene.ini", "[light]\nposition = 0 0 0\n[sphere]\ncenter = 0 0 0\nradius = 1\n"
                            "[material ; odd]\ncolor = 0 0 0\n");
    scratch_refused(s, "scene.ini", NULL,
                    "scene.ini:6: a section without its ']', expected [kind] or [kind name]");
    write_text("scene.ini", "[light]\nposition = 0 0 0\n[sphere]\ncenter = 0 0 0\nradius = 1\n"
                            "material = m\n[material m]\n");
    for (size_t i = 0; i < 4; i++) {
        struct job job = load(state, "scene.ini", overrides[i]);
        message_capture(s->said, sizeof s->said);
        assert_null(print_job(&job));
        message_capture(NULL, 0);
        assert_non_null(strstr(s->said, "cannot be written in an INI file"));
        assert_ptr_equal(strchr(s->said, '\n'), s->said + strlen(s->said) - 1);
        job_free(&job);
    }
    char *path = allocate(5000, 1);
    snprintf(path, 5000, "output.image=%04500d.png", 1);
    struct job job = load(state, "scene.ini", path);
    message_capture(s->said, sizeof s->said);
    assert_null(print_job(&job));
    message_capture(NULL, 0);
    job_free(&job);
    path[13 + 300] = '\0';
    strcat(path, ";.png");
    check_round_trip(state, "scene.ini", path);
    free(path);
}

/* Nothing but what is refused may stop a scene with numbers near the ends of their range. */
static void test_extreme_cameras(void **state)
{
#define FAR_SCENE(camera)                                                                          \
    "[light]\nposition = 0 0 0\n[sphere]\ncenter = 0 0 0\nradius = 1\n[camera]\n" camera
    static const char *const good[] = {
        FAR_SCENE("eye = 0 0 9\nlook_at = 0 0 0\nup = 0 1e-320 0\n"),
        FAR_SCENE("eye = 0 0 9\nlook_at = 0 0 0\nup = 1.7e308 1.7e308 1.7e308\n"),
        FAR_SCENE("eye = 0 1e-322 1e-320\nlook_at = 0 0 0\n"),
        FAR_SCENE("eye = 1.7e308 1.7e308 1.7e308\nlook_at = 0 0 0\n"),
        FAR_SCENE("eye = 0 0 9\nlook_at = 0 0 0\nfov = 1e-300\n"),
        FAR_SCENE("eye = 0 0 9\nlook_at = 0 0 0\nfov = 179.99999999999997\n"),
    };
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        write_text("far.ini", good[i]);
        free(scratch_scene(*state, "far.ini", NULL));
    }
    write_text("far.ini", FAR_SCENE("eye = 0 0 9\nlook_at = 0 0 0\nfov = 1e-323\n"));
    scratch_refused(*state, "far.ini", NULL,
                    "far.ini:9: fov is too close to 0 or 180, expected an angle between them");
    write_text("far.ini", "[light]\nposition = 0 0 0\n"
                          "[sphere]\ncenter = 1.7e308 0 0\nradius = 1.7e308\n");
    scratch_refused(*state, "far.ini", NULL,
                    "far.ini: the scene is too large or too small for an eye to be placed, "
                    "expected camera.eye and camera.look_at");
    write_text("far.obj", "v 1.6e308 0 0\nv 1e307 1e308 0\nv 0 0 1e308\nf 1 2 3\n");
    scratch_refused(*state, "far.obj", NULL,
                    "far.obj: the scene is too large or too small for an eye to be placed, "
                    "expected camera.eye and camera.look_at");
    write_text("far.obj", "v 1e307 0 0\nv 1e307 1e307 0\nv 0 0 1e307\nf 1 2 3\n");
    struct scratch *s = *state;
    char first[] = "camera.eye=0 0 1.7e308", second[] = "camera.look_at=0 0 0";
    char *overrides[] = {first, second};
    struct job job;
    message_capture(s->said, sizeof s->said);
    assert_false(load_job("far.obj", overrides, 2, REACH_FOLDER, &job));
    message_capture(NULL, 0);
    assert_string_equal(s->said, "far.obj: there is no room for lights around it, expected a "
                                 "smaller scene\n");
}

/* In front is +z where up is y; the key light is the one on the right, and it is the stronger. */
static void test_sides_of_the_automatic_view(void **state)
{
    write_text("front.obj", "v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    struct scene *scene = scratch_scene(*state, "front.obj", NULL);
    const struct camera *camera = &scene->view.camera;
    const struct light *lights = scene_lights(scene);
    assert_true(camera->eye.z > 0 && camera->eye.x > 0 && camera->eye.y > 0.5);
    assert_true(camera->eye.z > camera->eye.x);
    assert_int_equal(scene->lights.count, 2);
    assert_true(vec_dot(vec_sub(lights[0].position, camera->eye), camera->right) > 0);
    assert_true(vec_dot(vec_sub(lights[1].position, camera->eye), camera->right) < 0);
    assert_true(vec_dot(vec_sub(lights[0].position, camera->eye), camera->down) < 0);
    assert_true(vec_max(lights[0].color) > 2 * vec_max(lights[1].color));
    free(scene);
    scene = scratch_scene(*state, "front.obj", "camera.up=0 0 1");
    assert_true(scene->view.camera.eye.y < 0 && scene->view.camera.eye.z > 0);
    free(scene);
}

/* The lights that an OBJ file is given are sections as any others. */
static void test_overridden_shoulder_lights(void **state)
{
    write_text("front.obj", "v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    struct scene *plain = scratch_scene(*state, "front.obj", NULL);
    struct scene *scene = scratch_scene(*state, "front.obj", "light key.color=2 1 3");
    const struct light *before = scene_lights(plain), *lights = scene_lights(scene);
    assert_int_equal(scene->lights.count, 2);
    assert_true(lights[0].color.x == 2 && lights[0].color.z == 3);
    assert_memory_equal(&lights[0].position, &before[0].position, sizeof lights[0].position);
    assert_memory_equal(&lights[1], &before[1], sizeof lights[1]);
    free(scene);
    scene = scratch_scene(*state, "front.obj", "light fill.position=7 8 9");
    lights = scene_lights(scene);
    assert_memory_equal(&lights[0], &before[0], sizeof lights[0]);
    assert_memory_equal(&lights[1].color, &before[1].color, sizeof lights[1].color);
    assert_true(lights[1].position.y == 8);
    free(scene);
    free(plain);
    check_round_trip(state, "front.obj", "light key.color=2 1 3");
    scratch_refused(*state, "front.obj", "light kye.color=2 2 2",
                    "light kye.color=2 2 2: front.obj has no section [light kye], did you mean "
                    "'key'?");
    scratch_refused(*state, "front.obj", "light key.size=2",
                    "light key.size=2: unknown key 'size' in [light key], expected one of position "
                    "color");
}

/* So are the materials of an OBJ file's MTL: what arguments do not set is as it is there. */
static void test_overridden_mtl(void **state)
{
    write_text("glass.mtl", "newmtl glass\nKd 0.1 0.2 0.3\nKs 0.4 0.4 0.4\nd 0.25\n"
                            "newmtl unused\nKd 1 0 0\n");
    write_text("ball.obj", "mtllib glass.mtl\nusemtl glass\nv -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    char diffuse[] = "material glass.diffuse=0.5", ior[] = "material glass.ior=1.25";
    char *both[] = {diffuse, ior};
    struct job job;
    struct scene *scene = scratch_scene(*state, "ball.obj", diffuse);
    const struct material *material = scene_materials(scene);
    assert_int_equal(scene->materials.count, 1);
    assert_true(material->diffuse == 0.5 && material->color.y == 0.2 && material->ior == 1 &&
                material->specular == 0.4 && material->transmission == 0.75);
    free(scene);
    assert_true(load_job("ball.obj", both, 2, REACH_FOLDER, &job));
    char *printed = print_job(&job);
    assert_non_null(
        strstr(printed, "[material glass]\ndiffuse = 0.5\nior = 1.25\ncolor = 0.1 0.2 0.3\n"));
    free(printed);
    job_free(&job);
    check_round_trip(state, "ball.obj", diffuse);
    check_round_trip(state, "ball.obj", "material unused.color=0 1 0");
    scratch_refused(*state, "ball.obj", "material glas.ior=2",
                    "material glas.ior=2: ball.obj has no material 'glas', did you mean 'glass'?");
    scratch_refused(*state, "ball.obj", "material glass.size=2",
                    "material glass.size=2: unknown key 'size' in [material glass], expected one "
                    "of color ambient diffuse specular shininess reflection transmission ior");
    scratch_refused(*state, "ball.obj", "material.ior=2",
                    "material.ior=2: ball.obj has no section [material]");
}

/* Names of materials in MTL files may be such as no section can have. */
static void test_unprintable_name(void **state)
{
    struct scratch *s = *state;
    struct job job;
    write_text("ball.obj", "mtllib odd.mtl\nusemtl g]h\nv -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write_text("odd.mtl", "newmtl g]h\nKd 0.1 0.2 0.3\n");
    assert_true(scratch_load(s, "ball.obj", "material g]h.ior=2", &job));
    message_capture(s->said, sizeof s->said);
    assert_null(print_job(&job));
    message_capture(NULL, 0);
    assert_string_equal(s->said, "ball.obj: [material g]h] cannot be written in an INI file, "
                                 "expected a shorter name, without ']' and ';'\n");
    job_free(&job);
}

#define DOUBLES                                                                                    \
    "transparent surfaces coincide with earlier ones, and each splits all rays once more, which "  \
    "may take very long: "
#define CLEAR "[material clear]\ntransmission = 0.9\n[light]\nposition = 1 2 3\n"
#define BALL  "center = 0 0 0\nradius = 1\n"

static void assert_said(void **state, const char *scene, const char *said)
{
    struct scratch *s = *state;
    write_text("scene.ini", scene);
    struct job job = load(state, "scene.ini", NULL);
    job_free(&job);
    assert_string_equal(s->said, said);
}

/* Of what is opaque, and of what touches, nothing is said. */
static void test_glass_in_one_place(void **state)
{
    assert_said(
        state,
        CLEAR "[sphere a]\n" BALL "[sphere b]\n" BALL "[sphere c]\n" BALL "material = clear\n", "");
    assert_said(state,
                CLEAR "[sphere a]\n" BALL "[sphere b]\n" BALL "material = clear\n"
                      "[box a]\nmin = 0 0 0\nmax = 1 1 1\nmaterial = clear\n"
                      "[box b]\nmin = 1 0 0\nmax = 2 1 1\nmaterial = clear\n"
                      "[sphere c]\n" BALL "material = clear\n[sphere d]\n" BALL "[sphere e]\n" BALL
                      "material = clear\n",
                "scene.ini:20: warning: " DOUBLES
                "2 in all; the first is here and coincides with that of line 8\n");
    write_text("ball.ini",
               "[material clear]\ntransmission = 0.5\n\n[sphere]\n" BALL "material = clear\n");
    assert_said(state, CLEAR "[sphere]\n" BALL "material = clear\n[include]\nfile = ball.ini\n",
                "ball.ini:4: warning: " DOUBLES
                "1 in all; the first is here and coincides with that of scene.ini:5\n");
    assert_said(
        state,
        "[include a]\nfile = ball.ini\n[include b]\nfile = ball.ini\ntranslate = 1 0 0\n" CLEAR,
        "");
}

/* Faces that look the other way are of what lies behind them; those of the same sense have any corner first. */
static void test_glass_faces_in_one_place(void **state)
{
    static const char mesh[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 1 0\n";
    char obj[128];
    snprintf(obj, sizeof obj, "%sf 1 2 3\nf 3 2 1\n", mesh);
    write_text("mesh.obj", obj);
    assert_said(state, CLEAR "[mesh m]\nfile = mesh.obj\nmaterial = clear\n", "");
    snprintf(obj, sizeof obj, "%sf 1 2 3\nf 3 2 1\nf 2 4 1\nf 4 1 2\n", mesh);
    write_text("mesh.obj", obj);
    assert_said(state, CLEAR "[mesh m]\nfile = mesh.obj\nmaterial = clear\n",
                "scene.ini:5: warning: " DOUBLES
                "2 in all; the first is here and coincides with another one here\n");
    assert_said(state,
                CLEAR "[mesh m]\nfile = mesh.obj\n"
                      "[mesh n]\nfile = mesh.obj\nmaterial = clear\ntranslate = 0 0 1\n",
                "scene.ini:7: warning: " DOUBLES
                "2 in all; the first is here and coincides with another one here\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_overrides),
        cmocka_unit_test(test_overrides_in_order),
        cmocka_unit_test(test_backgrounds_of_arguments),
        cmocka_unit_test(test_bad_overrides),
        cmocka_unit_test(test_settings_spoilt_by_arguments),
        cmocka_unit_test(test_objects_spoilt_by_arguments),
        cmocka_unit_test(test_rows_sent_at_a_time),
        cmocka_unit_test(test_output_names),
        cmocka_unit_test(test_automatic_camera),
        cmocka_unit_test(test_view_follows_settings),
        cmocka_unit_test(test_unprintable_values),
        cmocka_unit_test(test_extreme_cameras),
        cmocka_unit_test(test_sides_of_the_automatic_view),
        cmocka_unit_test(test_print_round_trip),
        cmocka_unit_test(test_overridden_shoulder_lights),
        cmocka_unit_test(test_overridden_mtl),
        cmocka_unit_test(test_unprintable_name),
        cmocka_unit_test(test_glass_in_one_place),
        cmocka_unit_test(test_glass_faces_in_one_place),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
