#include "scene_fixture.h"

#include "common/processor.h"
#include "worker/order.h"
#include "worker/primitive.h"

/* ---- the answers without a tree ---- */

static uint32_t next_id(const struct scene *scene, uint32_t id)
{
    enum primitive_kind kind = primitive_kind(id);
    uint32_t index = primitive_index(id) + 1;
    while (kind < PRIMITIVE_KINDS && index >= scene->primitives[kind].count) {
        kind++;
        index = 0;
    }
    return kind < PRIMITIVE_KINDS ? primitive_id(kind, index) : PRIMITIVE_NONE;
}

static uint32_t first_id(const struct scene *scene)
{
    bool triangles = scene->primitives[PRIMITIVE_TRIANGLE].count > 0;
    return triangles ? 0 : next_id(scene, primitive_id(PRIMITIVE_TRIANGLE, 0));
}

/* Always by the unrounded distances, and the rule for equal ones. */
static bool comes_first(const struct scene *scene, const struct ray *ray, const struct shear *shear,
                        const struct hit *hit, const struct hit *best)
{
    if (best->primitive == PRIMITIVE_NONE) return true;
    struct crossing a = {hit->primitive, hit->part, hit->t};
    struct crossing b = {best->primitive, best->part, best->t};
    int order = compare_crossings(scene, ray, shear, &a, &b);
    return order < 0 || (order == 0 && has_priority(scene, a.primitive, b.primitive));
}

static struct hit brute_nearest(const struct scene *scene, const struct ray *ray)
{
    struct shear shear = shear_of(&ray->direction);
    struct hit hit = {.t = INFINITE, .primitive = PRIMITIVE_NONE};
    uint64_t exact = 0;
    for (uint32_t id = first_id(scene); id != PRIMITIVE_NONE; id = next_id(scene, id)) {
        struct crossings found =
            primitive_crossings(scene, id, ray, &shear, &ALL_CROSSINGS, &exact);
        for (unsigned i = 0; i < 2; i++) {
            if (!(found.t[i] > 0 && found.t[i] < ray->t_max)) continue;
            struct hit next = {found.t[i], found.u, found.v, id, (uint16_t)found.part[i], 0};
            if (comes_first(scene, ray, &shear, &next, &hit)) hit = next;
            break; /* the way out is behind the way in */
        }
    }
    return hit;
}

#define MATERIALS 6

static struct vec3 brute_light(const struct scene *scene, const struct ray *ray)
{
    struct shear shear = shear_of(&ray->direction);
    struct purpose any = {true, ray->t_max};
    unsigned crossings[MATERIALS] = {0};
    uint64_t exact = 0;
    for (uint32_t id = first_id(scene); id != PRIMITIVE_NONE; id = next_id(scene, id)) {
        struct crossings found = primitive_crossings(scene, id, ray, &shear, &any, &exact);
        for (unsigned i = 0; i < 2; i++)
            if (found.t[i] > 0 && found.t[i] < ray->t_max)
                crossings[primitive_material(scene, id)]++;
    }
    struct vec3 light = vec3(1, 1, 1);
    for (unsigned m = 0; m < scene->materials.count; m++) {
        const struct material *material = &scene_materials(scene)[m];
        for (unsigned k = 0; k < crossings[m]; k++)
            light = vec_mul(light, vec_scale(material->color, material->transmission));
    }
    return light;
}

/* ---- random scenes ---- */

enum style {
    SCATTERED, /* anywhere, of any size */
    LATTICE,   /* integer coordinates: many equal distances and rays in surfaces */
    MESH,      /* triangles alone, their vertices on a lattice, most of them shared */
    STYLES
};

struct recipe {
    uint64_t *random;
    enum style style;
    double reach;
    struct vec3 offset;
    double apart; /* above 0: in three clusters, so far from each other */
};

static double some_length(const struct recipe *recipe)
{
    if (recipe->style != SCATTERED) return 1 + random_below(recipe->random, 2);
    return recipe->reach * pow(10, random_between(recipe->random, -4, -0.5));
}

