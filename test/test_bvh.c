#include "scene_fixture.h"

#include "worker/primitive.h"
#include "worker/traverse.h"

/* What a walk over a whole tree finds. */
static const double at_origin[3];

struct survey {
    const struct scene *scene;
    const struct bvh *bvh;
    uint64_t nodes, primitives;
    unsigned depth;
    uint32_t largest_leaf;
    unsigned char *seen; /* per entry of the primitive list */
};

static void check_leaf(struct survey *survey, const struct bvh_node *node)
{
    if (node->count > survey->largest_leaf) survey->largest_leaf = node->count;
    for (uint32_t i = 0; i < node->count; i++) {
        uint32_t entry = node->first + i;
        assert_true(entry < survey->bvh->primitive_count);
        assert_false(survey->seen[entry]);
        survey->seen[entry] = 1;
        survey->primitives++;
        struct bounds bounds = primitive_bounds(survey->scene, bvh_primitives(survey->bvh)[entry]);
        for (unsigned axis = 0; axis < 3; axis++) {
            double center = survey->bvh->center[axis];
            assert_true((double)node->min[axis] < bounds.min[axis] - center);
            assert_true((double)node->max[axis] > bounds.max[axis] - center);
        }
    }
}

static void check_node(struct survey *survey, uint32_t index, unsigned depth)
{
    assert_true(index < survey->bvh->node_count);
    assert_true(depth <= BVH_MAX_DEPTH);
    if (depth > survey->depth) survey->depth = depth;
    const struct bvh_node *node = &bvh_nodes(survey->bvh)[index];
    survey->nodes++;
    if (node->count > 0) {
        check_leaf(survey, node);
        return;
    }
    assert_int_equal(node->first % 2, 0); /* siblings share a cache line */
    for (uint32_t child = node->first; child < node->first + 2; child++) {
        const struct bvh_node *inner = &bvh_nodes(survey->bvh)[child];
        for (unsigned axis = 0; axis < 3; axis++) {
            assert_true(inner->min[axis] >= node->min[axis]);
            assert_true(inner->max[axis] <= node->max[axis]);
        }
        check_node(survey, child, depth + 1);
    }
}

/* Every bounded primitive is in one leaf, in all boxes above it; frees the tree and the scene. */
static struct survey check_tree(struct scene *scene)
{
    struct bvh *bvh = build_tree(scene);
    struct survey survey = {.scene = scene, .bvh = bvh};
    assert_true(bvh->bytes <= bvh_bytes_bound(scene));
    survey.seen = calloc(bvh->primitive_count + 1, 1);
    assert_non_null(survey.seen);
    if (bvh->node_count > 0) check_node(&survey, 0, 0);
    assert_int_equal(survey.primitives, bvh->primitive_count);
    if (bvh->node_count > 0) assert_int_equal(survey.nodes + 1, bvh->node_count);
    uint64_t planes = scene->primitives[PRIMITIVE_PLANE].count;
    assert_int_equal(survey.primitives + planes, scene_primitive_count(scene));
    struct bvh *again = build_tree(scene);
    assert_int_equal(again->bytes, bvh->bytes);
    assert_memory_equal(again, bvh, bvh->bytes);
    free(again);
    free(bvh);
    free(survey.seen);
    free(scene);
    return survey;
}

static struct builder *with_material(void)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    return builder;
}

static void test_empty_and_planes_only(void **state)
{
    (void)state;
    struct builder *builder = with_material();
    assert_int_equal(check_tree(finish_scene(builder)).nodes, 0);
    builder = with_material();
    struct plane plane = {.normal = {0, 1, 0}};
    assert_added(builder_add_plane(builder, &plane));
    assert_int_equal(check_tree(finish_scene(builder)).nodes, 0);
}

static void test_one_primitive(void **state)
{
    (void)state;
    struct builder *builder = with_material();
    add_sphere(builder, vec3(1, 2, 3), 4, 0);
    struct survey survey = check_tree(finish_scene(builder));
    assert_int_equal(survey.nodes, 1);
    assert_int_equal(survey.primitives, 1);
}

static void test_all_kinds(void **state)
{
    (void)state;
    uint64_t random = 12;
    struct builder *builder = with_material();
    for (int i = 0; i < 2000; i++) {
        struct vec3 p = random_vector(&random, 100);
        struct disc disc = {.center = p, .normal = {0.6, 0, 0.8}, .radius = 1};
        struct cone cone = {.base = p, .apex = {0, 0, 0}, .base_radius = 1, .apex_radius = 0.5};
        add_triangle(builder, p, random_vector(&random, 100), vec3(0, 0, 1), 0);
        add_sphere(builder, p, random_between(&random, 0.1, 2), 0);
        add_box(builder, p, vec_add(p, vec3(1, 2, 3)), 0);
        assert_added(builder_add_disc(builder, &disc));
        assert_added(builder_add_cone(builder, &cone));
    }
    struct survey survey = check_tree(finish_scene(builder));
    assert_int_equal(survey.primitives, 10000);
    assert_true(survey.largest_leaf <= 8);
}

