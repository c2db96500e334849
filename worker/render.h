/*
 * Renders the pixels of a tile: traces the Whitted ray tree of every sample, in waves.
 *
 * Many samples of a tile advance together until all of them are complete. In every wave each unfinished
 * sample contributes one ray of its tree. The rays of the wave go through the intersection kernel as one
 * batch, its shadow rays as another. A sample's tree is expanded best-first: the ray that can still change
 * the colour most comes next, until all pending rays together can change it by at most `cutoff`. There is no
 * recursion. What is computed for a sample depends on that sample alone, not on the tile or the batch that it
 * is in.
 */
#ifndef FARM_WORKER_RENDER_H
#define FARM_WORKER_RENDER_H

#include <stdbool.h>

#include "common/protocol.h"
#include "worker/bvh.h"
#include "worker/task.h"

/* The state of one rendering thread. The scene and the BVH are only read. */
struct renderer;

/* It is made in two steps: the first, which takes longest, does not need the BVH. scene and bvh must outlive it. */
struct renderer *renderer_prepare(const struct scene *scene);
void renderer_begin(struct renderer *renderer, const struct bvh *bvh);
void renderer_destroy(struct renderer *renderer);

/* The scene that the renderer was created for. */
const struct scene *renderer_scene(const struct renderer *renderer);

/*
 * Registers a function that is called before every wave and returns whether to give up the tile; NULL: none.
 * A wave takes some tens of microseconds, and a tenth of a second in a scene with a hundred thousand lights.
 */
typedef bool renderer_interrupted(void *context);
void renderer_on_wave(struct renderer *renderer, renderer_interrupted *interrupted, void *context);

/*
 * Renders the task, whose tile must be valid. *counts receives its costs. Returns false if it was
 * interrupted; pixels and counts are then undefined.
 */
bool renderer_task(struct renderer *renderer, const struct task *task,
                   struct render_counts *counts);

#endif
