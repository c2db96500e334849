/*
 * The progress display: on a terminal a bar that is redrawn in place and fits its width, otherwise
 * a line every few seconds. What counts as a terminal under mpiexec: master/terminal.h.
 *
 * No clock of its own: the time is passed in.
 */
#ifndef FARM_MASTER_PROGRESS_H
#define FARM_MASTER_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "master/terminal.h"

struct progress {
    FILE *out;         /* stderr */
    bool terminal;     /* redraw in place */
    int descriptor;    /* of the terminal, for its width; -1: none */
    double started;    /* rendering: seconds, any origin */
    double before;     /* seconds of the run until then: loading a large scene takes a while */
    double last_shown; /* seconds, same origin */
    double left;       /* estimate of the seconds still to go, smoothed; < 0: unknown */
    unsigned pass;     /* that the display is in */
    double share;      /* shown last: what is finished never becomes less within a pass */
    double begun;      /* of all, what was done when the pass began; 0 in the first one */
    bool drawn;        /* a bar stands on the current line */
};

/* What is done and what there is to do, of all passes so far together. */
struct progress_state {
    double share_done;   /* of all seconds that the rays are expected to take: 0 to 1 */
    double share_before; /* part of that which an earlier run has done */
    uint32_t tiles_done, tiles;
    uint32_t tiles_before; /* of these, those of earlier passes, which are not shown */
    unsigned pass; /* of adaptive sampling: with each one there is more to do; 0: there are none */
    uint64_t rays; /* traced so far, all kinds */
    double limit;  /* seconds after which rendering ends in any case; 0: there is no such limit */
    double ends;   /* when that is, on the clock of now */
    bool only_limit; /* nothing else is expected to end it */
};

/* Rendering starts; before: seconds of the run until now, which count as elapsed, but not for any rate. */
void progress_start(struct progress *progress, FILE *out, double now, double before);

/* Shows state if it is time to (10 times a second on a terminal, else every 5 s). */
void progress_update(struct progress *progress, const struct progress_state *state, double now);

/* Takes the bar off the terminal, so that other text can follow; messages do so themselves
 * (message_clear_line()), from start to end. progress stays where it is meanwhile. */
void progress_end(struct progress *progress);

#endif
