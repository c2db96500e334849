#include "scene_fixture.h"

#include "test/fatal.h"
#include "worker/bvh_cut.h"
#include "worker/bvh_trees.h"
#include "worker/primitive.h"
#include "worker/several.h"
#include "worker/slabs.h"

/* An entry of a leaf, and the box of this leaf. */
struct piece {
    uint32_t id;
    float min[3], max[3];
};

/* Totals over a whole tree. */
struct survey {
    const struct scene *scene;
    const struct bvh *bvh;
    uint64_t nodes, entries, primitives;
    uint64_t places; /* size of all leaves with their quantized vertices, as a number of entries */
    uint64_t bytes;
    /* expected number of tests of a ray that meets the root: by the ratio of the areas of leaves and root */
    double tests;
    unsigned depth; /* largest depth of a node */
    uint32_t largest_leaf;
    struct piece *pieces; /* one per entry of the leaves, in the order of traversal */
};

/* The quantized vertices of a leaf are within half a unit of the true ones, up to the rounding of doubles. */
static void check_corners(const struct survey *survey, const struct bvh_leaf *leaves,
                          uint32_t count, uint32_t triangles)
{
    const struct bvh_corners *corners = bvh_corners(leaves, count);
    double unit = 1 / (double)corners->inverse, error = 0.501 * unit;
    if (isnan(unit)) return;
    assert_true(frexp(unit, &(int){0}) == 0.5);
    for (uint32_t i = 0; i < triangles; i++) {
        const uint32_t *vertex = corner_indices(survey->scene, leaves[i].id);
        for (unsigned row = 0; row < CORNER_ROWS; row++) {
            const struct vec3 *at = &scene_vertices(survey->scene)[vertex[row % 3]];
            double base = (double)corners->base[row / 3] + survey->bvh->center[row / 3];
            double place = base + corners->place[row * triangles + i] * unit;
            assert_true(fabs(place - vec_component(at, row / 3)) <= error);
        }
    }
}

static double area_of(const float min[3], const float max[3])
{
    double x = (double)max[0] - (double)min[0], y = (double)max[1] - (double)min[1];
    double z = (double)max[2] - (double)min[2];
    return x * y + y * z + z * x;
}

static void check_leaf(struct survey *survey, const struct bvh_node *node, unsigned slot)
{
    uint32_t count = node->count[slot], triangles = 0;
    const struct bvh_leaf *leaves = bvh_leaves(survey->bvh) + node->child[slot];
    if (count > survey->largest_leaf) survey->largest_leaf = count;
    for (uint32_t i = 0; i < count; i++) {
        assert_true(survey->entries < survey->bvh->leaf_count);
        const struct bvh_leaf *leaf = &leaves[i];
        struct bvh_leaf expected = bvh_leaf_of(survey->scene, leaf->id);
        assert_memory_equal(leaf, &expected, sizeof expected);
        assert_true(i == 0 || leaf[-1].id < leaf->id);
        uint32_t material = primitive_material(survey->scene, leaf->id);
        bool transmits = scene_materials(survey->scene)[material].transmission > 0;
        assert_int_equal(leaf->transparent, transmits);
        triangles += is_triangle(leaf->id);
        struct piece *piece = &survey->pieces[survey->entries++];
        piece->id = leaf->id;
        for (unsigned axis = 0; axis < 3; axis++) {
            piece->min[axis] = node->min[axis][slot];
            piece->max[axis] = node->max[axis][slot];
        }
        double root = area_of(survey->bvh->min, survey->bvh->max);
        survey->tests += area_of(piece->min, piece->max) / root;
    }
    survey->places += count;
    if (triangles == 0) return;
    check_corners(survey, leaves, count, triangles);
    survey->places += corner_entries(triangles);
}

static int by_id(const void *a, const void *b)
{
    uint32_t p = ((const struct piece *)a)->id, q = ((const struct piece *)b)->id;
    return (p > q) - (p < q);
}

static void check_inside(const struct survey *survey, const struct piece *piece)
{
    struct bounds bounds = primitive_bounds(survey->scene, piece->id);
    for (unsigned axis = 0; axis < 3; axis++) {
        double center = survey->bvh->center[axis];
        assert_true((double)piece->min[axis] < bounds.min[axis] - center);
        assert_true((double)piece->max[axis] > bounds.max[axis] - center);
    }
}

static bool is_in_box(const struct piece *piece, const struct vec3 *point, double far)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        double x = vec_component(point, axis), error = far + 0x1p-50 * fabs(x);
        if ((double)piece->min[axis] > x + error || (double)piece->max[axis] < x - error)
            return false;
    }
    return true;
}

static struct vec3 triangle_point(const struct scene *scene, uint32_t id, int i, uint64_t *random)
{
    const uint32_t *corner = corner_indices(scene, id);
    const struct vec3 *at = scene_vertices(scene);
    double u = random_between(random, 0, 1), v = random_between(random, 0, 1 - u);
    if (i < 3) u = i == 1, v = i == 2;
    struct vec3 point = vec_scale(at[corner[0]], 1 - u - v);
    return vec_add(vec_add(point, vec_scale(at[corner[1]], u)), vec_scale(at[corner[2]], v));
}

