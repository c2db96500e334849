/* Tests of triangles in float with rounded vertices: what is decided of them is true, at all sizes. */
#include "scene_fixture.h"

#include "worker/primitive.h"
#include "worker/rough_triangles.h"

#define SCENES 4000
#define RAYS   40

/* A ray towards a vertex, an edge or an inner point of a triangle, or past it, from near or far. */
static struct ray random_ray(uint64_t *random, const struct scene *scene)
{
    uint32_t count = (uint32_t)scene->primitives[PRIMITIVE_TRIANGLE].count;
    const uint32_t *vertex = scene_triangles(scene)[random_below(random, count)].vertex;
    const struct vec3 *at = scene_vertices(scene);
    struct vec3 a = at[vertex[0]], e1 = vec_sub(at[vertex[1]], a), e2 = vec_sub(at[vertex[2]], a);
    double u = random_between(random, -0.5, 1), v = random_between(random, -0.5, 1);
    if (random_below(random, 4) == 0) u = 0;
    if (random_below(random, 8) == 0) v = 0;
    struct vec3 target = vec_add_scaled(vec_add_scaled(a, e1, u), e2, v);
    double size = vec_largest(e1) + vec_largest(e2);
    struct vec3 origin = random_vector(random, ldexp(size, random_exponent(random, -3, 30)));
    struct ray ray = ray_to(vec_add(target, origin), target);
    if (random_below(random, 2) > 0)
        ray.t_max = random_between(random, 0, 2 * vec_largest(origin)) / vec_largest(ray.direction);
    return ray;
}

struct told {
    uint64_t tested, missed, certain, open;
};

/* Checks a ray with LANES triangles of a leaf of `count` triangles, from number `first` on. */
static void check_ray(const struct scene *scene, const struct bvh *bvh,
                      const struct bvh_leaf *leaves, uint32_t count, uint32_t first,
                      const struct ray *ray, struct told *told)
{
    struct shear shear = shear_of(&ray->direction);
    struct rough_ray rough;
    rough_ray_begin(&rough, bvh, ray, &shear);
    struct reach reach = reach_of(ray, &shear);
    struct purpose purpose = {true, ray->t_max};
    struct triangle_sets sets = {first_lanes(count - first), 0};
    if (!sort_rough_triangles(bvh_corners(leaves, count), count, first, &rough, &reach, &sets))
        return;
    assert_int_equal(sets.maybe & ~first_lanes(count - first), 0);
    assert_int_equal(sets.certain & ~sets.maybe, 0);
    for (uint32_t i = 0; i < LANES && first + i < count; i++) {
        uint64_t exact = 0;
        struct crossings found =
            primitive_crossings(scene, leaves[first + i].id, ray, &shear, &purpose, &exact);
        bool crossed = found.t[0] < INFINITE && found.t[0] > -INFINITE;
        bool counts = found.t[0] > 0 && found.t[0] < ray->t_max;
        bool maybe = sets.maybe >> i & 1, certain = sets.certain >> i & 1;
        assert_true(maybe || !crossed);
        assert_true(!certain || counts);
        assert_true(!exact || !certain);
        told->tested++;
        told->missed += !maybe;
        told->certain += certain;
        told->open += maybe && !crossed;
    }
}

static void test_tells_the_truth(void **state)
{
    uint64_t random = 1;
    struct told told = {0};
    for (int i = 0; i < SCENES; i++) {
        struct scene *scene = random_triangles(&random, 130, 45);
        struct bvh *bvh = build_tree(scene);
        const struct bvh_node *root = bvh_nodes(bvh);
        for (unsigned slot = 0; slot < BVH_WIDTH; slot++)
            for (int k = 0; root->count[slot] > 0 && k < RAYS; k++) {
                struct ray ray = random_ray(&random, scene);
                if (!vec_is_finite(ray.direction) || vec_is_zero(ray.direction)) continue;
                const struct bvh_leaf *leaves = bvh_leaves(bvh) + root->child[slot];
                for (uint32_t first = 0; first < root->count[slot]; first += LANES)
                    check_ray(scene, bvh, leaves, root->count[slot], first, &ray, &told);
            }
        free(bvh);
        free(scene);
    }
    /* Most misses and most crossings are decided. */
    assert_true(told.tested > UINT64_C(10) * SCENES);
    assert_true(told.missed > told.tested / 4);
    assert_true(told.certain > told.tested / 40);
    assert_true(told.open < told.missed / 4);
}

