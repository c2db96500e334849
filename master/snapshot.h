/* Snapshots: writes the picture so far to its file now and then, in a thread of its own. Rendering and serving
 * do not wait for a disk, only for a copy of the picture. */
#ifndef FARM_MASTER_SNAPSHOT_H
#define FARM_MASTER_SNAPSHOT_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "master/canvas.h"

/* Snapshots keep the master from serving for no more than this part of the time, and so do rows of errors between
 * passes (master/watch.h). */
#define SERVING_MOST 0.05

struct snapshot {
    /* Filled in by the caller. seconds: from the end of one snapshot to the next; 0: none are written. */
    const char *path;
    double seconds;
    double due;    /* when the next one is due: a time of common/clock.h */
    double took_s; /* seconds for which the last one kept the master from serving */

    bool is_writing; /* the writing thread exists */
    atomic_bool is_written;
    bool told_failure;
    pthread_t thread;
    struct canvas copy; /* the picture that it writes; owned */
};

/* Whether the next snapshot_look() copies the canvas: a snapshot is due, and the last one is written. */
bool snapshot_is_due(const struct snapshot *snapshot, double now);

/* Copies the canvas and starts to write it, when a snapshot is due and the last one is written. Only the first
 * failure is reported; later snapshots are still tried. */
void snapshot_look(struct snapshot *snapshot, const struct canvas *canvas, double now);

/* Reports for how many seconds the last one kept the master from serving: the next one is delayed accordingly. */
void snapshot_took(struct snapshot *snapshot, double seconds);

/* Waits for what is being written, and writes no more: the file is the caller's again. */
void snapshot_end(struct snapshot *snapshot);

#endif
