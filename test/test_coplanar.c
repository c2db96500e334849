/* Whether two surfaces lie in one plane, and which of two flat ones a ray crosses first. */
#include "test/scene_fixture.h"
#include "worker/coplanar.h"
#include "worker/primitive.h"

static struct scene *planes_scene(void)
{
    struct builder *builder = builder_create();
    uint32_t grey = add_material(builder, vec3(1, 1, 1), 0);
    double up = 1 + 0x1p-52;
    /* In y = 1, off it by a corner's last bit, and oblique: x + 3 y - z = 1. */
    add_triangle(builder, vec3(0.1, 1, 0.3), vec3(7, 1, 0.7), vec3(0.9, 1, 1e6), grey);
    add_triangle(builder, vec3(0.1, 1, 0.3), vec3(7, up, 0.7), vec3(0.9, 1, 1e6), grey);
    add_triangle(builder, vec3(1, 0, 0), vec3(0, 1, 2), vec3(5, 4, 16), grey);
    add_triangle(builder, vec3(2, -1, -2), vec3(0, 0, -1), vec3(-3, 1, -1), grey);
    add_triangle(builder, vec3(2, -1, -2), vec3(0, 0, -1), vec3(-3, 1, nextafter(-1, 0)), grey);
    add_box(builder, vec3(0, 1, 0), vec3(1, 2, 1), grey);
    const struct cone cones[] = {{{0, 1, 0}, {0, 5, 0}, 1, 1, grey, 1},
                                 {{0, 1, 0}, {0x1p-52, 5, 0}, 1, 1, grey, 1}};
    const struct disc discs[] = {{{3, 1, 2}, {0, -1, 0}, 1, grey, 0},
                                 {{3, up, 2}, {0, 1, 0}, 1, grey, 0}};
    for (int i = 0; i < 2; i++) {
        assert_added(builder_add_cone(builder, &cones[i]));
        assert_added(builder_add_disc(builder, &discs[i]));
    }
    assert_added(builder_add_plane(builder, &(struct plane){{-9, 1, 7}, {0, 1, 0}, grey, 0}));
    add_sphere(builder, vec3(0, 0, 0), 1, grey); /* touches y = 1 */
    return finish_scene(builder);
}

/* Whether the two are in one plane, whichever is named first. If so, a ray must meet both at once. */
static bool coplanar(const struct scene *scene, const uint32_t a[2], const uint32_t b[2])
{
    enum surfaces found = surfaces_of(scene, a[0], a[1], b[0], b[1]);
    assert_int_equal(surfaces_of(scene, b[0], b[1], a[0], a[1]), found);
    assert_true(found == SURFACES_TWO || found == SURFACES_ONE_PLANE);
    struct ray ray = ray_along(vec3(0.1, 7.3, 0.7), vec3(0.1, -0.9, 0.3));
    int order = 0;
    if (compare_flats(scene, &ray, a[0], a[1], b[0], b[1], &order) && order != 0)
        assert_int_equal(found, SURFACES_TWO);
    return found == SURFACES_ONE_PLANE;
}

