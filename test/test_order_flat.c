/* Several flat surfaces in one plane: all rays agree on which of them comes first. */
#include "test/scene_fixture.h"
#include "worker/order.h"
#include "worker/primitive.h"

enum kind { MESH, BOX, CONE, DISC, PLANE, KINDS };

/* Two triangles in y = height, a quadrangle about `half` to each side of the origin. */
static void add_square(struct builder *builder, double half, double height, uint32_t material)
{
    double x = 1.1 * half, z = 0.9 * half;
    add_triangle(builder, vec3(-x, height, -z), vec3(half, height, -half), vec3(half, height, z),
                 material);
    add_triangle(builder, vec3(-x, height, -z), vec3(half, height, z), vec3(-half, height, half),
                 material);
}

/* What is flat in y = height, for `half` around the origin at least; boxes and cones are from there to
 * height + thickness. */
static void add_flat(struct builder *builder, enum kind kind, double half, double height,
                     double thickness, uint32_t material)
{
    double top = height + thickness;
    struct disc disc = {{0, height, 0}, {0, 1, 0}, 2 * half, material, 0};
    struct cone cone = {{0, height, 0}, {0, top, 0}, 2 * half, half, material, 1};
    switch (kind) {
    case MESH:
        add_square(builder, half, height, material);
        break;
    case BOX:
        add_box(builder, vec3(-half, fmin(height, top), -half), vec3(half, fmax(height, top), half),
                material);
        break;
    case CONE:
        assert_added(builder_add_cone(builder, &cone));
        break;
    case DISC:
        assert_added(builder_add_disc(builder, &disc));
        break;
    case PLANE:
    case KINDS:
        assert_added(
            builder_add_plane(builder, &(struct plane){disc.center, disc.normal, material, 0}));
        break;
    }
}

#define HEIGHT 0.7
#define PILE   3   /* surfaces in one plane */
#define RAYS   512 /* some of them as packets and bundles */

/* ---- two surfaces: which is first ---- */

/* A floor in y = HEIGHT and glass above that stands on it. */
static struct scene *glass_on_floor(enum kind glass, enum kind floor, double share)
{
    struct builder *builder = builder_create();
    uint32_t opaque = add_material(builder, vec3(1, 1, 1), share);
    uint32_t clear = add_material(builder, vec3(1, 1, 1), 0.8);
    add_flat(builder, glass, 3, HEIGHT, 2, clear);
    add_flat(builder, floor, 50, HEIGHT, -2, opaque);
    return finish_scene(builder);
}

/* From within the glass to its bottom; all from one eye, or from anywhere, some along the floor. */
static struct ray ray_down(uint64_t *random, bool one_eye)
{
    struct vec3 target = vec3(random_between(random, -1, 1), HEIGHT, random_between(random, -1, 1));
    double up = pow(10, random_between(random, -9, 0));
    struct vec3 eye =
        vec3(random_between(random, -1, 1), HEIGHT + up, random_between(random, -1, 1));
    return ray_to(one_eye ? vec3(0.3, HEIGHT + 0.9, 0.2) : eye, target);
}

/* What each kernel level finds for RAYS rays together. */
static void nearest_together(const struct scene *scene, const struct bvh *bvh,
                             const struct ray *rays, struct hit *hits)
{
    uint64_t exact = 0;
    nearest(scene, bvh, rays, RAYS, hits, &exact);
    assert_hits(scene, bvh, rays, RAYS, hits);
}

static bool is_opaque(const struct scene *scene, const struct hit *hit)
{
    assert_int_not_equal(hit->primitive, PRIMITIVE_NONE);
    return scene_materials(scene)[primitive_material(scene, hit->primitive)].transmission == 0;
}

/* Whether the hit is in y = HEIGHT. */
static bool is_bottom(const struct scene *scene, const struct ray *ray, const struct hit *hit)
{
    struct surface surface;
    if (hit->primitive == PRIMITIVE_NONE) return false;
    surface_at(scene, ray, hit, &surface);
    return fabs(surface.geometric.y) > 0.99 && fabs(surface.point.y - HEIGHT) < 1e-3;
}

