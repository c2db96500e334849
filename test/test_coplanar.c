/* Surfaces in one plane: whether they are, and that all rays agree on which of them comes first. */
#include "scene_fixture.h"

#include "worker/coplanar.h"
#include "worker/order.h"
#include "worker/primitive.h"

/* ---- whether they are ---- */

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

/* The same in either order. Then rays meet both at once. */
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
    (void)state;
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

/* ---- the same without anything but exact sums ---- */

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

static bool reference_coplanar(const struct corners *a, const struct corners *b)
{
    struct accumulator height;
    for (unsigned i = 0; i < 3; i++) {
        height_above(&height, a, b->at[i]);
        if (accumulator_sign(&height) != 0) return false;
    }
    return true;
}

/* 2: one of them is along the ray. */
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

/* From about the plane or far from it, to a corner, in a plane, or across. */
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
    (void)state;
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

/* ---- which is first ---- */

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
#define PILE   3
#define RAYS   512 /* some of them as packets and bundles */

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
    static struct hit others[RAYS];
    uint64_t exact = 0;
    nearest(scene, bvh, rays, RAYS, hits, &exact);
    for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        if (!processor_has(level)) continue;
        kernel_at(level)->nearest(scene, bvh, rays, RAYS, others, &exact);
        for (int i = 0; i < RAYS; i++)
            assert_same_hit(&others[i], &hits[i]);
    }
}

static struct ray ray_from(const struct scene *scene, const struct ray *ray, const struct hit *hit)
{
    struct surface surface;
    surface_at(scene, ray, hit, &surface);
    return ray_going_on(surface.point, hit, ray->direction);
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
    (void)state;
    check_all(floor_comes_first, 0, 71);
}

static void test_glass_on_glass(void **state)
{
    (void)state;
    check_all(both_in_one_order, 0.5, 72);
}

/* ---- through all of them, and back ---- */

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

/* Rays at the plane, all at surfaces of one material. */
struct crowd {
    const struct scene *scene;
    struct bvh *bvh;
    bool reversed; /* they cross the plane on their way back */
    struct ray rays[RAYS];
    struct hit hits[RAYS];
};

/* To what is next on the way, or on the way back. */
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

/* PILE: none of those in y = HEIGHT. */
static uint32_t material_met(const struct crowd *crowd, int i)
{
    if (!is_bottom(crowd->scene, &crowd->rays[i], &crowd->hits[i])) return PILE;
    return primitive_material(crowd->scene, crowd->hits[i].primitive);
}

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

/* Half of what came through from the surface before. */
static void assert_halved(const struct crowd *crowd, const struct vec3 before[RAYS],
                          struct vec3 light[RAYS])
{
    light_of_all(crowd, light);
    for (int i = 0; i < RAYS; i++)
        assert_vector_near(before[i], vec_scale(light[i], 0.5), 0);
}

/* Each of the three once, in one order; shadow rays, too, cross what is left of them. From the last one
 * back to the middle, there and back again, and out. */
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
    (void)state;
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

/* ---- what is round ---- */

#define CROWD 41 /* a bundle, a packet, and one */

/* What each kernel level finds for these rays together, and for each alone. */
static void nearest_of_all(const struct scene *scene, const struct bvh *bvh,
                           const struct ray rays[CROWD], struct hit hits[CROWD])
{
    struct hit others[CROWD];
    uint64_t exact = 0;
    for (int i = 0; i < CROWD; i++)
        nearest(scene, bvh, &rays[i], 1, &hits[i], &exact);
    for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        if (!processor_has(level)) continue;
        kernel_at(level)->nearest(scene, bvh, rays, CROWD, others, &exact);
        for (int i = 0; i < CROWD; i++)
            assert_same_hit(&others[i], &hits[i]);
    }
}

/* So much light comes through along each of them. */
static void assert_light(const struct scene *scene, const struct bvh *bvh,
                         const struct ray rays[CROWD], double light)
{
    struct vec3 found[CROWD];
    uint64_t exact = 0;
    for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        if (!processor_has(level)) continue;
        kernel_at(level)->occluded(scene, bvh, rays, CROWD, found, &exact);
        for (int i = 0; i < CROWD; i++)
            assert_vector_near(found[i], vec3(light, light, light), 0);
    }
}