static void test_are_in_one_surface(void **state)
{
    struct scene *scene = planes_scene();
    const uint32_t in_plane[][2] = {{0, 0}, /* the box's face min y is part 2 */
                                    {primitive_id(PRIMITIVE_BOX, 0), 2},
                                    {primitive_id(PRIMITIVE_CONE, 0), CONE_BASE_CAP},
                                    {primitive_id(PRIMITIVE_DISC, 0), 0},
                                    {primitive_id(PRIMITIVE_PLANE, 0), 0}};
    const uint32_t others[][2] = {{1, 0},
                                  {2, 0},
                                  {primitive_id(PRIMITIVE_BOX, 0), 0},
                                  {primitive_id(PRIMITIVE_BOX, 0), 3},
                                  {primitive_id(PRIMITIVE_CONE, 0), CONE_SIDE},
                                  {primitive_id(PRIMITIVE_CONE, 0), CONE_APEX_CAP},
                                  {primitive_id(PRIMITIVE_CONE, 1), CONE_BASE_CAP},
                                  {primitive_id(PRIMITIVE_DISC, 1), 0},
                                  {primitive_id(PRIMITIVE_SPHERE, 0), 0}};
    for (size_t i = 0; i < sizeof in_plane / sizeof *in_plane; i++) {
        for (size_t k = 0; k < sizeof in_plane / sizeof *in_plane; k++)
            assert_true(coplanar(scene, in_plane[i], in_plane[k]));
        for (size_t k = 0; k < sizeof others / sizeof *others; k++)
            assert_false(coplanar(scene, in_plane[i], others[k]));
    }
    assert_true(coplanar(scene, (uint32_t[]){2, 0}, (uint32_t[]){3, 0}));
    assert_false(coplanar(scene, (uint32_t[]){2, 0}, (uint32_t[]){4, 0}));
    free(scene);
}

#define ROUND 9

/* Cones and cylinders, and to which of them the surface belongs that each of the following ones has. */
static const struct {
    struct cone cone;
    uint32_t same;
} rounds[ROUND] = {
    {{{0, 1, 0}, {0, 5, 0}, 1, 1, 0, 0}, 0},
    {{{0, 9, 0}, {0, 2, 0}, 1, 1, 0, 0}, 0},       /* another part of the same cylinder */
    {{{3, 1, 0}, {3, 5, 0}, 1, 1, 0, 0}, 2},       /* beside it */
    {{{0, 1, 0}, {0, 5, 0}, 2, 2, 0, 0}, 3},       /* around it */
    {{{0, 1, 0}, {0x1p-52, 5, 0}, 1, 1, 0, 0}, 4}, /* oblique */
    {{{0, 1, 0}, {0, 5, 0}, 1, 2, 0, 0}, 5},
    {{{0, 5, 0}, {0, 1, 0}, 2, 1, 0, 0}, 5}, /* the same from its other end */
    {{{0, 5, 0}, {0, 1, 0}, 1, 2, 0, 0}, 7},
    {{{0, 1, 0}, {0, 5, 0}, 1, 3, 0, 0}, 8},
};

/* The sides of two cylinders lie in one surface if they have one axis and radius, those of two cones if they are the
 * same one. */
static void test_round_sides(void **state)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (uint32_t i = 0; i < ROUND; i++)
        assert_added(builder_add_cone(builder, &rounds[i].cone));
    struct scene *scene = finish_scene(builder);
    for (uint32_t i = 0; i < ROUND; i++)
        for (uint32_t k = 0; k < ROUND; k++) {
            uint32_t a = primitive_id(PRIMITIVE_CONE, i), b = primitive_id(PRIMITIVE_CONE, k);
            bool same = rounds[i].same == rounds[k].same;
            assert_int_equal(surfaces_of(scene, a, CONE_SIDE, b, CONE_SIDE),
                             same ? SURFACES_ONE_ROUND : SURFACES_TWO);
        }
    free(scene);
}

/* sum += (a x b).c */
static void add_determinant(struct accumulator *sum, struct vec3 a, struct vec3 b, struct vec3 c,
                            bool subtract)
{
    for (unsigned x = 0; x < 3; x++) {
        unsigned y = (x + 1) % 3, z = (x + 2) % 3;
        double first[] = {vec_component(&a, x), vec_component(&b, y), vec_component(&c, z)};
        double second[] = {vec_component(&a, x), vec_component(&b, z), vec_component(&c, y)};
        accumulator_add(sum, first, 3, subtract);
        accumulator_add(sum, second, 3, !subtract);
    }
}

struct corners {
    struct vec3 at[3];
};