/* Every ray meets the floor and not the glass, and what the floor throws back does not meet the glass's
 * bottom: it stays within. */
static void floor_comes_first(const struct scene *scene, bool one_eye, uint64_t *random)
{
    static struct ray rays[RAYS];
    static struct hit hits[RAYS];
    struct bvh *bvh = build_tree(scene);
    for (int i = 0; i < RAYS; i++)
        rays[i] = ray_down(random, one_eye);
    nearest_together(scene, bvh, rays, hits);
    for (int i = 0; i < RAYS; i++) {
        assert_true(is_opaque(scene, &hits[i]));
        rays[i] = ray_from(scene, &rays[i], &hits[i]);
        rays[i].direction.y = -rays[i].direction.y;
    }
    nearest_together(scene, bvh, rays, hits);
    for (int i = 0; i < RAYS; i++)
        assert_false(is_bottom(scene, &rays[i], &hits[i]));
    free(bvh);
}

/* Where light goes through both, all rays meet the same one first, and the other one from there. */
static void both_in_one_order(const struct scene *scene, bool one_eye, uint64_t *random)
{
    static struct ray rays[RAYS];
    static struct hit hits[RAYS], seconds[RAYS];
    struct bvh *bvh = build_tree(scene);
    for (int i = 0; i < RAYS; i++)
        rays[i] = ray_down(random, one_eye);
    nearest_together(scene, bvh, rays, hits);
    for (int i = 0; i < RAYS; i++)
        rays[i] = ray_from(scene, &rays[i], &hits[i]);
    nearest_together(scene, bvh, rays, seconds);
    for (int i = 0; i < RAYS; i++) {
        uint32_t first = primitive_material(scene, hits[i].primitive);
        assert_int_equal(first, primitive_material(scene, hits[0].primitive));
        assert_int_not_equal(seconds[i].primitive, PRIMITIVE_NONE);
        assert_int_not_equal(primitive_material(scene, seconds[i].primitive), first);
        assert_true(is_bottom(scene, &rays[i], &seconds[i]));
    }
    free(bvh);
}

typedef void check_scene(const struct scene *scene, bool one_eye, uint64_t *random);

/* Of all kinds of glass on all kinds of floor, which lets so much light through. */
static void check_all(check_scene *check, double transmission, uint64_t random)
{
    for (enum kind glass = MESH; glass < PLANE; glass++)
        for (enum kind floor = MESH; floor < KINDS; floor++)
            for (int one_eye = 0; one_eye < 2; one_eye++) {
                struct scene *scene = glass_on_floor(glass, floor, transmission);
                check(scene, one_eye, &random);
                free(scene);
            }
}

static void test_glass_on_floor(void **state)
{
    check_all(floor_comes_first, 0, 71);
}

static void test_glass_on_glass(void **state)
{
    check_all(both_in_one_order, 0.5, 72);
}

/* ---- three surfaces: through all of them, and back ---- */

/* Three of them in y = HEIGHT, each of a material of its own that lets half of the light through. */
static struct scene *pile(enum kind upper, enum kind lower)
{
    struct builder *builder = builder_create();
    uint32_t materials[PILE];
    for (int i = 0; i < PILE; i++)
        materials[i] = add_material(builder, vec3(1, 1, 1), 0.5);
    add_flat(builder, upper, 3, HEIGHT, 2, materials[0]);
    add_flat(builder, lower, 50, HEIGHT, -2, materials[1]);
    add_flat(builder, DISC, 20, HEIGHT, 0, materials[2]);
    return finish_scene(builder);
}

/* Rays that cross the surfaces together, and what each of them meets next. */
struct crowd {
    const struct scene *scene;
    struct bvh *bvh;
    bool reversed; /* they cross the plane on their way back */
    struct ray rays[RAYS];
    struct hit hits[RAYS];
};

/* All rays go on from their hits to the next surface, or turn back there. */
static void go_on(struct crowd *crowd, bool back)
{
    if (back) crowd->reversed = !crowd->reversed;
    for (int i = 0; i < RAYS; i++) {
        struct ray *ray = &crowd->rays[i], next = ray_from(crowd->scene, ray, &crowd->hits[i]);
        if (back) {
            next.origin = surface_beyond(crowd->scene, ray, &crowd->hits[i]);
            next.direction.y = -next.direction.y;
        }
        if (crowd->reversed) next.from_part |= FROM_REVERSED;
        *ray = next;
    }
    nearest_together(crowd->scene, crowd->bvh, crowd->rays, crowd->hits);
}