/* A point on the side of a rod, for small i on a rim. */
static struct vec3 rod_point(const struct scene *scene, uint32_t id, int i, uint64_t *random)
{
    const struct cone *cone = &scene_cones(scene)[primitive_index(id)];
    double height = i < 8 ? i & 1 : random_between(random, 0, 1);
    struct vec3 w = vec_sub(cone->apex, cone->base), axis = vec_normalize(w);
    struct vec3 away = vec_normalize(vec_cross(axis, random_vector(random, 1)));
    double radius = cone->base_radius + (cone->apex_radius - cone->base_radius) * height;
    return vec_add(vec_add(cone->base, vec_scale(w, height)), vec_scale(away, radius));
}

/* Points of a triangle, including its corners, must be in the box of one of its pieces. */
static void check_covered(const struct survey *survey, const struct piece *pieces, size_t count)
{
    uint64_t random = 18;
    uint32_t id = pieces->id;
    double error = is_triangle(id) ? 0 : 0x1p-49 * survey->bvh->size;
    struct vec3 center =
        vec3(survey->bvh->center[0], survey->bvh->center[1], survey->bvh->center[2]);
    for (int i = 0; i < 100; i++) {
        struct vec3 point = is_triangle(id) ? triangle_point(survey->scene, id, i, &random)
                                            : rod_point(survey->scene, id, i, &random);
        point = vec_sub(point, center);
        size_t in = 0;
        while (in < count && !is_in_box(&pieces[in], &point, error))
            in++;
        assert_true(in < count);
    }
}

static void check_pieces(struct survey *survey)
{
    size_t count = (size_t)survey->entries, next;
    qsort(survey->pieces, count, sizeof *survey->pieces, by_id);
    for (size_t i = 0; i < count; i = next) {
        const struct piece *piece = &survey->pieces[i];
        next = i + 1;
        while (next < count && survey->pieces[next].id == piece->id)
            next++;
        if (next == i + 1)
            check_inside(survey, piece);
        else
            check_covered(survey, piece, next - i);
        survey->primitives++;
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

/* Checks a node and all nodes below it. min, max: its box according to its parent. */
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
        for (unsigned axis = 0; axis < 3; axis++) {
            assert_true(node->min[axis][slot] >= min[axis]);
            assert_true(node->max[axis][slot] <= max[axis]);
        }
        if (node->count[slot] > 0) check_leaf(survey, node, slot);
    }
    for (unsigned i = 0; i < slot; i++) {
        float below[3], above[3];
        for (unsigned axis = 0; axis < 3; axis++) {
            below[axis] = node->min[axis][i];
            above[axis] = node->max[axis][i];
        }
        if (node->count[i] == 0) check_node(survey, node->child[i], below, above, depth + 1);
    }
    check_empty(node, slot);
}

/* Checks reach and size, on which bounds on the rounding errors of rays depend. */
static void check_size(const struct bvh *bvh)
{
    double center = 0, reach = 0;
    for (unsigned axis = 0; axis < 3 && bvh->node_count > 0; axis++) {
        center = fmax(center, fabs(bvh->center[axis]));
        reach = fmax(reach, fmax(fabs((double)bvh->min[axis]), fabs((double)bvh->max[axis])));
    }
    assert_true(bvh->reach == reach && bvh->size == reach + center);
}

/* Checks that all boxes above a primitive contain it, and returns totals. */
static struct survey survey_tree(const struct scene *scene, const struct bvh *bvh)
{
    struct survey survey = {.scene = scene, .bvh = bvh};
    survey.pieces = malloc((bvh->leaf_count + 1) * sizeof *survey.pieces);
    assert_non_null(survey.pieces);
    memset(survey.pieces, 0xff, (bvh->leaf_count + 1) * sizeof *survey.pieces);
    if (bvh->node_count > 0) check_node(&survey, 0, bvh->min, bvh->max, 1);
    check_size(bvh);
    assert_int_equal(survey.entries, bvh->leaf_count);
    check_pieces(&survey);
    assert_int_equal(survey.nodes, bvh->node_count);
    survey.bytes = bvh->leaves_offset + survey.places * sizeof(struct bvh_leaf);
    free(survey.pieces);
    return survey;
}

/* Checks, for each of several trees, that its box contains its primitives. */
static void check_boxes(const struct bvh *first)
{
    const struct bvh *boxes = bvh_boxes(first);
    assert_true((boxes != NULL) == (first->next_offset != 0));
    if (!boxes) return;
    lane_set left = all_trees(first);
    unsigned i = 0;
    for (const struct bvh *tree = first; tree; tree = bvh_next(tree), i++) {
        const struct bvh_node *node = &bvh_nodes(boxes)[i / BVH_WIDTH];
        unsigned slot = i % BVH_WIDTH;
        assert_ptr_equal(take_tree(first, &left), tree);
        assert_int_equal(node->count[slot], 1);
        for (unsigned axis = 0; axis < 3; axis++) {
            double aside = tree->center[axis] - boxes->center[axis];
            assert_true((double)node->min[axis][slot] <= (double)tree->min[axis] + aside);
            assert_true((double)node->max[axis][slot] >= (double)tree->max[axis] + aside);
            assert_true(boxes->min[axis] <= node->min[axis][slot]);
            assert_true(boxes->max[axis] >= node->max[axis][slot]);
        }
    }
    assert_int_equal(left, 0);
    assert_int_equal(i, boxes->leaf_count);
    for (; i < boxes->node_count * BVH_WIDTH; i++)
        assert_false(occupied(&bvh_nodes(boxes)[i / BVH_WIDTH]) >> i % BVH_WIDTH & 1);
    check_size(boxes);
}