static struct corners corners_of(const struct scene *scene, uint32_t id)
{
    const uint32_t *corner = corner_indices(scene, id);
    const struct vec3 *vertices = scene_vertices(scene);
    return (struct corners){{vertices[corner[0]], vertices[corner[1]], vertices[corner[2]]}};
}

/* sum += n.way with n = (b - a) x (c - a) = a x b + b x c + c x a */
static void add_along_normal(struct accumulator *sum, const struct corners *of, struct vec3 way,
                             bool subtract)
{
    for (unsigned i = 0; i < 3; i++)
        add_determinant(sum, of->at[i], of->at[(i + 1) % 3], way, subtract);
}

/* n.(a - point) */
static void height_above(struct accumulator *sum, const struct corners *of, struct vec3 point)
{
    accumulator_clear(sum);
    add_determinant(sum, of->at[0], of->at[1], of->at[2], false);
    add_along_normal(sum, of, point, true);
}

/* Whether all corners of b are in the plane of a, by exact sums. */
static bool reference_coplanar(const struct corners *a, const struct corners *b)
{
    struct accumulator height;
    for (unsigned i = 0; i < 3; i++) {
        height_above(&height, a, b->at[i]);
        if (accumulator_sign(&height) != 0) return false;
    }
    return true;
}

/* What compare_flats() is to say of the planes of a and b; 2: one of them is parallel to the ray. */
static int reference_order(const struct corners *a, const struct corners *b, const struct ray *ray)
{
    struct accumulator height[2], speed[2], difference;
    const struct corners *of[2] = {a, b};
    for (unsigned i = 0; i < 2; i++) {
        height_above(&height[i], of[i], ray->origin);
        accumulator_clear(&speed[i]);
        add_along_normal(&speed[i], of[i], ray->direction, false);
    }
    accumulator_clear(&difference);
    accumulator_add_product(&difference, &height[0], &speed[1], NULL, false);
    accumulator_add_product(&difference, &height[1], &speed[0], NULL, true);
    int sign = accumulator_sign(&speed[0]) * accumulator_sign(&speed[1]);
    return sign == 0 ? 2 : sign * accumulator_sign(&difference);
}

#define NEARLY_FLAT 24

static double random_whole(uint64_t *random, int reach)
{
    return (double)random_below(random, 2 * (uint32_t)reach + 1) - reach;
}

/* A third of its triangles in one oblique plane, a third off it by the last bit of a coordinate, a third where
 * rounding puts them; some have a side along the plane's first direction. */
static struct scene *nearly_flat(uint64_t *random)
{
    struct builder *builder = builder_create();
    uint32_t grey = add_material(builder, vec3(1, 1, 1), 0);
    struct vec3 at = vec3(random_whole(random, 99), random_whole(random, 9), 1);
    struct vec3 p = vec3(3, random_whole(random, 3), random_whole(random, 2));
    struct vec3 q = vec3(random_whole(random, 3), 5, random_whole(random, 2));
    double scale = ldexp(1, random_exponent(random, -130, 130));
    for (int i = 0; i < NEARLY_FLAT; i++) {
        struct vec3 corner[3];
        double x = random_whole(random, 20), y = random_whole(random, 20);
        double share = i % 3 == 2 ? random_between(random, 0.1, 1) : 1;
        for (int k = 0; k < 3; k++) {
            double u = k == 1 ? x + 1 + random_below(random, 5) : x;
            double v = k == 2 ? y + 1 + random_below(random, 5) : y;
            struct vec3 way = vec_add(vec_scale(p, share * u), vec_scale(q, share * v));
            corner[k] = vec_scale(vec_add(at, way), scale);
        }
        double *last = &corner[random_below(random, 3)].y;
        if (i % 3 == 1) *last = nextafter(*last, random_below(random, 2) ? INFINITE : -INFINITE);
        add_triangle(builder, corner[0], corner[1], corner[2], grey);
    }
    return finish_scene(builder);
}

