/*
 * What an earlier run has left, tile by tile, and how much of it counts in this one. Tiles may have been
 * cut in another way then: of those that are found only in part all pixels are rendered again. What
 * finished tiles cost and told is known of each as a whole; a part of one counts with its share of the
 * pixels.
 */
#ifndef FARM_MASTER_FOUND_H
#define FARM_MASTER_FOUND_H

#include <stdint.h>

#include "common/protocol.h"
#include "master/coverage.h"

/* A tile as it was cut then. */
struct found_tile {
    struct tile tile;
    double busy_s, cpu_s; /* that it took to render: wall, CPU */
    struct render_counts counts;
};

struct found {
    struct coverage used;   /* pixels that need no rendering */
    struct coverage unused; /* the other ones that were found */
    struct coverage all;    /* both */
    struct found_tile *tiles;
    size_t count;
};

/* For a region of so many pixels. */
void found_init(struct found *found, uint32_t width, uint32_t height);
void found_free(struct found *found);

/* Frees all but the coverage of all pixels that were found: nothing more is to be used or summed up. */
void found_close(struct found *found);

/* One more, which lies in the region; returns how many of its pixels had not been found yet. In passes
 * after the first, where those are 0, it counts as a whole. */
uint32_t found_add(struct found *found, const struct found_tile *tile);

/* How many pixels of a tile of this run were found. When all were, they count as used, and the tile is
 * not asked for again. */
uint32_t found_use(struct found *found, const struct tile *tile);

/* All pixels that were found count as used: nothing is asked for again, whatever tiles it came in. */
void found_use_all(struct found *found);

/* Sums over pixels that count once, each as the last tile tells that has it. */
struct found_sums {
    double busy_s, cpu_s;        /* of the pixels used, of all renderers together */
    double again_s;              /* wall seconds of the others */
    struct render_counts counts; /* of the pixels used; whole numbers are rounded up */
};

/* After all found_use(); once. */
struct found_sums found_sum(struct found *found);

#endif