/* Checks that every bounded primitive is in a leaf of one of the trees. Frees trees and scene. Returns the totals of
 * the first tree. */
static struct survey check_tree(struct scene *scene)
{
    struct bvh *bvh = build_tree(scene);
    uint64_t primitives = scene->primitives[PRIMITIVE_PLANE].count, bytes = 0;
    assert_true(bvh->bytes <= bvh_bytes_bound(scene));
    struct survey survey = survey_tree(scene, bvh);
    for (const struct bvh *tree = bvh; tree; tree = bvh_next(tree)) {
        struct survey here = survey_tree(scene, tree);
        primitives += here.primitives;
        bytes += here.bytes;
        assert_true(!tree->next_offset || here.bytes <= tree->next_offset);
    }
    assert_int_equal(primitives, scene_primitive_count(scene));
    assert_true(bytes <= bvh->bytes);
    check_boxes(bvh);
    struct bvh *again = build_tree_by(scene, 3);
    assert_int_equal(again->bytes, bvh->bytes);
    assert_memory_equal(again, bvh, bvh->bytes);
    free(again);
    free(bvh);
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
    struct builder *builder = with_material();
    assert_int_equal(check_tree(finish_scene(builder)).nodes, 0);
    builder = with_material();
    struct plane plane = {.normal = {0, 1, 0}};
    assert_added(builder_add_plane(builder, &plane));
    assert_int_equal(check_tree(finish_scene(builder)).nodes, 0);
}

static void test_one_primitive(void **state)
{
    struct builder *builder = with_material();
    add_sphere(builder, vec3(1, 2, 3), 4, 0);
    struct survey survey = check_tree(finish_scene(builder));
    assert_int_equal(survey.nodes, 1);
    assert_int_equal(survey.primitives, 1);
}

static void test_all_kinds(void **state)
{
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
    assert_true(survey.largest_leaf <= 12);
}

static void test_equal_centroids(void **state)
{
    struct builder *builder = with_material();
    for (int i = 0; i < 10000; i++)
        add_sphere(builder, vec3(1, 2, 3), 1 + i % 7, 0);
    struct survey survey = check_tree(finish_scene(builder));
    assert_true(survey.largest_leaf <= 2); /* solids */
    assert_true(survey.depth <= 9);
}

/* The number of tests in a tree over small spheres that are spread far along one axis, less along the next one, and
 * hardly along the third. */
static double tests_along(unsigned axis)
{
    uint64_t random = 13;
    struct builder *builder = with_material();
    for (int i = 0; i < 1000; i++) {
        struct vec3 p = random_vector(&random, 1);
        const double at[3] = {100 * p.x, 10 * p.y, p.z};
        add_sphere(builder, vec3(at[(3 - axis) % 3], at[(4 - axis) % 3], at[(5 - axis) % 3]), 0.05,
                   0);
    }
    return check_tree(finish_scene(builder)).tests;
}

/* However a scene is turned, its tree is as good. */
static void test_axes_are_alike(void **state)
{
    double tests = tests_along(0);
    for (unsigned axis = 1; axis < 3; axis++)
        assert_true(fabs(tests_along(axis) - tests) <= 0.02 * tests);
}

/* Spheres of decreasing size and distance over the whole range of float. Each node separates only a few octaves, so
 * that the tree would become deeper than the limit. */
static void test_depth_cap(void **state)
{
    uint64_t random = 17;
    struct builder *builder = with_material();
    for (int i = 0; i < 15000; i++) {
        double size = ldexp(random_between(&random, 1, 2), 124 - i / 60);
        add_sphere(builder, vec3(size, size, 0), size / 64, 0);
    }
    struct survey survey = check_tree(finish_scene(builder));
    assert_true(survey.largest_leaf <= 2); /* solids */
    assert_true(survey.depth >= BVH_MAX_DEPTH - 2);
}

/* Coordinates above and below the range of float. */
static void test_extreme_coordinates(void **state)
{
    struct builder *builder = with_material();
    for (int i = -300; i <= 300; i++) {
        double size = pow(10, i);
        add_sphere(builder, vec3(size, -size, 0), size / 4, 0);
        add_sphere(builder, vec3(-size, -size, size), size / 4, 0);
    }
    struct survey survey = check_tree(finish_scene(builder));
    assert_true(survey.largest_leaf <= 2); /* solids */
}

/* Rounding outward gives floats that are further out than the number, but none that is not finite. */
static void test_outward_rounding(void **state)
{
    const double most = (double)FLT_MAX;
    const double numbers[] = {0,           1e-320,        1e-46,   1,
                              1 + 0x1p-30, 0.1,           0x1p100, most * (1 - 0x1p-26),
                              most,        most * 1.0001, 1e300,   HUGE_VAL};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        double x = numbers[i], below = (double)round_down(x), above = (double)round_up(x);
        assert_true(isfinite(below) && isfinite(above) && below < x);
        assert_true(above > x || above == most);
        assert_true(x > most || above - below <= 0x1p-22 * x + 0x1p-147);
        assert_true((double)round_down(-x) == -above && (double)round_up(-x) == -below);
    }
}

