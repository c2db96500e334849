/*
 * Looks at the picture while it is rendered: rows of its sampling error against time, into the
 * report and, as the run goes, into a CSV file; the picture so far into its file.
 */
#ifndef FARM_MASTER_WATCH_H
#define FARM_MASTER_WATCH_H

#include <stdbool.h>
#include <stdio.h>

#include "master/adaptive.h"
#include "master/canvas.h"
#include "master/forecast.h"
#include "master/snapshot.h"

struct watch {
    /* Filled in before watch_start(). */
    const struct canvas *canvas;
    const struct canvas *reference; /* of the same size; NULL: none */
    struct adaptive *adaptive;      /* NULL: every pixel gets so many samples: */
    uint32_t samples;
    uint32_t first_samples;   /* of the first pass, where there are several */
    double begin;             /* start of the program, a time of common/clock.h */
    struct snapshot snapshot; /* the picture so far: path, and seconds from one to the next */

    /* So far. */
    FILE *csv;     /* NULL: none; owned */
    int csv_error; /* errno of what could not be written first, 0: all is well */
    struct error_sum sampling, halfway;
    uint64_t finished; /* pixels */
    double work_s;     /* CPU seconds of rendering, of all renderers */
    struct error_log log;
    unsigned looks; /* rows that do not stand behind a whole pass */
    double next;    /* when the next row is due */
};

/* csv: path of the CSV file, empty for none. false, after saying why: it cannot be written. */
bool watch_start(struct watch *watch, const char *csv);

/* So many pixels came in; the header tells what they cost and what they told. */
void watch_add(struct watch *watch, uint64_t pixels, const struct result_header *header);

/* A row, and a picture, when they are due; what else changes the canvas waits meanwhile. */
void watch_look(struct watch *watch, double now);

/* A pass is complete. */
void watch_pass(struct watch *watch, double now);

/* No more pictures: from now on their file is the caller's. */
void watch_leave_file(struct watch *watch);

/*
 * The last row, and what the run lets expect; render_s: seconds of rendering, of all that watch_add() was
 * told. Closes the file; false, after saying why: not all of it could be written.
 */
bool watch_end(struct watch *watch, double now, double render_s, struct error_forecast *forecast);

void watch_free(struct watch *watch);

#endif
