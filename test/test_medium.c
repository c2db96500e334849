/* Tests of stacks of media: nested, overlapping, open and solid objects, and the stack at the eye. */
#include "test/scene_fixture.h"
#include "worker/eye_media.h"

static uint32_t add_glass(struct builder *builder, double ior, double transmission)
{
    struct material material = {.color = {1, 1, 1}, .transmission = transmission, .ior = ior};
    uint32_t index;
    assert_added(builder_add_material(builder, &material, &index));
    return index;
}

enum { WATER, GLASS };

/* A glass ball in a ball of water, a plane of oil as a lid below, a disc of glass. */
static struct scene *nested(void)
{
    struct builder *builder = builder_create();
    uint32_t water = add_glass(builder, 1.33, 1), glass = add_glass(builder, 1.5, 1);
    uint32_t oil = add_glass(builder, 1.47, 1), stone = add_glass(builder, 9, 0);
    add_sphere(builder, vec3(0, 0, 0), 4, water);
    add_sphere(builder, vec3(0, 0, 0), 1, glass);
    add_sphere(builder, vec3(0, 0, 0), 6, stone);
    struct plane plane = {.point = {0, -10, 0}, .normal = {0, 1, 0}, .material = oil};
    assert_added(builder_add_plane(builder, &plane));
    struct disc disc = {.center = {0, 20, 0}, .normal = {0, 1, 0}, .radius = 2, .material = glass};
    assert_added(builder_add_disc(builder, &disc));
    return finish_scene(builder);
}

static uint32_t sphere(uint32_t index)
{
    return primitive_id(PRIMITIVE_SPHERE, index);
}

static void assert_crossing(struct crossing_media at, double from, double to, bool unmatched)
{
    if (at.from != from || at.to != to || at.unmatched != unmatched)
        fail_msg("from %g to %g, unmatched %d", at.from, at.to, at.unmatched);
}

static struct scene *scene;
static struct bvh *bvh;
static struct media *media;

static void begin(struct scene *of)
{
    scene = of;
    bvh = build_tree(scene);
    media = media_create(scene);
}

static void end(void)
{
    media_destroy(media);
    free(bvh);
    free(scene);
}

static struct crossing_media cross(uint32_t stack, uint32_t primitive, bool entering, double from,
                                   double to, bool unmatched)
{
    struct crossing_media at = media_cross(media, stack, primitive, entering);
    assert_crossing(at, from, to, unmatched);
    return at;
}

static void test_nested(void **state)
{
    begin(nested());
    struct crossing_media at = cross(MEDIUM_OUTSIDE, sphere(WATER), true, 1, 1.33, false);
    at = cross(at.stack, sphere(GLASS), true, 1.33, 1.5, false);
    uint32_t deepest = at.stack;
    at = cross(at.stack, sphere(GLASS), false, 1.5, 1.33, false);
    at = cross(at.stack, sphere(WATER), false, 1.33, 1, false);
    assert_int_equal(at.stack, MEDIUM_OUTSIDE);
    /* The same crossings again give the same numbers, and no new stacks. */
    uint32_t count = media_count(media);
    at = media_cross(media, MEDIUM_OUTSIDE, sphere(WATER), true);
    at = media_cross(media, at.stack, sphere(GLASS), true);
    assert_int_equal(at.stack, deepest);
    assert_int_equal(media_count(media), count);
    media_clear(media);
    assert_int_equal(media_count(media), 1);
    end();
}

/* In the overlap the one entered last counts; leaving the first changes nothing then. */
static void test_overlapping(void **state)
{
    begin(nested());
    struct crossing_media at = media_cross(media, MEDIUM_OUTSIDE, sphere(WATER), true);
    at = media_cross(media, at.stack, sphere(GLASS), true);
    at = cross(at.stack, sphere(WATER), false, 1.5, 1.5, false);
    at = cross(at.stack, sphere(GLASS), false, 1.5, 1, false);
    assert_int_equal(at.stack, MEDIUM_OUTSIDE);
    end();
}

