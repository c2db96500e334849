#include "scene_fixture.h"

#include "worker/primitive.h"
#include "worker/traverse.h"

/* What a walk over a whole tree finds. */
struct survey {
    const struct scene *scene;
    const struct bvh *bvh;
    uint64_t nodes, primitives;
    unsigned depth; /* of nodes */
    uint32_t largest_leaf;
    unsigned char *seen; /* per entry of the list of leaves */
};

static void check_leaf(struct survey *survey, const struct bvh_node *node, unsigned slot)
{
    uint32_t first = node->child[slot], count = node->count[slot];
    if (count > survey->largest_leaf) survey->largest_leaf = count;
    for (uint32_t entry = first; entry < first + count; entry++) {
        assert_true(entry < survey->bvh->leaf_count);
        assert_false(survey->seen[entry]);
        survey->seen[entry] = 1;
        survey->primitives++;
        const struct bvh_leaf *leaf = &bvh_leaves(survey->bvh)[entry];
        struct bvh_leaf expected = bvh_leaf_of(survey->scene, leaf->id);
        assert_memory_equal(leaf, &expected, sizeof expected);
        assert_true(entry == first || leaf[-1].id < leaf->id);
        struct bounds bounds = primitive_bounds(survey->scene, leaf->id);
        for (unsigned axis = 0; axis < 3; axis++) {
            double center = survey->bvh->center[axis];
            assert_true((double)node->min[axis][slot] < bounds.min[axis] - center);
            assert_true((double)node->max[axis][slot] > bounds.max[axis] - center);
        }
    }
}

static bool is_empty(const struct bvh_node *node, unsigned slot)
{
    return node->child[slot] == 0 && node->count[slot] == 0;
}

static void check_empty(const struct bvh_node *node, unsigned first)
{
    for (unsigned slot = first; slot < BVH_WIDTH; slot++) {
        assert_true(is_empty(node, slot));
        for (unsigned axis = 0; axis < 3; axis++) {
            assert_true(node->min[axis][slot] == INFINITY);
            assert_true(node->max[axis][slot] == -INFINITY);
        }
    }
}

/* min and max are what the parent says about the node. */
static void check_node(struct survey *survey, uint32_t index, const float min[3],
                       const float max[3], unsigned depth)
{
    assert_true(index < survey->bvh->node_count);
    assert_true(depth <= BVH_MAX_DEPTH);
    if (depth > survey->depth) survey->depth = depth;
    const struct bvh_node *node = &bvh_nodes(survey->bvh)[index];
    survey->nodes++;
    unsigned slot = 0;
    for (; slot < BVH_WIDTH && !is_empty(node, slot); slot++) {
        float below[3], above[3];
        for (unsigned axis = 0; axis < 3; axis++) {
            below[axis] = node->min[axis][slot];
            above[axis] = node->max[axis][slot];
            assert_true(below[axis] >= min[axis] && above[axis] <= max[axis]);
        }
        if (node->count[slot] > 0)
            check_leaf(survey, node, slot);
        else
            check_node(survey, node->child[slot], below, above, depth + 1);
    }
    check_empty(node, slot);
}

/* Every bounded primitive is in one leaf, in all boxes above it; frees the tree and the scene. */
static struct survey check_tree(struct scene *scene)
{
    struct bvh *bvh = build_tree(scene);
    struct survey survey = {.scene = scene, .bvh = bvh};
    assert_true(bvh->bytes <= bvh_bytes_bound(scene));
    survey.seen = calloc(bvh->leaf_count + 1, 1);
    assert_non_null(survey.seen);
    if (bvh->node_count > 0) check_node(&survey, 0, bvh->min, bvh->max, 1);
    assert_int_equal(survey.primitives, bvh->leaf_count);
    assert_int_equal(survey.nodes, bvh->node_count);
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
    assert_true(survey.depth <= 9);
}

/* Spheres of ever smaller size and distance, over the range of float: a node takes in a few octaves
 * at a time, and the tree would grow deeper than the cap. */
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
    assert_true(survey.depth >= BVH_MAX_DEPTH - 2);
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