static struct vec3 cluster(const struct recipe *recipe, unsigned which)
{
    double apart = recipe->apart;
    const struct vec3 places[] = {{0, 0, 0}, {apart, 0, 0}, {-apart, 2 * apart, apart}};
    return places[which];
}

static struct vec3 some_point(const struct recipe *recipe)
{
    struct vec3 p = random_vector(recipe->random, recipe->reach);
    if (recipe->style != SCATTERED) p = vec3(floor(p.x), floor(p.y), floor(p.z));
    p = vec_add(p, recipe->offset);
    return recipe->apart > 0 ? vec_add(p, cluster(recipe, random_below(recipe->random, 3))) : p;
}

static struct vec3 near_point(const struct recipe *recipe, struct vec3 p)
{
    struct vec3 step = random_vector(recipe->random, 2 * some_length(recipe));
    if (recipe->style != SCATTERED) step = vec3(floor(step.x), floor(step.y), floor(step.z));
    return vec_is_zero(step) ? vec_add(p, vec3(0, 0, recipe->reach / 8)) : vec_add(p, step);
}

static void add_patch(struct builder *builder, const struct recipe *recipe, uint32_t material)
{
    struct patch patch = {.material = material};
    struct vec3 p = some_point(recipe);
    for (unsigned k = 0; k < 3; k++) {
        patch.vertex[k] = add_vertex(builder, k ? near_point(recipe, p) : p);
        patch.normal[k] = add_normal(builder, vec3(1, k, 2));
    }
    assert_added(builder_add_patch(builder, &patch));
}

static void add_some(struct builder *builder, const struct recipe *recipe)
{
    uint64_t *random = recipe->random;
    uint32_t material = random_below(random, MATERIALS);
    struct vec3 p = some_point(recipe), q = near_point(recipe, p);
    struct vec3 size = vec3(some_length(recipe), some_length(recipe), some_length(recipe));
    struct disc disc = {p, vec3(0, 0, 1), some_length(recipe), material, 0};
    struct cone cone = {p, q, some_length(recipe), 0, material, random_below(random, 2)};
    struct sphere shell = {p, some_length(recipe), material, 1};
    if (recipe->style == SCATTERED) disc.normal = vec_normalize(random_vector(random, 1));
    if (random_below(random, 2)) cone.apex_radius = cone.base_radius;
    switch (recipe->style == MESH ? 0 : random_below(random, 7)) {
    case 0:
        add_triangle(builder, p, q, near_point(recipe, p), material);
        break;
    case 1:
        add_patch(builder, recipe, material);
        break;
    case 2:
        add_sphere(builder, p, some_length(recipe), material);
        break;
    case 3:
        add_box(builder, p, vec_add(p, size), material);
        break;
    case 4:
        assert_added(builder_add_cone(builder, &cone));
        break;
    case 5:
        assert_added(builder_add_disc(builder, &disc));
        break;
    default:
        assert_added(builder_add_sphere(builder, &shell));
        break;
    }
}

static void add_materials(struct builder *builder, bool transparency)
{
    for (uint32_t m = 0; m < MATERIALS; m++) {
        double transmission = transparency && m > 0 ? 0.9 + 0.01 * m : 0;
        add_material(builder, vec3(0.9, 0.7 + 0.05 * m, 1 - 0.01 * m), transmission);
    }
}

/* One along two axes, and slanted ones, some of which meet it and each other in a recipe's points. */
static void add_some_planes(struct builder *builder, const struct recipe *recipe)
{
    struct plane plane = {.point = some_point(recipe), .normal = {0, 1, 0}};
    assert_added(builder_add_plane(builder, &plane));
    for (uint32_t count = random_below(recipe->random, 4); count > 0; count--) {
        if (random_below(recipe->random, 2)) plane.point = some_point(recipe);
        plane.normal = vec_sub(some_point(recipe), some_point(recipe));
        plane.material = random_below(recipe->random, MATERIALS);
        if (!vec_is_zero(plane.normal)) assert_added(builder_add_plane(builder, &plane));
    }
}

