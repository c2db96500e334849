/*
 * Looks at the picture while it is rendered: rows of its sampling error against time, into the
 * report and, as the run goes, into a CSV file.
 */
#ifndef FARM_MASTER_WATCH_H
#define FARM_MASTER_WATCH_H

#include <stdbool.h>
#include <stdio.h>

#include "master/canvas.h"
#include "master/error.h"

struct watch {
    uint64_t pixels;  /* of the picture */
    uint32_t samples; /* per pixel */
    double begin;     /* start of the program, a time of common/clock.h */
    FILE *csv;        /* NULL: none; owned */

    /* So far. */
    struct error_sum sampling, halfway;
    uint64_t finished; /* pixels */
    struct error_log log;
    double next; /* when the next row is due */
};

/* csv: path of the CSV file, empty for none. false, after saying why: it cannot be written. */
bool watch_start(struct watch *watch, const char *csv);

/* Pixels came in, with what rendering them told. */
void watch_add(struct watch *watch, uint64_t pixels, const struct render_counts *counts);

/* A row when one is due. */
void watch_look(struct watch *watch, double now);

/*
 * The last row, and what the run lets expect; render_s: seconds of rendering. Closes the file; false,
 * after saying why: not all of it could be written.
 */
bool watch_end(struct watch *watch, double now, double render_s, struct error_forecast *forecast);

void watch_free(struct watch *watch);

#endif
