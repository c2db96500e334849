/* Tests that rays in packets give the same bits as single rays, on every level of processor. */
#include "scene_fixture.h"

#include "common/processor.h"
#include "worker/primitive.h"

#define RAYS 256

/* Parameters of random rays, which packets accept or refuse. */
struct flock {
    struct vec3 eye;
    double spread;     /* of targets */
    double eye_spread; /* of origins */
    double size;       /* all coordinates' factor */
    struct vec3 (*target)(const struct scene *scene, uint64_t *random); /* NULL: anywhere */
};

static struct vec3 any_vertex(const struct scene *scene, uint64_t *random)
{
    return scene_vertices(scene)[random_below(random, (uint32_t)scene->vertices.count)];
}

/* A point on an edge up to rounding, often exactly. */
static struct vec3 edge_middle(const struct scene *scene, uint64_t *random)
{
    uint32_t index = random_below(random, (uint32_t)scene->primitives[PRIMITIVE_TRIANGLE].count);
    const struct triangle *triangle = &scene_triangles(scene)[index];
    const struct vec3 *at = scene_vertices(scene);
    return vec_scale(vec_add(at[triangle->vertex[0]], at[triangle->vertex[1]]), 0.5);
}

static struct ray flock_ray(const struct flock *flock, const struct scene *scene,
                            struct vec3 middle, uint64_t *random)
{
    struct vec3 target = vec_add(middle, random_vector(random, flock->spread));
    if (flock->target) target = flock->target(scene, random);
    struct vec3 eye = vec_add(flock->eye, random_vector(random, flock->eye_spread));
    return ray_to(vec_scale(eye, flock->size), vec_scale(target, flock->target ? 1 : flock->size));
}

/* Makes rays of which those of a packet, and those of a bundle, are close to each other. */
static void make_rays(const struct flock *flock, const struct scene *scene, uint64_t *random,
                      struct ray rays[RAYS])
{
    struct vec3 middle = vec3(0, 0, 0);
    for (int i = 0; i < RAYS; i++) {
        if (i % (i < RAYS / 2 ? 32 : 8) == 0) middle = random_vector(random, 3);
        rays[i] = flock_ray(flock, scene, middle, random);
        if (i % 16 >= 8) rays[i].t_max = random_between(random, 0.5, 1.5);
    }
}

static void check_nearest(const struct scene *scene, const struct bvh *bvh,
                          const struct ray rays[RAYS], struct hit hits[RAYS])
{
    uint64_t exact = 0;
    memset(hits, 0xa5, RAYS * sizeof *hits);
    nearest(scene, bvh, rays, RAYS, hits, &exact);
    for (int i = 0; i < RAYS; i++) {
        struct hit alone = nearest_of(scene, bvh, &rays[i]);
        assert_memory_equal(&hits[i], &alone, sizeof alone);
    }
    for (enum processor_level level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        struct hit rough[RAYS];
        if (!processor_has(level)) continue;
        kernel_at(level)->nearest_rough(scene, bvh, rays, RAYS, rough, &exact);
        for (int i = 0; i < RAYS; i++)
            assert_rough_hit(scene, &rays[i], &rough[i], &hits[i]);
    }
}

static void check_occluded(const struct scene *scene, const struct bvh *bvh,
                           const struct ray rays[RAYS])
{
    struct vec3 light[RAYS];
    uint64_t exact = 0;
    occluded(scene, bvh, rays, RAYS, light, &exact);
    for (int i = 0; i < RAYS; i++) {
        struct vec3 alone = light_through(scene, bvh, &rays[i]);
        assert_memory_equal(&light[i], &alone, sizeof alone);
    }
}

/* Replaces the rays by rays from their hits towards a light. */
static void leave_surfaces(const struct scene *scene, const struct hit hits[RAYS],
                           struct ray rays[RAYS], struct vec3 light)
{
    for (int i = 0; i < RAYS; i++) {
        if (hits[i].primitive == PRIMITIVE_NONE) continue;
        struct surface surface;
        surface_at(scene, &rays[i], &hits[i], &surface);
        rays[i] = ray_to(surface.point, light);
        rays[i].t_max = 1;
        rays[i].from = hits[i].primitive;
        rays[i].from_part = hits[i].part;
    }
}