/* The material that ray i has met of those in y = HEIGHT; PILE: none of them. */
static uint32_t material_met(const struct crowd *crowd, int i)
{
    if (!is_bottom(crowd->scene, &crowd->rays[i], &crowd->hits[i])) return PILE;
    return primitive_material(crowd->scene, crowd->hits[i].primitive);
}

/* All rays have met a surface of this material; PILE: none of the pile. */
static void assert_met(const struct crowd *crowd, uint32_t material)
{
    for (int i = 0; i < RAYS; i++)
        assert_int_equal(material_met(crowd, i), material);
}

/* What comes through for each ray as if it were a shadow ray, the same from all levels. */
static void light_of_all(const struct crowd *crowd, struct vec3 light[RAYS])
{
    static struct vec3 others[RAYS];
    uint64_t exact = 0;
    for (int i = 0; i < RAYS; i++)
        light[i] = light_through(crowd->scene, crowd->bvh, &crowd->rays[i]);
    for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        if (!processor_has(level)) continue;
        kernel_at(level)->occluded(crowd->scene, crowd->bvh, crowd->rays, RAYS, others, &exact);
        assert_memory_equal(others, light, sizeof others);
    }
}

/* From here twice as much light comes through as from the surface before, as half of it was lost there. */
static void assert_halved(const struct crowd *crowd, const struct vec3 before[RAYS],
                          struct vec3 light[RAYS])
{
    light_of_all(crowd, light);
    for (int i = 0; i < RAYS; i++)
        assert_vector_near(before[i], vec_scale(light[i], 0.5), 0);
}

/* All rays meet each of the three surfaces once, in the same order, and shadow rays cross those that are left. Then
 * back from the last one to the middle, there and back again, and out. */
static void passes_each_once(struct crowd *crowd)
{
    static struct vec3 light[PILE][RAYS];
    uint32_t order[PILE];
    nearest_together(crowd->scene, crowd->bvh, crowd->rays, crowd->hits);
    for (int k = 0; k < PILE; k++) {
        order[k] = material_met(crowd, 0);
        assert_int_not_equal(order[k], PILE);
        assert_met(crowd, order[k]);
        for (int before = 0; before < k; before++)
            assert_int_not_equal(order[k], order[before]);
        if (k == PILE - 1) break;
        go_on(crowd, false);
        if (k > 0)
            assert_halved(crowd, light[k - 1], light[k]);
        else
            light_of_all(crowd, light[0]);
    }
    go_on(crowd, true);
    assert_met(crowd, order[1]);
    light_of_all(crowd, light[0]);
    go_on(crowd, true);
    assert_met(crowd, order[2]);
    go_on(crowd, true);
    assert_met(crowd, order[1]);
    go_on(crowd, false);
    assert_met(crowd, order[0]);
    assert_halved(crowd, light[0], light[1]);
    go_on(crowd, false);
    assert_met(crowd, PILE);
    assert_halved(crowd, light[1], light[2]);
}

static void test_each_is_passed_once(void **state)
{
    static struct crowd crowd;
    uint64_t random = 74;
    for (enum kind upper = MESH; upper < KINDS; upper++)
        for (enum kind lower = MESH; lower < KINDS; lower++)
            for (int one_eye = 0; one_eye < 2; one_eye++) {
                struct scene *scene = pile(upper, lower);
                crowd.scene = scene;
                crowd.bvh = build_tree(scene);
                crowd.reversed = false;
                for (int i = 0; i < RAYS; i++)
                    crowd.rays[i] = ray_down(&random, one_eye);
                passes_each_once(&crowd);
                free(crowd.bvh);
                free(scene);
            }
}

/* ---- sheets with common corners ---- */