static struct scene *random_scene(const struct recipe *recipe, unsigned count, bool transparency)
{
    struct builder *builder = builder_create();
    add_materials(builder, transparency);
    for (unsigned i = 0; i < count; i++)
        add_some(builder, recipe);
    add_some_planes(builder, recipe);
    return finish_scene(builder);
}

static struct ray random_ray(const struct recipe *recipe)
{
    uint64_t *random = recipe->random;
    struct ray ray = ray_to(some_point(recipe), some_point(recipe));
    struct vec3 *d = &ray.direction;
    unsigned choice = random_below(random, 8);
    if (choice == 0) d->x = random_below(random, 2) ? 0.0 : -0.0;
    if (choice == 1) *d = vec3(0.0, random_below(random, 2) ? 3.0 : -3.0, -0.0);
    if (choice == 2) ray.origin = vec_add_scaled(ray.origin, *d, random_between(random, -1e3, 0));
    if (choice == 3) ray.t_max = random_between(random, 0, 1.5);
    if (choice == 4) ray.t_max = 1;
    if (vec_is_zero(*d)) *d = vec3(0, -0.0, 1);
    return ray;
}

static void compare_ray(const struct scene *scene, const struct bvh *bvh, const struct ray *ray,
                        struct hit *hit)
{
    *hit = nearest_of(scene, bvh, ray);
    struct hit expected = brute_nearest(scene, ray);
    assert_same_hit(hit, &expected);
    struct vec3 light = light_through(scene, bvh, ray);
    struct vec3 expected_light = brute_light(scene, ray);
    assert_memory_equal(&light, &expected_light, sizeof light);
}

/* A ray, and, from where it hits, another one. */
static unsigned compare_rays(const struct recipe *recipe, const struct scene *scene, unsigned count)
{
    struct bvh *bvh = build_tree(scene);
    unsigned hits = 0;
    for (unsigned i = 0; i < count; i++) {
        struct ray ray = random_ray(recipe);
        struct hit hit;
        compare_ray(scene, bvh, &ray, &hit);
        if (hit.primitive == PRIMITIVE_NONE) continue;
        hits++;
        struct surface surface;
        surface_at(scene, &ray, &hit, &surface);
        struct ray next = ray_to(surface.point, some_point(recipe));
        next.from = hit.primitive;
        next.from_part = hit.part;
        if (!vec_is_zero(next.direction)) compare_ray(scene, bvh, &next, &hit);
    }
    free(bvh);
    return hits;
}

static void compare_scenes(struct recipe recipe, unsigned scenes, unsigned primitives,
                           unsigned rays)
{
    for (unsigned i = 0; i < scenes; i++) {
        struct scene *scene = random_scene(&recipe, primitives, i % 4 != 0);
        assert_true(compare_rays(&recipe, scene, rays) > rays / 20);
        free(scene);
    }
}

static void test_scattered(void **state)
{
    uint64_t random = 13;
    compare_scenes((struct recipe){&random, SCATTERED, 10, {0, 0, 0}, 0}, 16, 80, 5000);
}

/*
 * A ray starts next to a sphere's surface, outside by some u, and goes through it: 2 b / a, which tells
 * its way out by plain arithmetic, is off by more than a face errs that lies between that and the root.
 */
static void test_face_before_a_way_out(void **state)
{
    for (unsigned form = 0; form < 2; form++) {
        double b = 0x1p-10, off, y = sqrt(1 - b * b);
        do {
            y = nextafter(y, 2);
            off = fma(y, y, b * b - 1); /* b^2 - 1 is exact */
        } while (!(off >= 2 * UNIT_ROUNDOFF));
        double root = b + sqrt(b * b - off), told = 2 * b;
        double x = root + 0.3 * (told - root) - b;
        struct builder *builder = builder_create();
        uint32_t material = add_material(builder, vec3(1, 1, 1), 0.5);
        add_sphere(builder, vec3(0, 0, 0), 1, material);
        if (form == 0)
            add_triangle(builder, vec3(x, -5, -5), vec3(x, 9, -5), vec3(x, 2, 9), material);
        else
            add_box(builder, vec3(x, -5, -5), vec3(x + 1, 5, 5), material);
        struct scene *scene = finish_scene(builder);
        struct bvh *bvh = build_tree(scene);
        struct ray ray = {vec3(-b, y, 0), vec3(1, 0, 0), HUGE_VAL,
                          primitive_id(PRIMITIVE_SPHERE, 0), 0};
        for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
            if (!processor_has(level)) continue;
            struct hit hit;
            uint64_t exact = 0;
            scene->view.processor = level;
            nearest(scene, bvh, &ray, 1, &hit, &exact);
            assert_int_equal(hit.primitive, ray.from);
            nearest_rough(scene, bvh, &ray, 1, &hit, &exact);
            assert_int_equal(hit.primitive, ray.from);
        }
        free(bvh);
        free(scene);
    }
}