/* A ray that starts near the triangle's plane, far from it or on a corner, and goes to a corner or past one. */
static struct ray ray_at(uint64_t *random, const struct corners *to)
{
    double size = sum_of_sizes(to->at[0]);
    struct vec3 origin =
        vec_add(to->at[1], random_vector(random, size * pow(10, random_between(random, -9, 3))));
    if (random_below(random, 8) == 0) origin = to->at[1];
    return ray_to(origin, random_below(random, 4) ? to->at[0] : vec_scale(to->at[2], 1.001));
}

/* How often each answer was right. */
struct answers {
    unsigned one_plane, two, orders[4];
};

static void check_pair(const struct scene *scene, uint32_t i, uint32_t k, uint64_t *random,
                       struct answers *answers)
{
    struct corners a = corners_of(scene, i), b = corners_of(scene, k);
    bool one = reference_coplanar(&a, &b);
    assert_int_equal(surfaces_of(scene, i, 0, k, 0), one ? SURFACES_ONE_PLANE : SURFACES_TWO);
    (*(one ? &answers->one_plane : &answers->two))++;
    for (unsigned n = 0; n < 4; n++) {
        struct ray ray = ray_at(random, n % 2 ? &a : &b);
        int order, expected = reference_order(&a, &b, &ray);
        bool told = compare_flats(scene, &ray, i, 0, k, 0, &order);
        assert_int_equal(told, expected != 2);
        if (told) assert_int_equal(order, expected);
        answers->orders[expected + 1]++;
    }
}

static void test_by_exact_sums(void **state)
{
    uint64_t random = 73;
    struct answers answers = {0};
    for (int n = 0; n < 40; n++) {
        struct scene *scene = nearly_flat(&random);
        for (uint32_t i = 0; i < NEARLY_FLAT; i++)
            for (uint32_t k = 0; k < i; k++)
                check_pair(scene, i, k, &random, &answers);
        free(scene);
    }
    assert_true(answers.one_plane > 999 && answers.two > 999);
    for (int i = 0; i < 4; i++)
        assert_true(answers.orders[i] > 99);
}

/* Never 0. */
static struct vec3 random_whole_vector(uint64_t *random)
{
    return vec3(random_whole(random, 9), random_whole(random, 9), 2 * random_whole(random, 9) + 1);
}

/* A capped cone whose base lies in a plane through the origin, off it; whole coordinates. */
static struct cone cone_beside(uint64_t *random)
{
    struct vec3 axis = random_whole_vector(random);
    struct vec3 base = vec_cross(axis, random_whole_vector(random));
    return (struct cone){base, vec_add(base, axis), 1, 2, 0, 1};
}

/* Oblique caps whose planes a ray crosses in one point, which is in the middle of neither: only exact arithmetic can
 * tell that none comes first. */
static void test_oblique_caps(void **state)
{
    uint64_t random = 74;
    unsigned crossed = 0;
    for (int n = 0; n < 200; n++) {
        struct builder *builder = builder_create();
        add_material(builder, vec3(1, 1, 1), 0);
        for (int i = 0; i < 2; i++) {
            struct cone cone = cone_beside(&random);
            assert_added(builder_add_cone(builder, &cone));
        }
        struct scene *scene = finish_scene(builder);
        uint32_t a = primitive_id(PRIMITIVE_CONE, 0), b = primitive_id(PRIMITIVE_CONE, 1);
        struct ray ray = ray_to(random_whole_vector(&random), vec3(0, 0, 0));
        int order;
        if (compare_flats(scene, &ray, a, CONE_BASE_CAP, b, CONE_BASE_CAP, &order)) {
            assert_int_equal(order, 0);
            crossed++;
        }
        free(scene);
    }
    assert_true(crossed > 99);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_are_in_one_surface),
        cmocka_unit_test(test_round_sides),
        cmocka_unit_test(test_by_exact_sums),
        cmocka_unit_test(test_oblique_caps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
