/* Shared by the tests of the kernel: makes scenes, one primitive at a time. */
#ifndef FARM_TEST_SCENE_FIXTURE_H
#define FARM_TEST_SCENE_FIXTURE_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/scene.h"
#include "master/builder.h"
#include "test/near.h"
#include "test/random.h"
#include "test/unit.h"
#include "worker/bvh.h"
#include "worker/kernel.h"
#include "worker/nearest.h"
#include "worker/shape.h"

static inline struct vec3 random_vector(uint64_t *state, double reach)
{
    double x = random_between(state, -reach, reach);
    double y = random_between(state, -reach, reach);
    return vec3(x, y, random_between(state, -reach, reach));
}

static inline struct ray ray_along(struct vec3 origin, struct vec3 direction)
{
    return (struct ray){origin, direction, INFINITE, PRIMITIVE_NONE, 0};
}

static inline struct ray ray_to(struct vec3 origin, struct vec3 target)
{
    return ray_along(origin, vec_sub(target, origin));
}

/* A ray that starts at a hit, on either side of the surface. */
static inline struct ray ray_going_on(struct vec3 point, const struct hit *hit,
                                      struct vec3 direction)
{
    return (struct ray){point, direction, INFINITE, hit->primitive, hit->part};
}

/* Goes on from this hit of the ray, in the same direction. */
static inline struct ray ray_from(const struct scene *scene, const struct ray *ray,
                                  const struct hit *hit)
{
    struct surface surface;
    surface_at(scene, ray, hit, &surface);
    return ray_going_on(surface.point, hit, ray->direction);
}

static inline void assert_vector_near(struct vec3 value, struct vec3 expected, double tolerance)
{
    assert_near(value.x, expected.x, tolerance);
    assert_near(value.y, expected.y, tolerance);
    assert_near(value.z, expected.z, tolerance);
}

/* Crossings ahead of the ray's origin. */
static inline unsigned count_ahead(const struct crossings *found)
{
    return (unsigned)(found->t[0] > 0) + (unsigned)(found->t[1] > 0);
}

static inline void assert_added(const char *why)
{
    if (why) fail_msg("%s", why);
}

static inline uint32_t add_material(struct builder *builder, struct vec3 color, double transmission)
{
    struct material material = {
        .color = color, .diffuse = 1, .transmission = transmission, .ior = 1};
    uint32_t index;
    assert_added(builder_add_material(builder, &material, &index));
    return index;
}

static inline uint32_t add_vertex(struct builder *builder, struct vec3 point)
{
    uint32_t index;
    assert_added(builder_add_vertex(builder, point, &index));
    return index;
}

static inline uint32_t add_normal(struct builder *builder, struct vec3 normal)
{
    uint32_t index;
    assert_added(builder_add_normal(builder, normal, &index));
    return index;
}

static inline void add_triangle(struct builder *builder, struct vec3 a, struct vec3 b,
                                struct vec3 c, uint32_t material)
{
    struct triangle triangle = {.material = material};
    triangle.vertex[0] = add_vertex(builder, a);
    triangle.vertex[1] = add_vertex(builder, b);
    triangle.vertex[2] = add_vertex(builder, c);
    assert_added(builder_add_triangle(builder, &triangle));
}

static inline void add_sphere(struct builder *builder, struct vec3 center, double radius,
                              uint32_t material)
{
    struct sphere sphere = {.center = center, .radius = radius, .material = material};
    assert_added(builder_add_sphere(builder, &sphere));
}

static inline void add_box(struct builder *builder, struct vec3 min, struct vec3 max,
                           uint32_t material)
{
    struct box box = {.min = min, .max = max, .material = material};
    assert_added(builder_add_box(builder, &box));
}

/* A bumpy sheet of 32 x 32 x 2 triangles that share their vertices, from -4 to 4 along two axes and from 0
 * to 1/4 along the third, which is `bumpy`. */