static void test_unmatched(void **state)
{
    begin(nested());
    struct crossing_media at = cross(MEDIUM_OUTSIDE, sphere(GLASS), false, 1.5, 1, true);
    assert_int_equal(at.stack, MEDIUM_OUTSIDE);
    at = media_cross(media, MEDIUM_OUTSIDE, sphere(WATER), true);
    uint32_t inside = at.stack;
    at = media_cross(media, inside, sphere(WATER), true); /* an exit was missed */
    assert_crossing(at, 1.33, 1.33, true);
    assert_int_equal(at.stack, inside);
    /* A sheet of glass is not the ball of glass. */
    cross(inside, primitive_id(PRIMITIVE_DISC, 0), false, 1.5, 1.33, true);
    end();
}

/* The same medium is behind sheets of one index, and behind one solid. */
static void test_same_medium(void **state)
{
    begin(nested());
    uint32_t disc = primitive_id(PRIMITIVE_DISC, 0), plane = primitive_id(PRIMITIVE_PLANE, 0);
    assert_true(is_same_medium(scene, disc, disc) && !is_same_medium(scene, disc, plane));
    assert_false(is_same_medium(scene, disc, sphere(GLASS)));
    end();
}

/* A medium entered through a mesh or a sheet is left through any other of that index. */
static void test_open_surfaces(void **state)
{
    begin(nested());
    uint32_t disc = primitive_id(PRIMITIVE_DISC, 0), plane = primitive_id(PRIMITIVE_PLANE, 0);
    struct crossing_media at = cross(MEDIUM_OUTSIDE, disc, true, 1, 1.5, false);
    at = cross(at.stack, disc, true, 1.5, 1.5, false); /* twice in */
    at = cross(at.stack, disc, false, 1.5, 1.5, false);
    at = cross(at.stack, plane, true, 1.5, 1.47, false);
    at = cross(at.stack, disc, false, 1.47, 1.47, false);
    cross(at.stack, plane, false, 1.47, 1, false);
    end();
}

static void test_by_side(void **state)
{
    begin(nested());
    assert_crossing(media_by_side(scene, sphere(GLASS), true), 1, 1.5, false);
    assert_crossing(media_by_side(scene, sphere(GLASS), false), 1.5, 1, false);
    end();
}

/* A thousand shells in each other, more than the first table holds, entered and left. */
static void test_deep_nesting(void **state)
{
    struct builder *builder = builder_create();
    uint32_t glass = add_glass(builder, 1.5, 1), air = add_glass(builder, 1, 1);
    for (int i = 0; i < 1000; i++)
        add_sphere(builder, vec3(0, 0, 0), 1000 - i, i % 2 ? air : glass);
    begin(finish_scene(builder));
    uint32_t stack = MEDIUM_OUTSIDE;
    for (uint32_t i = 0; i < 1000; i++) {
        struct crossing_media at =
            cross(stack, sphere(i), true, i % 2 ? 1.5 : 1, i % 2 ? 1 : 1.5, false);
        stack = at.stack;
    }
    uint32_t count = media_count(media), again = MEDIUM_OUTSIDE;
    for (uint32_t i = 0; i < 1000; i++)
        again = media_cross(media, again, sphere(i), true).stack;
    assert_int_equal(again, stack);
    assert_int_equal(media_count(media), count); /* equal stacks, equal numbers */
    /* From the middle of the stack: 998 are put back, in their order. */
    struct crossing_media at = cross(stack, sphere(1), false, 1, 1, false);
    again = media_cross(media, MEDIUM_OUTSIDE, sphere(0), true).stack;
    for (uint32_t i = 2; i < 1000; i++)
        again = media_cross(media, again, sphere(i), true).stack;
    assert_int_equal(at.stack, again);
    at = media_cross(media, at.stack, sphere(1), false);
    assert_true(at.unmatched);
    for (uint32_t i = 1000; i-- > 0;) {
        at = cross(stack, sphere(i), false, i % 2 ? 1 : 1.5, i % 2 ? 1.5 : 1, false);
        stack = at.stack;
    }
    assert_int_equal(stack, MEDIUM_OUTSIDE);
    end();
}

