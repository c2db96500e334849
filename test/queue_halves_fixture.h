/* Pictures whose left half costs a hundred times as much per pixel as the right one, as probes tell the queue. */
#ifndef FARM_TEST_QUEUE_HALVES_FIXTURE_H
#define FARM_TEST_QUEUE_HALVES_FIXTURE_H

#include "master/queue_parts.h"
#include "test/unit.h"

/* Answers a probe tile: pixels in the left half cost a hundred times as much as the others. */
static inline void probe_halves(struct queue *queue, const struct tile *probe, uint32_t width)
{
    float seconds[256];
    assert_true(tile_pixels(probe) <= 256);
    for (uint32_t k = 0; k < tile_pixels(probe); k++) {
        uint32_t x, y;
        tile_pixel(probe, k, &x, &y);
        seconds[k] = x < width / 2 ? 1e-4f : 1e-6f;
    }
    queue_probed(queue, probe, seconds);
}

/* Renderer 0 gets and answers probes until the queue predicts costs from them. */
static inline void settle_halves(struct queue *queue, uint32_t width)
{
    struct tile lot[LOT_TILES];
    uint32_t count;
    while ((count = queue_next(queue, 0, 0, lot)) > 0)
        for (uint32_t i = 0; i < count; i++) {
            if (lot[i].pass == TILE_PROBE) probe_halves(queue, &lot[i], width);
            queue_finish(queue, 0, lot[i].id, 1e-3, 1e-4);
            if (queue->settled) return;
        }
}

/* With answer_probes() only the left half of the first DEAR_WIDTH columns is expensive: so few pixels that one tile of
 * them is a large part of a renderer's share. */
#define DEAR_WIDTH 32

static inline void answer_probes(struct queue *queue, uint32_t renderer, const struct tile *probes,
                                 uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        probe_halves(queue, &probes[i], DEAR_WIDTH);
        queue_finish(queue, renderer, probes[i].id, 1e-3, 1e-3);
    }
}

#endif
