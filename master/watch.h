/* Monitoring of a run: records the sampling error of the picture against time, as rows of the report and, while
 * the run goes on, of a CSV file; and writes the picture so far to its file now and then. */
#ifndef FARM_MASTER_WATCH_H
#define FARM_MASTER_WATCH_H

#include <stdbool.h>
#include <stdio.h>

#include "common/extremes.h"
#include "master/adaptive.h"
#include "master/canvas.h"
#include "master/forecast.h"
#include "master/snapshot.h"

struct watch {
    /* Filled in before watch_start(). */
    const struct canvas *canvas;
    const struct canvas *reference; /* of the same size; NULL: none */
    struct adaptive *adaptive;      /* NULL: every pixel gets `samples` samples */
    uint32_t samples;               /* the most that a pixel may get */
    double begin;                   /* start of the program: a time of common/clock.h */
    struct snapshot snapshot;       /* the picture so far: its path, and the seconds between two */

    /* State of the run. */
    FILE *csv;     /* NULL: none; owned */
    int csv_error; /* errno of the first failure to write it; 0: none */
    struct error_sum sampling, halfway;
    uint64_t pixels_finished;
    double work_s; /* CPU seconds of rendering, of all renderers */
    struct error_log log;
    unsigned looks; /* rows that do not follow a complete pass */
    double next;    /* when the next row is due: a time of common/clock.h */
};

/* From one row to the next the time grows by this factor: so they are evenly spaced where error is drawn against time
 * with logarithmic axes. */
#define ROW_FACTOR 1.25

/* Seconds from the start to the next row between passes, if the last one was added at `elapsed` and took took_s. A row
 * of a large adaptive picture, whose pixels are all summed, takes as long as many tiles, and nobody is served
 * meanwhile. */
static inline double watch_next_row(double elapsed, double took_s)
{
    return larger_number(elapsed * ROW_FACTOR, elapsed + took_s / SERVING_MOST);
}

/* Starts monitoring. csv: path of the CSV file, empty: none. Returns false, after saying why, if it cannot be
 * written. */
bool watch_start(struct watch *watch, const char *csv);

/* Takes in the counts of a tile that became part of the picture, and the number of its pixels. */
void watch_add(struct watch *watch, uint64_t pixels, const struct result_header *header);

/* Adds a row, and writes a picture, when they are due. The canvas must not change meanwhile. */
void watch_look(struct watch *watch, double now);

/* Adds the row that follows a complete pass. */
void watch_pass(struct watch *watch, double now);

/*
 * Adds the last row, and predicts what a smaller error would cost. render_s: seconds of rendering of all that
 * was passed to watch_add(). Closes the CSV file; returns false, after saying why, if not all of it could be
 * written.
 */
bool watch_end(struct watch *watch, double now, double render_s, struct error_forecast *forecast);

void watch_free(struct watch *watch);

#endif