/* One of the directions that media_at() tries itself, for points that are not on a surface. */
static uint32_t stack_around(struct vec3 point)
{
    return media_at(media, bvh, point, vec3(0.48, 0.61, 0.63));
}

static uint32_t stack_at(double x, double y)
{
    return stack_around(vec3(x, y, 0.01));
}

/* The media around an eye: opaque objects do not count; planes count from behind. */
static void test_eye(void **state)
{
    begin(nested());
    assert_int_equal(stack_at(30, 0), MEDIUM_OUTSIDE);
    assert_int_equal(stack_at(5, 0), MEDIUM_OUTSIDE);
    assert_int_equal(stack_at(0, 19), MEDIUM_OUTSIDE); /* behind a disc */
    struct crossing_media at = cross(stack_at(0.2, 0.1), sphere(GLASS), false, 1.5, 1.33, false);
    at = cross(at.stack, sphere(WATER), false, 1.33, 1, false);
    assert_int_equal(at.stack, MEDIUM_OUTSIDE);
    cross(stack_at(0, 2), sphere(WATER), false, 1.33, 1, false);
    cross(stack_at(0, -11), primitive_id(PRIMITIVE_PLANE, 0), false, 1.47, 1, false);
    end();
}

/* An eye exactly on a surface is on the side that it looks to, whichever side of the object it is at. */
static void test_eye_on_a_surface(void **state)
{
    static const struct vec3 ways[] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},
                                       {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    struct builder *builder = builder_create();
    uint32_t glass = add_glass(builder, 1.5, 0.9);
    add_sphere(builder, vec3(8, 0, 0), 1, glass);
    add_box(builder, vec3(-1, -1, -1), vec3(1, 1, 1), glass);
    struct plane lid = {.point = {0, -5, 0}, .normal = {0, 1, 0}, .material = glass};
    assert_added(builder_add_plane(builder, &lid));
    begin(finish_scene(builder));
    for (unsigned i = 0; i < 6; i++) {
        struct vec3 out = ways[i], in = vec_neg(out), on_ball = vec_add(vec3(8, 0, 0), out);
        uint32_t in_box = media_at(media, bvh, out, in),
                 in_ball = media_at(media, bvh, on_ball, in);
        assert_int_equal(media_at(media, bvh, out, out), MEDIUM_OUTSIDE);
        assert_int_equal(media_at(media, bvh, on_ball, out), MEDIUM_OUTSIDE);
        assert_false(media_cross(media, in_box, primitive_id(PRIMITIVE_BOX, 0), false).unmatched);
        assert_false(media_cross(media, in_ball, sphere(0), false).unmatched);
        assert_true(media_meet_at(media, bvh, out) && media_meet_at(media, bvh, on_ball));
        assert_false(media_meet_at(media, bvh, vec_scale(out, 1 - 0x1p-53)));
        assert_false(media_meet_at(media, bvh, vec_scale(out, 1 + 0x1p-52)));
    }
    assert_true(media_meet_at(media, bvh, vec3(-1, 1, -1)));
    assert_true(media_meet_at(media, bvh, vec3(3, -5, 0)));
    assert_false(media_meet_at(media, bvh, vec3(3, -5 + 0x1p-50, 0)));
    assert_int_equal(media_at(media, bvh, vec3(3, -5, 0), vec3(0.8, 0.6, 0)), MEDIUM_OUTSIDE);
    uint32_t below = media_at(media, bvh, vec3(3, -5, 0), vec3(0.8, -0.6, 0));
    assert_false(media_cross(media, below, primitive_id(PRIMITIVE_PLANE, 0), false).unmatched);
    end();
}

