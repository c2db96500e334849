/* A text that says what a run spent its time on before it rendered, for messages that a time limit was too short for
 * this. */
#ifndef FARM_MASTER_START_TIMES_H
#define FARM_MASTER_START_TIMES_H

#include "master/report.h"

/* A phase before rendering, and what it took. */
struct start_phase {
    const char *name;
    double seconds;
};

enum { START_MPI, START_LOAD, START_ROOM, START_JOURNAL, START_SHARE, START_BUILD, START_PHASES };

/* Fills in all phases, in their order. */
void start_phases(const struct run_times *time, struct start_phase phases[START_PHASES]);

/* Returns a text with the longest phases before rendering and their times, the longest first, such as "picture
 * memory 49.8 s, loading 1.1 s". It names at most three, and apart from the first none of less than a hundredth of
 * the total. The text is owned by the caller. */
char *start_times_text(const struct run_times *time);

#endif
