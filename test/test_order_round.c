/* Several surfaces in one sphere, cylinder or cone: all rays agree on which of them comes first. */
#include "test/scene_fixture.h"
#include "worker/order.h"
#include "worker/primitive.h"

#define PILE  3  /* surfaces in one another */
#define CROWD 41 /* a bundle, a packet, and one */

/* What each kernel level finds for these rays together, and for each alone. */
static void nearest_of_all(const struct scene *scene, const struct bvh *bvh,
                           const struct ray rays[CROWD], struct hit hits[CROWD])
{
    uint64_t exact = 0;
    for (int i = 0; i < CROWD; i++)
        nearest(scene, bvh, &rays[i], 1, &hits[i], &exact);
    assert_hits(scene, bvh, rays, CROWD, hits);
}

/* Along each ray so much light comes through. */
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

/* Three surfaces of glass in one sphere, cylinder or cone, `far` from the origin; cylinders are of different
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

/* A random ray from around the axis that meets the surfaces, in some cases close to their outline. */
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

/* All rays go into the three surfaces and out of them in the same order. */
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

/* The ray that is reflected where this one has met a surface; reversed: it crosses surfaces in the reverse order. */
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

/* A ray that the second surface reflects meets the first one next; reflected by that, it meets the second one again. */
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

/* Two lengths of one open tube, so far from the origin that, for rounding, its other side counts as near a ray's start:
 * it is met all the same. */
static void test_tube_far_away(void **state)
{
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round),
        cmocka_unit_test(test_tube_far_away),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
