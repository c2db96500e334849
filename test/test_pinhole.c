/* Tests of triangles and bundles of rays with a common origin: what is decided in float is true. */
#include "scene_fixture.h"

#include "worker/pinhole.h"
#include "worker/primitive.h"

#define SCENES 3000
#define LOOKS  12

/* Rays from one point towards vertices, edges and inner points of triangles; some exactly to such a point. Those of the
 * second packet are closer together than those of the first. grazing: they come from near the plane of a triangle, so
 * that it is in doubt where they cross it. */
static void random_rays(uint64_t *random, const struct scene *scene, bool grazing,
                        struct ray rays[2 * LANES])
{
    const struct vec3 *at = scene_vertices(scene);
    uint32_t count = (uint32_t)scene->primitives[PRIMITIVE_TRIANGLE].count;
    const uint32_t *vertex = scene_triangles(scene)[random_below(random, count)].vertex;
    struct vec3 a = at[vertex[0]], e1 = vec_sub(at[vertex[1]], a), e2 = vec_sub(at[vertex[2]], a);
    double size = vec_largest(e1) + vec_largest(e2);
    double spread = ldexp(1, -(int)random_below(random, 10));
    double u = random_between(random, -0.25, 1), v = random_between(random, -0.25, 1);
    if (random_below(random, 2) > 0) u = 0;
    struct vec3 eye = random_vector(random, ldexp(size, random_exponent(random, 1, 25)));
    if (grazing)
        eye = vec_add_scaled(vec_add_scaled(vec_scale(e1, random_between(random, -9, 9)), e2,
                                            random_between(random, -9, 9)),
                             vec_cross(e1, e2), ldexp(1 / size, -(int)random_below(random, 50)));
    eye = vec_add(a, eye);
    for (unsigned i = 0; i < 2 * LANES; i++) {
        struct vec3 target = vec_add_scaled(vec_add_scaled(a, e1, u), e2, v);
        if (i % 4 > 0) target = vec_add(target, random_vector(random, spread * size));
        rays[i] = ray_to(eye, target);
        if (i == LANES) spread /= 8;
    }
}

struct told {
    uint64_t tested, passed_by, missed, crossed, open;
    uint64_t vague; /* of those that are crossed: the distance is known to less than six digits */
};

/* What is told of one triangle, of which `maybe` says whether the window has it. */
static void check_triangle(const struct scene *scene, uint32_t id, const struct ray *rays,
                           bool maybe, const struct rough_crossings *found, lane_set open,
                           struct told *told)
{
    double from[LANES], to[LANES];
    lanes_store(from, found->from);
    lanes_store(to, found->to);
    for (unsigned lane = 0; lane < LANES; lane++) {
        uint64_t exact = 0;
        struct shear shear = shear_of(&rays[lane].direction);
        struct purpose purpose = {true, INFINITE};
        struct crossings is = primitive_crossings(scene, id, &rays[lane], &shear, &purpose, &exact);
        bool crosses = is.t[0] < INFINITE && is.t[0] > -INFINITE;
        bool certain = maybe && (found->certain >> lane & 1), doubt = open >> lane & 1;
        assert_true(maybe || !crosses);
        assert_true(certain || doubt || !crosses);
        assert_true(!certain || (crosses && from[lane] <= is.t[0] && is.t[0] <= to[lane]));
        told->tested++;
        told->passed_by += !maybe;
        told->missed += !certain && !(maybe && doubt);
        told->crossed += certain;
        told->open += maybe && doubt;
        told->vague += certain && to[lane] - from[lane] > 1e-6 * fabs(is.t[0]);
    }
}

