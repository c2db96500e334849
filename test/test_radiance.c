/* Tests of the bounds on the brightness of surfaces and rays, and of the errors that pruned pictures claim by them. */
#include "test/scene_fixture.h"

#include "test/view_fixture.h"
#include "worker/radiance.h"
#include "worker/shade.h"

#define EDGE 6u

static struct vec3 random_color(uint64_t *random)
{
    double x = random_between(random, 0, 1), y = random_between(random, 0, 1);
    return vec3(x, y, random_between(random, 0, 1));
}

static struct vec3 direct_in(const struct scene *scene, const struct material *material,
                             const struct bounds *box)
{
    struct box_lights box_lights;
    box_lights_init(&box_lights, scene, box, radiance_light_grows(scene));
    struct vec3 most = box_lights_bound(&box_lights, material);
    box_lights_free(&box_lights);
    return most;
}

/* No point of a box is brighter than the bound, for any normal and direction of view. */
static void test_direct(void **state)
{
    uint64_t random = 77;
    double closest = 0;
    for (int i = 0; i < 300; i++) {
        struct builder *builder = builder_create();
        for (int k = (int)random_below(&random, 5); k >= 0; k--) {
            struct light light = {random_vector(&random, 4), random_color(&random)};
            assert_added(builder_add_light(builder, &light));
        }
        struct material material = {.color = random_color(&random),
                                    .ambient = 0.1,
                                    .diffuse = i % 3 ? 0.7 : 0,
                                    .specular = i % 2 ? 0.8 : 0,
                                    .shininess = i % 5 ? random_between(&random, 0, 50) : 0.5,
                                    .ior = 1};
        uint32_t index;
        assert_added(builder_add_material(builder, &material, &index));
        struct sphere sphere = {{0, 0, 0}, 1, index, 0};
        assert_added(builder_add_sphere(builder, &sphere));
        struct view view = small_view(EDGE);
        struct scene *scene = finish_in_view(builder, &view);
        struct vec3 a = random_vector(&random, 1);
        double size = i % 4 ? 0.2 : 3;
        struct bounds box = {{a.x, a.y, a.z}, {a.x + size, a.y + size / 2, a.z + size}};
        const struct material *m = scene_materials(scene);
        struct vec3 most = direct_in(scene, m, &box);
        for (int k = 0; k < 300; k++) {
            struct shading_point at = {.normal = vec_normalize(random_vector(&random, 1)),
                                       .view = vec_normalize(random_vector(&random, 1)),
                                       .material = m};
            at.point = vec3(random_between(&random, box.min[0], box.max[0]),
                            random_between(&random, box.min[1], box.max[1]),
                            random_between(&random, box.min[2], box.max[2]));
            at.geometric = at.normal;
            struct vec3 sum = shade_ambient(m), to_light;
            for (uint64_t n = 0; n < scene->lights.count; n++)
                if (light_faces(&at, &scene_lights(scene)[n], &to_light))
                    sum = vec_add(sum, shade_light(&at, to_light, scene_lights(scene)[n].color));
            assert_true(sum.x <= most.x && sum.y <= most.y && sum.z <= most.z);
            closest = fmax(closest, sum.x / most.x);
        }
        free(scene);
    }
    assert_true(closest > 0.9); /* and the bound is tight */
}

static const struct material white_matte = {.color = {1, 1, 1}, .diffuse = 1, .ior = 1};

/* A white matte ball of radius 1 at the origin under two lights. The caller frees the scene. */
static struct scene *lit_ball(const struct light lights[2])
{
    struct builder *builder = builder_create();
    for (int i = 0; i < 2; i++)
        assert_added(builder_add_light(builder, &lights[i]));
    uint32_t index;
    assert_added(builder_add_material(builder, &white_matte, &index));
    struct sphere sphere = {{0, 0, 0}, 1, index, 0};
    assert_added(builder_add_sphere(builder, &sphere));
    struct view view = small_view(EDGE);
    return finish_in_view(builder, &view);
}

