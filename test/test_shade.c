/* Tests of Phong's model, reflection and refraction with values computed by hand. */

#include "test/random.h"
#include "test/unit.h"
#include "worker/shade.h"

static const struct material plain = {.color = {0.5, 0.25, 1},
                                      .ambient = 0.1,
                                      .diffuse = 0.6,
                                      .specular = 0.3,
                                      .shininess = 2,
                                      .ior = 1.5};

/* A point at the origin on the plane y = 0, seen at 45 degrees from the left. */
static struct shading_point point_on_floor(const struct material *material)
{
    return (struct shading_point){.view = {sqrt(0.5), -sqrt(0.5), 0},
                                  .geometric = {0, 1, 0},
                                  .normal = {0, 1, 0},
                                  .entering = true,
                                  .material = material};
}

static void assert_near(double value, double expected)
{
    if (!(fabs(value - expected) <= 4e-16 * fmax(1, fabs(expected))))
        fail_msg("%.17g is not %.17g", value, expected);
}

static void assert_vec_near(struct vec3 value, double x, double y, double z)
{
    assert_near(value.x, x);
    assert_near(value.y, y);
    assert_near(value.z, z);
}

/* Light from straight above: cos a = 1, cos b = cos 45 degrees, so cos^2 b = 1/2. */
static void test_phong_terms(void **state)
{
    struct shading_point at = point_on_floor(&plain);
    struct light light = {.position = {0, 5, 0}, .color = {1, 1, 0.5}};
    struct vec3 to_light;
    assert_true(light_faces(&at, &light, &to_light));
    struct vec3 color = shade_light(&at, to_light, light.color);
    assert_vec_near(color, 0.6 * 0.5 + 0.3 * 0.5, 0.6 * 0.25 + 0.3 * 0.5,
                    0.5 * (0.6 * 1 + 0.3 * 0.5));
    assert_vec_near(shade_ambient(&plain), 0.05, 0.025, 0.1);
}

/* In the mirror direction cos b = 1 whatever the exponent. */
static void test_highlight_peak(void **state)
{
    struct material shiny = plain;
    shiny.shininess = 1000;
    struct shading_point at = point_on_floor(&shiny);
    struct vec3 to_light = {3, 3, 0};
    struct vec3 color = shade_light(&at, to_light, vec3(1, 1, 1));
    double diffuse = 0.6 * sqrt(0.5);
    assert_true(fabs(color.x - (0.5 * diffuse + 0.3)) < 1e-12);
}

static void test_light_below_does_not_reach(void **state)
{
    struct shading_point at = point_on_floor(&plain);
    struct vec3 to_light;
    assert_false(light_faces(&at, &(struct light){.position = {0, -1, 0}}, &to_light));
    assert_false(light_faces(&at, &(struct light){.position = {1, 0, 0}}, &to_light));
    assert_true(light_faces(&at, &(struct light){.position = {1e9, 1e-9, 0}}, &to_light));
}

static void test_normals_turn_to_the_viewer(void **state)
{
    struct block {
        struct scene scene;
        struct material material;
    } block = {.material = plain};
    block.scene.materials = (struct scene_span){offsetof(struct block, material), 1};
    struct surface surface = {.geometric = {0, 1, 0}, .shading = {0, 1, 0}};
    struct ray above = {.direction = {0, -1, 0}}, below = {.direction = {0, 1, 0}};
    struct shading_point at = shading_point(&block.scene, &above, &surface);
    assert_true(at.entering && at.normal.y == 1 && at.geometric.y == 1);
    at = shading_point(&block.scene, &below, &surface);
    assert_true(!at.entering && at.normal.y == -1 && at.geometric.y == -1);
}

static void test_mirror(void **state)
{
    struct shading_point at = point_on_floor(&plain);
    assert_vec_near(reflect(&at), sqrt(0.5), sqrt(0.5), 0);
    /* If an interpolated normal would reflect the ray into the floor, the geometric one is used. */
    at.view = vec3(0.8, -0.6, 0);
    at.normal = vec_normalize(vec3(1, 1e-3, 0));
    assert_true(reflect(&at).y > 0);
}

static void test_snell(void **state)
{
    struct shading_point at = point_on_floor(&plain);
    struct vec3 direction;
    assert_true(refract(&at, 1, 1.5, &direction));
    assert_near(direction.x, sqrt(0.5) / 1.5); /* sin of 45 degrees over the ior */
    assert_near(vec_length(direction), 1);
    at.entering = false; /* from inside: 45 degrees is beyond the critical angle of 41.8 */
    assert_false(refract(&at, 1.5, 1, &direction));
    at.view = vec3(0.5, -sqrt(0.75), 0);
    assert_true(refract(&at, 1.5, 1, &direction));
    assert_near(direction.x, 0.75);
}

static void test_equal_media_bend_nothing(void **state)
{
    struct shading_point at = point_on_floor(&plain);
    struct vec3 direction;
    assert_true(refract(&at, 1.5, 1.5, &direction));
    assert_true(direction.x == at.view.x && direction.y == at.view.y && direction.z == at.view.z);
}

