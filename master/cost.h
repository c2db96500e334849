/*
 * A map of what the parts of the picture cost, made from probes: single samples, one per block of edge x edge pixels,
 * each with the CPU seconds that it took. Probes are sent in tiles of their own (TILE_PROBE in common/tile.h), each a
 * row of some blocks.
 *
 * The map predicts work in seconds of probing, which is proportional to the seconds that rendering takes. Their ratio
 * depends on the samples per pixel and on how much cheaper coherent rays are; it is known when the first tiles are back
 * (master/pace.h).
 */
#ifndef FARM_MASTER_COST_H
#define FARM_MASTER_COST_H

#include <stdbool.h>
#include <stdint.h>

#include "common/tile.h"

struct cost_map {
    uint32_t width, height; /* of the picture, pixels */
    uint32_t edge;          /* pixels of a block's edge; 0: no map, every pixel costs 1 */
    uint32_t columns, rows; /* blocks that have a probe; the last ones may be narrower */
    uint32_t probe_blocks;  /* most blocks of a probe tile */
    uint32_t probes;        /* probe tiles */
    uint32_t blocks_known;  /* blocks whose probes are back */
    float *seconds;         /* per block: CPU seconds of its probe; < 0: unknown */
    float *mean, *peak;     /* per block, work per pixel: smoothed; largest around it */
};

/*
 * Creates a map that knows nothing: every pixel costs the same until cost_settle(). edge: of a block; blocks: of a
 * probe tile, at least 1. Where the picture is too small for a probe, or edge is 0, there is no map, and probes is 0.
 */
void cost_init(struct cost_map *map, uint32_t width, uint32_t height, uint32_t edge,
               uint32_t blocks);
void cost_free(struct cost_map *map);

/* The probe tile with number i < probes; its id is set by the caller. */
struct tile cost_probe(const struct cost_map *map, uint32_t i);

/* Takes in the seconds that each pixel of a probe tile took. false: one of them is below 0 or above SECONDS_MOST. Each
 * is read once, as it may be in memory that others can write. */
bool cost_put(struct cost_map *map, const struct tile *probe, const float *seconds);

/* Makes predictions from the probes that are back, of which there must be one at least. */
void cost_settle(struct cost_map *map);

struct cost {
    double work;  /* expected, of all pixels */
    double worst; /* if every pixel cost as much as the most expensive one around */
};

/* Predicts the cost of the w x h pixels at x, y. */
struct cost cost_predict(const struct cost_map *map, uint32_t x, uint32_t y, uint32_t w,
                         uint32_t h);

#endif
