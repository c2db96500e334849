/* Adaptive sampling of a small picture whose pixels come in as the test says, whatever the passes ask for. */
#ifndef FARM_TEST_ADAPTIVE_BY_HAND_FIXTURE_H
#define FARM_TEST_ADAPTIVE_BY_HAND_FIXTURE_H

#include <math.h>

#include "common/protocol.h"
#include "master/adaptive.h"
#include "test/adaptive_view_fixture.h"
#include "test/unit.h"

/* Wider than high. */
enum { WIDE = 24, HIGH = 8, ALL = WIDE * HIGH };

static inline struct tile columns(uint32_t x, uint32_t w)
{
    return (struct tile){.x = x, .w = w, .h = HIGH, .step = 1};
}

static const struct tile all = {.w = WIDE, .h = HIGH, .step = 1};

/* What comes in for the pixels of a tile. */
struct sent {
    float mean, more; /* of the first pixel; how much more it is from each one to the next */
    float difference;
    float rays[2]; /* per sample, of pixels in the left half of the picture and in the right one */
};

static inline void put(struct adaptive *adaptive, struct tile tile, struct sent sent,
                       double seconds)
{
    float part[REFINED_FLOATS * ALL];
    uint32_t pixels = adaptive_pixels(adaptive, &tile);
    struct pixel_floats to = pixel_floats(part, pixels, true);
    for (uint32_t k = 0; k < pixels; k++) {
        uint32_t x, y;
        tile_pixel(&tile, k, &x, &y);
        for (uint32_t c = 3 * k; c < 3 * k + 3; c++) {
            to.mean[c] = sent.mean + (float)k * sent.more;
            to.difference[c] = sent.difference;
        }
        to.spread[k] = fabsf(sent.difference); /* as at edges that 4 samples have met */
        to.rays[k] = sent.rays[x >= WIDE / 2];
    }
    adaptive_put(adaptive, &tile, part, seconds);
}

/* The error of each pixel where all are alike, and what its halves then differ by. It is the largest error of those
 * that master/allocation.c does not tell apart, so that passes come to what they aim at. */
#define EVEN  0.1249
#define APART (2 * (float)EVEN)

/* Pass 0 has come in: 4 samples of each pixel, all alike, in 1 s. */
static inline struct adaptive *begin_even(struct canvas *canvas, uint32_t max_samples,
                                          double target)
{
    struct view view = view_of(4, max_samples);
    canvas_init(canvas, WIDE, HIGH);
    struct adaptive *adaptive = adaptive_create(&view, canvas, target);
    put(adaptive, all, (struct sent){0.5f, 0, APART, {1, 1}}, 1);
    return adaptive;
}

/* The next pass doubles the samples of each pixel four times. DENSE: samples of a pixel after it; MORE: those that it
 * adds; LEFT: the part of the squared error that it leaves. */
#define DENSE 64
#define MORE  60
#define LEFT  (1.0 / 64)

#endif
