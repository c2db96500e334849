/*
 * A tile in, its pixels out: the Whitted ray tree of every sample, traced in waves.
 *
 * Many samples of a tile advance together until all of them are done: in every wave each unfinished sample
 * contributes one ray of its tree, and the wave's rays go through the intersection kernel as one batch, its
 * shadow rays as another. A sample's tree is expanded best-first (the ray that can still change the colour
 * most comes next) until all that is pending could change it by `cutoff` at most. There is no recursion,
 * and what a sample does depends on that sample alone, not on the tile or the batch it is in.
 */
#ifndef FARM_WORKER_RENDER_H
#define FARM_WORKER_RENDER_H

#include <stdbool.h>

#include "common/protocol.h"
#include "worker/bvh.h"
#include "worker/task.h"

/* One rendering thread's scratch memory; the scene and the BVH are only read. */
struct renderer;

/* scene and bvh must outlive the renderer. The caller frees it with renderer_destroy(). */
struct renderer *renderer_create(const struct scene *scene, const struct bvh *bvh);

/* The same in two steps: what takes longest needs no BVH. */
struct renderer *renderer_prepare(const struct scene *scene);
void renderer_begin(struct renderer *renderer, const struct bvh *bvh);

void renderer_destroy(struct renderer *renderer);

/* The scene that it was created for. */
const struct scene *renderer_scene(const struct renderer *renderer);

/*
 * Asks a function between waves, whose rays take some tens of microseconds, of a scene with a hundred thousand lights
 * a tenth of a second, whether to give up the tile; NULL: never.
 */
typedef bool renderer_interrupted(void *context);
void renderer_on_wave(struct renderer *renderer, renderer_interrupted *interrupted, void *context);

/*
 * Renders what the task says of a valid tile. *counts is set to what it cost. Returns false, with
 * nothing of use in the pixels and counts, when it was interrupted.
 */
bool renderer_task(struct renderer *renderer, const struct task *task,
                   struct render_counts *counts);

/* All pixels of a tile, min_samples each: 3 floats (linear RGB) per pixel in the tile's order. */
static inline bool renderer_tile(struct renderer *renderer, const struct tile *tile, float *rgb,
                                 struct render_counts *counts)
{
    struct task task = {.tile = tile, .to.mean = rgb};
    return renderer_task(renderer, &task, counts);
}

#endif
