/* Tests that coherent rays are traced in bundles and packets: the linker's --wrap redirects the kernel's calls for
 * these to this file, which counts them. */
#include "scene_fixture.h"

#include "worker/lanes.h"
#include "worker/packet.h"

#define RAYS 256

static unsigned taken, refused; /* rays */

bool __real_nearest_bundle(const struct nearest_batch *batch, const struct ray *rays,
                           unsigned packets, struct hit *hits);
bool __wrap_nearest_bundle(const struct nearest_batch *batch, const struct ray *rays,
                           unsigned packets, struct hit *hits);
bool __real_occluded_packet(const struct occlusion_batch *batch, const struct ray *rays,
                            struct vec3 *transmittance, lane_set *open);
bool __wrap_occluded_packet(const struct occlusion_batch *batch, const struct ray *rays,
                            struct vec3 *transmittance, lane_set *open);

static bool count(bool worth_it, unsigned rays)
{
    *(worth_it ? &taken : &refused) += rays;
    return worth_it;
}

bool __wrap_nearest_bundle(const struct nearest_batch *batch, const struct ray *rays,
                           unsigned packets, struct hit *hits)
{
    return count(__real_nearest_bundle(batch, rays, packets, hits), packets * LANES);
}

bool __wrap_occluded_packet(const struct occlusion_batch *batch, const struct ray *rays,
                            struct vec3 *transmittance, lane_set *open)
{
    return count(__real_occluded_packet(batch, rays, transmittance, open), LANES);
}

static struct scene *sheet(void)
{
    struct builder *builder = builder_create();
    add_sheet(builder, 2, add_material(builder, vec3(1, 1, 1), 0));
    return finish_scene(builder);
}

/* Rays towards a square of the sheet, in blocks of 8 x 4 like those of pixels. */
static void look(struct vec3 eye, double x, double y, double size, struct ray rays[RAYS])
{
    for (unsigned i = 0; i < RAYS; i++) {
        unsigned block = i / 32, column = i % 8 + 8 * (block % 2),
                 row = i / 8 % 4 + 4 * (block / 2);
        rays[i] = ray_to(eye, vec3(x + size * (column + 0.5) / 16, y + size * (row + 0.5) / 16, 0));
    }
}

static void check_taken(unsigned at_least)
{
    assert_true(taken >= at_least);
    taken = refused = 0;
}

static void trace_nearest(const struct scene *scene, const struct bvh *bvh,
                          const struct ray rays[RAYS], unsigned at_least)
{
    struct hit hits[RAYS];
    uint64_t exact = 0;
    nearest(scene, bvh, rays, RAYS, hits, &exact);
    check_taken(at_least);
}

static void trace_occluded(const struct scene *scene, const struct bvh *bvh, struct ray rays[RAYS])
{
    struct vec3 light[RAYS];
    uint64_t exact = 0;
    for (unsigned i = 0; i < RAYS; i++)
        rays[i].t_max = 0.5;
    occluded(scene, bvh, rays, RAYS, light, &exact);
    check_taken(RAYS);
}

static void check_eye(struct vec3 eye, double x, double y)
{
    struct scene *scene = sheet();
    struct bvh *bvh = build_tree(scene);
    struct ray rays[RAYS];
    look(eye, x, y, 0.8, rays);
    trace_nearest(scene, bvh, rays, RAYS);
    trace_occluded(scene, bvh, rays);
    for (unsigned i = 0; i < RAYS; i++) /* of many origins, as reflected ones are */
        rays[i].origin = vec_add_scaled(rays[i].origin, rays[i].direction, 0.001 * i);
    trace_nearest(scene, bvh, rays, RAYS);
    free(bvh);
    free(scene);
}

static void test_mesh_from_an_eye(void **state)
{
    check_eye(vec3(3, 2, 6), -2.1, -1.2);
}

/* In the middle of the picture some components of directions change their sign. */
static void test_straight_ahead(void **state)
{
    check_eye(vec3(0, 0, 6), -0.35, -0.45);
}

/* Rays in all directions are traced one by one. */
static void test_rays_apart(void **state)
{
    struct scene *scene = sheet();
    struct bvh *bvh = build_tree(scene);
    struct ray rays[RAYS];
    uint64_t random = 43;
    for (unsigned i = 0; i < RAYS; i++)
        rays[i] = ray_along(vec3(0, 0, 1), random_vector(&random, 1));
    struct hit hits[RAYS];
    uint64_t exact = 0;
    nearest(scene, bvh, rays, RAYS, hits, &exact);
    assert_int_equal(taken, 0);
    assert_true(refused < RAYS); /* bundles are not tried again and again */
    taken = refused = 0;
    free(bvh);
    free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mesh_from_an_eye),
        cmocka_unit_test(test_straight_ahead),
        cmocka_unit_test(test_rays_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