static void test_lattice(void **state)
{
    uint64_t random = 14;
    compare_scenes((struct recipe){&random, LATTICE, 4, {0, 0, 0}, 0}, 16, 60, 5000);
}

/* Triangles and discs, opaque and clear, in three planes one behind the other: more than struct known_planes has
 * room for. */
static struct scene *piles(uint64_t *random, double slope)
{
    struct builder *builder = builder_create();
    add_materials(builder, true);
    for (int i = 0; i < 3000; i++) {
        struct vec3 at[3];
        double level = random_below(random, 3), size = 1 + random_below(random, 40);
        double x = (double)random_below(random, 64) - 32, y = (double)random_below(random, 64) - 32;
        for (int k = 0; k < 3; k++) {
            double u = k == 1 ? x + size : x, v = k == 2 ? y + size : y;
            at[k] = vec3(u, v, level + slope * (u - 2 * v));
        }
        struct disc disc = {
            at[0], {slope, -2 * slope, -1}, size, random_below(random, MATERIALS), 0};
        if (i % 4)
            add_triangle(builder, at[0], at[1], at[2], random_below(random, MATERIALS));
        else
            assert_added(builder_add_disc(builder, &disc));
    }
    return finish_scene(builder);
}

#define PILE_RAYS 512

/* Together, so that what one has met is known to the next: the same as without. */
static void compare_with_brute(const struct scene *scene, const struct ray *rays)
{
    static struct hit expected[PILE_RAYS];
    struct bvh *bvh = build_tree(scene);
    for (int i = 0; i < PILE_RAYS; i++)
        expected[i] = brute_nearest(scene, &rays[i]);
    assert_hits(scene, bvh, rays, PILE_RAYS, expected);
    free(bvh);
}

static void test_piles(void **state)
{
    uint64_t random = 17;
    static struct ray rays[PILE_RAYS];
    for (int form = 0; form < 4; form++) {
        struct scene *scene = piles(&random, form % 2 ? 0.25 : 0);
        for (int i = 0; i < PILE_RAYS; i++) {
            struct vec3 eye = vec3(1.3, 0.7, -300), target = random_vector(&random, 24);
            if (form > 1) eye = vec_add(random_vector(&random, 30), vec3(0, 0, -60));
            if (i % 2) target = vec3(floor(target.x), floor(target.y), 0);
            rays[i] = ray_to(eye, target);
        }
        compare_with_brute(scene, rays);
        free(scene);
    }
}

/* Of whose facets the tree has pieces. */
static void test_pipe(void **state)
{
    uint64_t random = 19;
    static struct ray rays[PILE_RAYS];
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_pipe(builder, 300, 0);
    struct scene *scene = finish_scene(builder);
    for (unsigned form = 0; form < 4; form++) {
        struct vec3 eye = random_vector(&random, form > 1 ? 100 : 4);
        for (int i = 0; i < PILE_RAYS; i++) {
            if (form % 2) eye = vec_add(eye, random_vector(&random, 1));
            double along = random_between(&random, -0.1, 1.1);
            rays[i] = ray_to(
                eye, vec_add(vec3(9 * along, 12 * along, 13 * along), random_vector(&random, 1)));
        }
        compare_with_brute(scene, rays);
    }
    free(scene);
}