/* Lets the rays end at their hits, up to some units in the last place. */
static void end_at_hits(const struct hit hits[RAYS], uint64_t *random, struct ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++)
        if (hits[i].primitive != PRIMITIVE_NONE)
            rays[i].t_max = hits[i].t * (1 + random_exponent(random, -3, 3) * 2 * UNIT_ROUNDOFF);
}

/* Lets the rays start at their hits, up to rounding, on either side. */
static void start_at_hits(const struct hit hits[RAYS], struct ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++)
        if (hits[i].primitive != PRIMITIVE_NONE)
            rays[i].origin = vec_add_scaled(rays[i].origin, rays[i].direction, hits[i].t);
}

/* Rays whose first crossing is close to one of their ends. */
static void check_ends(const struct scene *scene, const struct bvh *bvh,
                       const struct hit hits[RAYS], const struct ray rays[RAYS], uint64_t *random)
{
    struct ray close[RAYS];
    struct hit others[RAYS];
    memcpy(close, rays, sizeof close);
    end_at_hits(hits, random, close);
    check_occluded(scene, bvh, close);
    check_nearest(scene, bvh, close, others);
    memcpy(close, rays, sizeof close);
    start_at_hits(hits, close);
    check_occluded(scene, bvh, close);
    check_nearest(scene, bvh, close, others);
}

static void check_flock(const struct flock *flock, const struct scene *scene, const struct bvh *bvh,
                        uint64_t *random)
{
    struct ray rays[RAYS];
    struct hit hits[RAYS];
    for (int round = 0; round < 3; round++) {
        make_rays(flock, scene, random, rays);
        check_occluded(scene, bvh, rays);
        check_nearest(scene, bvh, rays, hits);
        check_ends(scene, bvh, hits, rays, random);
        leave_surfaces(scene, hits, rays, vec_scale(vec3(20, 30, 40), flock->size));
        check_occluded(scene, bvh, rays);
        check_nearest(scene, bvh, rays, hits);
    }
}

/* Frees the scene. */
static void check_scene(struct scene *scene, const struct flock *flock)
{
    uint64_t random = 31;
    struct bvh *bvh = build_tree(scene);
    for (uint32_t level = PROCESSOR_PORTABLE; level < PROCESSOR_LEVELS; level++) {
        if (!processor_has(level)) continue;
        scene->view.processor = level;
        check_flock(flock, scene, bvh, &random);
    }
    free(bvh);
    free(scene);
}

static const struct flock from_afar = {.eye = {9, 11, 14}, .spread = 0.1, .size = 1};
static const struct flock apart = {.eye = {9, 11, 14}, .spread = 0.5, .eye_spread = 0.2, .size = 1};

/* Rays whose components of directions have both signs in a bundle, and some are 0. */
static const struct flock both_ways[] = {
    {.eye = {0, 0, 14}, .spread = 1, .size = 1},
    {.eye = {0, 0, 14}, .spread = 1, .eye_spread = 0.2, .size = 1},
    {.eye = {0.1, 0.2, 0.3}, .spread = 0.3, .size = 1},
    {.eye = {0.1, 0.2, 0.3}, .spread = 0.3, .eye_spread = 0.2, .size = 1},
    {.eye = {0, 14, 0}, .target = any_vertex, .size = 1},
};

static struct builder *triangles(double size, double edge, double transmission, int count)
{
    uint64_t random = 41;
    struct builder *builder = builder_create();
    add_material(builder, vec3(0.9, 0.8, 0.7), transmission);
    add_material(builder, vec3(1, 1, 1), 0);
    for (int i = 0; i < count; i++) {
        struct vec3 p = random_vector(&random, 4 * size);
        struct vec3 q = vec_add(p, random_vector(&random, edge));
        add_triangle(builder, p, q, vec_add(p, random_vector(&random, edge)), i % 5 == 0);
    }
    return builder;
}

static struct builder *sheet(void)
{
    struct builder *builder = builder_create();
    add_sheet(builder, 1, add_material(builder, vec3(1, 1, 1), 0));
    return builder;
}

static void test_triangles(void **state)
{
    check_scene(finish_scene(triangles(1, 0.3, 0.5, 2000)), &from_afar);
    check_scene(finish_scene(triangles(1, 6, 0.5, 300)), &apart);
}

