/* Positions of the samples in a pixel, and the rays through them. */
#ifndef FARM_WORKER_SAMPLE_H
#define FARM_WORKER_SAMPLE_H

#include <stdint.h>

#include "worker/ray.h"
#include "worker/wave.h"

/*
 * Samples in work, at most WAVE: sample_put() puts each into a lane, sample number `sample` of pixel (x, y) of the
 * whole picture; then sample_rays() computes the rays from the eye through their positions, of unit length.
 *
 * A position lies in its pixel, less than 1 right of and below the pixel's top left corner. The samples of even and of
 * odd number are two low-discrepancy sequences, randomised independently of each other (see worker/task.h) and of those
 * of all other pixels. If a view has one sample per pixel, it is in the middle. Nothing else counts, so the picture is
 * the same whoever renders it, and more samples continue where fewer have ended.
 */
struct sample_lanes {
    uint32_t pixel_x[WAVE], pixel_y[WAVE], sample[WAVE];

    /* Used by sample_rays(). */
    lane_row x, y; /* positions in the whole picture, pixels from its top left corner */
    struct rows3 direction;
    lane_row sure;
};
void sample_put(struct sample_lanes *lanes, uint32_t i, uint32_t x, uint32_t y, uint32_t sample);
void sample_rays(const struct view *view, struct sample_lanes *lanes, uint32_t count,
                 struct ray *rays);

#endif
