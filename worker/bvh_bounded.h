/* The bounded primitives of a scene, that is all but planes, counted in order of kind and index. */
#ifndef FARM_WORKER_BVH_BOUNDED_H
#define FARM_WORKER_BVH_BOUNDED_H

#include <stdint.h>

#include "common/scene.h"

_Static_assert(PRIMITIVE_PLANE + 1 == PRIMITIVE_KINDS, "planes come last");

static inline uint64_t bounded_count(const struct scene *scene)
{
    return scene_primitive_count(scene) - scene->primitives[PRIMITIVE_PLANE].count;
}

/* The number of bounded primitives of the kinds before this one. */
static inline uint64_t bounded_before(const struct scene *scene, enum primitive_kind kind)
{
    uint64_t before = 0;
    for (enum primitive_kind k = 0; k < kind; k++)
        before += scene->primitives[k].count;
    return before;
}

/* The id of a bounded primitive; index < bounded_count(). */
static inline uint32_t bounded_id(const struct scene *scene, uint64_t index)
{
    enum primitive_kind kind = 0;
    for (; index >= scene->primitives[kind].count; kind++)
        index -= scene->primitives[kind].count;
    return primitive_id(kind, (uint32_t)index);
}

/* The id of the next bounded primitive, which must exist. */
static inline uint32_t bounded_id_after(const struct scene *scene, uint32_t id)
{
    enum primitive_kind kind = primitive_kind(id);
    if (primitive_index(id) + 1 < scene->primitives[kind].count) return id + 1;
    do
        kind++;
    while (scene->primitives[kind].count == 0);
    return primitive_id(kind, 0);
}

#endif