static inline void add_sheet(struct builder *builder, unsigned bumpy, uint32_t material)
{
    uint64_t random = 42;
    uint32_t corner[33][33];
    for (int i = 0; i < 33; i++)
        for (int k = 0; k < 33; k++) {
            double x = i / 4.0 - 4, y = k / 4.0 - 4, bump = random_between(&random, 0, 0.25);
            corner[i][k] = add_vertex(builder, bumpy == 2 ? vec3(x, y, bump) : vec3(x, bump, y));
        }
    for (int i = 0; i < 32; i++) {
        for (int k = 0; k < 32; k++) {
            struct triangle a = {{corner[i][k], corner[i + 1][k], corner[i][k + 1]}, material};
            struct triangle b = {{corner[i + 1][k], corner[i + 1][k + 1], corner[i][k + 1]},
                                 material};
            assert_added(builder_add_triangle(builder, &a));
            assert_added(builder_add_triangle(builder, &b));
        }
    }
}

/* The facets of a pipe of length 20, oblique to all axes, two triangles each. */
static inline void add_pipe(struct builder *builder, uint32_t facets, uint32_t material)
{
    const struct vec3 along = {9, 12, 13}, aside = {0.8, -0.6, 0}, up = {0.39, 0.52, -0.75};
    struct vec3 last = aside;
    for (uint32_t i = 1; i <= facets; i++) {
        double angle = i * (2 * acos(-1) / facets);
        struct vec3 next = vec_add(vec_scale(aside, cos(angle)), vec_scale(up, sin(angle)));
        struct vec3 far = vec_add(last, along), next_far = vec_add(next, along);
        add_triangle(builder, last, far, next_far, material);
        add_triangle(builder, last, next_far, next, material);
        last = next;
    }
}

/* Thin cylinders and cones, open and with caps, 20 long or less, in much the same direction across all axes. Their
 * bases are within `spread` of the origin on each axis. */
static inline void add_rods(struct builder *builder, uint32_t count, double spread,
                            uint32_t material)
{
    uint64_t random = 26;
    for (uint32_t i = 0; i < count; i++) {
        double length = random_between(&random, 0.8, 1);
        struct cone cone = {.base = random_vector(&random, spread),
                            .base_radius = 0.005,
                            .apex_radius = 0.005 * (i % 3) / 2,
                            .capped = i % 5 > 0,
                            .material = material};
        struct vec3 along = vec_add(vec3(9, 12, 13), random_vector(&random, 0.1));
        cone.apex = vec_add(cone.base, vec_scale(along, length));
        assert_added(builder_add_cone(builder, &cone));
    }
}

/* Finishes a scene with everything in it, including primitives that coincide with others. */
static inline struct scene *finish_scene(struct builder *builder)
{
    struct view view = {.camera = {.forward = {0, 0, 1}, .right = {1, 0, 0}, .down = {0, 1, 0}},
                        .background_up = {0, 1, 0},
                        .width = 1,
                        .height = 1,
                        .region_w = 1,
                        .region_h = 1,
                        .min_samples = 1,
                        .max_samples = 1,
                        .variant = VARIANT_FULL};
    struct scene *scene = builder_finish(builder, &view);
    builder_destroy(builder);
    return scene;
}

/*
 * A few triangles of random sizes, some of which share vertices. They fit into one leaf. One scene of three has a size
 * of 2^-`scale` to 2^`scale` instead of 1. Its distance from the origin is at most 2^`far` sizes.
 */
static inline struct scene *random_triangles(uint64_t *random, int scale, int far)
{
    struct builder *builder = builder_create();
    uint32_t grey = add_material(builder, vec3(1, 1, 1), 0), count = 1 + random_below(random, 12);
    int exponent = random_below(random, 3) > 0 ? 0 : random_exponent(random, -scale, scale);
    double size = ldexp(1, exponent);
    struct vec3 at = random_vector(random, ldexp(size, random_exponent(random, -4, far)));
    struct vec3 corner = vec_add(at, random_vector(random, size));
    for (uint32_t i = 0; i < count; i++) {
        double edge = ldexp(size, -(int)random_below(random, 6));
        struct vec3 b = vec_add(corner, random_vector(random, edge));
        struct vec3 c = vec_add(corner, random_vector(random, edge));
        add_triangle(builder, corner, b, c, grey);
        corner = random_below(random, 2) > 0 ? b : vec_add(at, random_vector(random, size));
    }
    return finish_scene(builder);
}

