/* Tests of the bound on what a sample leaves out: memory is bounded, and every ray counts. */
#include "test/scene_fixture.h"

#include "common/message.h"
#include "test/view_fixture.h"
#include "worker/omission.h"

static struct scene *mirror_ball(void)
{
    struct builder *builder = builder_create();
    struct material material = {.color = {1, 1, 1}, .reflection = 0.9, .ior = 1};
    uint32_t index;
    assert_added(builder_add_material(builder, &material, &index));
    struct sphere sphere = {{0, 0, -5}, 1, index, 0};
    assert_added(builder_add_sphere(builder, &sphere));
    struct view view = small_view(4);
    struct scene *scene = finish_in_view(builder, &view);
    return scene;
}

/* The structures that a sample needs. */
struct sample {
    struct scene *scene;
    struct radiance radiance;
    struct omission omission;
};

static int begin_sample(void **state)
{
    struct sample *sample = allocate_zeroed(1, sizeof *sample);
    sample->scene = mirror_ball();
    radiance_init(&sample->radiance, sample->scene);
    omission_clear(&sample->omission);
    *state = sample;
    return 0;
}

static int end_sample(void **state)
{
    struct sample *sample = *state;
    omission_free(&sample->omission);
    radiance_free(&sample->radiance);
    free(sample->scene);
    free(sample);
    return 0;
}

/* A ray that leaves the scene for the sky. */
static void set_ray(struct branch *branch, struct vec3 weight, bool coarse)
{
    branch->ray = (struct ray){.direction = {0, 1, 0}, .t_max = HUGE_VAL, .from = PRIMITIVE_NONE};
    branch->weight = weight;
    branch->coarse = coarse;
}

static void add_ray(struct omission *omission, const struct radiance *radiance, double bound,
                    struct vec3 weight, bool coarse)
{
    set_ray(omission_add(omission, radiance, bound, 1), weight, coarse);
}

static void test_many_rays_are_folded(void **state)
{
    struct sample *sample = *state;
    struct omission *omission = &sample->omission;
    const struct radiance *radiance = &sample->radiance;
    uint64_t random = 3;
    long double sum = 0;
    double most = 0;
    for (int i = 0; i < 100000; i++) {
        double bound = random_between(&random, 0, 1);
        add_ray(omission, radiance, bound, vec3(bound, bound, bound), false);
        assert_true(omission->pending.count <= OMISSION_MAX);
        sum += (long double)bound;
        most = fmax(most, bound);
    }
    long double told = (long double)omission_bound(omission);
    assert_true(told >= sum && told < sum * (1 + 1e-9L));
    struct branch branch;
    assert_true(omission_next(omission, radiance, &branch));
    assert_true(branch.bound == most);
    omission_clear(omission);
    assert_true(omission_bound(omission) == 0);
}

/* A ray whose rough bound is infinite may have a finite one when it is examined, and still counts. */
static void test_coarse_bounds_are_told_first(void **state)
{
    struct sample *sample = *state;
    struct omission *omission = &sample->omission;
    const struct radiance *radiance = &sample->radiance;
    for (int i = 0; i < 2 * OMISSION_MAX; i++)
        add_ray(omission, radiance, HUGE_VAL, vec3(0.5, 0.5, 0.5), true);
    struct branch branch;
    while (omission_next(omission, radiance, &branch))
        continue;
    assert_true(isfinite(omission_bound(omission)));
}

/* The rays with the largest bounds are kept. */
static void test_largest_stay(void **state)
{
    struct sample *sample = *state;
    struct omission *omission = &sample->omission;
    const struct radiance *radiance = &sample->radiance;
    for (uint32_t step = 1; step < OMISSION_MAX; step += 2) {
        omission_clear(omission);
        for (uint32_t i = 0; i < OMISSION_MAX; i++)
            add_ray(omission, radiance, i * step % OMISSION_MAX, vec3(1, 1, 1), false);
        omission_fold(omission, radiance);
        assert_int_equal(omission->pending.count, OMISSION_KEPT);
        for (uint32_t i = 0; i < OMISSION_KEPT; i++)
            assert_true(omission->pending.bounds[i] >= OMISSION_MAX - OMISSION_KEPT);
    }
}