/* Of which the tree has pieces. */
static void test_rods(void **state)
{
    uint64_t random = 20;
    static struct ray rays[PILE_RAYS];
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    add_rods(builder, 300, 1, 0);
    struct scene *scene = finish_scene(builder);
    for (unsigned form = 0; form < 6; form++) {
        /* Across them, and along. */
        struct vec3 eye = random_vector(&random, form < 2 ? 4 : 100);
        if (form > 3) eye = vec3(-27, -36, -39);
        for (int i = 0; i < PILE_RAYS; i++) {
            if (form % 2) eye = vec_add(eye, random_vector(&random, 0.1));
            double along = random_between(&random, -0.1, 1.1);
            rays[i] = ray_to(
                eye, vec_add(vec3(9 * along, 12 * along, 13 * along), random_vector(&random, 1)));
        }
        compare_with_brute(scene, rays);
    }
    free(scene);
}

/* Rays of all kinds from and to one of the clusters. */
static void cluster_rays(const struct recipe *recipe, unsigned form, struct ray *rays)
{
    uint64_t *random = recipe->random;
    struct vec3 to = cluster(recipe, form % 3), away = random_vector(random, 3 * recipe->reach);
    struct vec3 eye = vec_add(to, away);
    if (form >= 6) eye = vec_add(cluster(recipe, (form + 1) % 3), away);
    for (int i = 0; i < PILE_RAYS; i++) {
        struct vec3 target = vec_add(to, random_vector(random, recipe->reach / 2));
        if (form >= 3) eye = vec_add(eye, random_vector(random, recipe->reach / 64));
        rays[i] = ray_to(eye, target);
    }
}

/* Of which each is too fine for the floats of the other's tree. */
static void test_clusters(void **state)
{
    uint64_t random = 18;
    static struct ray rays[PILE_RAYS];
    const struct recipe recipes[] = {{&random, SCATTERED, 1e-2, {0, 0, 0}, 1e6},
                                     {&random, SCATTERED, 1e-3, {9, 1, 7}, 1e6},
                                     {&random, MESH, 6, {0, 0, 0}, 0x1p40},
                                     {&random, LATTICE, 4, {0, 0, 0}, 0x1p40}};
    for (size_t i = 0; i < sizeof recipes / sizeof *recipes; i++) {
        struct scene *scene = random_scene(&recipes[i], 600, i % 2);
        struct bvh *bvh = build_tree(scene);
        assert_non_null(bvh_next(bvh));
        free(bvh);
        assert_true(compare_rays(&recipes[i], scene, 1500) > 1500 / 20);
        for (unsigned form = 0; form < 9; form++) {
            cluster_rays(&recipes[i], form, rays);
            compare_with_brute(scene, rays);
        }
        free(scene);
    }
}

/* Enough triangles for leaves of all sizes. */
static void test_meshes(void **state)
{
    uint64_t random = 16;
    compare_scenes((struct recipe){&random, MESH, 6, {0, 0, 0}, 0}, 6, 400, 1500);
    compare_scenes((struct recipe){&random, MESH, 3, {0x1p50, -0x1p50, 0}, 0}, 2, 100, 1000);
}

static void test_tiny_and_far_away(void **state)
{
    uint64_t random = 15;
    compare_scenes((struct recipe){&random, SCATTERED, 1e-9, {0, 0, 0}, 0}, 4, 50, 4000);
    compare_scenes((struct recipe){&random, SCATTERED, 1, {1e6, -1e6, 1e6}, 0}, 4, 50, 4000);
    compare_scenes((struct recipe){&random, SCATTERED, 1e9, {0, 0, 0}, 0}, 4, 50, 4000);
    compare_scenes((struct recipe){&random, SCATTERED, 1e-3, {1e9, 0, 0}, 0}, 4, 50, 4000);
}

/* ---- rules ---- */

