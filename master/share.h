/*
 * The static schedules: every renderer's share of the picture is fixed before the start. A share is sent in tiles,
 * bands of rows, numbered 0 .. ids - 1.
 *
 * strips       the paper's: rows are divided among the renderers, the first ones get one more row each where needed
 * cyclic       pixel number i (row by row) belongs to renderer i mod renderers
 * cyclic-rows  row number y belongs to renderer y mod renderers (Tachyon's)
 */
#ifndef FARM_MASTER_SHARE_H
#define FARM_MASTER_SHARE_H

#include <stdbool.h>

#include "common/tile.h"
#include "master/outlook.h"
#include "master/queue.h"

/* The ids of one renderer's tiles: next, next + stride, ... while below end. */
struct share_cursor {
    uint32_t next, end;
};

/* What is known of one renderer's share, or of all shares, of which pixels and skipped are not needed; in pixels. */
struct share_work {
    double pixels;
    double finished, skipped; /* of these: finished in this run, and in an earlier one */
    double seconds;           /* that the finished pixels took */
};

struct shares {
    /* tile_edge: rows of a band; 0: chosen by the size of a share (share.c). cyclic-rows: rows of a turn; 0: 1. */
    struct queue_config config;
    uint64_t ids;       /* under cyclic some of them have no pixels */
    uint32_t stride;    /* between the ids of one renderer's share */
    uint32_t band_rows; /* of each band but the last one (strips: of each strip) */
    /* strips: first row of each band, and after the last one the height; else NULL. */
    uint32_t *strip_rows;
    struct share_cursor *cursors; /* per renderer */
    struct share_work *work;      /* per renderer */
    struct share_work all;
    double last_result_s; /* seconds from the start to the last result */
    bool *finished;       /* per id; what is finished is not handed out */
};

/* Sets up the shares under one of these schedules, with no work done. If there are more than QUEUE_MAX_TILES tiles,
 * only ids is valid. */
void share_init(struct shares *shares, const struct queue_config *config);
void share_free(struct shares *shares);

/* The tile of this id. If it begins after the last pixel of its band (share_has_pixels() is false), it has no
 * pixels. */
struct tile share_tile(const struct shares *shares, uint32_t id);
bool share_has_pixels(const struct tile *tile);

/* Hands out the next tile of a renderer's share. false: there is none left. */
bool share_next(struct shares *shares, uint32_t renderer, struct tile *tile);

/* Counts a tile as finished, or as finished by an earlier run. now: the time when it came in, seconds since the start;
 * seconds: of rendering it. */
void share_finish(struct shares *shares, const struct tile *tile, double now, double seconds);
void share_skip(struct shares *shares, const struct tile *tile);

/* How much of the run is over. It ends with the share that has most to do. A pixel that is left of a share is expected
 * to take the mean of what its own finished pixels and those of all shares took, where the latter mean counts as much
 * as half of the share's pixels. */
struct outlook_share share_outlook(const struct shares *shares);

#endif
