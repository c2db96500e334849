/* Tests of the camera and the lights of scenes that have none. */
#include <math.h>

#include "master/framing.h"
#include "master/outline.h"
#include "master/view.h"
#include "test/unit.h"

#define DEGREE (M_PI / 180)

static void check_near(struct vec3 v, struct vec3 expected, double error)
{
    assert_true(vec_length(vec_sub(v, expected)) <= error);
}

/* A builder that has a material, number 0. */
static struct builder *with_material(void)
{
    struct builder *builder = builder_create();
    const struct material material = {.color = {1, 1, 1}, .diffuse = 1, .ior = 1};
    uint32_t index;
    assert_null(builder_add_material(builder, &material, &index));
    return builder;
}

static struct builder *box_of(struct vec3 min, struct vec3 max)
{
    struct builder *builder = with_material();
    assert_null(builder_add_box(builder, &(struct box){.min = min, .max = max}));
    return builder;
}

static struct builder *triangle_of(const struct vec3 corners[3])
{
    struct builder *builder = with_material();
    struct triangle triangle = {.material = 0};
    for (int k = 0; k < 3; k++)
        assert_null(builder_add_vertex(builder, corners[k], &triangle.vertex[k]));
    assert_null(builder_add_triangle(builder, &triangle));
    return builder;
}

static struct builder *point_of(struct vec3 point)
{
    return triangle_of((struct vec3[]){point, point, point});
}

static struct builder *floor_of(double y)
{
    struct builder *builder = with_material();
    assert_null(builder_add_plane(
        builder, &(struct plane){.point = vec3(0, y, 0), .normal = vec3(0, 1, 0)}));
    return builder;
}

/* The camera of a scene, which is freed, with `up` and, unless it is NULL, look_at. */
static struct settings framed(struct builder *builder, struct vec3 up, const struct vec3 *look_at)
{
    struct settings settings;
    settings_init(&settings);
    settings.camera.up = up;
    if (look_at) settings.camera.look_at = *look_at;
    frame_scene(builder, &settings, false, look_at != NULL);
    builder_destroy(builder);
    settings_free(&settings);
    return settings;
}

static struct vec3 back_of(const struct settings *settings)
{
    return vec_sub(settings->camera.eye, settings->camera.look_at);
}

/* Where the eye of a cube is, seen from where it looks. */
static struct vec3 way_to_eye(struct vec3 up)
{
    struct settings settings = framed(box_of(vec3(-1, -1, -1), vec3(1, 1, 1)), up, NULL);
    return vec_normalize(back_of(&settings));
}

/* The eye is 30 degrees to the right and 20 degrees above what is in front: +z where up is y, -y where up is z. */
static void test_three_quarter_view(void **state)
{
    double right = cos(20 * DEGREE) * sin(30 * DEGREE), up = sin(20 * DEGREE);
    double ahead = cos(20 * DEGREE) * cos(30 * DEGREE);
    check_near(way_to_eye(vec3(0, 1, 0)), vec3(right, up, ahead), 1e-12);
    check_near(way_to_eye(vec3(0, 0, 1)), vec3(right, -ahead, up), 1e-12);
    check_near(way_to_eye(vec3(0, -1, 0)), vec3(-right, -up, ahead), 1e-12);
    check_near(way_to_eye(vec3(0, 0, -1)), vec3(-right, -ahead, -up), 1e-12);
    check_near(way_to_eye(vec3(1, 0, 0)), vec3(up, -right, ahead), 1e-12);
    for (int degrees = 0; degrees <= 90; degrees += 10) { /* from y towards z */
        double c = cos(degrees * DEGREE), s = sin(degrees * DEGREE);
        struct vec3 eye = vec3(right, up * c - ahead * s, up * s + ahead * c);
        check_near(way_to_eye(vec3(0, c, s)), eye, 1e-12);
    }
}

/* How long the vector is does not matter, from the smallest to the largest double. */
static void test_any_length_of_up(void **state)
{
    static const double scales[] = {0x1p-1070, 0x1p-500, 3, 0x1p500, 0x1.8p1023};
    struct vec3 expected = way_to_eye(vec3(-1, 1, 1));
    for (size_t i = 0; i < sizeof scales / sizeof *scales; i++) {
        struct vec3 up = vec3(-scales[i], scales[i], scales[i]);
        check_near(way_to_eye(up), expected, 1e-15);
        struct settings settings;
        struct light lights[2], plain[2];
        settings_init(&settings);
        settings.camera.eye = vec3(1, 2, 9);
        settings.camera.look_at = vec3(1, 1, 1);
        settings.camera.up = vec3(-1, 1, 1);
        shoulder_lights(&settings, plain);
        settings.camera.up = up;
        shoulder_lights(&settings, lights);
        check_near(lights[0].position, plain[0].position, 1e-14);
        check_near(lights[1].position, plain[1].position, 1e-14);
        settings_free(&settings);
    }
    /* Of a zero, which is refused later, the message should not be about the eye. */
    check_near(way_to_eye(vec3(0, 0, 0)), way_to_eye(vec3(0, 1, 0)), 0);
}