/* Small spheres near (0, height, 0), a large sphere that has them on its surface, and if sun > 0 another one of its
 * radius, sun times as far away on two axes. */
static struct bvh *tree_on_ball(double height, double sun)
{
    uint64_t random = 18;
    struct builder *builder = with_material();
    add_sphere(builder, vec3(0, 0, 0), fabs(height), 0);
    if (sun > 0) add_sphere(builder, vec3(sun * height, sun * height, 0), fabs(height), 0);
    for (int i = 0; i < 3000; i++)
        add_sphere(builder, vec_add(vec3(0, height, 0), random_vector(&random, 1)), 0.01, 0);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    free(scene);
    return bvh;
}

/* Checks the centre to within 1, on axes where 0 is expected exactly. Frees the tree. */
static void assert_center(struct bvh *bvh, double x, double y, double z)
{
    const double expected[3] = {x, y, z};
    for (unsigned axis = 0; axis < 3; axis++)
        assert_true(fabs(bvh->center[axis] - expected[axis]) <= (expected[axis] == 0 ? 0 : 1));
    free(bvh);
}

/* The centre is where most boxes are, so that float resolves these, whatever other boxes there are. */
static void test_center_is_where_most_are(void **state)
{
    assert_center(tree_on_ball(6.37e6, 0), 0, 6.37e6, 0);
    assert_center(tree_on_ball(6.37e6, 1e4), 0, 6.37e6, 0);
    assert_center(tree_on_ball(-6.37e6, 0), 0, -6.37e6, 0);
    assert_center(tree_on_ball(1, 0), 0, 0, 0);
}

/* A scene that is further from the origin than it is wide, though not far from it, has the centre in its middle. */
static void test_center_of_a_scene_aside(void **state)
{
    uint64_t random = 18;
    struct builder *builder = with_material();
    for (int i = 0; i < 3000; i++)
        add_sphere(builder, vec_add(vec3(25, -25, 4), random_vector(&random, 5)), 0.01, 0);
    struct scene *scene = finish_scene(builder);
    assert_center(build_tree(scene), 25, -25, 0);
    free(scene);
}

/* This many small spheres around each of some places on a large sphere. */
static struct scene *clusters_on_ball(const struct vec3 *places, unsigned count, unsigned spheres)
{
    uint64_t random = 19;
    struct builder *builder = with_material();
    add_sphere(builder, vec3(0, 0, 0), 6.37e6, 0);
    for (unsigned i = 0; i < count * spheres; i++) {
        struct vec3 at = vec_add(places[i % count], random_vector(&random, 1));
        add_sphere(builder, at, 0.01, 0);
    }
    return finish_scene(builder);
}

/* Checks the trees over a scene and returns their number. Frees the scene. */
static unsigned count_trees(struct scene *scene)
{
    struct bvh *bvh = build_tree(scene);
    unsigned count = 0;
    for (const struct bvh *tree = bvh; tree; tree = bvh_next(tree))
        count++;
    free(bvh);
    check_tree(scene);
    return count;
}

/* A cluster that is too fine for floats at its place gets a tree of its own, whose centre is within it. */
static void test_clusters_have_trees(void **state)
{
    const struct vec3 places[] = {{6.37e6, 0, 0}, {0, 6.37e6, 0}, {0, 0, 6.37e6}, {0, 0, -6.37e6}};
    struct scene *scene = clusters_on_ball(places, 4, 500);
    struct bvh *bvh = build_tree(scene);
    unsigned near = 0;
    for (const struct bvh *tree = bvh_next(bvh); tree; tree = bvh_next(tree))
        for (unsigned i = 0; i < 4; i++) {
            const struct vec3 center = {tree->center[0], tree->center[1], tree->center[2]};
            near += vec_largest(vec_sub(center, places[i])) <= 1 && tree->reach < 3;
        }
    assert_int_equal(near, 4);
    free(bvh);
    assert_int_equal(count_trees(scene), 5);
    /* No trees for clusters of too few primitives, and for specks that are far from each other. */
    assert_int_equal(count_trees(clusters_on_ball(places, 4, 20)), 1);
    uint64_t random = 20;
    struct builder *builder = with_material();
    for (int i = 0; i < 3000; i++)
        add_sphere(builder, random_vector(&random, 1e6), 0.01, 0);
    assert_int_equal(count_trees(finish_scene(builder)), 1);
}

/* Clusters that are all far from the centre of the scene, where nothing is: they have trees, and there is no other. */
static void test_nothing_but_clusters(void **state)
{
    const struct vec3 places[] = {{6.37e6, 0, 0}, {0, 6.37e6, 0}, {0, 0, 6.37e6}};
    uint64_t random = 19;
    struct builder *builder = with_material();
    for (unsigned i = 0; i < 1500; i++)
        add_sphere(builder, vec_add(places[i % 3], random_vector(&random, 1)), 0.01, 0);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    for (const struct bvh *tree = bvh; tree; tree = bvh_next(tree))
        assert_true(tree->reach < 3 && tree->leaf_count == 500);
    free(bvh);
    assert_int_equal(count_trees(scene), 3);
}