/* The same square in y = HEIGHT twice, with the same vertices, cut along the same diagonal or along different ones. */
static struct scene *two_sheets(unsigned diagonal)
{
    struct builder *builder = builder_create();
    uint32_t corner[4], first = add_material(builder, vec3(1, 1, 1), 0.5);
    uint32_t second = add_material(builder, vec3(1, 1, 1), 0.5);
    for (unsigned i = 0; i < 4; i++)
        corner[i] = add_vertex(builder, vec3(i == 1 || i == 2 ? 3 : -3, HEIGHT, i < 2 ? -3 : 3));
    for (unsigned i = 0; i < 4; i += 2) {
        unsigned k = i + diagonal;
        struct triangle below = {{corner[i], corner[(i + 1) % 4], corner[(i + 2) % 4]}, first};
        struct triangle above = {{corner[k % 4], corner[(k + 3) % 4], corner[(k + 2) % 4]}, second};
        assert_added(builder_add_triangle(builder, &below));
        assert_added(builder_add_triangle(builder, &above));
    }
    return finish_scene(builder);
}

/* Both are met, and neither twice. */
static void test_sheets_with_common_corners(void **state)
{
    static struct crowd crowd;
    uint64_t random = 75;
    for (unsigned i = 0; i < 4; i++) {
        struct scene *scene = two_sheets(i % 2);
        crowd.scene = scene;
        crowd.bvh = build_tree(scene);
        crowd.reversed = false;
        for (int k = 0; k < RAYS; k++)
            crowd.rays[k] = ray_down(&random, i < 2);
        nearest_together(crowd.scene, crowd.bvh, crowd.rays, crowd.hits);
        uint32_t met[RAYS];
        for (int k = 0; k < RAYS; k++)
            met[k] = material_met(&crowd, k);
        go_on(&crowd, false);
        for (int k = 0; k < RAYS; k++)
            assert_int_equal(met[k] + material_met(&crowd, k), 1);
        go_on(&crowd, false);
        assert_met(&crowd, PILE);
        free(crowd.bvh);
        free(scene);
    }
}

/* ---- a third surface through the same line ---- */

/* An opaque floor, and a wedge of glass on it that ends in the line x = y = 0. */
static struct scene *wedge_on_floor(void)
{
    struct builder *builder = builder_create();
    uint32_t opaque = add_material(builder, vec3(1, 1, 1), 0);
    uint32_t clear = add_material(builder, vec3(1, 1, 1), 0.4);
    struct plane floor = {{0, 0, 0}, {0, 1, 0}, opaque, 0};
    assert_added(builder_add_plane(builder, &floor));
    add_triangle(builder, vec3(0, 0, -1.7), vec3(0, 0, 1.3), vec3(-1.1, 0, 0.4), clear);
    add_triangle(builder, vec3(0, 0, -1.7), vec3(0, 0, 1.3), vec3(-1.4, 0.9, 0.3), clear);
    return finish_scene(builder);
}

/* Rays to that line cross the floor and both sides of the wedge at one place: they meet the floor, whichever surface is
 * tested first. */
static void test_three_through_one_line(void **state)
{
    static struct ray rays[RAYS];
    static struct hit hits[RAYS];
    struct scene *scene = wedge_on_floor();
    struct bvh *bvh = build_tree(scene);
    for (int i = 0; i < RAYS; i++)
        rays[i] = ray_along(vec3(0, 1.37, 4.1), vec_normalize(vec3(0, -0.25 - 0.2 * i / RAYS, -1)));
    nearest_together(scene, bvh, rays, hits);
    for (int i = 0; i < RAYS; i++) {
        struct hit alone = nearest_of(scene, bvh, &rays[i]);
        assert_same_hit(&hits[i], &alone);
        assert_true(is_opaque(scene, &hits[i]));
    }
    free(bvh);
    free(scene);
}

/* ---- oblique surfaces ---- */

/* In x + 3 y - z = 1, exactly; reach: of the two steps along the plane from (1, 0, 0), (1, 0, 1) and
 * (3, -1, 0). */
static struct vec3 oblique_point(uint64_t *random, double reach)
{
    double i = floor(64 * random_between(random, -reach, reach)) / 64;
    double k = floor(64 * random_between(random, -reach, reach)) / 64;
    return vec3(1 + i + 3 * k, -k, i);
}

