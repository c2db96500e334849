#include "worker/survey.h"

#include "common/clock.h"

static bool probe_pixel(struct renderer *renderer, uint32_t x, uint32_t y, float *rgb,
                        float *seconds)
{
    struct render_counts counts;
    struct tile pixel = {.x = x, .y = y, .w = 1, .h = 1, .step = 1};
    /* Not wall time: other processes may share the core. */
    double start = clock_thread_cpu();
    struct task task = {.tile = &pixel, .first = 1, .mean = rgb};
    if (!renderer_task(renderer, &task, &counts)) return false;
    *seconds = (float)(clock_thread_cpu() - start);
    return true;
}

bool survey(struct renderer *renderer, const struct tile *tile, float *rgb, float *seconds)
{
    uint32_t pixels = tile_pixels(tile);
    bool complete = true;
    for (uint32_t k = 0; k < pixels && complete; k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        complete = probe_pixel(renderer, x, y, rgb + 3 * (size_t)k, seconds + k);
    }
    return complete;
}
