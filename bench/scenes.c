#include "bench/scenes.h"

#include <stdlib.h>

#include "common/message.h"

struct scene *scene_load(const char *path, const char *const *overrides, enum reach reach)
{
    struct job job;
    size_t count = 0;
    while (overrides[count])
        count++;
    char **copies = allocate(count, sizeof *copies);
    for (size_t i = 0; i < count; i++)
        copies[i] = copy_text(overrides[i]);
    bool loaded = load_job(path, copies, count, reach, &job);
    for (size_t i = 0; i < count; i++)
        free(copies[i]);
    free(copies);
    if (!loaded) return NULL;
    struct view view = settings_view(&job.settings);
    struct scene *scene = builder_finish(job.builder, &view);
    job_free(&job);
    return scene;
}

struct bvh *scene_tree(const struct scene *scene)
{
    void *memory = aligned_alloc(BVH_ALIGNMENT, bvh_bytes_bound(scene));
    if (!memory) fatal("no memory for a tree");
    return bvh_build(scene, memory, 1);
}

/* What becomes of a place and of a length. */
struct motion {
    double factor;
    struct vec3 by;
};

static void move_point(struct vec3 *p, const struct motion *motion)
{
    *p = vec_add(vec_scale(*p, motion->factor), motion->by);
}

/* Write access to what the accessors of common/scene.h return as const. */
static void *items(struct scene *scene, const struct scene_span *span)
{
    return (char *)scene + span->offset;
}

static void move_solids(struct scene *scene, const struct motion *motion)
{
    const struct scene_span *spans = scene->primitives;
    struct sphere *spheres = items(scene, &spans[PRIMITIVE_SPHERE]);
    for (uint64_t i = 0; i < spans[PRIMITIVE_SPHERE].count; i++) {
        move_point(&spheres[i].center, motion);
        spheres[i].radius *= motion->factor;
    }
    struct box *boxes = items(scene, &spans[PRIMITIVE_BOX]);
    for (uint64_t i = 0; i < spans[PRIMITIVE_BOX].count; i++) {
        move_point(&boxes[i].min, motion);
        move_point(&boxes[i].max, motion);
    }
    struct cone *cones = items(scene, &spans[PRIMITIVE_CONE]);
    for (uint64_t i = 0; i < spans[PRIMITIVE_CONE].count; i++) {
        move_point(&cones[i].base, motion);
        move_point(&cones[i].apex, motion);
        cones[i].base_radius *= motion->factor;
        cones[i].apex_radius *= motion->factor;
    }
}

void scene_move(struct scene *scene, double factor, struct vec3 by)
{
    const struct motion motion = {factor, by};
    move_point(&scene->view.camera.eye, &motion);
    struct vec3 *vertices = items(scene, &scene->vertices);
    for (uint64_t i = 0; i < scene->vertices.count; i++)
        move_point(&vertices[i], &motion);
    struct light *lights = items(scene, &scene->lights);
    for (uint64_t i = 0; i < scene->lights.count; i++)
        move_point(&lights[i].position, &motion);
    struct plane *planes = items(scene, &scene->primitives[PRIMITIVE_PLANE]);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_PLANE].count; i++)
        move_point(&planes[i].point, &motion);
    struct disc *discs = items(scene, &scene->primitives[PRIMITIVE_DISC]);
    for (uint64_t i = 0; i < scene->primitives[PRIMITIVE_DISC].count; i++) {
        move_point(&discs[i].center, &motion);
        discs[i].radius *= factor;
    }
    move_solids(scene, &motion);
}