/* More clusters than possible trees: no primitive is lost. */
static void test_more_clusters_than_trees(void **state)
{
    struct vec3 places[40];
    for (unsigned i = 0; i < 40; i++)
        places[i] = vec3(1e7 * cos(i), 1e7 * sin(i), 1e6 * i);
    assert_int_equal(count_trees(clusters_on_ball(places, 40, 100)), TREES_MAX);
}

static struct builder *long_triangles(double transmission)
{
    uint64_t random = 21;
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), transmission);
    for (int i = 0; i < 2000; i++) {
        struct vec3 p = random_vector(&random, 10), q = random_vector(&random, 10);
        add_triangle(builder, p, q, vec_add(q, random_vector(&random, 3)), 0);
    }
    add_sphere(builder, vec3(0, 0, 0), 8, 0);
    return builder;
}

/* Triangles that overlap are split: the tree has more pieces than triangles. Of 541 tests, wrong bins for these pieces
 * make 559 or more. */
static void test_spatial_splits(void **state)
{
    struct survey survey = check_tree(finish_scene(long_triangles(0)));
    assert_int_equal(survey.primitives, 2001);
    assert_true(survey.entries > 2200 && survey.tests < 550);
    assert_true(survey.largest_leaf > 8 && survey.largest_leaf <= 12);
}

/* The pieces of triangles that are far from the origin, slivers and others, are where these are. */
static void test_pieces_aside(void **state)
{
    uint64_t random = 21;
    struct builder *builder = with_material();
    const struct vec3 aside = {1000, -1000, 1000};
    for (int i = 0; i < 500; i++) {
        struct vec3 p = vec_add(aside, random_vector(&random, 10));
        struct vec3 q = vec_add(aside, random_vector(&random, 10));
        add_triangle(builder, p, q, vec_add(q, random_vector(&random, i % 2 ? 3 : 1e-3)), 0);
    }
    struct survey survey = check_tree(finish_scene(builder));
    assert_int_equal(survey.primitives, 500);
    assert_true(survey.entries > 1000);
}

/* Small groups of triangles, in which vertices are much closer to each other than floats at their place. */
static void test_quantized_vertices(void **state)
{
    uint64_t random = 30;
    struct builder *builder = with_material();
    for (int i = 0; i < 100; i++) {
        struct vec3 at = random_vector(&random, 10);
        for (int k = 0; k < 8; k++) {
            struct vec3 p = vec_add(at, random_vector(&random, 1e-4));
            struct vec3 q = vec_add(at, random_vector(&random, 1e-4));
            add_triangle(builder, p, q, vec_add(at, random_vector(&random, 1e-4)), 0);
        }
    }
    assert_int_equal(check_tree(finish_scene(builder)).primitives, 800);
}

/* A triangle is cut through one of its corners, which belongs to both pieces, whichever corner that is. */
static void test_cut_through_a_corner(void **state)
{
    const struct vec3 at[3] = {{0, 0, 0}, {2, 0, 0}, {1, 3, 5}};
    const double center[3] = {0, 0, 0};
    for (unsigned turn = 0; turn < 6; turn++) {
        struct builder *builder = with_material();
        unsigned on = turn < 3 ? 1 : 2;
        add_triangle(builder, at[turn % 3], at[(turn + on) % 3], at[(turn + 3 - on) % 3], 0);
        struct scene *scene = finish_scene(builder);
        struct bvh_input input = {.scene = scene, .center = center};
        struct corners corners = corners_of(&input, primitive_id(PRIMITIVE_TRIANGLE, 0));
        struct extent piece = {{-1, -1, -1, 0}, {3, 4, 6, 0}}, left, right;
        assert_true(cut_triangle(&corners, &piece, 0, 1, &left, &right));
        assert_true(left.min[0] <= 0 && left.max[1] >= 3 && left.max[2] >= 5);
        assert_true(right.max[0] >= 2 && right.max[1] >= 3 && right.max[2] >= 5);
        assert_true(left.max[0] == 1 && right.min[0] == 1);
        free(scene);
    }
}

/* 1024 triangles at distances of 1, `width` wide; far: and one as far away as that. */
static uint64_t entries_of_cells(double width, double height, double far)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (int i = 0; i < 1024; i++) {
        struct vec3 p = vec3(i % 32, i / 32, 0);
        add_triangle(builder, p, vec_add(p, vec3(width, 0, height)),
                     vec_add(p, vec3(0, width, height)), 0);
    }
    if (far > 0)
        add_triangle(builder, vec3(far, far, far), vec3(far + 1, far, far), vec3(far, far + 1, far),
                     0);
    return check_tree(finish_scene(builder)).entries;
}

/* Triangles are cut where the sides of a range overlap in more than 1/128 of its length, here of 33, unless the range
 * is small compared with the scene. */
static void test_where_triangles_are_cut(void **state)
{
    assert_int_equal(entries_of_cells(1 + 1 / 512.0, 1, 0), 1024);
    assert_int_equal(entries_of_cells(1.02, 0, 0), 1024);
    assert_true(entries_of_cells(1.08, 0, 0) > 1024);
    assert_int_equal(entries_of_cells(4, 1, 2000), 1025);
}