/* Builds a tree, which the caller frees, in memory full of garbage, another one each time: the tree must not depend on
 * its content. */
static inline struct bvh *build_tree_by(const struct scene *scene, unsigned threads)
{
    static unsigned char garbage = 0xa5;
    size_t bytes = bvh_bytes_bound(scene);
    void *memory = aligned_alloc(64, bytes);
    assert_non_null(memory);
    memset(memory, garbage++, bytes);
    return bvh_build(scene, memory, threads);
}

static inline struct bvh *build_tree(const struct scene *scene)
{
    return build_tree_by(scene, 1);
}

static inline void assert_same_hit(const struct hit *hit, const struct hit *expected)
{
    assert_int_equal(hit->primitive, expected->primitive);
    assert_int_equal(hit->part, expected->part);
    assert_memory_equal(&hit->t, &expected->t, sizeof hit->t);
    assert_memory_equal(&hit->u, &expected->u, sizeof hit->u);
    assert_memory_equal(&hit->v, &expected->v, sizeof hit->v);
}

/* Asserts that the result of nearest_rough() agrees with that of nearest(), `hit`. */
static inline void assert_rough_hit(const struct scene *scene, const struct ray *ray,
                                    const struct hit *rough, const struct hit *hit)
{
    struct hit settled = *rough;
    assert_int_equal(rough->primitive, hit->primitive);
    if (hit->primitive != PRIMITIVE_NONE) assert_int_equal(rough->part, hit->part);
    if (is_rough_hit(rough)) {
        assert_true(fabs(rough->t - hit->t) <= hit_t_error(rough));
        uint64_t exact = 0;
        settled = settled_hit(scene, ray, rough, &exact);
    }
    assert_same_hit(&settled, hit);
}

/* The nearest hit. Asserts that the kernels of all levels that this processor supports return the same bits. */
static inline struct hit nearest_of(const struct scene *scene, const struct bvh *bvh,
                                    const struct ray *ray)
{
    struct hit hit, other;
    uint64_t exact = 0;
    nearest(scene, bvh, ray, 1, &hit, &exact);
    for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        if (!processor_has(level)) continue;
        kernel_at(level)->nearest(scene, bvh, ray, 1, &other, &exact);
        assert_same_hit(&other, &hit);
        assert_int_equal(other.in_corner, hit.in_corner);
        kernel_at(level)->nearest_rough(scene, bvh, ray, 1, &other, &exact);
        assert_rough_hit(scene, ray, &other, &hit);
    }
    return hit;
}

/* Asserts that each level of the kernel finds these hits for the rays together. */
static inline void assert_hits(const struct scene *scene, const struct bvh *bvh,
                               const struct ray *rays, size_t count, const struct hit *expected)
{
    struct hit *hits = allocate(count, sizeof *hits);
    uint64_t exact = 0;
    for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        if (!processor_has(level)) continue;
        kernel_at(level)->nearest(scene, bvh, rays, count, hits, &exact);
        for (size_t i = 0; i < count; i++)
            assert_same_hit(&hits[i], &expected[i]);
    }
    free(hits);
}

static inline struct vec3 light_through(const struct scene *scene, const struct bvh *bvh,
                                        const struct ray *ray)
{
    struct vec3 light, other;
    uint64_t exact = 0;
    occluded(scene, bvh, ray, 1, &light, &exact);
    for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        if (!processor_has(level)) continue;
        kernel_at(level)->occluded(scene, bvh, ray, 1, &other, &exact);
        assert_memory_equal(&other, &light, sizeof other);
    }
    return light;
}

#endif