static void test_duplicates(void **state)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (int i = 0; i < 40; i++)
        add_triangle(builder, vec3(0, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), 0);
    for (int i = 0; i < 40; i++)
        add_box(builder, vec3(2, 0, 0), vec3(3, 1, 1), 0);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    struct ray ray = ray_along(vec3(0.25, 0.25, -1), vec3(0, 0, 1));
    assert_int_equal(nearest_of(scene, bvh, &ray).primitive, 0);
    ray.origin.x = 2.25;
    assert_int_equal(nearest_of(scene, bvh, &ray).primitive, primitive_id(PRIMITIVE_BOX, 0));
    ray = ray_along(vec3(1, -1, 0.5), vec3(1, 1, 0)); /* into an edge: the lowest part */
    struct hit hit = nearest_of(scene, bvh, &ray);
    assert_int_equal(hit.primitive, primitive_id(PRIMITIVE_BOX, 0));
    assert_int_equal(hit.part, 0);
    free(bvh);
    free(scene);
}

static struct scene *single_sphere(double transmission)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 0.5, 0.25), transmission);
    add_sphere(builder, vec3(0, 0, 0), 1, 0);
    return finish_scene(builder);
}

static void test_t_max(void **state)
{
    struct scene *scene = single_sphere(0);
    struct bvh *bvh = build_tree(scene);
    struct ray ray = ray_along(vec3(-3, 0, 0), vec3(1, 0, 0));
    ray.t_max = 2;
    assert_int_equal(nearest_of(scene, bvh, &ray).primitive, PRIMITIVE_NONE);
    assert_true(isinf(nearest_of(scene, bvh, &ray).t));
    assert_vector_near(light_through(scene, bvh, &ray), vec3(1, 1, 1), 0);
    ray.t_max = nextafter(2, 3);
    assert_same(nearest_of(scene, bvh, &ray).t, 2);
    assert_vector_near(light_through(scene, bvh, &ray), vec3(0, 0, 0), 0);
    ray.t_max = (double)NAN;
    assert_int_equal(nearest_of(scene, bvh, &ray).primitive, PRIMITIVE_NONE);
    free(bvh);
    free(scene);
}

static void test_nonfinite_rays(void **state)
{
    struct scene *scene = single_sphere(0);
    struct bvh *bvh = build_tree(scene);
    const double odd[] = {(double)NAN, INFINITE, -INFINITE};
    for (int i = 0; i < 18; i++) {
        struct ray ray = ray_along(vec3(-3, 0, 0), vec3(1, 0, 0));
        double *numbers[] = {&ray.origin.x,    &ray.origin.y,    &ray.origin.z,
                             &ray.direction.x, &ray.direction.y, &ray.direction.z};
        *numbers[i / 3] = odd[i % 3];
        assert_int_equal(nearest_of(scene, bvh, &ray).primitive, PRIMITIVE_NONE);
        assert_vector_near(light_through(scene, bvh, &ray), vec3(1, 1, 1), 0);
    }
    free(bvh);
    free(scene);
}

static void test_light_through_glass(void **state)
{
    struct scene *scene = single_sphere(0.5);
    struct bvh *bvh = build_tree(scene);
    struct ray ray = ray_along(vec3(-3, 0, 0), vec3(1, 0, 0));
    assert_vector_near(light_through(scene, bvh, &ray), vec3(0.25, 0.0625, 0.015625), 0);
    ray.origin.x = 0; /* out only */
    assert_vector_near(light_through(scene, bvh, &ray), vec3(0.5, 0.25, 0.125), 0);
    ray = ray_along(vec3(-1, 0, 0), vec3(1, 0, 0)); /* the start does not count */
    ray.from = primitive_id(PRIMITIVE_SPHERE, 0);
    assert_vector_near(light_through(scene, bvh, &ray), vec3(0.5, 0.25, 0.125), 0);
    ray.direction.x = -1;
    assert_vector_near(light_through(scene, bvh, &ray), vec3(1, 1, 1), 0);
    free(bvh);
    free(scene);
}

/* More materials than fit without an allocation, met in an order that is not that of materials; a
 * batch, so that one ray's passages must not colour the next. */
