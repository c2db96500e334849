/*
 * The progress display: on a terminal, a bar that is redrawn in place and fits the width; otherwise a line every
 * few seconds. master/terminal.h decides what counts as a terminal under mpiexec. The caller passes in the time:
 * there is no clock here.
 */
#ifndef FARM_MASTER_PROGRESS_H
#define FARM_MASTER_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

struct progress {
    FILE *out; /* stderr */
    /* Of the terminal on which the bar is redrawn in place, for its width; -1: lines are printed. */
    int descriptor;
    double started;    /* when rendering started: seconds of any origin */
    double before;     /* seconds of the run before that, such as for loading the scene */
    double last_shown; /* when it was last updated: same origin */
    double left;       /* estimate of the seconds still to go, smoothed; < 0: unknown */
    unsigned pass;     /* the pass that is displayed */
    double share;      /* the share shown last; it never decreases within a pass */
    /* The share of all work that was done when the pass began; 0 in the first one. */
    double begin_share;
    bool drawn; /* a bar stands on the current line */
};

/* How far the run has come; counts are over all passes so far. */
struct progress_state {
    double share_done;   /* part of the seconds that all tiles are predicted to take: 0 to 1 */
    double share_before; /* the part of that which an earlier run has done */
    uint32_t tiles_done, tiles;
    uint32_t tiles_before; /* tiles of earlier passes, which are subtracted from the others */
    /* Pass of adaptive sampling, from 1 on, each of which adds work; 0: not adaptive. */
    unsigned pass;
    uint64_t rays;   /* traced so far, all kinds */
    double limit;    /* seconds after which rendering ends in any case; 0: no such limit */
    double ends;     /* the time at which it ends so, on the clock of `now` */
    bool only_limit; /* nothing else is expected to end it */
};

/* Starts the display when rendering starts. before: seconds of the run until now, which count as elapsed, but
 * not for rates. */
void progress_start(struct progress *progress, FILE *out, double now, double before);

/* Shows the state if it is time to: 10 times a second on a terminal, otherwise every 5 s. */
void progress_update(struct progress *progress, const struct progress_state *state, double now);

/* Removes the bar from the terminal, so that other text can follow. From start to end messages remove it by
 * themselves (message_clear_line()); progress must not move meanwhile. */
void progress_end(struct progress *progress);

#endif
