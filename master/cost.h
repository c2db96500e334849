/*
 * A map of what the parts of the picture cost, from probes: single samples, one per block of edge x
 * edge pixels, each with the CPU seconds that it took. Probes travel as tiles of their own
 * (TILE_PROBE in common/tile.h), a row of some blocks each.
 *
 * The map predicts work, in seconds of probing: proportional to what rendering takes. What a second
 * of it is in seconds of rendering depends on samples per pixel and on how much cheaper rays are
 * that keep together, and shows when the first tiles are back (master/pace.h).
 */
#ifndef FARM_MASTER_COST_H
#define FARM_MASTER_COST_H

#include <stdbool.h>
#include <stdint.h>

#include "common/tile.h"

struct cost_map {
    uint32_t width, height; /* of the picture, pixels */
    uint32_t edge;          /* of a block; 0: no map, every pixel costs 1 */
    uint32_t columns, rows; /* blocks that have a probe: the last ones may be narrower */
    uint32_t probe_blocks;  /* blocks of a probe tile, at most */
    uint32_t probes;        /* probe tiles */
    uint32_t blocks_known;  /* probes that are back */
    float *seconds;         /* per block, as probed; < 0: unknown */
    float *mean, *peak;     /* per block, work per pixel: smoothed, and the most around it */
};

/*
 * A map without knowledge: every pixel costs the same until cost_settle(). blocks: of a probe tile,
 * at least 1. Where the picture holds no probe, or edge is 0, there is no map: probes is 0.
 */
void cost_init(struct cost_map *map, uint32_t width, uint32_t height, uint32_t edge,
               uint32_t blocks);
void cost_free(struct cost_map *map);

/* Probe tile i < probes; its id is the caller's business. */
struct tile cost_probe(const struct cost_map *map, uint32_t i);

/* What the pixels of a probe tile took; false: one of them is below 0 or above SECONDS_MOST. Each is read once. */
bool cost_put(struct cost_map *map, const struct tile *probe, const float *seconds);

/* Makes predictions from the probes that are back, at least one. */
void cost_settle(struct cost_map *map);

struct cost {
    double work;  /* of all pixels */
    double worst; /* the same, if all cost what the dearest around costs */
};

/* What the w x h pixels at x, y are predicted to cost. */
struct cost cost_predict(const struct cost_map *map, uint32_t x, uint32_t y, uint32_t w,
                         uint32_t h);

#endif