/* A straight line leaves a solid once, also where it goes through the edge in which the caps of two of them meet. */
static void test_eye_before_an_edge(void **state)
{
    struct builder *builder = builder_create();
    uint32_t water = add_glass(builder, 1.33, 0.9), glass = add_glass(builder, 1.5, 0.9);
    add_sphere(builder, vec3(0, 0, 0), 9, water);
    add_sphere(builder, vec3(0, 1, 0), 1, glass);
    struct cone rod = {.base = {1.25, 0, -0.5}, .apex = {1.25, 0, 1.5}, .capped = 1};
    rod.base_radius = rod.apex_radius = 1;
    struct cone cone = {.base = {-0.5, 0.25, 1.75}, .apex = {1.5, 0.25, 1.75}, .capped = 1};
    cone.base_radius = 0.25;
    cone.apex_radius = 0.5;
    rod.material = cone.material = glass;
    assert_added(builder_add_cone(builder, &rod));
    assert_added(builder_add_cone(builder, &cone));
    begin(finish_scene(builder));
    for (unsigned i = 0; i < 64; i++) {
        double far = 2.5 + i / 32.0;
        struct vec3 way = vec3(1.5, -0.75, 1.5), edge = vec3(1.5, -0.125, 1.5);
        uint32_t stack = media_at(media, bvh, vec_add_scaled(edge, way, -far), vec_normalize(way));
        struct crossing_media at = cross(stack, sphere(0), false, 1.33, 1, false);
        assert_int_equal(at.stack, MEDIUM_OUTSIDE);
    }
    end();
}

/* An eye that looks exactly along a tangent of a ball is outside of it. */
static void test_eye_along_a_tangent(void **state)
{
    struct builder *builder = builder_create();
    add_sphere(builder, vec3(0, 1, -0.25), 0.5, add_glass(builder, 1.5, 0.9));
    begin(finish_scene(builder));
    struct vec3 ahead = vec_normalize(vec3(1, -2, 0));
    assert_int_equal(media_at(media, bvh, vec3(-0.25, 1.5, 0.25), ahead), MEDIUM_OUTSIDE);
    end();
}

/* The vector with its components moved on cyclically, and mirrored if sign is -1. */
static struct vec3 turned(struct vec3 v, unsigned by, double sign)
{
    const double c[3] = {sign * v.x, sign * v.y, sign * v.z};
    return vec3(c[(3 - by) % 3], c[(4 - by) % 3], c[(5 - by) % 3]);
}

/* An eye in a ball, an oblique cone or a box is in it, also close to the surface; solids beside it do not count. */
static void test_eye_in_solids(void **state)
{
    const struct vec3 min = {1, 10, 100}, max = {2, 20, 200}, base = {-40, 0, 3},
                      apex = {-34, 8, 3};
    const struct vec3 along = {0.6, 0.8, 0}, across = {-0.8, 0.6, 0};
    for (unsigned i = 0; i < 6; i++) {
        unsigned by = i % 3;
        double sign = i < 3 ? 1 : -1;
        struct builder *builder = builder_create();
        uint32_t glass = add_glass(builder, 1.5, 0.9);
        struct vec3 corners[2] = {turned(min, by, sign), turned(max, by, sign)};
        add_box(builder, corners[i >= 3], corners[i < 3], glass);
        add_sphere(builder, turned(vec3(0, -30, 0), by, sign), 3, glass);
        struct cone cone = {.base = turned(base, by, sign), .apex = turned(apex, by, sign)};
        cone.base_radius = 4;
        cone.apex_radius = 1;
        cone.capped = 1;
        cone.material = glass;
        assert_added(builder_add_cone(builder, &cone));
        begin(finish_scene(builder));
        for (unsigned k = 0; k < 8; k++) {
            struct vec3 eye = {k & 1 ? 1.01 : 1.99, k & 2 ? 10.1 : 19.9, k & 4 ? 101 : 199};
            uint32_t stack = stack_around(turned(eye, by, sign));
            cross(stack, primitive_id(PRIMITIVE_BOX, 0), false, 1.5, 1, false);
            double far = k & 1 ? 0.1 : 9.9, radius = 4 - 0.3 * far, out = k & 2 ? 0.99 : -0.99;
            eye = vec_add_scaled(vec_add_scaled(base, along, far), across, out * radius);
            cross(stack_around(turned(eye, by, sign)), primitive_id(PRIMITIVE_CONE, 0), false, 1.5,
                  1, false);
            eye = vec3(k & 1 ? 1.7 : -1.7, k & 2 ? -31.7 : -28.3, k & 4 ? 1.7 : -1.7);
            cross(stack_around(turned(eye, by, sign)), sphere(0), false, 1.5, 1, false);
        }
        end();
    }
}