/* Triangles across the z axis, at any height between 0 and 1, of which the ray from (0, 0, 1/2 -+ 2) meets all. */
static struct scene *make_stack(uint64_t *random)
{
    struct builder *builder = builder_create();
    uint32_t grey = add_material(builder, vec3(1, 1, 1), 0);
    for (unsigned i = 0; i < LANES; i++) {
        double z = random_between(random, 0, 1);
        add_triangle(builder, vec3(-1, -1, z), vec3(1, -1, z), vec3(0, 1, z), grey);
    }
    return finish_scene(builder);
}

/* Rays that end just before a triangle, by less than its vertices are rounded, are not said to cross it. */
static void test_rays_end_before_triangles(void **state)
{
    uint64_t random = 2;
    struct told told = {0};
    for (unsigned i = 0; i < 100; i++) {
        struct scene *scene = make_stack(&random);
        struct bvh *bvh = build_tree(scene);
        const struct bvh_node *root = bvh_nodes(bvh);
        for (unsigned k = 0; k < 2 * LANES; k++) {
            double side = k % 2 ? 1 : -1, z = scene_vertices(scene)[k / 2 * 3].z;
            struct ray ray = ray_along(vec3(0, 0, 0.5 + 2 * side), vec3(0, 0, -side));
            ray.t_max = fabs(z - ray.origin.z) * (1 - 1e-9);
            for (unsigned slot = 0; slot < BVH_WIDTH; slot++)
                if (root->count[slot] > 0)
                    check_ray(scene, bvh, bvh_leaves(bvh) + root->child[slot], root->count[slot], 0,
                              &ray, &told);
        }
        free(bvh);
        free(scene);
    }
    assert_true(told.certain > told.tested / 4);
}

/* Nothing is decided if places have no meaning, or the leaf is too far away or aside. */
static void test_leaves_open(void **state)
{
    struct builder *builder = builder_create();
    uint32_t grey = add_material(builder, vec3(1, 1, 1), 0);
    add_triangle(builder, vec3(-1, -1, 0), vec3(1, -1, 0), vec3(0, 1, 0), grey);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    const struct bvh_leaf *leaf = bvh_leaves(bvh);
    struct ray ray = ray_along(vec3(0, 0, 2), vec3(0, 0, -1));
    struct shear shear = shear_of(&ray.direction);
    struct rough_ray rough;
    rough_ray_begin(&rough, bvh, &ray, &shear);
    struct triangle_sets sets = {1, 0};
    assert_true(sort_rough_triangles(bvh_corners(leaf, 1), 1, 0, &rough, NULL, &sets));
    assert_int_equal(sets.maybe, 1);
    rough.origin = quad_row(0x1p10, 0, 2, 0);
    assert_false(sort_rough_triangles(bvh_corners(leaf, 1), 1, 0, &rough, NULL, &sets));
    rough.origin = quad_row(0, 0, 0x1p40, 0);
    assert_false(sort_rough_triangles(bvh_corners(leaf, 1), 1, 0, &rough, NULL, &sets));
    rough_ray_begin(&rough, bvh, &ray, &shear);
    ((struct bvh_corners *)(uintptr_t)bvh_corners(leaf, 1))->inverse = NAN;
    assert_false(sort_rough_triangles(bvh_corners(leaf, 1), 1, 0, &rough, NULL, &sets));
    free(bvh);
    free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tells_the_truth),
        cmocka_unit_test(test_rays_end_before_triangles),
        cmocka_unit_test(test_leaves_open),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
