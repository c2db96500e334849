/* What a run does before it renders, and how long that took: for messages that a time limit was too short for it. */
#ifndef FARM_MASTER_START_TIMES_H
#define FARM_MASTER_START_TIMES_H

#include "master/report.h"

/* The largest parts of the time up to rendering, the longest first: "picture memory 49.8 s, loading 1.1 s". At most
 * three, and none of less than a hundredth of it but the first. Owned by the caller. */
char *start_times_text(const struct run_times *time);

#endif