/* Triangles whose boxes have one centre, in a plane, can be divided by a spatial split alone. */
static void test_concentric_triangles(void **state)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (int i = 0; i < 1000; i++) {
        double w = 1 + i % 10 / 16.0, y = i % 2 ? 4 * w : -4 * w;
        add_triangle(builder, vec3(0, -4 * w, -w), vec3(0, 4 * w, w), vec3(0, y, i % 2 ? -w : w),
                     0);
    }
    assert_true(check_tree(finish_scene(builder)).entries > 1000);
}

/* A scene so large that several threads build every part of the tree: the bins of the first ranges, in which long
 * triangles are split, subtrees, and leaves. */
static void test_large_scene(void **state)
{
    uint64_t random = 23;
    struct builder *builder = long_triangles(0);
    for (int i = 0; i < 50000; i++) {
        struct vec3 p = random_vector(&random, 10);
        add_triangle(builder, p, vec_add(p, random_vector(&random, 0.1)),
                     vec_add(p, random_vector(&random, 0.1)), 0);
    }
    struct survey survey = check_tree(finish_scene(builder));
    assert_int_equal(survey.primitives, 52001);
    assert_true(survey.entries > 60000);
}

static struct survey survey_pipe(uint32_t facets, double scattered)
{
    uint64_t random = 24;
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_pipe(builder, facets, 0);
    for (uint32_t i = 0; i < scattered * facets; i++) {
        struct vec3 p = random_vector(&random, 10);
        add_triangle(builder, p, vec_add(p, random_vector(&random, 0.1)),
                     vec_add(p, random_vector(&random, 0.1)), 0);
    }
    return check_tree(finish_scene(builder));
}

/* Cut into pieces, long thin triangles with nearly the same box cause few tests; also among other triangles. */
static void test_slivers_are_cut(void **state)
{
    assert_true(survey_pipe(1000, 0).tests < 2000.0 / 16);
    assert_true(survey_pipe(1000, 10).tests < 2000.0 / 16);
}

/* Many slivers are cut only as long as there is room for pieces. */
static void test_many_slivers(void **state)
{
    struct survey survey = survey_pipe(40000, 0);
    assert_true(survey.entries > 80000 * 6 && survey.entries <= 80000 * 8);
    assert_true(survey.tests < 80000.0 / 6);
}

/* Slivers that are small compared with others are left whole, as few rays come near them. */
static void test_small_slivers(void **state)
{
    uint64_t random = 25;
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_pipe(builder, 100, 0);
    for (int i = 0; i < 2000; i++) {
        struct vec3 p = random_vector(&random, 0.2), q = vec_add(p, random_vector(&random, 0.2));
        add_triangle(builder, p, q, vec_add(q, random_vector(&random, 1e-4)), 0);
    }
    assert_true(check_tree(finish_scene(builder)).entries <= 200 * 32 + 2000 + 2200 / 4);
}

/* Too few slivers to be cut: only spatial splits add pieces. */
static void test_few_slivers(void **state)
{
    assert_true(survey_pipe(7, 0).entries <= 14 + 14 / 4);
}

static struct builder *with_rods(uint32_t count, double spread, double transmission)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), transmission);
    add_rods(builder, count, spread, 0);
    return builder;
}

/* The same for long thin cylinders and cones, close to the origin and far from it, where floats are coarse. */
static void test_rods_are_cut(void **state)
{
    struct survey survey = check_tree(finish_scene(with_rods(2000, 5, 0)));
    assert_int_equal(survey.primitives, 2000);
    assert_true(survey.entries > 2000 * 8);
    assert_true(survey.tests < 2000.0 / 16);
    struct builder *builder = with_rods(2000, 5, 0);
    add_pipe(builder, 100, 0);
    add_sphere(builder, vec3(1e6, -1e6, 1e6), 10, 0);
    assert_int_equal(check_tree(finish_scene(builder)).primitives, 2201);
}

/* Rods are left whole if they are too few, or so close together that even their pieces have nearly the same boxes. */
static void test_rods_that_stay_whole(void **state)
{
    assert_int_equal(check_tree(finish_scene(with_rods(15, 5, 0))).entries, 15);
    assert_int_equal(check_tree(finish_scene(with_rods(2000, 0.2, 0))).entries, 2000);
}

/* Of very many nearly parallel rods each has but a few pieces, and they are no bundle for that. */
static void test_many_rods(void **state)
{
    struct survey survey = check_tree(finish_scene(with_rods(100000, 1.2, 0)));
    assert_true(survey.entries > 3 * 100000);
}

/* A rod that fills its box, or runs along an axis, is not cut. */
static void test_rods_that_fill_their_boxes(void **state)
{
    uint64_t random = 27;
    struct builder *builder = with_material();
    for (unsigned i = 0; i < 400; i++) {
        struct cone cone = {.base = random_vector(&random, 10), .base_radius = 0.01};
        struct vec3 along = random_vector(&random, 0.1);
        if (i % 4 < 3) along = vec3(10 * (i % 4 == 0), 10 * (i % 4 == 1), 10 * (i % 4 == 2));
        cone.apex = vec_add(cone.base, along);
        assert_added(builder_add_cone(builder, &cone));
    }
    assert_int_equal(check_tree(finish_scene(builder)).entries, 400);
}