/*
 * An eye that looks exactly along the edge of a box, or along the side of a rod, is outside of them, also where other
 * surfaces lie in between: from each the ray goes on at a rounded point, beside the edge or not.
 */
static void test_eye_along_an_edge(void **state)
{
    for (unsigned i = 0; i < 6 * 64; i++) {
        unsigned axis = i % 3;
        double sign = i % 6 < 3 ? 1 : -1, far = i / 6;
        struct builder *builder = builder_create();
        uint32_t glass = add_glass(builder, 1.2, 0.3);
        struct vec3 by = vec3(far, far / 4, 0);
        add_sphere(builder, turned(vec_add(vec3(1, 1, 2), by), axis, sign), 1, glass);
        struct vec3 corners[2] = {turned(vec_add(vec3(0.5, 1, 1), by), axis, sign),
                                  turned(vec_add(vec3(2, 2, 2), by), axis, sign)};
        add_box(builder, corners[sign < 0], corners[sign > 0], glass);
        struct cone rod = {.base = turned(vec_add(vec3(0, 1, 1), by), axis, sign),
                           .apex = turned(vec_add(vec3(0, 1, 2), by), axis, sign)};
        rod.base_radius = rod.apex_radius = 0.5;
        rod.capped = 1;
        rod.material = glass;
        assert_added(builder_add_cone(builder, &rod));
        begin(finish_scene(builder));
        struct vec3 eye = turned(vec_add(vec3(0.5, 1, 3), by), axis, sign);
        assert_int_equal(media_at(media, bvh, eye, turned(vec3(0, 0, -1), axis, sign)),
                         MEDIUM_OUTSIDE);
        end();
    }
}

/*
 * An eye within the last bit of an oblique plane is behind it exactly where a ray to its front meets it. The three
 * numbers are a sum of decimal fractions that is 0 but for their rounding.
 */
static void test_eye_at_an_oblique_plane(void **state)
{
    const struct vec3 front = {1, 1, 1};
    unsigned behind = 0, before = 0;
    struct builder *builder = builder_create();
    struct plane surface = {
        .point = {0, 0, 0}, .normal = front, .material = add_glass(builder, 1.5, 0.9)};
    assert_added(builder_add_plane(builder, &surface));
    begin(finish_scene(builder));
    for (int i = 1; i < 10; i++) {
        for (int k = 1; k < 10; k++) {
            struct vec3 eye = {i / 10.0, k / 10.0, -(i + k) / 10.0};
            struct ray ray = {
                .origin = eye, .direction = front, .t_max = HUGE_VAL, .from = PRIMITIVE_NONE};
            struct hit hit;
            uint64_t exact = 0;
            nearest(scene, bvh, &ray, 1, &hit, &exact);
            bool meets = hit.primitive != PRIMITIVE_NONE;
            assert_int_equal(media_at(media, bvh, eye, front) != MEDIUM_OUTSIDE, meets);
            behind += meets;
            before += !meets;
        }
    }
    assert_true(behind > 0 && before > 0);
    end();
}

