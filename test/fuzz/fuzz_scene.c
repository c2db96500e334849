/*
 * Fuzzes the scene block as it arrives on another rank: damages a good one. If scene_valid() still accepts it,
 * everything in it must be accessible where its header says.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "test/fuzz/fuzz.h"

/* At least one of everything, so that every check is reached. */
static struct scene *good_scene(void)
{
    struct builder *builder = builder_create();
    struct material material = {.color = {1, 1, 1}, .diffuse = 1, .reflection = 0.5, .ior = 1};
    struct light light = {{1, 2, 3}, {1, 1, 1}};
    uint32_t m, v[3], n[3];
    builder_add_material(builder, &material, &m);
    for (int i = 0; i < 3; i++) {
        builder_add_vertex(builder, vec3(i, i * i, 1), &v[i]);
        builder_add_normal(builder, vec3(i, 1, 1), &n[i]);
    }
    builder_add_light(builder, &light);
    builder_add_triangle(builder, &(struct triangle){{v[0], v[1], v[2]}, m});
    builder_add_patch(builder, &(struct patch){{v[0], v[1], v[2]}, {n[0], n[1], n[2]}, m});
    builder_add_sphere(builder, &(struct sphere){{0, 0, 0}, 1, m, 0});
    builder_add_box(builder, &(struct box){.min = {0, 0, 0}, .max = {1, 1, 1}, .material = m});
    builder_add_cone(builder, &(struct cone){{0, 0, 0}, {0, 1, 0}, 1, 0, m, 1});
    builder_add_disc(builder, &(struct disc){.normal = {0, 1, 0}, .radius = 1, .material = m});
    builder_add_plane(builder, &(struct plane){.normal = {0, 0, 1}, .material = m});
    struct scene *scene = fuzz_finish(builder);
    builder_destroy(builder);
    return scene;
}

static void check_corners(const struct scene *scene, const uint32_t vertex[3])
{
    for (int i = 0; i < 3; i++)
        PROMISE(vec_is_finite(scene_vertices(scene)[vertex[i]]));
}

/* Reads everything that the kernel may read; the sanitizer detects reads outside of the block. */
static void use(const struct scene *scene)
{
    uint64_t primitives = 0;
    PROMISE(scene_features(scene) < 1u << FEATURE_COUNT);
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        for (uint32_t i = 0; i < scene->primitives[kind].count; i++, primitives++) {
            uint32_t material =
                primitive_material(scene, primitive_id((enum primitive_kind)kind, i));
            PROMISE(scene_materials(scene)[material].ior > 0);
        }
    PROMISE(primitives == scene_primitive_count(scene));
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_TRIANGLE].count; i++)
        check_corners(scene, scene_triangles(scene)[i].vertex);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_PATCH].count; i++) {
        check_corners(scene, scene_patches(scene)[i].vertex);
        for (int j = 0; j < 3; j++)
            PROMISE(vec_is_finite(scene_normals(scene)[scene_patches(scene)[i].normal[j]]));
    }
    for (uint64_t i = 0; i < scene->lights.count; i++)
        PROMISE(isfinite(scene_lights(scene)[i].color.x));
    const struct view *view = &scene->view;
    PROMISE((uint64_t)view->region_x + view->region_w <= view->width);
    PROMISE((uint64_t)view->region_y + view->region_h <= view->height);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct scene *good;
    if (!good) good = good_scene();
    size_t bytes = good->bytes;
    /* Of the exact size, so that the sanitizer detects reads beyond the end. */
    void *whole = allocate(bytes, 1);
    memcpy(whole, good, bytes);
    size_t kept = fuzz_damage(data, size, whole, bytes);
    void *block = allocate(kept, 1);
    memcpy(block, whole, kept);
    const char *why = NULL;
    if (scene_valid(block, kept, &why))
        use(block);
    else
        PROMISE(why && *why);
    free(whole);
    free(block);
    return 0;
}
