/* A small view for tests that render: from z = 6 towards the origin, with one sample per pixel and no pruning; and a
 * scene that is ready to be rendered in it. */
#ifndef FARM_TEST_VIEW_FIXTURE_H
#define FARM_TEST_VIEW_FIXTURE_H

#include <stdlib.h>

#include "common/scene.h"
#include "master/builder.h"
#include "test/renderer_fixture.h"
#include "worker/bvh.h"

/* A view of edge x edge pixels. */
static inline struct view small_view(uint32_t edge)
{
    return (struct view){.camera = {.eye = {0, 0, 6},
                                    .forward = {0, 0, -1},
                                    .right = {0.5, 0, 0},
                                    .down = {0, -0.5, 0}},
                         .background_bottom = {0.1, 0.2, 0.3},
                         .background_top = {0.4, 0.5, 0.6},
                         .background_up = {0, 1, 0},
                         .width = edge,
                         .height = edge,
                         .region_w = edge,
                         .region_h = edge,
                         .max_depth = 20,
                         .shadows = 1,
                         .min_samples = 1,
                         .max_samples = 1};
}

/* Frees the builder. */
static inline struct scene *finish_in_view(struct builder *builder, const struct view *view)
{
    struct scene *scene = builder_finish(builder, view);
    builder_destroy(builder);
    return scene;
}

static inline struct bvh *tree_of(const struct scene *scene)
{
    return bvh_build(scene, aligned_alloc(BVH_ALIGNMENT, bvh_bytes_bound(scene)), 1);
}

struct prepared {
    struct scene *scene;
    struct bvh *bvh;
    struct renderer *renderer;
};

/* Frees the builder. */
static inline struct prepared prepare_scene(struct builder *builder, const struct view *view)
{
    struct prepared prepared = {.scene = finish_in_view(builder, view)};
    prepared.bvh = tree_of(prepared.scene);
    prepared.renderer = renderer_create(prepared.scene, prepared.bvh);
    return prepared;
}

static inline void prepared_free(struct prepared *prepared)
{
    renderer_destroy(prepared->renderer);
    free(prepared->bvh);
    free(prepared->scene);
}

#endif
