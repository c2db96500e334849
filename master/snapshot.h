/*
 * The picture so far, into its file now and then, by a thread of its own: whoever renders and serves
 * does not wait for a disk, but for a copy.
 */
#ifndef FARM_MASTER_SNAPSHOT_H
#define FARM_MASTER_SNAPSHOT_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "master/canvas.h"

struct snapshot {
    /* Filled in by the caller; seconds after the last one that is written; 0: never. */
    const char *path;
    double seconds;
    double due;    /* when the next one is, a time of common/clock.h */
    double took_s; /* that the last one has kept who serves from serving */

    bool is_writing; /* the thread exists */
    atomic_bool is_written;
    bool told_failure;
    pthread_t thread;
    struct canvas copy; /* what it writes; owned */
};

/* Whether the next look copies the canvas: that is due, and the last one is written. */
bool snapshot_is_due(const struct snapshot *snapshot, double now);

/* Copies the canvas and has it written, when that is due and the last one is written. The first failure
 * is told, and the next one is tried. */
void snapshot_look(struct snapshot *snapshot, const struct canvas *canvas, double now);

/* The last one has kept who serves from serving for so many seconds: the next one comes the later for it. */
void snapshot_took(struct snapshot *snapshot, double seconds);

/* Waits for what is being written: the file is the caller's again. */
void snapshot_end(struct snapshot *snapshot);

#endif