/* Overlapping triangles of glass and of something opaque, and two large ones that are opaque. */
static struct scene *oblique_scene(uint64_t *random)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_material(builder, vec3(1, 1, 1), 0.8);
    for (uint32_t i = 0; i < 24; i++)
        add_triangle(builder, oblique_point(random, 4), oblique_point(random, 4),
                     oblique_point(random, 4), i % 2);
    add_triangle(builder, vec3(61, -20, 0), vec3(-59, 20, 0), vec3(41, 0, 40), 0);
    add_triangle(builder, vec3(61, -20, 0), vec3(-59, 20, 0), vec3(-39, 0, -40), 0);
    return finish_scene(builder);
}

/* Reflected rays and shadow rays that start on one of the triangles meet none of them. */
static void test_oblique(void **state)
{
    uint64_t random = 73;
    for (int i = 0; i < 40; i++) {
        struct scene *scene = oblique_scene(&random);
        struct bvh *bvh = build_tree(scene);
        for (int k = 0; k < 500; k++) {
            struct vec3 eye = vec_add_scaled(oblique_point(&random, 3), vec3(1, 3, -1),
                                             pow(10, random_between(&random, -6, 1)));
            struct ray ray =
                ray_to(eye, vec_add(oblique_point(&random, 2), random_vector(&random, 1e-3)));
            struct hit hit = nearest_of(scene, bvh, &ray);
            if (hit.primitive == PRIMITIVE_NONE) continue;
            assert_true(is_opaque(scene, &hit));
            struct ray next = ray_from(scene, &ray, &hit);
            next.direction = random_vector(&random, 1);
            if (vec_dot(next.direction, vec3(1, 3, -1)) <= 0)
                next.direction = vec_neg(next.direction);
            assert_int_equal(nearest_of(scene, bvh, &next).primitive, PRIMITIVE_NONE);
            assert_vector_near(light_through(scene, bvh, &next), vec3(1, 1, 1), 0);
        }
        free(bvh);
        free(scene);
    }
}

/* Two triangles of glass around (1, 0, 0), with corners some `reach` away. */
static struct scene *large_scene(double reach, uint64_t *random)
{
    struct builder *builder = builder_create();
    for (uint32_t i = 0; i < 2; i++) {
        double a = floor(reach * random_between(random, 1, 2)) * (i == 0 ? 1 : -1);
        add_material(builder, vec3(1, 1, 1), 0.5);
        add_triangle(builder, vec3(1 - 4 * a, a, -a), vec3(1 - a, a, 2 * a),
                     vec3(1 + 5 * a, -2 * a, -a), i);
    }
    return finish_scene(builder);
}

/* From an eye close to triangles that are far larger than its distance, all rays meet them in the same order. */
static void test_large_and_oblique(void **state)
{
    uint64_t random = 77;
    for (double reach = 1; reach < 1e9; reach *= 30) {
        struct scene *scene = large_scene(reach, &random);
        struct bvh *bvh = build_tree(scene);
        for (int k = 0; k < 2000; k++) {
            double up = pow(10, random_between(&random, -3, 0));
            struct vec3 eye = vec_add_scaled(oblique_point(&random, 0.2), vec3(1, 3, -1), up);
            struct ray ray = ray_to(eye, oblique_point(&random, 0.2));
            struct hit hit = nearest_of(scene, bvh, &ray);
            for (uint32_t i = 0; i < 2; i++) {
                assert_int_not_equal(hit.primitive, PRIMITIVE_NONE);
                assert_int_equal(primitive_material(scene, hit.primitive), i);
                ray = ray_from(scene, &ray, &hit);
                hit = nearest_of(scene, bvh, &ray);
            }
            assert_int_equal(hit.primitive, PRIMITIVE_NONE);
        }
        free(bvh);
        free(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_glass_on_floor),
        cmocka_unit_test(test_glass_on_glass),
        cmocka_unit_test(test_each_is_passed_once),
        cmocka_unit_test(test_sheets_with_common_corners),
        cmocka_unit_test(test_three_through_one_line),
        cmocka_unit_test(test_oblique),
        cmocka_unit_test(test_large_and_oblique),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
