/*
 * A task: the samples of a tile to be rendered, pixel after pixel, and in each pixel the samples of its pass.
 *
 * The samples of even and of odd number form a pixel's two halves, A and B. They are placed independently of
 * each other (worker/sample.h), so that the difference of their means is an estimate of the error of their
 * mean: if each half holds half of the samples, the expectation of (A - B)^2 / 4 is exactly the mean squared error
 * of (A + B) / 2. That holds for any integrand, without any assumption about the samples within a half.
 */
#ifndef FARM_WORKER_TASK_H
#define FARM_WORKER_TASK_H

#include "common/protocol.h"
#include "common/refinement.h"
#include "common/tile.h"
#include "worker/color_sum.h"

/* A tile to be rendered, and where its pixels go; the memory is the caller's. */
struct task {
    const struct tile *tile;
    const struct refinement *refinements; /* one for each pixel, in order; NULL: level 0 to 1 */
    bool
        survey; /* render instead the first sample of every pixel, not for the picture; no refinements */
    struct pixel_floats to;
};

/* A position in the sequence of the task's samples. */
struct task_cursor {
    uint32_t pixel, sample;
    uint32_t begin, end; /* range of the pixel's samples in this task */
    uint32_t pixels;     /* number of pixels of the tile */
};

/* Sums over the samples of one pixel, added in order. */
struct pixel_sum {
    struct color_sum half[2];
    double squares; /* sum of the squares of all samples' components */
    double truncation;
    uint64_t rays; /* rays of all kinds */
};

static inline void cursor_enter(struct task_cursor *cursor, const struct task *task,
                                const struct view *view)
{
    if (task->survey) {
        cursor->sample = cursor->begin = 0;
        cursor->end = 1;
        return;
    }
    struct refinement refine = {0, 1};
    if (task->refinements) refine = task->refinements[cursor->pixel];
    cursor->sample = cursor->begin = level_samples(view, refine.from);
    cursor->end = level_samples(view, refine.to);
}

/* Moves on to the next pixel that gets samples, which may be the cursor's own. */
static inline void cursor_settle(struct task_cursor *cursor, const struct task *task,
                                 const struct view *view)
{
    while (cursor->pixel < cursor->pixels) {
        cursor_enter(cursor, task, view);
        if (cursor->sample < cursor->end) break;
        cursor->pixel++;
    }
}

/* Moves past the current sample; true if it was the pixel's last. Without refinements the next pixel has as
 * many samples. */
static inline bool cursor_advance(struct task_cursor *cursor, const struct task *task,
                                  const struct view *view)
{
    if (++cursor->sample < cursor->end) return false;
    cursor->pixel++;
    cursor->sample = cursor->begin;
    if (task->refinements) cursor_settle(cursor, task, view);
    return true;
}

/* The number of samples of all pixels. */
static inline uint64_t task_samples(const struct task *task, const struct view *view)
{
    uint32_t pixels = tile_pixels(task->tile);
    if (task->survey) return pixels;
    if (!task->refinements) return (uint64_t)pixels * level_samples(view, 1);
    uint64_t sum = 0;
    for (uint32_t k = 0; k < pixels; k++)
        sum += level_samples(view, task->refinements[k].to) -
               level_samples(view, task->refinements[k].from);
    return sum;
}

#endif