/* Rays of a packet with some of LANES triangles, of which `leaves` are the entries. */
static void check_packet(const struct scene *scene, const struct packet *packet,
                         const struct bvh_leaf *leaves, uint32_t count,
                         const struct pinhole_leaf *leaf, const struct pinhole_triangles *seen,
                         lane_set set, const struct pinhole_rays *through, const struct ray *rays,
                         struct told *told)
{
    for (uint32_t i = 0; i < count; i++) {
        lane_set open;
        struct rough_crossings found = {.from = lanes_of(0), .to = lanes_of(0)};
        struct rough_crossings is =
            pinhole_crossings(packet, leaf, seen, i, through, ALL_LANES, &open);
        if (is.certain) found = is;
        check_triangle(scene, leaves[i].id, rays, set >> i & 1, &found, open, told);
    }
}

static void check_leaf(const struct scene *scene, const struct bundle *bundle,
                       const struct bvh_leaf *leaves, uint32_t count, const struct ray *rays,
                       struct told *told)
{
    const struct bvh_corners *corners = bvh_corners(leaves, count);
    const struct pinhole eye = pinhole_of(bundle);
    struct pinhole_leaf leaf;
    struct pinhole_triangles seen;
    if (!pinhole_leaf_of(&eye, bundle->axes, corners, &leaf)) return;
    for (uint32_t first = 0; first < count; first += LANES) {
        struct rough_places places = rough_places(bundle->packets[0], corners, count, first);
        lane_set all = pinhole_triangles(&eye, &leaf, &places, &seen);
        uint32_t some = count - first < LANES ? count - first : LANES;
        for (unsigned p = 0; p < bundle->count; p++) {
            struct pinhole_rays through = pinhole_rays_of(&eye, bundle->packets[p]);
            through = rays_at_leaf(&through, &leaf);
            check_packet(scene, bundle->packets[p], leaves + first, some, &leaf, &seen,
                         all & in_window(&seen, &through.window), &through,
                         rays + (size_t)p * LANES, told);
        }
    }
}

/* What the filter in double tells of all triangles. */
static void check_in_double(const struct scene *scene, const struct bundle *bundle,
                            const struct ray *rays, struct told *told)
{
    for (unsigned p = 0; p < bundle->count; p++)
        for (uint32_t i = 0; i < scene->primitives[PRIMITIVE_TRIANGLE].count; i++) {
            uint32_t id = primitive_id(PRIMITIVE_TRIANGLE, i);
            struct rough_crossings found =
                crossings_in_double(bundle->packets[p], scene, id, ALL_LANES);
            check_triangle(scene, id, rays + (size_t)p * LANES, true, &found,
                           found.maybe & ~found.certain, told);
        }
}

static void check_bundle(const struct scene *scene, const struct bvh *bvh, const struct ray *rays,
                         struct told *told, struct told *in_double)
{
    struct packet packets[2];
    struct bundle bundle = {.count = 2, .packets = {&packets[0], &packets[1]}};
    const struct bvh_node *root = bvh_nodes(bvh);
    if (!bundle_of(rays, &bundle) || !bundle_enters(&bundle, bvh)) return;
    assert_true(bundle.one_origin);
    for (unsigned i = 0; i < bundle.count; i++) {
        packet_prepare(&packets[i], &bundle);
        packet_enters(&packets[i], &bundle);
    }
    check_in_double(scene, &bundle, rays, in_double);
    for (unsigned slot = 0; slot < BVH_WIDTH; slot++)
        if (root->count[slot] > 0)
            check_leaf(scene, &bundle, bvh_leaves(bvh) + root->child[slot], root->count[slot], rays,
                       told);
}

static void check_scenes(bool grazing, uint64_t random, struct told *told, struct told *in_double)
{
    for (int i = 0; i < SCENES; i++) {
        struct scene *scene = random_triangles(&random, 40, 30);
        struct bvh *bvh = build_tree(scene);
        for (int k = 0; k < LOOKS; k++) {
            struct ray rays[2 * LANES];
            random_rays(&random, scene, grazing, rays);
            check_bundle(scene, bvh, rays, told, in_double);
        }
        free(bvh);
        free(scene);
    }
}