/* From where to where in the picture points are: -1 to 1 are its edges. */
struct extent {
    double least, most;
};

/* The corners of a box. */
static struct extent extent_of(const struct settings *settings, struct vec3 min, struct vec3 max,
                               bool upward)
{
    struct vec3 back = vec_normalize(back_of(settings));
    struct vec3 right = vec_normalize(vec_cross(settings->camera.up, back));
    struct vec3 axis = upward ? vec_cross(back, right) : right;
    double half = view_half_height(settings->camera.fov);
    if (!upward) half *= (double)settings->image.width / settings->image.height;
    struct extent extent = {HUGE_VAL, -HUGE_VAL};
    for (int c = 0; c < 8; c++) {
        struct vec3 corner =
            vec3(c & 1 ? max.x : min.x, c & 2 ? max.y : min.y, c & 4 ? max.z : min.z);
        struct vec3 d = vec_sub(corner, settings->camera.eye);
        double at = vec_dot(d, axis) / -vec_dot(d, back) / half;
        extent.least = fmin(extent.least, at);
        extent.most = fmax(extent.most, at);
    }
    return extent;
}

static bool is_centred(struct extent extent)
{
    return fabs(extent.least + extent.most) < 1e-4 * (extent.most - extent.least);
}

/* Scenes of any shape are in the middle and fill the picture up to its margin, however wide the view is. */
static void test_middle(void **state)
{
    static const double fovs[] = {1, 45, 90, 130};
    static const struct vec3 sizes[] = {{1, 1, 1},    {100, 1, 1}, {1, 100, 1}, {1, 1, 100},
                                        {50, 1, 100}, {1, 3, 1},   {4, 1, 2},   {1, 7, 20}};
    for (size_t i = 0; i < sizeof fovs / sizeof *fovs; i++)
        for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
            struct vec3 min = vec3(7, 8, 9), max = vec_add(min, sizes[k]);
            struct builder *builder = box_of(min, max);
            struct settings settings;
            settings_init(&settings);
            settings.camera.fov = fovs[i];
            frame_scene(builder, &settings, false, false);
            struct extent x = extent_of(&settings, min, max, false);
            struct extent y = extent_of(&settings, min, max, true);
            assert_true(is_centred(x) && is_centred(y));
            double most = fmax(x.most - x.least, y.most - y.least);
            assert_true(fabs(most - 2 / 1.1) < 1e-9);
            settings_free(&settings);
            builder_destroy(builder);
        }
}

/* A look_at that was set stays, and the scene touches the margin on the side on which most of it is. */
static void test_look_at(void **state)
{
    const struct vec3 min = vec3(-1, -1, -1), max = vec3(1, 1, 1);
    static const struct vec3 aims[] = {{-2, 0, 1}, {2, 0, -1}, {0, 3, 0}, {0, -3, 0}};
    for (size_t i = 0; i < 4; i++) {
        struct settings settings = framed(box_of(min, max), vec3(0, 1, 0), &aims[i]);
        assert_true(vec_length(vec_sub(settings.camera.look_at, aims[i])) == 0);
        struct extent x = extent_of(&settings, min, max, false);
        struct extent y = extent_of(&settings, min, max, true);
        const double touched[] = {x.most, -x.least, -y.least, y.most};
        assert_true(fabs(touched[i] - 1 / 1.1) < 1e-9);
        for (size_t k = 0; k < 4; k++)
            assert_true(touched[k] <= touched[i]);
    }
}

/* The eye is at a distance of 1 from a single point and where the scene is behind look_at; where there are only planes,
 * what is 1 above look_at is at the margin. */
static void test_no_extent(void **state)
{
    const struct vec3 up = vec3(0, 1, 0), before = vec3(300, 200, 500);
    struct settings settings = framed(point_of(vec3(4, 5, 6)), up, NULL);
    check_near(settings.camera.look_at, vec3(4, 5, 6), 0);
    assert_true(fabs(vec_length(back_of(&settings)) - 1) < 1e-12);
    settings = framed(box_of(vec3(-1, -1, -1), vec3(1, 1, 1)), up, &before);
    assert_true(fabs(vec_length(back_of(&settings)) - 1) < 1e-12);
    settings = framed(floor_of(-3), up, NULL);
    check_near(settings.camera.look_at, vec3(0, 0, 0), 0);
    double slope = view_half_height(settings.camera.fov) / 1.1;
    assert_true(fabs(vec_length(back_of(&settings)) * slope - 1) < 1e-12);
}

