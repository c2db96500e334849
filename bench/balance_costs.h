/*
 * The costs of tiles of any size, measured with the real renderer in this process.
 *
 * The picture is rendered in square tiles of 1, 2, 4 .. 64 pixels, each timed on its own (CPU seconds of the
 * thread, the median of several rounds). A tile that is one of these has its own measurement; the cost of any
 * other is modelled as
 *
 *     cost(tile) = fixed + spread(samples of the tile) * sum over its pixels of base(pixel)
 *
 * base: the cost of 8 x 8 tiles, distributed among their pixels in proportion to the 1 x 1 tiles.
 *
 * spread: how much more expensive the same pixels are in tiles of so many samples, because small waves fill SIMD
 * lanes badly; from the totals at all sizes, 1 at 8 x 8.
 *
 * This holds for tiles whose pixels are adjacent. Rays of distant pixels have little in common: shares of cyclic
 * pixels and of cyclic rows are measured as well, in the same minutes. Their cost is that of the model times the
 * measured ratio for such shares of as many renderers.
 */
#ifndef FARM_BENCH_BALANCE_COSTS_H
#define FARM_BENCH_BALANCE_COSTS_H

#include <stdbool.h>
#include <stdint.h>

#include "common/tile.h"
#include "master/schedule.h"

#define COST_LEVELS 7 /* edges 1 << level */
#define COST_BASE   3 /* the level from which base is derived */

/* Schedules whose shares consist of distant pixels, and the most renderers for which these are measured. */
enum { APART_CYCLIC, APART_CYCLIC_ROWS, APART_SCHEDULES };
#define APART_MOST 44

struct tile_costs {
    uint32_t width, height; /* size of the picture that was measured, pixels */
    uint32_t samples;       /* per pixel */
    double fixed;           /* seconds that a tile costs independently of its content */
    double totals[COST_LEVELS], spread[COST_LEVELS];
    float *levels[COST_LEVELS]; /* seconds per tile, rows from the top */
    /* By schedule and renderers: ratio of measured to modelled cost; 0: not measured. */
    double apart_ratio[APART_SCHEDULES][APART_MOST + 1];
    double *base; /* seconds per pixel */
    double *sums; /* integral of base, (width + 1) x (height + 1) */
};

/* Measures config at this size, and shares for each number of renderers whose bit (1 << number) is set. rounds
 * >= 1 is odd. */
void costs_measure(struct tile_costs *map, const char *config, uint32_t width, uint32_t height,
                   uint32_t samples, unsigned rounds, uint64_t renderers);

/* The bits of 2 to APART_MOST renderers. */
#define APART_ALL ((UINT64_C(2) << APART_MOST) - 4)
void costs_free(struct tile_costs *map);

/* Computes all members that follow from width, height, samples and levels, which are set. */
void costs_derive(struct tile_costs *map);

/* The same for the sums alone, from base. */
void costs_integrate(struct tile_costs *map);

/* The factor spread for tiles of so many samples; see above. */
double costs_spread(const struct tile_costs *map, double samples);

/* Writes a measurement to a file, and reads it back; false when there is none of this kind. */
void costs_save(const struct tile_costs *map, const char *path);
bool costs_read(struct tile_costs *map, const char *path);

/*
 * A picture of `scale` times the width and height of the map, with its own number of samples per pixel: every
 * measured pixel stands for scale x scale pixels. With scale 1 and the measured samples it is the map itself.
 */
struct run_costs;
struct record;
struct picture_costs {
    const struct tile_costs *map;
    const struct tile_costs *single; /* the same picture with one sample per pixel: for probes */
    uint32_t scale, samples;
    uint32_t top; /* rows of the map that are left out at the top, and as many at the bottom */
    /* Factor on the modelled costs, as costs_apart_ratio() returns it; 0: 1. */
    double apart_ratio;
    /* Not NULL: costs are those of this run, whose map it is then; scale is 1, top 0. */
    const struct run_costs *run;
    /* Not NULL: costs are those of this adaptive run but for probes; scale is 1, top 0. */
    const struct record *record;
};

/* Seconds that a processor of speed 1 needs for the tile, which may be a probe tile. */
double costs_of(const struct picture_costs *view, const struct tile *tile);

/* Seconds of all tiles of a renderer's share under a static schedule. */
double costs_of_share(const struct picture_costs *view, enum schedule schedule, uint32_t renderers,
                      uint32_t renderer);

/* The ratio of costs of this schedule's tiles for so many renderers to the model: 1 where pixels are adjacent.
 * Ends the program if it should have been measured and was not. */
double costs_apart_ratio(const struct tile_costs *map, enum schedule schedule, uint32_t renderers);

/* Seconds that such a processor needs for a single sample of the pixel if it is traced alone. */
double costs_of_probe(const struct picture_costs *view, uint32_t x, uint32_t y);

/* Size of the picture in pixels. */
uint32_t costs_width(const struct picture_costs *view);
uint32_t costs_height(const struct picture_costs *view);

/* Seconds of the whole picture in tiles of 8 x 8: the work that there is to distribute. */
double costs_total(const struct picture_costs *view);

#endif