#define ROUND_AXIS vec3(0.36, 0.48, 0.8)

/* Three of glass in one sphere, or in one cylinder or cone, all about the origin; the cylinders of different
 * lengths. */
static struct scene *round_pile(enum primitive_kind kind, double far, double apex_radius)
{
    struct builder *builder = builder_create();
    struct vec3 axis = ROUND_AXIS, at = {far, -far, far / 3};
    for (int i = 0; i < PILE; i++) {
        uint32_t material = add_material(builder, vec3(1, 1, 1), 0.5);
        double length = apex_radius == 1 ? 8 << i : 8;
        struct cone cone = {vec_add_scaled(at, axis, -length),
                            vec_add_scaled(at, axis, length),
                            1,
                            apex_radius,
                            material,
                            1};
        /* Rounded, the axes are one only about the origin. */
        if (kind == PRIMITIVE_SPHERE)
            add_sphere(builder, at, 1.5, material);
        else
            assert_added(builder_add_cone(builder, &cone));
    }
    return finish_scene(builder);
}

/* From all around the axis, some by the rim of what is seen, which all of them meet. */
static struct ray ray_through(const struct scene *scene, const struct bvh *bvh, uint64_t *random,
                              struct vec3 middle)
{
    struct hit hit;
    uint64_t exact = 0;
    for (;;) {
        struct vec3 from = vec_normalize(vec_cross(ROUND_AXIS, random_vector(random, 1)));
        from = vec_add_scaled(middle, from, 6);
        double off = random_below(random, 2) > 0 ? 0.3 : 1.4;
        struct ray ray = ray_to(from, vec_add(middle, random_vector(random, off)));
        nearest(scene, bvh, &ray, 1, &hit, &exact);
        if (hit.primitive != PRIMITIVE_NONE) return ray;
    }
}

/* Into and out of all three, in the same order. */
static void crosses_all(const struct scene *scene, const struct bvh *bvh,
                        const struct ray start[CROWD])
{
    struct ray rays[CROWD];
    struct hit hits[CROWD];
    memcpy(rays, start, sizeof rays);
    for (int k = 0; k < 2 * PILE; k++) {
        assert_light(scene, bvh, rays, ldexp(1, k - 2 * PILE));
        nearest_of_all(scene, bvh, rays, hits);
        for (int i = 0; i < CROWD; i++) {
            assert_int_equal(primitive_index(hits[i].primitive), k % PILE);
            rays[i] = ray_from(scene, &rays[i], &hits[i]);
        }
    }
    nearest_of_all(scene, bvh, rays, hits);
    for (int i = 0; i < CROWD; i++)
        assert_int_equal(hits[i].primitive, PRIMITIVE_NONE);
}

/* A ray that what it has met throws back, in an order that is `reversed`. */
static struct ray thrown_back(const struct scene *scene, const struct ray *ray,
                              const struct hit *hit, bool reversed)
{
    struct surface surface;
    struct ray next = ray_from(scene, ray, hit);
    surface_at(scene, ray, hit, &surface);
    double along = vec_dot(ray->direction, surface.geometric);
    next.origin = surface_beyond(scene, ray, hit);
    next.direction = vec_add_scaled(ray->direction, surface.geometric, -2 * along);
    if (reversed) next.from_part |= FROM_REVERSED;
    return next;
}

/* What the second one throws back goes out through the first one alone; and what that throws back, in again. */
static void is_thrown_back(const struct scene *scene, const struct bvh *bvh,
                           const struct ray start[CROWD])
{
    struct ray rays[CROWD];
    struct hit hits[CROWD];
    memcpy(rays, start, sizeof rays);
    for (uint32_t k = 0; k < 4; k++) {
        nearest_of_all(scene, bvh, rays, hits);
        for (int i = 0; i < CROWD; i++) {
            assert_int_equal(primitive_index(hits[i].primitive), k % 2);
            rays[i] = k > 0 ? thrown_back(scene, &rays[i], &hits[i], k % 2)
                            : ray_from(scene, &rays[i], &hits[i]);
        }
    }
}