/* Two opposite lights cannot light a surface together. */
static void test_opposite_lights(void **state)
{
    const struct light lights[2] = {{{0, -1e6, 0}, {1, 1, 1}}, {{0, 1e6, 0}, {1, 1, 1}}};
    struct scene *scene = lit_ball(lights);
    struct bounds box = {{-1, -1, -1}, {1, 1, 1}};
    struct vec3 most = direct_in(scene, &white_matte, &box);
    assert_true(most.x >= 1 && most.x < 1.001);
    struct bounds everywhere = {{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, {HUGE_VAL, HUGE_VAL, HUGE_VAL}};
    most = direct_in(scene, &white_matte, &everywhere);
    assert_true(most.x >= 2 && most.x < 2 + 1e-12);
    free(scene);
}

/* A far light nearly opposite to a near one: at the end of the box that is farthest aside of the near one, both
 * together light a surface as much as the bound says, up to the width of the far one's cone. */
static void test_nearly_opposite_lights(void **state)
{
    const struct vec3 white = {1, 1, 1}, end = {1, 0, 0}, near = {1, 0.25, 0};
    const struct bounds box = {{-1, 0, 0}, {1, 0, 0}};
    for (int i = 1; i < 200; i++) {
        double tilt = 1e-10 * i, far = 1e12;
        struct light lights[2] = {{near, white},
                                  {{-far * (1 + tilt / 4), -far * (0.25 - tilt), 0}, white}};
        struct scene *scene = lit_ball(lights);
        struct vec3 sum = vec_add(vec_normalize(vec_sub(lights[0].position, end)),
                                  vec_normalize(vec_sub(lights[1].position, end)));
        double claimed = direct_in(scene, &white_matte, &box).x;
        assert_true(vec_length(sum) <= claimed && claimed < vec_length(sum) + 1e-11);
        free(scene);
    }
}

static const struct vec3 one = {1, 1, 1};

/* Lights of any strength, a black one among them: a surface that faces all of those that light it gets as much as the
 * bound says. */
static void test_lights_of_any_strength(void **state)
{
    const struct bounds box = {{0, 0, 0}, {0, 0, 0}};
    const double strengths[] = {0.25, 0, 1, 0.5};
    struct builder *builder = builder_create();
    struct vec3 sum = {0, 0, 0};
    for (int i = 0; i < 4; i++) {
        struct light light = {{5, i, i * i - 2}, vec3(strengths[i], strengths[i], strengths[i])};
        assert_added(builder_add_light(builder, &light));
        sum = vec_add(sum, vec_scale(vec_normalize(light.position), strengths[i]));
    }
    uint32_t index;
    assert_added(builder_add_material(builder, &white_matte, &index));
    add_sphere(builder, vec3(0, 0, 0), 1, index);
    struct view view = small_view(EDGE);
    struct scene *scene = finish_in_view(builder, &view);
    double claimed = direct_in(scene, &white_matte, &box).x;
    assert_true(vec_length(sum) <= claimed && claimed < vec_length(sum) + 1e-9);
    free(scene);
}

/* A mirror ball under a sky: a ray that misses it has the sky's bound, one that may hit it has that of the reflected
 * sky. */
static void test_rays(void **state)
{
    struct builder *builder = builder_create();
    struct material mirror = {.color = {1, 1, 1}, .ambient = 0.25, .reflection = 0.5, .ior = 1};
    uint32_t index;
    assert_added(builder_add_material(builder, &mirror, &index));
    struct sphere sphere = {{0, 0, 0}, 1, index, 0};
    assert_added(builder_add_sphere(builder, &sphere));
    struct view view = small_view(EDGE);
    view.background_bottom = view.background_top = vec3(0.75, 0.75, 0.75);
    struct scene *scene = finish_in_view(builder, &view);
    struct radiance radiance;
    radiance_init(&radiance, scene);
    struct ray past = {{0, 0, 5}, {0, 1, 0}, HUGE_VAL, PRIMITIVE_NONE, 0};
    struct ray at = {{0, 0, 5}, {0, 0, -1}, HUGE_VAL, PRIMITIVE_NONE, 0};
    struct ray off = {{0, 0, 1}, {0, 0, 1}, HUGE_VAL, primitive_id(PRIMITIVE_SPHERE, 0), 0};
    double sky = radiance_bound(&radiance, &past, one, 1, true);
    assert_true(sky >= 0.75 && sky < 0.75 + 1e-12);
    assert_true(radiance_bound(&radiance, &off, one, 1, false) == sky); /* it cannot hit the ball */
    double ball = radiance_bound(&radiance, &at, one, 20, true); /* nothing below max_depth */
    assert_true(ball == sky);
    double half = radiance_bound(&radiance, &at, vec3(0, 0.5, 0.25), 1, false);
    assert_true(half >= 0.375 && half < 0.375 + 1e-6);
    past.direction.x = (double)NAN; /* it may go anywhere */
    assert_true(radiance_bound(&radiance, &past, one, 1, true) >= 0.75);
    radiance_free(&radiance);
    free(scene);
}

/* Between lossless mirrors a ray can bring the light that is added at its own level and at each one below. */
static void test_lossless_levels(void **state)
{
    struct builder *builder = builder_create();
    struct material mirror = {.color = {1, 1, 1}, .ambient = 0.25, .reflection = 1, .ior = 1};
    uint32_t index;
    assert_added(builder_add_material(builder, &mirror, &index));
    for (int side = -1; side < 2; side += 2) {
        struct plane plane = {{0, 0, side}, {0, 0, -side}, index, 0};
        assert_added(builder_add_plane(builder, &plane));
    }
    struct view view = small_view(EDGE);
    view.background_bottom = view.background_top = vec3(0, 0, 0);
    view.max_depth = RADIANCE_LEVELS;
    struct scene *scene = finish_in_view(builder, &view);
    struct radiance radiance;
    radiance_init(&radiance, scene);
    struct ray ray = {{0, 0, 0}, {0, 0, 1}, HUGE_VAL, PRIMITIVE_NONE, 0};
    for (uint32_t depth = 0; depth <= RADIANCE_LEVELS; depth += 50) {
        double brings = 0.25 * (RADIANCE_LEVELS - depth + 1);
        for (int in_picture = 0; in_picture < 2; in_picture++) {
            double most = radiance_bound(&radiance, &ray, one, depth, in_picture);
            double coarse = radiance_coarse_bound(&radiance, one, depth, in_picture);
            assert_true(most >= brings && most < brings + 1e-4);
            assert_true(coarse >= brings && coarse < brings + 1e-4);
        }
    }
    radiance_free(&radiance);
    free(scene);
}

/* A mirror in the dark, a ball or a cone, that adds a little light of its own. */
static struct scene *mirror_in_the_dark(const struct material *mirror, bool cone, uint32_t formulas,
                                        uint32_t max_depth)
{
    struct builder *builder = builder_create();
    uint32_t index;
    assert_added(builder_add_material(builder, mirror, &index));
    struct sphere ball = {{0, 0, 0}, 1, index, 0};
    struct cone tube = {{0, 0, -1}, {0, 0, 1}, 1, 1, index, 0};
    if (cone)
        assert_added(builder_add_cone(builder, &tube));
    else
        assert_added(builder_add_sphere(builder, &ball));
    struct view view = small_view(EDGE);
    view.background_bottom = view.background_top = vec3(0, 0, 0);
    view.formulas = formulas;
    view.max_depth = max_depth;
    return finish_in_view(builder, &view);
}

/* Inside of a mirror that adds a tenth at every reflection: the bound counts all possible reflections. */
static void test_all_levels(void **state)
{
    enum { DEPTH = 4 };
    struct material mirror = {.color = one, .ambient = 0.1, .reflection = 0.9, .ior = 1};
    struct radiance radiance;
    struct scene *scene = mirror_in_the_dark(&mirror, false, FORMULAS_EXACT, DEPTH);
    radiance_init(&radiance, scene);
    double most = radiance_primary_bound(&radiance);
    assert_true(most >= 1 && most < 1 + 1e-6); /* 0.1 (1 + 0.9 + 0.81 ...) */
    radiance_free(&radiance);
    free(scene);
    mirror.reflection = 1;
    scene = mirror_in_the_dark(&mirror, false, FORMULAS_EXACT, DEPTH);
    radiance_init(&radiance, scene);
    for (uint32_t depth = 0; depth <= DEPTH; depth++) {
        double shown = radiance_coarse_bound(&radiance, one, depth, true) / 0.1;
        double any = radiance_coarse_bound(&radiance, one, depth, false) / 0.1;
        assert_true(shown >= DEPTH + 1 - depth && shown < (DEPTH + 1 - depth) * (1 + 1e-6));
        assert_true(any >= RADIANCE_LEVELS + 1 - depth &&
                    any < (RADIANCE_LEVELS + 1 - depth) * (1 + 1e-6));
    }
    radiance_free(&radiance);
    free(scene);
}

/* Whether a ray meets the cube around the origin with this half edge. */
static bool meets_cube(const struct ray *ray, double half)
{
    const double o[3] = {ray->origin.x, ray->origin.y, ray->origin.z};
    const double d[3] = {ray->direction.x, ray->direction.y, ray->direction.z};
    double enter = 0, leave = HUGE_VAL;
    for (int axis = 0; axis < 3; axis++) {
        double a = (-half - o[axis]) / d[axis], b = (half - o[axis]) / d[axis];
        enter = fmax(enter, fmin(a, b));
        leave = fmin(leave, fmax(a, b));
    }
    return enter <= leave;
}

/* In the dark only rays that meet the box around a mirror bring light, or that go nobody knows where. */
static void test_box_is_met(void **state)
{
    const struct material mirror = {.color = one, .ambient = 0.5, .reflection = 0.5, .ior = 1};
    struct scene *scene = mirror_in_the_dark(&mirror, false, FORMULAS_EXACT, 4);
    struct radiance radiance;
    struct ray ray = {.t_max = HUGE_VAL, .from = PRIMITIVE_NONE};
    uint64_t random = 79;
    radiance_init(&radiance, scene);
    for (int i = 0; i < 3000; i++) {
        ray.origin = random_vector(&random, 3);
        ray.direction = random_vector(&random, 1);
        double most = radiance_bound(&radiance, &ray, one, 1, true);
        assert_true(most == 0 || most >= 0.5);
        if (meets_cube(&ray, 0.999)) assert_true(most > 0);
        if (!meets_cube(&ray, 1.001)) assert_true(most == 0);
    }
    ray.direction.x = (double)NAN;
    assert_true(radiance_bound(&radiance, &ray, one, 1, true) >= 0.5);
    radiance_free(&radiance);
    free(scene);
}

/* Each component has a bound of its own: that of the sky at its brightest, and of what a mirror adds. */
static void test_components(void **state)
{
    const struct vec3 weights[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    struct builder *builder = builder_create();
    struct material mirror = {.color = one, .ambient = 0.25, .reflection = 1, .ior = 1};
    struct sphere sphere = {{0, 0, 0}, 1, 0, 0};
    assert_added(builder_add_material(builder, &mirror, &sphere.material));
    assert_added(builder_add_sphere(builder, &sphere));
    struct view view = small_view(EDGE);
    view.background_bottom = vec3(0.25, 0.75, 0.25);
    view.background_top = vec3(0.75, 0.25, 0.75);
    struct scene *scene = finish_in_view(builder, &view);
    struct radiance radiance;
    radiance_init(&radiance, scene);
    struct ray lost = {{0, 0, 5}, {(double)NAN, 1, 0}, HUGE_VAL, PRIMITIVE_NONE, 0};
    for (int c = 0; c < 3; c++) {
        double sky = radiance_bound(&radiance, &lost, weights[c], view.max_depth, true);
        double two = radiance_coarse_bound(&radiance, weights[c], view.max_depth - 1, true);
        assert_true(sky >= 0.75 && sky < 0.75 + 1e-6 && two >= 1 && two < 1 + 1e-6);
    }
    radiance_free(&radiance);
    free(scene);
}

/* Whether the bound assumes that a ray from the mirror may hit it again. */
static bool meets_again(bool cone, uint32_t formulas, struct vec3 origin, struct vec3 direction)
{
    const struct material mirror = {.color = one, .ambient = 0.5, .reflection = 0.5, .ior = 1};
    struct scene *scene = mirror_in_the_dark(&mirror, cone, formulas, 4);
    struct radiance radiance;
    radiance_init(&radiance, scene);
    struct ray ray = {.origin = origin,
                      .direction = vec_normalize(direction),
                      .t_max = HUGE_VAL,
                      .from = primitive_id(cone ? PRIMITIVE_CONE : PRIMITIVE_SPHERE, 0)};
    double most = radiance_bound(&radiance, &ray, one, 1, true);
    assert_true(most == 0 || most >= 0.5);
    radiance_free(&radiance);
    free(scene);
    return most > 0;
}

/* A ray that leaves a ball outward does not; one inside does, however short its path, and so does one in a tube. With
 * the paper's formulas a ray may always hit the surface that it has left. */
static void test_met_again(void **state)
{
    const struct vec3 top = {0, 0, 1}, side = {1, 0, 0};
    assert_false(meets_again(false, FORMULAS_EXACT, top, vec3(1, 0, 1)));
    assert_true(meets_again(false, FORMULAS_PAPER, top, vec3(1, 0, 1)));
    assert_true(meets_again(false, FORMULAS_EXACT, top, vec3(1, 0, -1)));
    assert_true(meets_again(false, FORMULAS_EXACT, top, vec3(1, 0, -1e-7)));
    assert_true(meets_again(true, FORMULAS_EXACT, side, vec3(-1, 0, 0)));
}

static void test_box_met_again(void **state)
{
    struct builder *builder = builder_create();
    struct material glass = {.color = one, .ambient = 0.5, .transmission = 0.5, .ior = 1};
    uint32_t index;
    assert_added(builder_add_material(builder, &glass, &index));
    struct box box = {{-1, -1, -1}, {1, 1, 1}, index, 0};
    assert_added(builder_add_box(builder, &box));
    struct view view = small_view(EDGE);
    view.background_bottom = view.background_top = vec3(0, 0, 0);
    struct scene *scene = finish_in_view(builder, &view);
    struct radiance radiance;
    radiance_init(&radiance, scene);
    struct ray ray = {{0, 0, 1}, {0, 0, 1}, HUGE_VAL, primitive_id(PRIMITIVE_BOX, 0), 5};
    assert_true(radiance_bound(&radiance, &ray, one, 1, true) == 0);
    ray.direction.z = -1; /* through it, to the other face */
    assert_true(radiance_bound(&radiance, &ray, one, 1, true) >= 0.5);
    radiance_free(&radiance);
    free(scene);
}

/* A ray that misses a ball: the paper's formulas may err by more than its size, and find a hit. */
static void test_past(void **state)
{
    const struct material mirror = {.color = one, .ambient = 0.5, .reflection = 0.5, .ior = 1};
    for (uint32_t formulas = FORMULAS_EXACT; formulas <= FORMULAS_PAPER; formulas++) {
        struct scene *scene = mirror_in_the_dark(&mirror, false, formulas, 4);
        struct radiance radiance;
        radiance_init(&radiance, scene);
        struct ray ray = {{1.5, 0, 5}, {0, 0, -1}, HUGE_VAL, PRIMITIVE_NONE, 0};
        assert_int_equal(radiance_bound(&radiance, &ray, one, 1, true) > 0,
                         formulas == FORMULAS_PAPER);
        radiance_free(&radiance);
        free(scene);
    }
}

/* ---- claims ---- */

static uint32_t random_material(struct builder *builder, uint64_t *random, int family)
{
    uint32_t index;
    struct material m = {.color = random_color(random),
                         .ambient = 0.1,
                         .diffuse = random_between(random, 0, 0.7),
                         .specular = random_between(random, 0, 0.5),
                         .shininess = random_between(random, 1, 60),
                         .ior = random_between(random, 0.7, 1.8)};
    m.reflection = random_between(random, 0, family ? 0.9 : 0.3);
    m.transmission = random_between(random, 0, 1 - m.reflection);
    if (family == 2) { /* loses nothing */
        m.color = vec3(1, 1, 1);
        m.transmission = 1 - m.reflection;
    }
    assert_added(builder_add_material(builder, &m, &index));
    return index;
}

static struct scene *random_scene(uint64_t *random, int family)
{
    struct builder *builder = builder_create();
    uint32_t matte, kinds[3];
    struct material m = {.color = random_color(random), .ambient = 0.2, .diffuse = 0.7, .ior = 1};
    assert_added(builder_add_material(builder, &m, &matte));
    for (int i = 0; i < 3; i++)
        kinds[i] = random_material(builder, random, family);
    for (int i = 0; i < 7; i++) {
        struct sphere sphere = {.center = random_vector(random, 2),
                                .radius = random_between(random, 0.2, 0.8),
                                .material = i < 2 ? matte : kinds[i % 3]};
        assert_added(builder_add_sphere(builder, &sphere));
    }
    struct vec3 a = random_vector(random, 1.5);
    struct box box = {a, {a.x + 0.8, a.y + 0.5, a.z + 0.6}, kinds[0], 0};
    assert_added(builder_add_box(builder, &box));
    struct plane floor = {{0, -2, 0}, {0, 1, 0}, family == 1 ? kinds[1] : matte, 0};
    assert_added(builder_add_plane(builder, &floor));
    for (int i = 0; i < 3; i++) {
        struct light light = {random_vector(random, 6), random_color(random)};
        assert_added(builder_add_light(builder, &light));
    }
    struct view view = small_view(EDGE);
    return finish_in_view(builder, &view);
}

/* Renders a single pixel; returns the error that it claims. */
static double render_pixel(struct renderer *renderer, uint32_t pixel, float rgb[3],
                           struct render_counts *counts)
{
    struct tile tile = {.x = pixel % EDGE, .y = pixel / EDGE, .w = 1, .h = 1, .step = 1};
    renderer_tile(renderer, &tile, rgb, counts);
    return counts->truncation;
}

struct coverage {
    uint32_t pixels, broken, bounded;
    double largest; /* error / claim */
};

/* Compares the pixels of a picture with a far deeper one, whose own claimed error is allowed for. */
static void compare(struct scene *scene, const struct bvh *bvh, const float *deep,
                    const double *left, struct coverage *coverage)
{
    struct renderer *renderer = renderer_create(scene, bvh);
    for (uint32_t pixel = 0; pixel < EDGE * EDGE; pixel++) {
        float rgb[3];
        struct render_counts counts;
        double claim = render_pixel(renderer, pixel, rgb, &counts), error = 0, rounding = 0;
        for (uint32_t c = 0; c < 3; c++) {
            double truth = (double)deep[3 * pixel + c];
            error = fmax(error, fabs((double)rgb[c] - truth));
            rounding = fmax(rounding, 0x1p-23 * fmax((double)rgb[c], truth));
        }
        coverage->pixels++;
        coverage->bounded += isfinite(claim) != 0;
        coverage->broken += !(error <= claim + left[pixel] + rounding);
        if (error > 1e-4)
            coverage->largest = fmax(coverage->largest, error / (claim + left[pixel] + rounding));
    }
    renderer_destroy(renderer);
}

static void test_claims(void **state)
{
    uint64_t random = 5;
    for (int family = 0; family < 3; family++) {
        struct coverage coverage = {0};
        for (int i = 0; i < 2; i++) {
            static float deep[EDGE * EDGE * 3];
            static double left[EDGE * EDGE];
            struct scene *scene = random_scene(&random, family);
            struct bvh *bvh = tree_of(scene);
            struct render_counts counts;
            scene->view.max_depth = 30;
            scene->view.cutoff = 0x1p-11;
            struct renderer *renderer = renderer_create(scene, bvh);
            for (uint32_t pixel = 0; pixel < EDGE * EDGE; pixel++)
                left[pixel] = render_pixel(renderer, pixel, &deep[3 * pixel], &counts);
            renderer_destroy(renderer);
            for (uint32_t depth = 0; depth < 6; depth += 1 + depth / 2) {
                scene->view.max_depth = depth;
                scene->view.cutoff = depth % 2 ? 0x1p-6 : 0x1p-9;
                compare(scene, bvh, deep, left, &coverage);
            }
            scene->view.max_depth = 20;
            for (scene->view.cutoff = 0x1p-10; scene->view.cutoff < 0.1; scene->view.cutoff *= 8)
                compare(scene, bvh, deep, left, &coverage);
            free(bvh);
            free(scene);
        }
        assert_int_equal(coverage.broken, 0);
        assert_int_equal(coverage.bounded, coverage.pixels);
        assert_true(coverage.largest > 0.5 && coverage.largest <= 1);
    }
}

/* Surfaces that pass on more light than they get: the claimed error is infinite, and all requested rays are traced. */
static void test_growing_light(void **state)
{
    struct builder *builder = builder_create();
    struct material glass = {
        .color = {1.5, 1, 1}, .ambient = 0.1, .reflection = 0.5, .transmission = 1, .ior = 1.5};
    uint32_t index;
    assert_added(builder_add_material(builder, &glass, &index));
    for (int i = 0; i < 2; i++) {
        struct sphere sphere = {{2 * i, 0, 0}, 0.9, index, 0};
        assert_added(builder_add_sphere(builder, &sphere));
    }
    struct view view = small_view(EDGE);
    view.max_depth = 4;
    view.cutoff = 0.125;
    struct prepared prepared = prepare_scene(builder, &view);
    float rgb[3];
    struct render_counts counts;
    double claim = render_pixel(prepared.renderer, EDGE / 2 * EDGE + EDGE / 2, rgb, &counts);
    assert_true(isinf(claim) && claim > 0);
    prepared_free(&prepared);
}

/* A light, a ball whose glass amplifies transmitted light, and one of this material beside it. */
static struct scene *growing_light_beside(const struct material *material, const struct view *view)
{
    struct builder *builder = builder_create();
    struct light light = {{0, 0, 9}, one};
    struct material glass = {.color = {1.5, 1, 1}, .transmission = 1, .ior = 1.5};
    uint32_t index, other;
    assert_added(builder_add_light(builder, &light));
    assert_added(builder_add_material(builder, &glass, &index));
    assert_added(builder_add_material(builder, material, &other));
    add_sphere(builder, vec3(0, 0, 0), 1, index);
    add_sphere(builder, vec3(3, 0, 0), 1, other);
    return finish_in_view(builder, view);
}

/* Surfaces that amplify transmitted light, with shadow rays: there is no bound on the light behind them. */
static void test_light_through_growing(void **state)
{
    const struct bounds box = {{-1, -1, -1}, {1, 1, 1}};
    for (uint32_t shadows = 0; shadows <= 1; shadows++) {
        struct material matte = {.color = one, .ambient = 0.25, .diffuse = 0.5, .ior = 1};
        struct view view = small_view(EDGE);
        view.shadows = shadows;
        struct scene *scene = growing_light_beside(&matte, &view);
        assert_int_equal(radiance_light_grows(scene), shadows);
        assert_int_equal(isinf(direct_in(scene, &matte, &box).x) != 0, shadows);
        matte.diffuse = 0;
        assert_true(direct_in(scene, &matte, &box).x < 0.25 + 1e-9);
        free(scene);
    }
}

/* Where there is no bound at all, that is so at every depth: even at one where nothing is left that could add light. */
static void test_growing_at_any_depth(void **state)
{
    const struct material mirror = {.color = one, .diffuse = 0.5, .reflection = 1, .ior = 1};
    const struct view view = small_view(EDGE);
    struct scene *scene = growing_light_beside(&mirror, &view);
    struct radiance radiance;
    radiance_init(&radiance, scene);
    for (uint32_t depth = RADIANCE_LEVELS - 2; depth < RADIANCE_LEVELS + 4; depth++)
        assert_true(radiance_coarse_bound(&radiance, one, depth, false) == HUGE_VAL);
    radiance_free(&radiance);
    free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_box_met_again),
        cmocka_unit_test(test_direct),
        cmocka_unit_test(test_opposite_lights),
        cmocka_unit_test(test_nearly_opposite_lights),
        cmocka_unit_test(test_lights_of_any_strength),
        cmocka_unit_test(test_rays),
        cmocka_unit_test(test_lossless_levels),
        cmocka_unit_test(test_all_levels),
        cmocka_unit_test(test_box_is_met),
        cmocka_unit_test(test_components),
        cmocka_unit_test(test_met_again),
        cmocka_unit_test(test_past),
        cmocka_unit_test(test_claims),
        cmocka_unit_test(test_growing_light),
        cmocka_unit_test(test_light_through_growing),
        cmocka_unit_test(test_growing_at_any_depth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