static void test_both_ways(void **state)
{
    for (size_t i = 0; i < sizeof both_ways / sizeof *both_ways; i++) {
        check_scene(finish_scene(triangles(1, 0.3, 0.5, 1000)), &both_ways[i]);
        check_scene(finish_scene(triangles(1, 6, 0.5, 300)), &both_ways[i]);
        check_scene(finish_scene(sheet()), &both_ways[i]);
    }
}

/* Long triangles, which have pieces in several leaves. */
static void test_pieces(void **state)
{
    check_scene(finish_scene(triangles(1, 8, 0.5, 2000)), &from_afar);
}

static void test_vertices_and_edges(void **state)
{
    struct flock flock = from_afar;
    flock.target = any_vertex;
    check_scene(finish_scene(sheet()), &flock);
    flock.target = edge_middle;
    check_scene(finish_scene(sheet()), &flock);
    check_scene(finish_scene(sheet()), &from_afar);
}

/* Rays of a packet whose directions have different longest components. */
static void test_wide(void **state)
{
    struct flock flock = {.eye = {-6, 6, -5}, .target = any_vertex, .size = 1};
    check_scene(finish_scene(sheet()), &flock);
    flock.target = edge_middle;
    check_scene(finish_scene(sheet()), &flock);
    flock.eye_spread = 0.2;
    check_scene(finish_scene(sheet()), &flock);
}

/* Rays with a component of the direction that is never of the other sign and mostly as small as this. */
static void check_slow(const struct scene *scene, const struct bvh *bvh, const struct flock *flock,
                       double least, uint64_t *random)
{
    struct ray rays[RAYS];
    struct hit hits[RAYS];
    make_rays(flock, scene, random, rays);
    for (int i = 0; i < RAYS; i++) {
        double *component = i < RAYS / 2 ? &rays[i].direction.x : &rays[i].direction.y;
        *component = i % 4 ? least : copysign(0.01 * *component, least);
    }
    check_occluded(scene, bvh, rays);
    check_nearest(scene, bvh, rays, hits);
}

static void test_slow(void **state)
{
    const double least[] = {0, -0.0, 1e-310, -1e-310, 1e-40, -1e-40, 1e-12, -1e-12};
    uint64_t random = 48;
    struct scene *scene = finish_scene(sheet());
    struct bvh *bvh = build_tree(scene);
    for (size_t i = 0; i < sizeof least / sizeof *least; i++)
        for (size_t k = 0; k < 2; k++)
            check_slow(scene, bvh, &both_ways[k], least[i], &random);
    free(bvh);
    free(scene);
}

static struct builder *coplanar(void)
{
    uint64_t random = 43;
    struct builder *builder = builder_create();
    add_material(builder, vec3(1, 1, 1), 0);
    for (int i = 0; i < 300; i++) {
        struct vec3 p = random_vector(&random, 4), q = random_vector(&random, 4);
        p.z = q.z = 1;
        struct vec3 r = vec3(q.y, p.x, 1);
        for (int k = 0; k < 1 + i % 3; k++)
            add_triangle(builder, p, q, r, 0);
    }
    return builder;
}

/* Of triangles in one plane, or in one place, the first one counts. */
static void test_coplanar(void **state)
{
    struct flock flock = from_afar;
    check_scene(finish_scene(coplanar()), &flock);
    flock.target = edge_middle;
    check_scene(finish_scene(coplanar()), &flock);
}

static void test_all_kinds(void **state)
{
    uint64_t random = 44;
    struct builder *builder = triangles(1, 0.5, 0.5, 500);
    struct plane plane = {.point = {0, -5, 0}, .normal = {0, 1, 0}, .material = 0};
    assert_added(builder_add_plane(builder, &plane));
    for (uint32_t i = 0; i < 300; i++) {
        struct vec3 p = random_vector(&random, 4);
        struct disc disc = {.center = p, .normal = {0.6, 0, 0.8}, .radius = 0.3};
        struct cone cone = {
            .base = p, .apex = {p.z, p.x, p.y}, .base_radius = 0.2, .capped = i % 2};
        add_sphere(builder, random_vector(&random, 4), 0.2, i % 2);
        add_box(builder, p, vec_add(p, vec3(0.2, 0.1, 0.3)), i % 2);
        assert_added(builder_add_disc(builder, &disc));
        assert_added(builder_add_cone(builder, &cone));
    }
    check_scene(finish_scene(builder), &from_afar);
}