static void test_round(void **state)
{
    (void)state;
    uint64_t random = 76;
    static const struct {
        enum primitive_kind kind;
        double far, apex_radius;
    } piles[] = {{PRIMITIVE_SPHERE, 0, 0},   {PRIMITIVE_SPHERE, 1000, 0},
                 {PRIMITIVE_SPHERE, 1e7, 0}, {PRIMITIVE_CONE, 0, 1},
                 {PRIMITIVE_CONE, 0, 0.5},   {PRIMITIVE_CONE, 1000, 0.5},
                 {PRIMITIVE_CONE, 1e7, 0.5}};
    for (size_t i = 0; i < sizeof piles / sizeof *piles; i++) {
        double far = piles[i].far;
        struct scene *scene = round_pile(piles[i].kind, far, piles[i].apex_radius);
        struct bvh *bvh = build_tree(scene);
        for (int k = 0; k < 60; k++) {
            struct ray rays[CROWD];
            for (int n = 0; n < CROWD; n++)
                rays[n] = ray_through(scene, bvh, &random, vec3(far, -far, far / 3));
            crosses_all(scene, bvh, rays);
            is_thrown_back(scene, bvh, rays);
        }
        free(bvh);
        free(scene);
    }
}

/* Two lengths of one open tube, so far away that the other side of it is near the start: all the same it is met. */
static void test_tube_far_away(void **state)
{
    (void)state;
    uint64_t random = 77;
    struct builder *builder = builder_create();
    uint32_t material = add_material(builder, vec3(1, 1, 1), 0);
    for (int i = 0; i < 2; i++) {
        struct cone cone = {{5e6, 0, i - 1}, {5e6, 0, i}, 1, 1, material, 0};
        assert_added(builder_add_cone(builder, &cone));
    }
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    for (int k = 0; k < 100; k++) {
        struct hit hit;
        uint64_t exact = 0;
        double angle = random_between(&random, 0, 7), down = random_between(&random, -0.2, 0.2);
        struct ray ray = ray_along(vec3(5e6 + 0.25, 0.125, 0), vec3(cos(angle), sin(angle), down));
        for (int bounce = 0; bounce < 2; bounce++) {
            nearest(scene, bvh, &ray, 1, &hit, &exact);
            if (hit.primitive == PRIMITIVE_NONE) fail_msg("ray %d, bounce %d", k, bounce);
            ray = ray_from(scene, &ray, &hit);
            ray.direction = vec_neg(ray.direction); /* into the other length */
        }
    }
    free(bvh);
    free(scene);
}

/* ---- sheets with common corners ---- */

/* Two of a square in y = HEIGHT that are cut along different or the same diagonals, with the same vertices. */
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
    (void)state;
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

/* Rays to that line cross all three at one place: the floor is met, whatever is looked at first. */
static void test_three_through_one_line(void **state)
{
    (void)state;
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

/* ---- oblique ---- */

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

/* What is thrown back or lit from one of them meets none of them. */
static void test_oblique(void **state)
{
    (void)state;
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

/* Close to the eye, what is larger by far is met in the same order by all rays. */
static void test_large_and_oblique(void **state)
{
    (void)state;
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
        cmocka_unit_test(test_are_in_one_surface),
        cmocka_unit_test(test_by_exact_sums),
        cmocka_unit_test(test_glass_on_floor),
        cmocka_unit_test(test_glass_on_glass),
        cmocka_unit_test(test_each_is_passed_once),
        cmocka_unit_test(test_round),
        cmocka_unit_test(test_tube_far_away),
        cmocka_unit_test(test_sheets_with_common_corners),
        cmocka_unit_test(test_three_through_one_line),
        cmocka_unit_test(test_oblique),
        cmocka_unit_test(test_large_and_oblique),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
