/*
 * Keeps what is finished: what an earlier run left in its journal comes into the picture, and what
 * this one finishes goes into the journal, by a thread of its own, so that a slow disk holds nobody
 * up.
 *
 *   save_open() --> save_use() ... --> save_start() --> save_tile() ... --> save_keep() or
 *                                                                              save_drop()
 *
 * A tile is in the file within a few hundredths of a second; in the first second none is, so that short runs write
 * nothing. What has not been written when the run ends in order is written then.
 */
#ifndef FARM_MASTER_SAVE_H
#define FARM_MASTER_SAVE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/protocol.h"
#include "common/scene.h"
#include "master/adaptive.h"
#include "master/canvas.h"
#include "master/found.h"

/* What an earlier run has left. */
struct save_found {
    uint64_t records; /* good ones in the journal */
    uint64_t pixels;  /* each counted once */
};

struct save;

/*
 * Opens the journal at path for this scene and puts what it holds into the canvas, which outlives the
 * result, or, where sampling is adaptive, through adaptive_put() pass by pass: each pass is planned
 * again from the one before, by the limit that its records tell, and a record counts if it has just what
 * that plan asks for. NULL after user_error() (journal_open()).
 */
struct save *save_open(const char *path, const struct scene *scene, struct canvas *canvas,
                       struct adaptive *adaptive);

const struct save_found *save_found(const struct save *save);

/* Whether the journal held nothing when it was opened: nothing is lost with it before save_start(). */
bool save_was_empty(const struct save *save);

/* How many pixels of a tile were found, as found_use(); until save_start(). */
uint32_t save_use(struct save *save, const struct tile *tile);

/* All that was found counts as used, as found_use_all(); until save_start(). */
void save_use_all(struct save *save);

/* What that comes to, as found_sum(); once, until save_start(). */
struct found_sums save_used(struct save *save);

/* Pixels that an earlier run has left, also those that are rendered again with the rest of their tiles; as long
 * as the save lives. NULL where save is. */
const struct coverage *save_there(const struct save *save);

/* Whether there is room for so many tiles and pixels more; false after user_error(). */
bool save_has_room(const struct save *save, uint32_t tiles, uint64_t pixels);

/* From now on tiles are taken: about so many, of so many pixels together. */
void save_start(struct save *save, uint32_t tiles, uint64_t pixels);

/*
 * A tile is finished: its pixels are in the canvas and stay as they are. Any thread; save may be
 * NULL: nothing is kept.
 */
void save_tile(struct save *save, const struct tile *tile, const struct result_header *header);

/*
 * The same where sampling is adaptive, before adaptive_put() with the same part, which is copied: later
 * passes change the canvas.
 */
void save_part(struct save *save, const struct tile *tile, const struct result_header *header,
               const float *part);

/* What save_keep() has made of it. */
struct save_kept {
    char *path;    /* of the journal, for the caller to free */
    bool moved;    /* another one than asked for, because nothing could be written there */
    uint64_t lost; /* tiles that could be written nowhere */
    uint64_t lost_pixels;
    double lost_s; /* what they took to render */
};

/*
 * Writes what is not written yet and leaves the journal for the next run. When its folder is full or
 * gone, tries the current folder and those for temporary files. Ends the save.
 */
struct save_kept save_keep(struct save *save);

/* Removes the journal: the picture is safely written. Ends the save; NULL: nothing. */
void save_drop(struct save *save);

#endif
