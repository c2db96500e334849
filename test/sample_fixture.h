/* Single samples, which the kernel takes many at a time. */
#ifndef FARM_TEST_SAMPLE_FIXTURE_H
#define FARM_TEST_SAMPLE_FIXTURE_H

#include "worker/sample.h"

/* The ray of one sample. offset: where it goes through its pixel, from the top left corner; NULL: not asked. */
static inline struct ray sample_ray(const struct view *view, uint32_t x, uint32_t y,
                                    uint32_t sample, double offset[2])
{
    struct sample_lanes lanes;
    struct ray ray;
    sample_put(&lanes, 0, x, y, sample);
    sample_rays(view, &lanes, 1, &ray);
    if (offset) {
        offset[0] = lanes.x[0] - x;
        offset[1] = lanes.y[0] - y;
    }
    return ray;
}

static inline void sample_position(const struct view *view, uint32_t x, uint32_t y, uint32_t sample,
                                   double offset[2])
{
    (void)sample_ray(view, x, y, sample, offset);
}

#endif