static void test_tells_the_truth(void **state)
{
    struct told told = {0}, in_double = {0};
    check_scenes(false, 1, &told, &in_double);
    /* Most is decided, much of it by the window. */
    assert_true(told.tested > UINT64_C(20) * SCENES);
    assert_true(told.passed_by > told.tested / 4);
    assert_true(told.crossed > told.tested / 40);
    assert_true(told.open < told.tested / 8);
    /* In double nearly everything is, but for rays exactly to an edge. */
    assert_true(in_double.crossed > in_double.tested / 40);
    assert_true(in_double.open < in_double.tested / 100);
    assert_true(in_double.vague < in_double.crossed / 100);
}

static void test_grazing(void **state)
{
    struct told told = {0}, in_double = {0};
    for (uint64_t seed = 1; seed <= 4; seed++)
        check_scenes(true, seed, &told, &in_double);
    assert_true(in_double.crossed > UINT64_C(40) * SCENES);
}

/* Rays in the plane of a triangle, to which all errors are 0, do not certainly cross it. */
static void test_edge_on(void **state)
{
    struct builder *builder = builder_create();
    uint32_t grey = add_material(builder, vec3(1, 1, 1), 0);
    add_triangle(builder, vec3(0.25, -1, 0), vec3(0.25, 1, 0), vec3(0.25, 0, 1), grey);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    struct told told = {0}, in_double = {0};
    struct ray rays[2 * LANES];
    for (unsigned i = 0; i < 2 * LANES; i++)
        rays[i] = ray_to(vec3(0.25, 0, 10), vec3(0.25, (i + 1) / 16., 0));
    check_bundle(scene, bvh, rays, &told, &in_double);
    assert_int_equal(in_double.tested, 2 * LANES);
    assert_int_equal(in_double.open, 2 * LANES);
    free(bvh);
    free(scene);
}

/* Nothing is decided for leaves that contain the eye, are behind it, too far away or too far aside. */
static void test_leaves_open(void **state)
{
    struct builder *builder = builder_create();
    uint32_t grey = add_material(builder, vec3(1, 1, 1), 0);
    add_triangle(builder, vec3(-1, -1, 0), vec3(1, -1, 0), vec3(0, 1, 0.5), grey);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    const struct bvh_corners *corners = bvh_corners(bvh_leaves(bvh), 1);
    const unsigned axes[3] = {0, 1, 2};
    const struct pinhole eye = {.from_center = {0, 0, 10}, .wide = 0.01, .down = true};
    struct pinhole_leaf leaf;
    assert_true(pinhole_leaf_of(&eye, axes, corners, &leaf));
    struct pinhole other = eye;
    other.down = false;
    assert_false(pinhole_leaf_of(&other, axes, corners, &leaf));
    other = eye;
    other.from_center[2] = 0.7;
    assert_false(pinhole_leaf_of(&other, axes, corners, &leaf));
    other.from_center[2] = 0x1p30;
    assert_false(pinhole_leaf_of(&other, axes, corners, &leaf));
    other = eye;
    other.from_center[2] = 20;
    assert_true(pinhole_leaf_of(&other, axes, corners, &leaf));
    other.sx = 0.9;
    assert_false(pinhole_leaf_of(&other, axes, corners, &leaf));
    other.sx = 0;
    other.sy = 0.9;
    assert_false(pinhole_leaf_of(&other, axes, corners, &leaf));
    other.sy = 0;
    other.wide = 0.9;
    assert_false(pinhole_leaf_of(&other, axes, corners, &leaf));
    ((struct bvh_corners *)(uintptr_t)corners)->inverse = NAN;
    assert_false(pinhole_leaf_of(&eye, axes, corners, &leaf));
    free(bvh);
    free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tells_the_truth),
        cmocka_unit_test(test_grazing),
        cmocka_unit_test(test_edge_on),
        cmocka_unit_test(test_leaves_open),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