/* An eye in a closed mesh: all rays agree. */
static void test_eye_in_a_mesh(void **state)
{
    struct builder *builder = builder_create();
    uint32_t glass = add_glass(builder, 1.5, 1);
    struct vec3 a = {1, 1, 1}, b = {-1, -1, 1}, c = {-1, 1, -1}, d = {1, -1, -1};
    add_triangle(builder, a, c, b, glass);
    add_triangle(builder, a, b, d, glass);
    add_triangle(builder, a, d, c, glass);
    add_triangle(builder, b, c, d, glass);
    begin(finish_scene(builder));
    uint32_t inside = stack_around(vec3(0.01, 0.02, 0.03));
    cross(inside, primitive_id(PRIMITIVE_TRIANGLE, 2), false, 1.5, 1, false);
    assert_int_equal(stack_around(vec3(2, 2, 2)), MEDIUM_OUTSIDE);
    assert_int_equal(stack_around(vec3(-2, -2, -3)), MEDIUM_OUTSIDE);
    end();
}

/* A sphere that is seen from inside alone bounds no volume: like a sheet it may be entered twice. */
static void test_sphere_seen_from_inside(void **state)
{
    struct builder *builder = builder_create();
    struct sphere shell = {{0, 0, 0}, 1, add_glass(builder, 1.5, 1), 1};
    assert_added(builder_add_sphere(builder, &shell));
    begin(finish_scene(builder));
    struct crossing_media at = cross(MEDIUM_OUTSIDE, sphere(0), true, 1, 1.5, false);
    cross(at.stack, sphere(0), true, 1.5, 1.5, false);
    end();
}

/* Eight faces around the eye, with corners at this distance, except the face of one octant; -1: all of them. */
static void add_octahedron(struct builder *builder, uint32_t glass, double size, int without)
{
    for (int octant = 0; octant < 8; octant++) {
        double x = octant & 1 ? -size : size, y = octant & 2 ? -size : size,
               z = octant & 4 ? -size : size;
        struct vec3 a = {x, 0, 0}, b = {0, y, 0}, c = {0, 0, z};
        if (octant == without) continue;
        add_triangle(builder, a, x * y * z > 0 ? b : c, x * y * z > 0 ? c : b, glass);
    }
}

static struct scene *octahedron(int without)
{
    struct builder *builder = builder_create();
    add_octahedron(builder, add_glass(builder, 1.5, 1), 1, without);
    return finish_scene(builder);
}

/* An eye exactly on a closed mesh is on the side that it looks to. */
static void test_eye_on_a_mesh(void **state)
{
    begin(octahedron(-1));
    const struct vec3 on[] = {{0.25, 0.25, 0.5}, {-0.5, 0, 0.5}, {0, -1, 0}};
    for (unsigned i = 0; i < 3; i++) {
        struct vec3 out = vec_normalize(on[i]), in = vec_neg(out);
        assert_true(media_meet_at(media, bvh, on[i]));
        assert_int_equal(media_ahead(media, bvh, on[i], out), MEDIUM_OUTSIDE);
        assert_int_not_equal(media_ahead(media, bvh, on[i], in), MEDIUM_OUTSIDE);
        assert_false(media_meet_at(media, bvh, vec_scale(on[i], 1 - 0x1p-50)));
        assert_false(media_meet_at(media, bvh, vec_scale(on[i], 1 + 0x1p-50)));
    }
    end();
}

/* A mesh with a hole where one of four rays leaves it: they do not agree that the eye is inside. */
static void test_eye_in_an_open_mesh(void **state)
{
    uint32_t outside = 0;
    for (int without = -1; without < 8; without++) {
        begin(octahedron(without));
        uint32_t inside = stack_around(vec3(0.01, 0.02, 0.03));
        if (without < 0) assert_int_not_equal(inside, MEDIUM_OUTSIDE);
        outside += inside == MEDIUM_OUTSIDE;
        end();
    }
    assert_int_equal(outside, 4);
}

