/*
 * What a tile costs: measured with the real renderer in this process, at every size of tile.
 *
 * The picture is rendered in square tiles of 1, 2, 4 .. 64 pixels, each timed on its own (CPU
 * seconds of the thread, the median of several rounds). A tile that is one of these has its own
 * measurement; any other is put together:
 *
 *     cost(tile) = fixed + spread(samples of the tile) * sum over its pixels of base(pixel)
 *
 * base: what 8 x 8 tiles cost, shared out among their pixels as the 1 x 1 tiles say.
 * spread: how much dearer the same pixels are in tiles of so many samples, because small waves fill
 * SIMD lanes badly: from the totals at all sizes, 1 at 8 x 8.
 *
 * That is of tiles whose pixels lie together. Rays of pixels that lie apart have little in common: shares of
 * cyclic pixels and of cyclic rows are measured as well, in the same minutes, and cost as many times what this
 * says as such shares of as many renderers did.
 */
#ifndef FARM_BENCH_BALANCE_COSTS_H
#define FARM_BENCH_BALANCE_COSTS_H

#include <stdbool.h>
#include <stdint.h>

#include "common/schedule.h"
#include "common/tile.h"

#define COST_LEVELS 7 /* edges 1 << level */
#define COST_BASE   3 /* the level that base is made of */

/* Schedules whose shares lie apart, and the most renderers for which these are measured. */
enum { APART_CYCLIC, APART_CYCLIC_ROWS, APART_SCHEDULES };
#define APART_MOST 44

struct tile_costs {
    uint32_t width, height; /* pixels that were measured */
    uint32_t samples;       /* per pixel */
    double fixed;           /* seconds that a tile costs whatever is in it */
    double totals[COST_LEVELS], spread[COST_LEVELS];
    float *levels[COST_LEVELS]; /* seconds per tile, rows from the top */
    /* By schedule and renderers: measured over told by the model; 0: not measured. */
    double apart[APART_SCHEDULES][APART_MOST + 1];
    double *base; /* seconds per pixel */
    double *sums; /* integral of base, (width + 1) x (height + 1) */
};

/* Measures config at this size, and shares of as many renderers as have their bit (1 << renderers) in the set.
 * rounds >= 1 is odd. */
void costs_measure(struct tile_costs *map, const char *config, uint32_t width, uint32_t height,
                   uint32_t samples, unsigned rounds, uint64_t renderers);

/* Of 2 to APART_MOST. */
#define APART_ALL ((UINT64_C(2) << APART_MOST) - 4)
void costs_free(struct tile_costs *map);

/* All that follows from width, height, samples and levels, which are set. */
void costs_derive(struct tile_costs *map);

/* Of that the sums, from base. */
void costs_integrate(struct tile_costs *map);

/* How much dearer the same pixels are in tiles of so many samples; see above. */
double costs_spread(const struct tile_costs *map, double samples);

/* Keeps a measurement in a file, and reads it back; false when there is none of this kind. */
void costs_save(const struct tile_costs *map, const char *path);
bool costs_read(struct tile_costs *map, const char *path);

/*
 * A picture of `scale` times the width and height of the map, in samples per pixel of its own: every
 * measured pixel stands for scale x scale of them. scale 1 and the measured samples: the map itself.
 */
struct run_costs;
struct picture_costs {
    const struct tile_costs *map;
    const struct tile_costs *single; /* the same picture with one sample per pixel: for probes */
    uint32_t scale, samples;
    uint32_t top; /* rows of the map that are left out above, and as many below */
    /* How many times as dear as those of the model tiles are, as costs_apart() tells; 0: once. */
    double apart;
    /* Not NULL: as in this run, whose map it is then; scale is 1, top 0. */
    const struct run_costs *run;
};

/* Seconds that a processor of speed 1 needs for the tile, which may be one of probes. */
double costs_of(const struct picture_costs *view, const struct tile *tile);

/* Seconds of all tiles of a renderer's share under a static schedule. */
double costs_of_share(const struct picture_costs *view, enum schedule schedule, uint32_t renderers,
                      uint32_t renderer);

/* How many times as dear this schedule's tiles are for so many renderers: 1 where they lie together. The program
 * ends when that should have been measured. */
double costs_apart(const struct tile_costs *map, enum schedule schedule, uint32_t renderers);

/* Seconds that it needs for a single sample of the pixel where it is traced alone. */
double costs_of_probe(const struct picture_costs *view, uint32_t x, uint32_t y);

/* Pixels. */
uint32_t costs_width(const struct picture_costs *view);
uint32_t costs_height(const struct picture_costs *view);

/* Seconds of the whole picture, as in tiles of 8 x 8: the work that is there to be shared. */
double costs_total(const struct picture_costs *view);

#endif