/* Rods of sizes whose products overflow or underflow. */
static void test_extreme_rods(void **state)
{
    uint64_t random = 28;
    for (int power = -300; power <= 300; power += 100) {
        struct builder *builder = with_material();
        double size = pow(10, power);
        for (unsigned i = 0; i < 100; i++) {
            struct cone cone = {.base = random_vector(&random, size), .base_radius = size * 1e-5};
            cone.apex = random_vector(&random, size);
            assert_added(builder_add_cone(builder, &cone));
        }
        assert_int_equal(check_tree(finish_scene(builder)).primitives, 100);
    }
}

/* A ray that meets several pieces of a triangle crosses it once. */
static void test_pieces_count_once(void **state)
{
    uint64_t random = 22, exact = 0;
    struct scene *scene = finish_scene(long_triangles(0.5));
    struct bvh *bvh = build_tree(scene);
    for (int i = 0; i < 200; i++) {
        struct ray ray = ray_to(random_vector(&random, 15), random_vector(&random, 5));
        struct shear shear = shear_of(&ray.direction);
        const struct purpose purpose = {true, INFINITE};
        unsigned expected = 0;
        for (uint32_t k = 0; k < 2000; k++) {
            struct crossings found = primitive_crossings(scene, primitive_id(PRIMITIVE_TRIANGLE, k),
                                                         &ray, &shear, &purpose, &exact);
            expected += count_ahead(&found);
        }
        struct crossings found = primitive_crossings(scene, primitive_id(PRIMITIVE_SPHERE, 0), &ray,
                                                     &shear, &purpose, &exact);
        expected += count_ahead(&found);
        assert_same(light_through(scene, bvh, &ray).x, ldexp(1, -(int)expected));
    }
    free(bvh);
    free(scene);
}

static void test_pieces_of_rods_count_once(void **state)
{
    uint64_t random = 29, exact = 0;
    struct scene *scene = finish_scene(with_rods(500, 2, 0.5));
    struct bvh *bvh = build_tree(scene);
    unsigned met = 0;
    assert_true(bvh->leaf_count > 500);
    for (int i = 0; i < 2000; i++) {
        const struct cone *aim = &scene_cones(scene)[i % 500];
        struct vec3 to = vec_scale(vec_add(aim->base, aim->apex), 0.5);
        struct ray ray =
            ray_to(random_vector(&random, 15), vec_add(to, random_vector(&random, 0.01)));
        struct shear shear = shear_of(&ray.direction);
        const struct purpose purpose = {true, INFINITE};
        unsigned expected = 0;
        for (uint32_t k = 0; k < 500; k++) {
            struct crossings found = primitive_crossings(scene, primitive_id(PRIMITIVE_CONE, k),
                                                         &ray, &shear, &purpose, &exact);
            expected += count_ahead(&found);
        }
        met += expected;
        assert_same(light_through(scene, bvh, &ray).x, ldexp(1, -(int)expected));
    }
    assert_true(met > 1000);
    free(bvh);
    free(scene);
}

/* A struct bvh of this size around the origin, with the fields that slabs need. */
static struct bvh bvh_of_size(float size)
{
    return (struct bvh){.reach = (double)size, .size = (double)size};
}

static struct bvh_node empty_node(void)
{
    struct bvh_node node = {.child = {0}};
    for (unsigned slot = 0; slot < BVH_WIDTH; slot++) {
        for (unsigned axis = 0; axis < 3; axis++) {
            node.min[axis][slot] = INFINITY;
            node.max[axis][slot] = -INFINITY;
        }
    }
    return node;
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
    enum { RIGHT, LEFT, BESIDE };
    const struct bvh bvh = bvh_of_size(1);
    struct bvh_node node = empty_node();
    set_slot(&node, RIGHT, vec3(TEST_ERROR, -1, 0.5), vec3(1, 1, 1));
    set_slot(&node, LEFT, vec3(-1, -1, 0.5), vec3(-TEST_ERROR, 1, 1));
    set_slot(&node, BESIDE, vec3(2 * TEST_ERROR, -1, 0.5), vec3(1, 1, 1));
    const double zeros[] = {0.0, -0.0};
    for (int i = 0; i < 4; i++) {
        struct ray ray = ray_along(vec3(0, 0, 0), vec3(zeros[i & 1], zeros[i >> 1], 2));
        struct slabs slabs = slabs_of(&bvh, &ray);
        double enter[LANES];
        struct lanes entered;
        assert_int_equal(slabs_meet(&slabs, &node, INFINITE, &entered), 1 << RIGHT | 1 << LEFT);
        lanes_store(enter, entered);
        assert_near(enter[RIGHT], 0.25, 1e-14);
        assert_near(enter[LEFT], 0.25, 1e-14);
        assert_int_equal(slabs_meet(&slabs, &node, 0.125, &entered), 0);
    }
}

