/* Tests of the warning of lights inside of solids. */
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/builder.h"
#include "master/enclosed.h"
#include "test/unit.h"
#include "test/view_fixture.h"

/* Adds a light at the origin. */
static void add_light(struct builder *builder)
{
    assert_null(builder_add_light(builder, &(struct light){.color = {1, 1, 1}}));
}

/* The same, after one outside of all solids here. */
static void add_lights(struct builder *builder)
{
    struct light out = {.position = {0, 9, 0}, .color = {1, 1, 1}};
    assert_null(builder_add_light(builder, &out));
    add_light(builder);
}

static uint32_t add_material(struct builder *builder, double transmission)
{
    uint32_t index;
    struct material m = {.color = {1, 1, 1}, .diffuse = 0.5, .shininess = 1, .ior = 1.5};
    m.transmission = transmission;
    assert_null(builder_add_material(builder, &m, &index));
    return index;
}

/* The messages about the builder's scene, in static memory. Frees the builder. */
static const char *said_of(struct builder *builder, const struct view *view)
{
    static char said[512];
    add_lights(builder);
    struct scene *scene = finish_in_view(builder, view);
    memset(said, 0, sizeof said);
    message_capture(said, sizeof said);
    warn_of_enclosed_lights(scene, "a.ini");
    message_capture(NULL, 0);
    free(scene);
    return said;
}

static const char warning[] =
    "a.ini: warning: a light is inside of an opaque solid, at 0 0 0: it lights "
    "nothing outside\n";

static struct builder *ball(double transmission, double radius)
{
    struct builder *builder = builder_create();
    struct sphere sphere = {.radius = radius, .material = add_material(builder, transmission)};
    assert_null(builder_add_sphere(builder, &sphere));
    return builder;
}

/* The eye is 6 away. */
static void test_spheres(void **state)
{
    struct view view = small_view(4);
    assert_string_equal(said_of(ball(0, 1), &view), warning);
    assert_string_equal(said_of(ball(0.5, 1), &view), "");
    assert_string_equal(said_of(ball(0, 7), &view), ""); /* a sky */
    struct builder *two = ball(0, 1);
    add_light(two);
    assert_string_equal(said_of(two, &view),
                        "a.ini: warning: 2 lights are inside of opaque solids, one at 0 0 0: "
                        "they light nothing outside\n");
    view.shadows = 0;
    assert_string_equal(said_of(ball(0, 1), &view), "");
}

static void test_boxes(void **state)
{
    struct view view = small_view(4);
    for (int beside = 0; beside < 2; beside++) {
        struct builder *builder = builder_create();
        struct box box = {{-1, beside ? 0.5 : -2, -1}, {1, 2, 1}, add_material(builder, 0), 0};
        assert_null(builder_add_box(builder, &box));
        assert_string_equal(said_of(builder, &view), beside ? "" : warning);
    }
}

/* It is 0.5 wide where the light is; an open one is a surface. Behind its ends nothing is enclosed. */
static void test_cones(void **state)
{
    struct view view = small_view(4);
    const struct {
        double x, y;
        uint32_t capped;
        bool encloses;
    } cases[] = {{0.4, 0, 1, true},    {-0.4, 0, 1, true}, {0.6, 0, 1, false}, {0.4, 0, 0, false},
                 {0.4, 1.5, 1, false}, {0, -3, 1, false},  {0, -1.8, 1, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct builder *builder = builder_create();
        struct cone cone = {.base = {cases[i].x, cases[i].y - 1, 0},
                            .apex = {cases[i].x, cases[i].y + 1, 0},
                            .base_radius = 1,
                            .capped = cases[i].capped,
                            .material = add_material(builder, 0)};
        assert_null(builder_add_cone(builder, &cone));
        assert_string_equal(said_of(builder, &view), cases[i].encloses ? warning : "");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_spheres),
        cmocka_unit_test(test_boxes),
        cmocka_unit_test(test_cones),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
