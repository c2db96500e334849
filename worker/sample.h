/* Where in a pixel its samples lie. */
#ifndef FARM_WORKER_SAMPLE_H
#define FARM_WORKER_SAMPLE_H

#include <stdint.h>

#include "worker/ray.h"
#include "worker/wave.h"

/*
 * Where sample number `sample` of pixel (x, y) of the whole picture lies: offsets from the pixel's
 * top left corner, each in [0, 1). Samples of even number and of odd number are two sequences of low
 * discrepancy, randomised independently of each other and of all other pixels' (worker/task.h says
 * what for); a view with one sample per pixel has it in the middle. Depends on nothing else, so
 * the picture is the same whoever renders it, and more samples go on where fewer have ended.
 */
void sample_position(const struct view *view, uint32_t x, uint32_t y, uint32_t sample,
                     double offset[2]);

/* The ray from the eye through that position. */
struct ray sample_ray(const struct view *view, uint32_t x, uint32_t y, uint32_t sample);

/* The same for many samples, WAVE at most: each is put into a lane before. */
struct sample_lanes {
    uint32_t pixel_x[WAVE], pixel_y[WAVE], sample[WAVE];

    /* Of sample_rays(). */
    lane_row x, y; /* in the whole picture, pixels from its top left corner */
    struct rows3 direction;
    lane_row sure;
};
void sample_put(struct sample_lanes *lanes, uint32_t i, uint32_t x, uint32_t y, uint32_t sample);
void sample_rays(const struct view *view, struct sample_lanes *lanes, uint32_t count,
                 struct ray *rays);

#endif
