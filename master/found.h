/*
 * What an earlier run has left in the journal, tile by tile, and how much of it is used in this run. Its tiles may have
 * been cut in another way: those of this run that are found only in part are rendered again as a whole. What a finished
 * tile cost and counted is known for the tile as a whole; a part of it counts with its share of the pixels.
 */
#ifndef FARM_MASTER_FOUND_H
#define FARM_MASTER_FOUND_H

#include <stdint.h>

#include "common/protocol.h"
#include "master/coverage.h"

/* A tile as the earlier run had cut it. */
struct found_tile {
    struct tile tile;
    double busy_s, cpu_s; /* wall and CPU seconds of rendering */
    struct render_counts counts;
};

struct found {
    struct coverage used;   /* pixels that need no rendering in this run */
    struct coverage unused; /* pixels that were found but are rendered again */
    struct coverage all;    /* used and unused ones */
    struct found_tile *tiles;
    size_t count;
    uint64_t pixels; /* that were found, each counted once */
};

/* Starts with nothing found in a region of this size. */
void found_init(struct found *found, uint32_t width, uint32_t height);
void found_free(struct found *found);

/* Frees everything but `all`: no more tiles are to be used or summed up. */
void found_close(struct found *found);

/* Adds a tile, which lies in the region; returns how many of its pixels had not been found yet. A tile of a pass after
 * the first returns 0, and counts as a whole. */
uint32_t found_add(struct found *found, const struct found_tile *tile);

/* Returns how many pixels of a tile of this run were found. If all were, they count as used, and the tile is not to be
 * rendered again. */
uint32_t found_use(struct found *found, const struct tile *tile);

/* Counts all pixels that were found as used: nothing is rendered again, in whatever tiles it was found. */
void found_use_all(struct found *found);

/* Sums over pixels. Each counts once, with the last of the tiles that contain it. */
struct found_sums {
    double busy_s, cpu_s;        /* of the pixels used, summed over all renderers */
    double repeated_s;           /* wall seconds of the unused ones */
    struct render_counts counts; /* of the pixels used; whole numbers are rounded up */
};

/* Must be called after all found_use(), and only once. */
struct found_sums found_sum(struct found *found);

#endif
