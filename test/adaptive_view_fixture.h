/* The view of tests of adaptive sampling, and forecasts with its most samples. */
#ifndef FARM_TEST_ADAPTIVE_VIEW_FIXTURE_H
#define FARM_TEST_ADAPTIVE_VIEW_FIXTURE_H

#include <stdint.h>

#include "common/scene.h"
#include "master/adaptive_state.h"

enum { EDGE = 96, PIXELS = EDGE * EDGE };

/* The range of samples per pixel is the caller's. */
static inline struct view view_of(uint32_t min_samples, uint32_t max_samples)
{
    return (struct view){.width = EDGE,
                         .height = EDGE,
                         .region_w = EDGE,
                         .region_h = EDGE,
                         .min_samples = min_samples,
                         .max_samples = max_samples};
}

static inline double forecast_of(struct adaptive *adaptive, double rmse, double power)
{
    const struct levels *levels = &adaptive->statistics.levels;
    return adaptive_forecast(adaptive, rmse, power, (uint32_t)levels->samples[levels->last]);
}

#endif
