/* What a sample leaves out: in bounded memory, and none of it forgotten. */
#include "test/scene_fixture.h"

#include "test/view_fixture.h"
#include "worker/omission.h"

static struct scene *mirror_ball(void)
{
    struct builder *builder = builder_create();
    struct material material = {.color = {1, 1, 1}, .reflection = 0.5, .ior = 1};
    uint32_t index;
    assert_added(builder_add_material(builder, &material, &index));
    struct sphere sphere = {{0, 0, -5}, 1, index, 0};
    assert_added(builder_add_sphere(builder, &sphere));
    struct view view = small_view(4);
    struct scene *scene = builder_finish(builder, &view);
    builder_destroy(builder);
    return scene;
}

/* A ray that leaves the scene for the sky. */
static void add_ray(struct omission *omission, const struct radiance *radiance, double bound,
                    struct vec3 weight, bool rough)
{
    struct branch *branch = omission_add(omission, radiance, bound, 1);
    branch->ray = (struct ray){.direction = {0, 1, 0}, .t_max = HUGE_VAL, .from = PRIMITIVE_NONE};
    branch->weight = weight;
    branch->rough = rough;
}

static void test_many_rays_are_folded(void **state)
{
    (void)state;
    struct scene *scene = mirror_ball();
    struct radiance radiance;
    struct omission omission = {0};
    uint64_t random = 3;
    long double sum = 0;
    double most = 0;
    radiance_init(&radiance, scene);
    omission_clear(&omission);
    for (int i = 0; i < 100000; i++) {
        double bound = random_between(&random, 0, 1);
        add_ray(&omission, &radiance, bound, vec3(bound, bound, bound), false);
        assert_true(omission.pending.count <= OMISSION_MAX);
        sum += (long double)bound;
        most = fmax(most, bound);
    }
    long double told = (long double)omission_bound(&omission);
    assert_true(told >= sum && told < sum * (1 + 1e-9L));
    struct branch branch;
    assert_true(omission_next(&omission, &radiance, &branch));
    assert_true(branch.bound == most);
    omission_clear(&omission);
    assert_true(omission_bound(&omission) == 0);
    omission_free(&omission);
    radiance_free(&radiance);
    free(scene);
}

/* What has no bound may have one when its ray is looked at: that is not forgotten, either. */
static void test_rough_bounds_are_told_first(void **state)
{
    (void)state;
    struct scene *scene = mirror_ball();
    struct radiance radiance;
    struct omission omission = {0};
    radiance_init(&radiance, scene);
    omission_clear(&omission);
    for (int i = 0; i < 2 * OMISSION_MAX; i++)
        add_ray(&omission, &radiance, HUGE_VAL, vec3(0.5, 0.5, 0.5), true);
    struct branch branch;
    while (omission_next(&omission, &radiance, &branch))
        continue;
    assert_true(isfinite(omission_bound(&omission)));
    omission_free(&omission);
    radiance_free(&radiance);
    free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_many_rays_are_folded),
        cmocka_unit_test(test_rough_bounds_are_told_first),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
