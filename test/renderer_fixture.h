/* What tests and benches do with a renderer beside what the farm does. */
#ifndef FARM_TEST_RENDERER_FIXTURE_H
#define FARM_TEST_RENDERER_FIXTURE_H

#include "worker/render.h"

/* Both steps at once. */
static inline struct renderer *renderer_create(const struct scene *scene, const struct bvh *bvh)
{
    struct renderer *renderer = renderer_prepare(scene);
    renderer_begin(renderer, bvh);
    return renderer;
}

/* Renders all pixels of a tile with min_samples each: 3 floats (linear RGB) per pixel in the tile's order. */
static inline bool renderer_tile(struct renderer *renderer, const struct tile *tile, float *rgb,
                                 struct render_counts *counts)
{
    struct task task = {.tile = tile, .to.mean = rgb};
    return renderer_task(renderer, &task, counts);
}

#endif