/* A mesh with a hole around a closed one of the same medium: where one of four rays leaves through the hole, they agree
 * that the eye is in that medium once, else twice. */
static void test_eye_in_two_meshes(void **state)
{
    uint32_t once = 0;
    for (int without = 0; without < 8; without++) {
        struct builder *builder = builder_create();
        uint32_t glass = add_glass(builder, 1.5, 1);
        add_octahedron(builder, glass, 1, -1);
        add_octahedron(builder, glass, 2, without);
        begin(finish_scene(builder));
        uint32_t inside = stack_around(vec3(0.01, 0.02, 0.03));
        uint32_t face = primitive_id(PRIMITIVE_TRIANGLE, 0);
        struct crossing_media at = media_cross(media, inside, face, false);
        once += at.to == 1;
        assert_crossing(at, 1.5, at.to == 1 ? 1 : 1.5, false);
        at = media_cross(media, at.stack, face, false);
        assert_int_equal(at.stack, MEDIUM_OUTSIDE);
        end();
    }
    assert_int_equal(once, 4);
}

/* In water whose bed is a floor with a block on it, both opaque: the rays that look for what is around
 * go through the two in one plane. */
static void test_eye_above_coplanar(void **state)
{
    struct builder *builder = builder_create();
    uint32_t water = add_glass(builder, 1.33, 0.9), stone = add_glass(builder, 1.5, 0);
    struct plane floor = {.point = {0, 0, 0}, .normal = {0, 1, 0}, .material = stone};
    uint32_t corner[8];
    static const unsigned faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (unsigned i = 0; i < 8; i++)
        corner[i] = add_vertex(builder, vec3(i & 1 ? 5 : -5, i & 2 ? 3 : -1, i & 4 ? 5 : -5));
    for (unsigned i = 0; i < 6; i++)
        for (unsigned k = 1; k < 3; k++) {
            const unsigned *face = faces[i];
            struct triangle half = {{corner[face[0]], corner[face[k]], corner[face[k + 1]]}, water};
            assert_added(builder_add_triangle(builder, &half));
        }
    assert_added(builder_add_plane(builder, &floor));
    add_box(builder, vec3(-1.5, 0, 0.2), vec3(-0.5, 0.3, 1.2), stone);
    begin(finish_scene(builder));
    uint32_t inside = stack_around(vec3(0, 1, 0));
    uint32_t outside =
        cross(inside, primitive_id(PRIMITIVE_TRIANGLE, 0), false, 1.33, 1, false).stack;
    assert_int_equal(outside, MEDIUM_OUTSIDE);
    end();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nested),
        cmocka_unit_test(test_overlapping),
        cmocka_unit_test(test_unmatched),
        cmocka_unit_test(test_same_medium),
        cmocka_unit_test(test_open_surfaces),
        cmocka_unit_test(test_by_side),
        cmocka_unit_test(test_deep_nesting),
        cmocka_unit_test(test_eye),
        cmocka_unit_test(test_eye_on_a_surface),
        cmocka_unit_test(test_eye_along_a_tangent),
        cmocka_unit_test(test_eye_in_solids),
        cmocka_unit_test(test_eye_along_an_edge),
        cmocka_unit_test(test_eye_before_an_edge),
        cmocka_unit_test(test_eye_at_an_oblique_plane),
        cmocka_unit_test(test_eye_in_a_mesh),
        cmocka_unit_test(test_eye_on_a_mesh),
        cmocka_unit_test(test_sphere_seen_from_inside),
        cmocka_unit_test(test_eye_in_an_open_mesh),
        cmocka_unit_test(test_eye_in_two_meshes),
        cmocka_unit_test(test_eye_above_coplanar),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