/* A tree of this size around the origin, as the slabs see it. */
static struct bvh bvh_of_size(float size)
{
    return (struct bvh){.min = {-size, -size, -size}, .max = {size, size, size}};
}

static void set_slot(struct bvh_node *node, unsigned slot, struct vec3 min, struct vec3 max)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        node->min[axis][slot] = (float)vec_component(&min, axis);
        node->max[axis][slot] = (float)vec_component(&max, axis);
    }
}

/* A ray along z whose origin is exactly in the plane of a slab, after the slab has been widened:
 * 0 * infinity must not lose the box. */
static void test_origin_in_a_slab_plane(void **state)
{
    (void)state;
    enum { RIGHT, LEFT, BESIDE };
    const struct bvh bvh = bvh_of_size(1);
    struct bvh_node node;
    set_slot(&node, RIGHT, vec3(TEST_ERROR, -1, 0.5), vec3(1, 1, 1));
    set_slot(&node, LEFT, vec3(-1, -1, 0.5), vec3(-TEST_ERROR, 1, 1));
    set_slot(&node, BESIDE, vec3(2 * TEST_ERROR, -1, 0.5), vec3(1, 1, 1));
    const double zeros[] = {0.0, -0.0};
    for (int i = 0; i < 4; i++) {
        struct ray ray = ray_along(vec3(0, 0, 0), vec3(zeros[i & 1], zeros[i >> 1], 2));
        struct slabs slabs = slabs_of(&ray, &bvh);
        double enter;
        assert_true(slabs_meet(&slabs, &node, RIGHT, INFINITE, &enter));
        assert_near(enter, 0.25, 1e-14);
        assert_true(slabs_meet(&slabs, &node, LEFT, INFINITE, &enter));
        assert_near(enter, 0.25, 1e-14);
        assert_false(slabs_meet(&slabs, &node, BESIDE, INFINITE, &enter));
        assert_false(slabs_meet(&slabs, &node, RIGHT, 0.125, &enter));
    }
}

/* 1 / d overflows: that axis decides nothing, the others still do. */
static void test_tiny_direction(void **state)
{
    (void)state;
    enum { ALL, ABOVE, TINY };
    const struct bvh large = bvh_of_size(1), small = bvh_of_size(0x1p-100f);
    struct bvh_node node;
    set_slot(&node, ALL, vec3(-1, -1, -1), vec3(1, 1, 1));
    set_slot(&node, ABOVE, vec3(0.25, 2, 0.5), vec3(1, 3, 1));
    set_slot(&node, TINY, vec3(-0x1p-100, -0x1p-100, 0), vec3(0x1p-100, 0x1p-100, 0x1p-100));
    struct ray ray = ray_along(vec3(0, 0, 0), vec3(0x1p-1060, 0, 1));
    struct slabs slabs = slabs_of(&ray, &large);
    double enter;
    assert_true(slabs_meet(&slabs, &node, ALL, INFINITE, &enter));
    assert_false(slabs_meet(&slabs, &node, ABOVE, INFINITE, &enter));
    ray = ray_along(vec3(0, 0, -0x1p-100), vec3(0, 0, 0x1p-1060)); /* there at t = 2^960 */
    slabs = slabs_of(&ray, &small);
    assert_true(slabs_meet(&slabs, &node, TINY, 0x1p970, &enter));
}

/* No axis decides: every box is met, and empty slots must not lead back to the root. */
static void test_only_tiny_directions(void **state)
{
    (void)state;
    struct builder *builder = with_material();
    add_sphere(builder, vec3(0, 0, 0), 1, 0);
    add_sphere(builder, vec3(8, 0, 0), 1, 0);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    struct ray ray = ray_along(vec3(0, 0, 0), vec3(0x1p-1060, 0x1p-1060, 0x1p-1060));
    struct hit hit = nearest_of(scene, bvh, &ray);
    assert_true(hit.primitive == PRIMITIVE_NONE ||
                hit.primitive == primitive_id(PRIMITIVE_SPHERE, 0));
    free(bvh);
    free(scene);
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
        cmocka_unit_test(test_only_tiny_directions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