static void add_planes(struct builder *builder, uint64_t *random, unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        struct plane plane = {.point = random_vector(random, 4),
                              .normal = i % 4 ? random_vector(random, 1) : vec3(0, 0, 1),
                              .material = i % 5 == 0};
        assert_added(builder_add_plane(builder, &plane));
    }
}

/* Most planes are transparent, so that rays pass several. There may be nothing else. */
static void test_planes(void **state)
{
    uint64_t random = 46;
    for (size_t i = 0; i < sizeof both_ways / sizeof *both_ways; i++) {
        struct builder *builder = triangles(1, 0.5, 0.5, i == 0 ? 0 : 50);
        add_planes(builder, &random, 1 + 5 * (unsigned)i);
        check_scene(finish_scene(builder), &both_ways[i]);
    }
}

static struct vec3 near_by(struct vec3 at, uint64_t *random)
{
    return vec_add(at, random_vector(random, 3));
}

/* Things around a point. Each is there two times, one of them transparent; boxes have a triangle in one of their
 * faces. */
static struct builder *doubles(struct vec3 at, uint64_t *random)
{
    struct builder *builder = builder_create();
    add_material(builder, vec3(0.9, 0.8, 0.7), 0.5);
    add_material(builder, vec3(1, 1, 1), 0);
    for (uint32_t i = 0; i < 20; i++) {
        struct vec3 p = near_by(at, random), q = near_by(at, random), r = near_by(at, random);
        struct vec3 top = vec_add(p, vec3(1, 1, 1));
        struct disc disc = {.center = q, .normal = {0.6, 0, 0.8}, .radius = 1};
        struct cone cone = {.base = p, .apex = q, .base_radius = 0.5, .capped = 1};
        struct plane plane = {.point = p, .normal = {0, 0.8, 0.6}};
        add_box(builder, p, top, 1);
        add_triangle(builder, top, vec3(p.x, top.y, top.z), vec3(top.x, p.y, top.z), 0);
        for (uint32_t k = 0; k < 2; k++) {
            plane.material = cone.material = disc.material = k;
            add_triangle(builder, p, q, r, k);
            add_sphere(builder, r, 1, k);
            assert_added(builder_add_disc(builder, &disc));
            assert_added(builder_add_cone(builder, &cone));
            if (i % 8 == 0) assert_added(builder_add_plane(builder, &plane));
        }
    }
    return builder;
}

/* Lets the rays go on from their hits almost along the surface, through it or not. */
static void graze(const struct scene *scene, const struct hit hits[RAYS], double slope,
                  struct ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++) {
        if (hits[i].primitive == PRIMITIVE_NONE) continue;
        struct surface surface;
        surface_at(scene, &rays[i], &hits[i], &surface);
        struct vec3 along = vec_cross(surface.geometric, vec3(0.3, 0.4, 0.5));
        rays[i] = ray_along(surface.point, vec_add_scaled(along, surface.geometric, slope));
        rays[i].t_max = 20;
        rays[i].from = hits[i].primitive;
        rays[i].from_part = hits[i].part;
    }
}

/* Rays that pass surfaces in one place at small angles, where rounding has them cross far from where they start, and
 * farther if their coordinates are large. */
static void test_grazing(void **state)
{
    uint64_t random = 47;
    for (int far = 0; far < 3; far++) {
        struct vec3 at = vec_scale(vec3(20, 30, 50), far > 0 ? pow(30, far) : 0);
        struct scene *scene = finish_scene(doubles(at, &random));
        struct bvh *bvh = build_tree(scene);
        struct ray rays[RAYS];
        struct hit hits[RAYS];
        for (int slope = -8; slope > -50; slope--) {
            make_rays(&from_afar, scene, &random, rays);
            for (int i = 0; i < RAYS; i++)
                rays[i].origin = vec_add(rays[i].origin, at);
            check_nearest(scene, bvh, rays, hits);
            for (int n = 0; n < 4; n++) {
                graze(scene, hits, ldexp(n < 2 ? 1 : -1, slope), rays);
                check_occluded(scene, bvh, rays);
                check_nearest(scene, bvh, rays, hits);
            }
        }
        free(bvh);
        free(scene);
    }
}

