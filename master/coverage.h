/*
 * A bitmap of the finished pixels of the rendered region: tiles of an earlier run may have been cut in another way than
 * those of this one.
 */
#ifndef FARM_MASTER_COVERAGE_H
#define FARM_MASTER_COVERAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/tile.h"

struct coverage {
    uint32_t width; /* of the region, pixels */
    uint64_t *bits; /* one per pixel, rows from the top; owned */
};

/* For a region of this size, in pixels; none is finished. */
void coverage_init(struct coverage *coverage, uint32_t width, uint32_t height);
void coverage_free(struct coverage *coverage);

/* Marks the tile's pixels, which lie in the region, as finished; returns how many of them were not yet. */
uint32_t coverage_add(struct coverage *coverage, const struct tile *tile);

/* Marks them as not finished; returns how many of them were. */
uint32_t coverage_remove(struct coverage *coverage, const struct tile *tile);

/* Whether this pixel of the region is finished. */
bool coverage_has(const struct coverage *coverage, uint32_t x, uint32_t y);

/* How many pixels of the tile, which lies in the region, are finished. */
uint32_t coverage_count(const struct coverage *coverage, const struct tile *tile);

#endif