/* An eye that was set stays; it looks at the middle of the scene's box unless it is to look elsewhere. */
static void test_eye(void **state)
{
    struct builder *builder = box_of(vec3(0, 0, 0), vec3(2, 4, 6));
    struct settings settings;
    settings_init(&settings);
    settings.camera.eye = vec3(9, 9, 9);
    frame_scene(builder, &settings, true, false);
    check_near(settings.camera.eye, vec3(9, 9, 9), 0);
    check_near(settings.camera.look_at, vec3(1, 2, 3), 0);
    settings.camera.look_at = vec3(7, 7, 7);
    frame_scene(builder, &settings, true, true);
    check_near(settings.camera.eye, vec3(9, 9, 9), 0);
    check_near(settings.camera.look_at, vec3(7, 7, 7), 0);
    settings_free(&settings);
    builder_destroy(builder);
}

/* The lights keep their places beside the eye: the warm key light on the right, twice as bright as the bluish one that
 * fills the shadows from the left, and more from above. */
static void test_shoulder_lights(void **state)
{
    struct settings settings;
    struct light lights[2];
    settings_init(&settings);
    settings.camera.eye = vec3(1, 2, 13);
    settings.camera.look_at = vec3(1, 2, 3);
    shoulder_lights(&settings, lights);
    check_near(lights[0].position, vec3(1 + 6, 2 + 9, 13), 1e-12);
    check_near(lights[1].position, vec3(1 - 12, 2 + 2, 13), 1e-12);
    assert_true(lights[0].color.x > lights[0].color.y && lights[0].color.y > lights[0].color.z);
    assert_true(lights[1].color.x < lights[1].color.y && lights[1].color.y < lights[1].color.z);
    assert_true(lights[0].color.y > 2 * lights[1].color.y);
    settings_free(&settings);
}

/* Of this triangle one vertex decides how near the eye may come in both directions: the eye is in it. */
static void test_eye_in_vertex(void **state)
{
    const struct vec3 corners[] = {
        vec3(-25393.50944991693, -66956.37766953703, 24500.46655590913),
        vec3(-25393.612074702567, -66956.41083295643, 24500.412310636126),
        vec3(-25393.513738859994, -66956.40353935648, 24500.42137132352)};
    struct builder *builder = triangle_of(corners);
    struct settings settings;
    settings_init(&settings);
    settings.camera.fov = 90;
    settings.image.width = 640;
    settings.image.height = 480;
    frame_scene(builder, &settings, false, false);
    assert_true(vec_length(vec_sub(settings.camera.eye, corners[0])) < 1e-3);
    builder_destroy(builder);
    settings_free(&settings);
}

static void check_bounds(struct builder *builder, struct vec3 min, struct vec3 max)
{
    struct outline *outline = outline_create(builder);
    struct vec3 found[2];
    assert_true(outline_bounds(outline, &found[0], &found[1]));
    check_near(found[0], min, 1e-12);
    check_near(found[1], max, 1e-12);
    outline_destroy(outline);
    builder_destroy(builder);
}

/* Balls, oblique discs and oblique cones are as large as they are seen. Vertices without a triangle are not there. */
static void test_outline(void **state)
{
    struct builder *balls = with_material();
    const struct sphere two[] = {{.center = {5, 0, 0}, .radius = 1},
                                 {.center = {-3, 2, 0}, .radius = 2}};
    for (int i = 0; i < 2; i++)
        assert_null(builder_add_sphere(balls, &two[i]));
    uint32_t unused;
    assert_null(builder_add_vertex(balls, vec3(99, 99, 99), &unused));
    struct outline *outline = outline_create(balls);
    double support;
    assert_true(outline_support(outline, vec3(1, 0, 0), 1, &(struct vec3){3, 4, 0}, &support));
    assert_true(fabs(support - (3 * 4 + 5)) < 1e-12);
    outline_destroy(outline);
    check_bounds(balls, vec3(-5, -1, -2), vec3(6, 4, 2));
    struct builder *coin = with_material();
    const struct disc disc = {.center = {1, 2, 3}, .normal = {0.6, 0.8, 0}, .radius = 5};
    assert_null(builder_add_disc(coin, &disc));
    check_bounds(coin, vec3(-3, -1, -2), vec3(5, 5, 8));
    for (int wide = 0; wide <= 1; wide++) {
        struct builder *builder = with_material();
        struct cone cone = {.apex = {6, 8, 0}, .base_radius = 5, .apex_radius = wide ? 10 : 0};
        assert_null(builder_add_cone(builder, &cone));
        if (wide)
            check_bounds(builder, vec3(-4, -3, -10), vec3(14, 14, 10));
        else
            check_bounds(builder, vec3(-4, -3, -5), vec3(6, 8, 5));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_three_quarter_view),
        cmocka_unit_test(test_any_length_of_up),
        cmocka_unit_test(test_middle),
        cmocka_unit_test(test_look_at),
        cmocka_unit_test(test_no_extent),
        cmocka_unit_test(test_outline),
        cmocka_unit_test(test_eye),
        cmocka_unit_test(test_eye_in_vertex),
        cmocka_unit_test(test_shoulder_lights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
