/*
 * The static schedules: every renderer's share of the picture is fixed before the start. A share
 * travels in tiles, bands of rows, that are numbered 0 .. ids - 1.
 *
 * strips       the paper's: the rows divided by the renderers, one extra row each to the first ones
 * cyclic       pixel number i (row by row) belongs to renderer i mod renderers
 * cyclic-rows  row number y belongs to renderer y mod renderers (Tachyon's)
 */
#ifndef FARM_MASTER_SHARE_H
#define FARM_MASTER_SHARE_H

#include <stdbool.h>

#include "common/schedule.h"
#include "common/tile.h"
#include "master/outlook.h"

struct share_config {
    enum schedule schedule; /* one of those above */
    uint32_t width, height; /* of the rendered region, pixels, at least 1 */
    uint32_t renderers;     /* at least 1 */
    /* Of a band; 0: as many as suit the size of a share. cyclic-rows: of a renderer's turn, 0: 1. */
    uint32_t rows;
};

/* The ids of one renderer's tiles: next, next + stride, ... below end. */
struct share_cursor {
    uint32_t next, end;
};

/* What is known of one renderer's share, or of all; pixels. */
struct share_work {
    double pixels;
    double finished, skipped; /* of these, in this run and in an earlier one */
    double seconds;           /* that the finished ones took */
};

struct shares {
    struct share_config config;
    uint64_t ids;         /* under cyclic some of them have no pixels */
    uint32_t stride;      /* between the ids of one renderer's share */
    uint32_t band_rows;   /* of each band but the last one (strips: of each strip) */
    uint32_t *strip_rows; /* strips: first row of each band, and the height behind the last */
    struct share_cursor *cursors; /* per renderer */
    struct share_work *work;      /* per renderer */
    struct share_work all;
    double answered;               /* when the last tile came back, seconds after the start */
    const unsigned char *finished; /* per id: not 0: is not handed out; the caller's, NULL: none */
};

/* More tiles than most: only ids is of use then. */
void shares_init(struct shares *shares, const struct share_config *config, uint64_t most);
void shares_free(struct shares *shares);

/* The tile of this id; one that begins behind its last pixel (share_has_pixels()) is none. */
struct tile share_tile(const struct shares *shares, uint32_t id);
bool share_has_pixels(const struct tile *tile);

/* Hands out the next tile of a renderer's share; false: there is none left. */
bool share_next(struct shares *shares, uint32_t renderer, struct tile *tile);

/* A tile is finished, now, which took so many seconds; or an earlier run has finished it. */
void share_finish(struct shares *shares, const struct tile *tile, double now, double seconds);
void share_skip(struct shares *shares, const struct tile *tile);

/* How much of the run is over. It ends with the share of which most is left: that is taken to go on as it did
 * so far and, for half a share's pixels cost what those of all shares do on average. */
struct outlook_share share_outlook(const struct shares *shares);

#endif