static void test_many_transparent_materials(void **state)
{
    struct builder *builder = builder_create();
    struct vec3 expected = vec3(1, 1, 1);
    for (uint32_t i = 0; i < 100; i++) {
        struct vec3 color = vec3(1 - i * 0.001, 0.99, 1);
        add_material(builder, color, 0.98);
        for (int face = 0; face < 2; face++)
            expected = vec_mul(expected, vec_scale(color, 0.98));
    }
    for (uint32_t i = 0; i < 100; i++)
        add_sphere(builder, vec3(3.0 * i, 0, 0), 1, i * 37 % 100);
    struct scene *scene = finish_scene(builder);
    struct bvh *bvh = build_tree(scene);
    struct ray ray = ray_along(vec3(-3, 0, 0), vec3(1, 0, 0));
    struct ray rays[3] = {ray, ray, ray};
    rays[1].origin.y = 5;
    struct vec3 light[3];
    uint64_t exact = 0;
    occluded(scene, bvh, rays, 3, light, &exact);
    assert_memory_equal(&light[0], &expected, sizeof expected);
    assert_vector_near(light[1], vec3(1, 1, 1), 0);
    assert_memory_equal(&light[2], &expected, sizeof expected);
    free(bvh);
    free(scene);
}

static void test_empty_scene(void **state)
{
    struct scene *scene = finish_scene(builder_create());
    struct bvh *bvh = build_tree(scene);
    struct ray ray = ray_along(vec3(0, 0, 0), vec3(1, 2, 3));
    assert_int_equal(nearest_of(scene, bvh, &ray).primitive, PRIMITIVE_NONE);
    assert_vector_near(light_through(scene, bvh, &ray), vec3(1, 1, 1), 0);
    free(bvh);
    free(scene);
}

static void scale_vectors(struct vec3 *vectors, uint64_t count, double scale)
{
    for (uint64_t i = 0; i < count; i++)
        vectors[i] = vec_scale(vectors[i], scale);
}

/* A copy of the scene with all lengths scaled. */
static struct scene *scaled_scene(const struct scene *scene, double scale)
{
    struct scene *copy = malloc(scene->bytes);
    assert_non_null(copy);
    memcpy(copy, scene, scene->bytes);
    char *block = (char *)copy;
    const struct scene_span *spans = copy->primitives;
    struct sphere *spheres = (void *)(block + spans[PRIMITIVE_SPHERE].offset);
    struct box *boxes = (void *)(block + spans[PRIMITIVE_BOX].offset);
    struct cone *cones = (void *)(block + spans[PRIMITIVE_CONE].offset);
    struct disc *discs = (void *)(block + spans[PRIMITIVE_DISC].offset);
    struct plane *planes = (void *)(block + spans[PRIMITIVE_PLANE].offset);
    scale_vectors((void *)(block + copy->vertices.offset), copy->vertices.count, scale);
    for (uint64_t i = 0; i < spans[PRIMITIVE_SPHERE].count; i++) {
        scale_vectors(&spheres[i].center, 1, scale);
        spheres[i].radius *= scale;
    }
    for (uint64_t i = 0; i < spans[PRIMITIVE_BOX].count; i++)
        scale_vectors(&boxes[i].min, 2, scale);
    for (uint64_t i = 0; i < spans[PRIMITIVE_CONE].count; i++) {
        scale_vectors(&cones[i].base, 2, scale);
        cones[i].base_radius *= scale;
        cones[i].apex_radius *= scale;
    }
    for (uint64_t i = 0; i < spans[PRIMITIVE_DISC].count; i++) {
        scale_vectors(&discs[i].center, 1, scale);
        discs[i].radius *= scale;
    }
    for (uint64_t i = 0; i < spans[PRIMITIVE_PLANE].count; i++)
        scale_vectors(&planes[i].point, 1, scale);
    return copy;
}