/* Rays that the picture has left at max_depth get bounds for any depth; others, which have such bounds, keep them. */
static void test_rays_of_the_picture(void **state)
{
    struct sample *sample = *state;
    struct tree tree = {0};
    const uint32_t last = sample->scene->view.max_depth;
    add_ray(&sample->omission, &sample->radiance, 1, vec3(1, 1, 1), false);
    for (uint32_t depth = last - 1; depth <= last; depth++)
        set_ray(tree_add(&tree, 0x1p-9, depth), vec3(1, 1, 1), false);
    omission_take(&sample->omission, &sample->radiance, &tree);
    struct branch *branch = sample->omission.pending.pending;
    assert_true(tree.count == 0 && sample->omission.pending.count == 3);
    assert_true(branch[0].bound == 1 && branch[1].bound == 0x1p-9 && branch[2].coarse);
    assert_true(omission_bound(&sample->omission) > 1.5);
    /* To the ball, which mirrors a brighter sky than the one below. */
    branch[2].ray.origin = vec3(0, 3, -5);
    branch[2].ray.direction = vec3(0, -1, 0);
    struct branch next = branch[2];
    double any = radiance_bound(&sample->radiance, &next.ray, next.weight, last, false);
    while (omission_next(&sample->omission, &sample->radiance, &next) && next.depth < last)
        continue;
    assert_true(next.depth == last && next.bound == any);
    tree_free(&tree);
}

/* A few rays that nobody looks at count, too. */
static void test_few_rays_count(void **state)
{
    struct sample *sample = *state;
    struct omission *omission = &sample->omission;
    for (int i = 0; i < 3; i++)
        add_ray(omission, &sample->radiance, 0.5, vec3(1, 1, 1), false);
    omission_found(omission, vec3(1, 1, 1), vec3(0.25, 0, 0));
    double bound = omission_bound(omission);
    assert_true(bound >= 1.75 && bound < 1.7500001);
}

/* Rays of equal importance are folded, too. */
static void test_equal_rays_are_folded(void **state)
{
    struct sample *sample = *state;
    struct omission *omission = &sample->omission;
    const struct radiance *radiance = &sample->radiance;
    for (int i = 0; i < 4 * OMISSION_MAX; i++) {
        add_ray(omission, radiance, 0.5, vec3(1, 1, 1), false);
        assert_true(omission->pending.count <= OMISSION_MAX);
    }
    assert_true(omission_bound(omission) >= 2 * OMISSION_MAX);
}

/* The number of rays that are traced for the bound, of many important ones. */
static uint32_t looked_at(struct omission *omission, const struct radiance *radiance)
{
    struct branch branch;
    uint32_t count = 0;
    omission_clear(omission);
    for (int i = 0; i < OMISSION_MAX; i++)
        add_ray(omission, radiance, 0.5, vec3(1, 1, 1), false);
    while (omission_next(omission, radiance, &branch))
        count++;
    return count;
}

/* The limit on rays applies to each sample separately. */
static void test_every_sample_looks(void **state)
{
    struct sample *sample = *state;
    struct omission *omission = &sample->omission;
    const struct radiance *radiance = &sample->radiance;
    uint32_t first = looked_at(omission, radiance);
    assert_true(first > 1 && first < OMISSION_MAX);
    assert_int_equal(looked_at(omission, radiance), first);
}

/* The bounds of folded rays count when what is left is compared with what was found. */
static void test_folded_is_not_yet_looked_at(void **state)
{
    struct sample *sample = *state;
    struct omission *omission = &sample->omission;
    const struct radiance *radiance = &sample->radiance;
    struct branch branch;
    for (int matters = 0; matters < 2; matters++) {
        omission_clear(omission);
        for (int i = 0; i <= OMISSION_MAX; i++)
            add_ray(omission, radiance, 0.5, vec3(1, 1, 1), false);
        double all = omission->folded + tree_sum(&omission->pending);
        assert_true(omission->folded > 0.1 * all);
        double found = 4 * all * (matters ? 0.95 : 1.05);
        omission_found(omission, vec3(1, 1, 1), vec3(found, 0, 0));
        assert_int_equal(omission_next(omission, radiance, &branch), matters);
    }
}

