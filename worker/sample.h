/* Positions of the samples in a pixel, and the rays through them. */
#ifndef FARM_WORKER_SAMPLE_H
#define FARM_WORKER_SAMPLE_H

#include <stdint.h>

#include "worker/ray.h"
#include "worker/wave.h"

/*
 * The position of sample number `sample` of pixel (x, y) of the whole picture: offsets from the pixel's top
 * left corner, each in [0, 1). The samples of even and of odd number are two low-discrepancy sequences,
 * randomised independently of each other (see worker/task.h) and of those of all other pixels. If a view has
 * one sample per pixel, it is in the middle. The position depends on nothing else, so the picture is the same
 * whoever renders it, and more samples continue where fewer have ended.
 */
void sample_position(const struct view *view, uint32_t x, uint32_t y, uint32_t sample,
                     double offset[2]);

/* The ray from the eye through that position; its direction has unit length. */
struct ray sample_ray(const struct view *view, uint32_t x, uint32_t y, uint32_t sample);

/* The same for many samples, at most WAVE: sample_put() puts each into a lane, then sample_rays() computes
 * all rays. */
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