/* The paper's formulas give the same in ordinary cases; at a huge exponent they do not. */
static void test_paper_formulas(void **state)
{
    struct shading_point at = point_on_floor(&plain), paper = at;
    paper.formulas = FORMULAS_PAPER;
    struct vec3 to_light = {2, 3, 1}, one = {1, 1, 1}, refracted, expected;
    struct vec3 color = shade_light(&at, to_light, one);
    assert_vec_near(shade_light(&paper, to_light, one), color.x, color.y, color.z);
    assert_vec_near(reflect(&paper), reflect(&at).x, reflect(&at).y, reflect(&at).z);
    assert_true(refract(&at, 1, 1.5, &expected));
    assert_true(refract(&paper, 1, 1.5, &refracted));
    assert_vec_near(refracted, expected.x, expected.y, expected.z);
    struct material needle = plain;
    needle.shininess = 1e9;
    at.material = paper.material = &needle;
    to_light = vec_add(reflect(&at), vec3(1e-5, 0, 0));
    double exact = shade_light(&at, to_light, one).x, naive = shade_light(&paper, to_light, one).x;
    assert_true(fabs(exact - naive) > 1e-9 * exact && fabs(exact - naive) < 1e-3 * exact);
}

/* Catalogue 33: a light at the point itself does not light it; a light next to it does. */
static void test_light_at_the_point(void **state)
{
    struct shading_point at = point_on_floor(&plain);
    struct vec3 to_light, one = {1, 1, 1};
    assert_false(light_faces(&at, &(struct light){.position = at.point}, &to_light));
    const double distances[] = {5e-324, 1e-310, 1e-200, 1e150, 1e308};
    struct vec3 color = shade_light(&at, vec3(0, 1, 0), one);
    for (size_t i = 0; i < sizeof distances / sizeof *distances; i++) {
        struct light light = {.position = {0, distances[i], 0}};
        assert_true(light_faces(&at, &light, &to_light));
        struct vec3 near = shade_light(&at, to_light, one);
        assert_vec_near(near, color.x, color.y, color.z);
    }
}

/* Catalogue 47: light scaled by a power of two scales the colour bit for bit. */
static void test_light_scales(void **state)
{
    struct shading_point at = point_on_floor(&plain);
    struct vec3 strength = {0.3, 0.7, 1.1}, to_light = {0.4, 0.9, -0.2};
    struct vec3 color = shade_light(&at, to_light, strength);
    for (int k = -60; k <= 60; k += 15) {
        struct vec3 scaled = shade_light(&at, to_light, vec_scale(strength, ldexp(1, k)));
        assert_true(scaled.x == ldexp(color.x, k) && scaled.y == ldexp(color.y, k) &&
                    scaled.z == ldexp(color.z, k));
    }
}

static void test_background_gradient(void **state)
{
    struct view view = {
        .background_bottom = {1, 0, 0}, .background_top = {0, 0, 1}, .background_up = {0, 1, 0}};
    assert_vec_near(background(&view, vec3(0, 1, 0)), 0, 0, 1);
    assert_vec_near(background(&view, vec3(0, -1, 0)), 1, 0, 0);
    assert_vec_near(background(&view, vec3(1, 0, 0)), 0.5, 0, 0.5);
}

static struct vec3 random_unit(uint64_t *random)
{
    double x = random_between(random, -1, 1), y = random_between(random, -1, 1);
    return vec_normalize(vec3(x, y, random_between(random, -1, 1)));
}

/* Whether a light faces a point is decided before its direction is rounded to a unit vector: the cosine of one
 * next to 90 degrees may be rounded below 0 then. */
static void test_no_light_is_negative(void **state)
{
    uint64_t random = 5;
    unsigned facing = 0;
    struct material matt = plain;
    matt.specular = 0;
    for (int i = 0; i < 100000; i++) {
        struct shading_point at = point_on_floor(&matt);
        struct vec3 to_light, away = random_unit(&random);
        at.geometric = at.normal = random_unit(&random);
        struct light light = {.position = vec_cross(away, at.normal)};
        if (!light_faces(&at, &light, &to_light)) continue;
        facing++;
        struct vec3 color = shade_light(&at, to_light, vec3(1, 1, 1));
        assert_true(color.x >= 0 && color.x < 1e-15);
    }
    assert_true(facing > 10000);
}

/* Straight up and down, where the product of two unit vectors may be rounded beyond 1. */
static void test_background_is_not_negative(void **state)
{
    uint64_t random = 6;
    for (int i = 0; i < 1000; i++) {
        struct vec3 up = random_unit(&random);
        struct view view = {
            .background_bottom = {1, 0, 1}, .background_top = {0, 1, 1}, .background_up = up};
        struct vec3 above = background(&view, up), below = background(&view, vec_neg(up));
        assert_true(above.x >= 0 && below.y >= 0 && above.y <= 1 && below.x <= 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_phong_terms),
        cmocka_unit_test(test_highlight_peak),
        cmocka_unit_test(test_light_below_does_not_reach),
        cmocka_unit_test(test_normals_turn_to_the_viewer),
        cmocka_unit_test(test_mirror),
        cmocka_unit_test(test_snell),
        cmocka_unit_test(test_equal_media_bend_nothing),
        cmocka_unit_test(test_paper_formulas),
        cmocka_unit_test(test_light_at_the_point),
        cmocka_unit_test(test_light_scales),
        cmocka_unit_test(test_background_gradient),
        cmocka_unit_test(test_no_light_is_negative),
        cmocka_unit_test(test_background_is_not_negative),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