/* The sum of what was found is rounded up; with NaN the bound is infinite. */
static void test_found_is_rounded_up(void **state)
{
    uint64_t random = 5;
    struct omission omission = {0};
    for (int round = 0; round < 100; round++) {
        long double sum = 0;
        omission_clear(&omission);
        for (int i = 0; i < 50; i++) {
            double weight = random_between(&random, 0, 1), color = random_between(&random, 0, 1);
            omission_found(&omission, vec3(0, weight, 0), vec3(1, color, 1));
            sum += (long double)weight * (long double)color;
        }
        long double told = (long double)omission_bound(&omission);
        assert_true(told >= sum && told < sum * (1 + 1e-12L));
    }
    omission_found(&omission, vec3(1, 1, 1), vec3(0, (double)NAN, 0));
    assert_true(omission_bound(&omission) == HUGE_VAL);
    omission_free(&omission);
}

/* A lit point is at most as bright as the lights allow, unless surfaces between make light brighter. */
static void test_light_that_grows(void **state)
{
    struct builder *builder = builder_create();
    struct light light = {{0, 0, 5}, {1, 1, 1}};
    struct material material = {.color = {1, 1, 1}, .diffuse = 0.5, .ambient = 0.25, .ior = 1};
    struct view view = small_view(4);
    uint32_t index;
    assert_added(builder_add_light(builder, &light));
    assert_added(builder_add_light(builder, &light));
    assert_added(builder_add_material(builder, &material, &index));
    struct sphere sphere = {{0, 0, -5}, 1, index, 0};
    assert_added(builder_add_sphere(builder, &sphere));
    struct scene *scene = finish_in_view(builder, &view);
    struct shading_point at = {.point = {0, 0, -4},
                               .view = {0, 0, -1},
                               .geometric = {0, 0, 1},
                               .normal = {0, 0, 1},
                               .entering = true,
                               .material = &material};
    struct radiance radiance;
    struct omission omission = {0};
    radiance_init(&radiance, scene);
    for (int grows = 0; grows < 2; grows++) {
        radiance.light_grows = grows;
        omission_clear(&omission);
        omission_found_point(&omission, &radiance, vec3(1, 1, 1), &at);
        double bound = omission_bound(&omission);
        assert_true(grows ? bound == HUGE_VAL : bound >= 1.25 && bound < 1.2500001);
    }
    /* What shows no light, and a light that is none, stay dark however much the light grows. */
    struct light *lights = (struct light *)((char *)scene + scene->lights.offset);
    for (int no_light = 0; no_light < 2; no_light++) {
        material.diffuse = no_light ? 0.5 : 0;
        if (no_light) lights[0].color = lights[1].color = vec3(0, 0, 0);
        omission_clear(&omission);
        omission_found_point(&omission, &radiance, vec3(1, 1, 1), &at);
        double bound = omission_bound(&omission);
        assert_true(bound >= 0.25 && bound < 0.2500001);
    }
    omission_free(&omission);
    radiance_free(&radiance);
    free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_many_rays_are_folded, begin_sample, end_sample),
        cmocka_unit_test_setup_teardown(test_coarse_bounds_are_told_first, begin_sample,
                                        end_sample),
        cmocka_unit_test_setup_teardown(test_largest_stay, begin_sample, end_sample),
        cmocka_unit_test_setup_teardown(test_equal_rays_are_folded, begin_sample, end_sample),
        cmocka_unit_test_setup_teardown(test_rays_of_the_picture, begin_sample, end_sample),
        cmocka_unit_test_setup_teardown(test_few_rays_count, begin_sample, end_sample),
        cmocka_unit_test_setup_teardown(test_every_sample_looks, begin_sample, end_sample),
        cmocka_unit_test_setup_teardown(test_folded_is_not_yet_looked_at, begin_sample, end_sample),
        cmocka_unit_test(test_found_is_rounded_up),
        cmocka_unit_test(test_light_that_grows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