/* Scenes of all sizes up to the limit of boxes in float. */
static void test_sizes(void **state)
{
    const double sizes[] = {0x1p-60, 0x1p60, 1e-30, 1e37, 1e100, 1e-100};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        struct flock flock = from_afar;
        flock.size = sizes[i];
        check_scene(finish_scene(triangles(sizes[i], 0.5 * sizes[i], 0, 100)), &flock);
    }
}

/* Tiny triangles, so far away from the eye that a leaf's units are too small for floats, before large ones. */
static struct builder *tiny(void)
{
    struct builder *builder = triangles(1e-8, 1e-8, 0.5, 40);
    for (int i = 1; i < 20; i++)
        add_triangle(builder, vec3(-9, -9, -i), vec3(9, -9, -i), vec3(0, 9, -i), 0);
    return builder;
}

static void test_far_away(void **state)
{
    struct flock flock = from_afar;
    flock.target = any_vertex;
    check_scene(finish_scene(tiny()), &flock);
    flock.target = edge_middle;
    check_scene(finish_scene(tiny()), &flock);
    flock.eye_spread = 0.2;
    check_scene(finish_scene(tiny()), &flock);
}

static double odd_component(uint64_t *random)
{
    const double odd[] = {0,     -0.0, 0x1p-1074, -1e-310,     1e-300,   -1e300,
                          1e308, 1,    -1,        (double)NAN, HUGE_VAL, -HUGE_VAL};
    return odd[random_below(random, sizeof odd / sizeof *odd)];
}

/* Seen from far away, one behind the other, are two clusters so far from each other that each has a tree of its own. */
static const struct flock at_clusters = {
    .eye = {0, -3e6, 0}, .spread = 0.1, .eye_spread = 0.2, .size = 1};

static struct scene *two_clusters(double transmission)
{
    uint64_t random = 48;
    struct builder *builder = triangles(1, 0.3, transmission, 800);
    for (unsigned i = 0; i < 800; i++) {
        struct vec3 p = vec_add(vec3(0, 3e6, 0), random_vector(&random, 7));
        struct vec3 q = vec_add(p, random_vector(&random, 0.6));
        add_triangle(builder, p, q, vec_add(p, random_vector(&random, 0.6)), i % 5 == 0);
        if (i % 4 == 0) add_sphere(builder, p, 0.3, i % 8 == 0);
    }
    return finish_scene(builder);
}

/* Rays that go through several trees. What blocks a shadow ray may be in another tree than what the next one meets. */
static void test_several_trees(void **state)
{
    for (int i = 0; i < 2; i++) {
        struct scene *scene = two_clusters(i * 0.5);
        struct bvh *bvh = build_tree(scene);
        assert_non_null(bvh_next(bvh));
        free(bvh);
        check_scene(scene, &at_clusters);
    }
}

/* One unusual ray among similar ones. */
static void test_odd_rays(void **state)
{
    uint64_t random = 45;
    struct scene *scene = finish_scene(triangles(1, 1, 0.5, 500));
    struct bvh *bvh = build_tree(scene);
    struct ray rays[RAYS];
    struct hit hits[RAYS];
    for (int round = 0; round < 10; round++) {
        make_rays(&from_afar, scene, &random, rays);
        for (int i = 0; i < RAYS; i += 8) {
            struct ray *ray = &rays[i + (int)random_below(&random, 8)];
            double *place[] = {&ray->direction.x, &ray->direction.y, &ray->direction.z,
                               &ray->origin.x,    &ray->origin.y,    &ray->origin.z};
            *place[random_below(&random, round % 2 ? 6 : 3)] = odd_component(&random);
            if (vec_is_zero(ray->direction)) ray->direction.x = 0x1p-1074;
        }
        check_nearest(scene, bvh, rays, hits);
        check_occluded(scene, bvh, rays);
    }
    free(bvh);
    free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_triangles),
        cmocka_unit_test(test_pieces),
        cmocka_unit_test(test_vertices_and_edges),
        cmocka_unit_test(test_wide),
        cmocka_unit_test(test_slow),
        cmocka_unit_test(test_coplanar),
        cmocka_unit_test(test_all_kinds),
        cmocka_unit_test(test_planes),
        cmocka_unit_test(test_grazing),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_far_away),
        cmocka_unit_test(test_odd_rays),
        cmocka_unit_test(test_several_trees),
        cmocka_unit_test(test_both_ways),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