/* If 1 / d overflows, that axis does not decide anything; the others still do. */
static void test_tiny_direction(void **state)
{
    enum { ALL, ABOVE };
    const struct bvh large = bvh_of_size(1), small = bvh_of_size(0x1p-100f);
    struct bvh_node node = empty_node();
    set_slot(&node, ALL, vec3(-1, -1, -1), vec3(1, 1, 1));
    set_slot(&node, ABOVE, vec3(0.25, 2, 0.5), vec3(1, 3, 1));
    struct bvh_node tiny = empty_node();
    set_slot(&tiny, 0, vec3(-0x1p-100, -0x1p-100, 0), vec3(0x1p-100, 0x1p-100, 0x1p-100));
    struct ray ray = ray_along(vec3(0, 0, 0), vec3(0x1p-1060, 0, 1));
    struct slabs slabs = slabs_of(&large, &ray);
    struct lanes entered;
    assert_int_equal(slabs_meet(&slabs, &node, INFINITE, &entered), 1 << ALL);
    ray = ray_along(vec3(0, 0, -0x1p-100), vec3(0, 0, 0x1p-1060)); /* there at t = 2^960 */
    slabs = slabs_of(&small, &ray);
    assert_int_equal(slabs_meet(&slabs, &tiny, 0x1p970, &entered), 1);
}

/* If no axis decides, every box counts as met, and empty slots must not lead back to the root. */
static void test_only_tiny_directions(void **state)
{
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

static void build_too_many(void *memory)
{
    struct scene scene = {.primitives = {[PRIMITIVE_SPHERE] = {.count = PRIMITIVE_MAX_COUNT},
                                         [PRIMITIVE_BOX] = {.count = PRIMITIVE_MAX_COUNT},
                                         [PRIMITIVE_CONE] = {.count = PRIMITIVE_MAX_COUNT}}};
    bvh_build(&scene, memory, 1);
}

/* Too many primitives: nothing but their number is read. */
static void test_too_many(void **state)
{
    _Alignas(64) char memory[256];
    assert_fatal(build_too_many, memory,
                 "farm: rank 0: the scene has too many primitives for a tree\n");
}

/* Boxes are added and measured along each axis, and halved also where they are as far away as numbers go. */
static void test_bounds(void **state)
{
    const struct bounds a = {{-1, 2, 3}, {0, 4, 6}}, b = {{0, -2, 5}, {3, 1, 5.5}};
    const struct bounds both = {{-1, -2, 3}, {3, 4, 6}};
    const struct bounds below = {{-3, -5, -7}, {-2, -4, -1}};
    struct bounds all = BOUNDS_NONE;
    assert_same(bounds_size(&all), 0);
    bounds_add(&all, &below);
    assert_memory_equal(&all, &below, sizeof below);
    all = BOUNDS_NONE;
    bounds_add(&all, &a);
    assert_memory_equal(&all, &a, sizeof a);
    bounds_add(&all, &b);
    assert_memory_equal(&all, &both, sizeof all);
    assert_same(bounds_half_area(&all), 4 * 6 + 6 * 3 + 3 * 4);
    for (unsigned axis = 0; axis < 3; axis++) {
        struct bounds longest = all;
        longest.max[axis] = 100;
        assert_same(bounds_size(&longest), 100 - all.min[axis]);
        assert_same(bounds_middle(&all, axis), (all.min[axis] + all.max[axis]) / 2);
        longest.min[axis] = 0x1p1023;
        longest.max[axis] = 0x1.8p1023;
        assert_same(bounds_middle(&longest, axis), 0x1.4p1023);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_empty_and_planes_only),
        cmocka_unit_test(test_one_primitive),
        cmocka_unit_test(test_all_kinds),
        cmocka_unit_test(test_equal_centroids),
        cmocka_unit_test(test_axes_are_alike),
        cmocka_unit_test(test_depth_cap),
        cmocka_unit_test(test_outward_rounding),
        cmocka_unit_test(test_center_is_where_most_are),
        cmocka_unit_test(test_center_of_a_scene_aside),
        cmocka_unit_test(test_clusters_have_trees),
        cmocka_unit_test(test_nothing_but_clusters),
        cmocka_unit_test(test_more_clusters_than_trees),
        cmocka_unit_test(test_extreme_coordinates),
        cmocka_unit_test(test_spatial_splits),
        cmocka_unit_test(test_pieces_aside),
        cmocka_unit_test(test_quantized_vertices),
        cmocka_unit_test(test_cut_through_a_corner),
        cmocka_unit_test(test_where_triangles_are_cut),
        cmocka_unit_test(test_concentric_triangles),
        cmocka_unit_test(test_large_scene),
        cmocka_unit_test(test_slivers_are_cut),
        cmocka_unit_test(test_many_slivers),
        cmocka_unit_test(test_small_slivers),
        cmocka_unit_test(test_few_slivers),
        cmocka_unit_test(test_rods_are_cut),
        cmocka_unit_test(test_rods_that_stay_whole),
        cmocka_unit_test(test_many_rods),
        cmocka_unit_test(test_rods_that_fill_their_boxes),
        cmocka_unit_test(test_extreme_rods),
        cmocka_unit_test(test_pieces_count_once),
        cmocka_unit_test(test_pieces_of_rods_count_once),
        cmocka_unit_test(test_origin_in_a_slab_plane),
        cmocka_unit_test(test_tiny_direction),
        cmocka_unit_test(test_only_tiny_directions),
        cmocka_unit_test(test_too_many),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
