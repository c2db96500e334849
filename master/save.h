/*
 * Saves finished tiles. What an earlier run left in its journal is put into the picture, and what this run
 * finishes goes into the journal, written by a thread of its own, so that a slow disk holds nothing up.
 *
 *   save_open() --> save_found() --> save_start() --> save_tile() ... --> save_finish()
 *                                                                     --> save_keep() or save_drop()
 *
 * A tile is in the file within a few hundredths of a second. In the first second nothing is written, so that
 * short runs write nothing. If a run ends regularly, what is not written yet is written then.
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

struct save;

/*
 * Opens the journal at path for this scene and puts what it holds into the canvas, which outlives the result.
 * With adaptive sampling this goes through adaptive_put(), pass by pass: each pass is planned again from the one
 * before, with the time limit that its records state, and a record counts if it has exactly what that plan asks
 * for. tiles: about how many the whole picture has. NULL after user_error() (journal_open()).
 */
struct save *save_open(const char *path, const struct scene *scene, struct canvas *canvas,
                       struct adaptive *adaptive, uint32_t tiles);

/* What an earlier run has left, to be used by this one until save_start(); from then on only `all` of it. Valid as long
 * as save is. */
struct found *save_found(struct save *save);

/* Whether the journal held nothing when it was opened: nothing is lost with it before save_start(). */
bool save_was_empty(const struct save *save);

/* Whether the disk has room for this number of further tiles and pixels; false after user_error(). */
bool save_has_room(const struct save *save, uint32_t tiles, uint64_t pixels);

/* Starts the writing thread: from now on tiles are taken. tiles, pixels: about how many there will be in all. */
void save_start(struct save *save, uint32_t tiles, uint64_t pixels);

/*
 * Saves a finished tile, whose pixels are in the canvas and do not change any more. May be called by any thread;
 * save may be NULL: then nothing is saved.
 */
void save_tile(struct save *save, const struct tile *tile, const struct result_header *header);

/*
 * The same with adaptive sampling, to be called before adaptive_put() with the same part, which is copied, as
 * later passes change the canvas.
 */
void save_part(struct save *save, const struct tile *tile, const struct result_header *header,
               const float *part);

/* Ends the thread: all tiles have been saved. Writes what is not written yet, unless the run was so short that nothing
 * was, and gives back reserved space that is not needed: the picture may need it. NULL: does nothing. */
void save_finish(struct save *save);

struct save_kept {
    char *path;   /* of the journal; owned by the caller */
    bool is_bare; /* nothing was saved, and the journal is removed */
    bool is_gone; /* because somebody else has removed it, and there was no room for a copy */
    /* It is not at the requested path, because that could not be written. */
    bool moved;
    /* The file at the requested path, if it is left beside the one at `path`, which holds as much or more; owned, or
     * NULL. */
    char *original;
    uint64_t lost; /* number of tiles that could not be written anywhere */
    uint64_t lost_pixels;
    double lost_s; /* wall seconds that they took to render */
};

/*
 * Writes what is not written yet and keeps the journal for the next run. If its folder is full or gone, tries
 * the current folder and those for temporary files; what is at the requested path is removed once all is elsewhere.
 * Frees the save.
 */
struct save_kept save_keep(struct save *save);
void save_kept_free(struct save_kept *kept);

/* Removes the journal, for when the picture is safely written. Frees the save; NULL: does nothing. */
void save_drop(struct save *save);

#endif
