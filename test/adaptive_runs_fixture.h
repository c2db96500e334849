/* Whole runs of adaptive sampling without any rays: the picture is a function of the place. */
#ifndef FARM_TEST_ADAPTIVE_RUNS_FIXTURE_H
#define FARM_TEST_ADAPTIVE_RUNS_FIXTURE_H

#include <math.h>
#include <stdlib.h>

#include "common/hash.h"
#include "common/message.h"
#include "master/adaptive.h"
#include "master/allocation.h"
#include "master/error.h"
#include "test/adaptive_view_fixture.h"
#include "test/halves.h"
#include "test/sample_fixture.h"
#include "test/unit.h"

typedef double scene_function(double x, double y);

/* A ball beside a soft sky. */
static inline double ball(double x, double y)
{
    return hypot(x - 40, y - 50) < 22.3 ? 0.8 - 0.01 * (x - 40) : 0.2 + 0.001 * y;
}

/* A wire a twentieth of a pixel thick across the whole picture: the first four samples meet it in one of five of its
 * pixels. */
static inline double wire_at(double x)
{
    return 20.3 + 0.37 * x;
}

static inline double wire(double x, double y)
{
    return fabs(y - wire_at(x)) < 0.025 * hypot(1, 0.37) ? 1 : 0.1;
}

/* A ball of a third of a pixel in every sixteenth pixel. */
static inline double balls(double x, double y)
{
    double u = fmod(x, 4) - 1.37, v = fmod(y, 4) - 2.61;
    return hypot(u, v) < 0.3 ? 1 : 0.2;
}

/* Chooses one of many pictures of those scenes whose things are scattered at random. */
static double draw;

/* Two random numbers from 0 to 1 that belong to a cell of a grid, whose last one is kept: neighbours ask for it. */
static inline void luck_of(double column, double row, double luck[2])
{
    static double cell[3] = {HUGE_VAL}, kept[2];
    if (cell[0] != column || cell[1] != row || cell[2] != draw) {
        cell[0] = column, cell[1] = row, cell[2] = draw;
        for (uint64_t i = 0; i < 2; i++)
            kept[i] = (double)(hash64(cell, sizeof cell, i) >> 11) * 0x1p-53;
    }
    luck[0] = kept[0], luck[1] = kept[1];
}

/* A disc with a radius of a sixth of a pixel at a random place in each square of 3 x 3 pixels. The first four samples
 * of pixels meet three in ten of them. */
static inline double scattered(double x, double y)
{
    double luck[2], column = floor(x / 3), row = floor(y / 3);
    luck_of(column, row, luck);
    double u = x - 3 * column - 0.2 - 2.6 * luck[0], v = y - 3 * row - 0.2 - 2.6 * luck[1];
    return u * u + v * v < 0.16 * 0.16 ? 1 : 0.2;
}

/* Seconds per effort of the passes after pass 0, in which it is 1. Other than what is assumed while there are none. */
#define SLOWER 1.7

/* Samples of each pixel after its last pass. */
static uint32_t sampled[PIXELS];

/* Renders what the pass asks for in a tile, in seconds that go with the effort. */
static inline void render_tile(struct adaptive *adaptive, const struct view *view,
                               scene_function *f, const struct tile *tile)
{
    uint32_t pixels = tile_pixels(tile), in = 0;
    double seconds = 0;
    struct refinement *refinements = allocate(pixels, sizeof *refinements);
    float *part = allocate(pixels, REFINED_FLOATS * sizeof *part);
    adaptive_refinements(adaptive, tile, refinements);
    uint32_t work = adaptive_pixels(adaptive, tile);
    struct pixel_floats to = pixel_floats(part, work, true);
    for (uint32_t k = 0; k < pixels; k++) {
        uint32_t begin = level_samples(view, refinements[k].from), x, y;
        uint32_t end = level_samples(view, refinements[k].to);
        if (begin == end) continue;
        tile_pixel(tile, k, &x, &y);
        sampled[y * EDGE + x] = end;
        struct halves halves = {{0, 0}, 0};
        for (uint32_t s = begin; s < end; s++) {
            double at[2];
            sample_position(view, x, y, s, at);
            halves_add(&halves, s, f(x + at[0], y + at[1]));
        }
        halves_tell(&halves, end - begin, in++, &to);
        seconds += pow(end - begin, EFFORT_POWER) * (begin > 0 ? SLOWER : 1);
    }
    adaptive_put(adaptive, tile, part, seconds);
    free(part);
    free(refinements);
}

/* A pass in tiles of this edge, from the first to the last or the other way round. */
static inline void render_pass(struct adaptive *adaptive, const struct view *view,
                               scene_function *f, uint32_t edge, bool backwards)
{
    uint32_t columns = (EDGE + edge - 1) / edge, tiles = columns * columns;
    for (uint32_t i = 0; i < tiles; i++) {
        uint32_t t = backwards ? tiles - 1 - i : i;
        uint32_t x = t % columns * edge, y = t / columns * edge;
        struct tile tile = {.x = x, .y = y, .step = 1};
        tile.w = x + edge < EDGE ? edge : EDGE - x;
        tile.h = y + edge < EDGE ? edge : EDGE - y;
        render_tile(adaptive, view, f, &tile);
    }
}

/* The outcome of a run. */
struct result {
    struct canvas canvas;
    struct adaptive *adaptive;
    unsigned passes;
    double samples; /* per pixel */
    double estimated, low, high;
};

static inline void estimate(struct result *result)
{
    uint64_t pixels, samples;
    struct error_breakdown breakdown = adaptive_errors(result->adaptive, &pixels, &samples);
    struct error_estimate estimate =
        error_estimate(&breakdown, pixels, ERROR_LOOK_PASS, result->passes);
    assert_int_equal(pixels, PIXELS);
    result->samples = (double)samples / PIXELS;
    result->estimated = estimate.rmse;
    result->low = estimate.low;
    result->high = estimate.high;
}

/* Renders all passes. */
static inline void run(struct result *result, scene_function *f, const struct view *view,
                       double target, uint32_t edge, bool backwards)
{
    canvas_init(&result->canvas, EDGE, EDGE);
    result->adaptive = adaptive_create(view, &result->canvas, target);
    do
        render_pass(result->adaptive, view, f, edge, backwards);
    while (adaptive_plan(result->adaptive, HUGE_VAL));
    result->passes = adaptive_passes(result->adaptive);
    estimate(result);
}

static inline void drop(struct result *result)
{
    adaptive_destroy(result->adaptive);
    canvas_free(&result->canvas);
}

#endif