static void test_scaling_by_powers_of_two(void **state)
{
    uint64_t random = 16;
    struct recipe recipe = {&random, SCATTERED, 10, {0, 0, 0}, 0};
    struct scene *scene = random_scene(&recipe, 100, true);
    struct bvh *bvh = build_tree(scene);
    /* Floats end at 2^128, the square and the cube of a length where doubles do. */
    static const int exponents[] = {-460, -345, -60, -36, -12, 12, 36, 60, 130, 345, 460};
    for (size_t e = 0; e < sizeof exponents / sizeof *exponents; e++) {
        int k = exponents[e];
        struct scene *scaled = scaled_scene(scene, ldexp(1, k));
        struct bvh *scaled_bvh = build_tree(scaled);
        for (int i = 0; i < 500; i++) {
            struct ray ray = ray_to(some_point(&recipe), some_point(&recipe));
            struct hit hit = nearest_of(scene, bvh, &ray), expected = hit;
            ray.origin = vec_scale(ray.origin, ldexp(1, k));
            hit = nearest_of(scaled, scaled_bvh, &ray);
            expected.t = ldexp(expected.t, k);
            assert_same_hit(&hit, &expected);
        }
        free(scaled_bvh);
        free(scaled);
    }
    free(bvh);
    free(scene);
}

/* The naive formulas agree where nothing is extreme. */
static void test_naive_formulas(void **state)
{
    uint64_t random = 20;
    struct recipe recipe = {&random, SCATTERED, 10, {0, 0, 0}, 0};
    struct scene *scene = random_scene(&recipe, 100, true);
    struct bvh *bvh = build_tree(scene);
    unsigned same = 0, all = 5000;
    for (unsigned i = 0; i < all; i++) {
        struct ray ray = ray_to(some_point(&recipe), some_point(&recipe));
        struct hit hit = nearest_of(scene, bvh, &ray);
        scene->view.formulas = FORMULAS_PAPER;
        struct hit naive = nearest_of(scene, bvh, &ray);
        scene->view.formulas = FORMULAS_EXACT;
        same += hit.primitive == naive.primitive && hit.part == naive.part &&
                (hit.t == naive.t || fabs(hit.t - naive.t) < 1e-6 * hit.t);
    }
    assert_true(same > all - 10);
    free(bvh);
    free(scene);
}

/* Through a cluster of opaque spheres and one of glass, by both formulas: whichever comes first, nothing passes. The
 * spheres are so small, and the clusters so far apart, that each has a tree. */
static void test_shadow_through_several_trees(void **state)
{
    for (unsigned glass = 0; glass < 2; glass++) {
        struct builder *builder = builder_create();
        uint32_t materials[] = {add_material(builder, vec3(1, 1, 1), 0),
                                add_material(builder, vec3(1, 1, 1), 0.5)};
        for (unsigned i = 0; i < 200; i++)
            add_sphere(builder, vec3(i % 2 * 1e6 + i * 0.01, 0, 0), 4e-3, materials[i % 2 ^ glass]);
        struct scene *scene = finish_scene(builder);
        struct bvh *bvh = build_tree(scene);
        struct ray ray = ray_along(vec3(-1, 0, 0), vec3(1, 0, 0));
        assert_non_null(bvh_next(bvh));
        for (unsigned paper = 0; paper < 2; paper++) {
            scene->view.formulas = paper ? FORMULAS_PAPER : FORMULAS_EXACT;
            assert_vector_near(light_through(scene, bvh, &ray), vec3(0, 0, 0), 0);
            assert_int_equal(nearest_of(scene, bvh, &ray).primitive,
                             primitive_id(PRIMITIVE_SPHERE, 0));
        }
        free(bvh);
        free(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scattered),
        cmocka_unit_test(test_face_before_a_way_out),
        cmocka_unit_test(test_lattice),
        cmocka_unit_test(test_piles),
        cmocka_unit_test(test_pipe),
        cmocka_unit_test(test_rods),
        cmocka_unit_test(test_clusters),
        cmocka_unit_test(test_meshes),
        cmocka_unit_test(test_tiny_and_far_away),
        cmocka_unit_test(test_duplicates),
        cmocka_unit_test(test_t_max),
        cmocka_unit_test(test_nonfinite_rays),
        cmocka_unit_test(test_light_through_glass),
        cmocka_unit_test(test_many_transparent_materials),
        cmocka_unit_test(test_empty_scene),
        cmocka_unit_test(test_scaling_by_powers_of_two),
        cmocka_unit_test(test_naive_formulas),
        cmocka_unit_test(test_shadow_through_several_trees),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
