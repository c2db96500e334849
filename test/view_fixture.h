/* A small view for tests that render: from z = 6 towards the origin, with one sample per pixel and no pruning. */
#ifndef FARM_TEST_VIEW_FIXTURE_H
#define FARM_TEST_VIEW_FIXTURE_H

#include "common/scene.h"

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

#endif
