#include "worker/survey.h"

#include "common/clock.h"

static bool probe_pixel(struct renderer *renderer, uint32_t x, uint32_t y, float *rgb)
{
    struct render_counts counts;
    struct tile pixel = {.x = x, .y = y, .w = 1, .h = 1, .step = 1};
    struct task task = {.tile = &pixel, .survey = true, .mean = rgb};
    return renderer_task(renderer, &task, &counts);
}

/* By CPU time, not wall time: other processes may share the core. To read it is a call into the system, which
 * may take half as long as a probe: where one ends the next begins. */
bool survey(struct renderer *renderer, const struct tile *tile, float *rgb, float *seconds)
{
    uint32_t pixels = tile_pixels(tile);
    double begin = clock_thread_cpu();
    for (uint32_t k = 0; k < pixels; k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        if (!probe_pixel(renderer, x, y, rgb + 3 * (size_t)k)) return false;
        double end = clock_thread_cpu();
        seconds[k] = (float)(end - begin);
        begin = end;
    }
    return true;
}