static void test_equal_centroids(void **state)
{
    (void)state;
    struct builder *builder = with_material();
    for (int i = 0; i < 10000; i++)
        add_sphere(builder, vec3(1, 2, 3), 1 + i % 7, 0);
    struct survey survey = check_tree(finish_scene(builder));
    assert_true(survey.largest_leaf <= 8);
    assert_true(survey.depth <= 12);
}

/* Spheres of ever smaller size and distance, over the range of float: the heuristic peels off four
 * octaves at a time and would go deeper than the cap. */
static void test_depth_cap(void **state)
{
    (void)state;
    uint64_t random = 17;
    struct builder *builder = with_material();
    for (int i = 0; i < 15000; i++) {
        double size = ldexp(random_between(&random, 1, 2), 124 - i / 60);
        add_sphere(builder, vec3(size, size, 0), size / 64, 0);
    }
    struct survey survey = check_tree(finish_scene(builder));
    assert_true(survey.largest_leaf <= 8);
    assert_int_equal(survey.depth, BVH_MAX_DEPTH);
}

/* Beyond the range of float, above and below. */
static void test_extreme_coordinates(void **state)
{
    (void)state;
    struct builder *builder = with_material();
    for (int i = -300; i <= 300; i++) {
        double size = pow(10, i);
        add_sphere(builder, vec3(size, -size, 0), size / 4, 0);
        add_sphere(builder, vec3(-size, -size, size), size / 4, 0);
    }
    struct survey survey = check_tree(finish_scene(builder));
    assert_true(survey.largest_leaf <= 8);
}

/* A ray along z whose origin is exactly in the plane of a slab, after the slab has been widened:
 * 0 * infinity must not lose the box. */
static void test_origin_in_a_slab_plane(void **state)
{
    (void)state;
    const struct bvh_node root = {{-1, -1, -1}, {1, 1, 1}, 0, 1};
    float margin = (float)TEST_ERROR;
    const struct bvh_node right = {{margin, -1, 0.5f}, {1, 1, 1}, 0, 1};
    const struct bvh_node left = {{-1, -1, 0.5f}, {-margin, 1, 1}, 0, 1};
    const struct bvh_node beside = {{2 * margin, -1, 0.5f}, {1, 1, 1}, 0, 1};
    const double zeros[] = {0.0, -0.0};
    for (int i = 0; i < 4; i++) {
        struct ray ray = ray_along(vec3(0, 0, 0), vec3(zeros[i & 1], zeros[i >> 1], 2));
        struct slabs slabs = slabs_of(&ray, at_origin, &root);
        double enter;
        assert_true(slabs_meet(&slabs, &right, INFINITE, &enter));
        assert_near(enter, 0.25, 1e-14);
        assert_true(slabs_meet(&slabs, &left, INFINITE, &enter));
        assert_near(enter, 0.25, 1e-14);
        assert_false(slabs_meet(&slabs, &beside, INFINITE, &enter));
        assert_false(slabs_meet(&slabs, &right, 0.125, &enter));
    }
}

/* 1 / d overflows: that axis decides nothing, the others still do. */
static void test_tiny_direction(void **state)
{
    (void)state;
    const struct bvh_node root = {{-1, -1, -1}, {1, 1, 1}, 0, 1};
    const struct bvh_node above = {{0.25f, 2, 0.5f}, {1, 3, 1}, 0, 1};
    struct ray ray = ray_along(vec3(0, 0, 0), vec3(0x1p-1060, 0, 1));
    struct slabs slabs = slabs_of(&ray, at_origin, &root);
    double enter;
    assert_true(slabs_meet(&slabs, &root, INFINITE, &enter));
    assert_false(slabs_meet(&slabs, &above, INFINITE, &enter));
    const struct bvh_node tiny = {
        {-0x1p-100f, -0x1p-100f, 0}, {0x1p-100f, 0x1p-100f, 0x1p-100f}, 0, 1};
    ray = ray_along(vec3(0, 0, -0x1p-100), vec3(0, 0, 0x1p-1060)); /* there at t = 2^960 */
    slabs = slabs_of(&ray, at_origin, &tiny);
    assert_true(slabs_meet(&slabs, &tiny, 0x1p970, &enter));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_empty_and_planes_only),
        cmocka_unit_test(test_one_primitive),
        cmocka_unit_test(test_all_kinds),
        cmocka_unit_test(test_equal_centroids),
        cmocka_unit_test(test_depth_cap),
        cmocka_unit_test(test_extreme_coordinates),
        cmocka_unit_test(test_origin_in_a_slab_plane),
        cmocka_unit_test(test_tiny_direction),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
