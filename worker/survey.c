#include "worker/survey.h"

#include "common/cpu_time.h"

static bool probe_pixel(struct renderer *renderer, uint32_t x, uint32_t y, float *rgb)
{
    struct render_counts counts;
    struct tile pixel = {.x = x, .y = y, .w = 1, .h = 1, .step = 1};
    struct task task = {.tile = &pixel, .survey = true, .to.mean = rgb};
    return renderer_task(renderer, &task, &counts);
}

/* Measures CPU time, not wall time: other processes may share the core. */
bool survey(struct renderer *renderer, const struct tile *tile, float *rgb, float *seconds)
{
    uint32_t pixels = tile_pixels(tile);
    struct cpu_time time = {0};
    for (uint32_t k = 0; k < pixels; k++) {
        uint32_t x, y;
        double ended;
        tile_pixel(tile, k, &x, &y);
        cpu_time_begin(&time);
        if (!probe_pixel(renderer, x, y, rgb + 3 * (size_t)k)) return false;
        seconds[k] = (float)cpu_time_end(&time, &ended);
    }
    return true;
}
