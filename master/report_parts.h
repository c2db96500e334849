/* Shared by the files that print the table at the end of a run; report.h is the interface to it. */
#ifndef FARM_MASTER_REPORT_PARTS_H
#define FARM_MASTER_REPORT_PARTS_H

#include <math.h>
#include <stdbool.h>

#include "master/report.h"

struct table {
    FILE *out;
    int columns;
    int used; /* columns of the current line that text has filled so far */
};

/* part / whole; 0 if whole is 0. */
static inline double share_of(double part, double whole)
{
    return whole > 0 ? fmax(part, 0) / whole : 0;
}

/* Sums over all renderers, in seconds. */
struct work {
    double busy, cpu;               /* wall and CPU time of rendering */
    double probe, intersect, shade; /* wall time: parts of busy */
    double wait;
    bool shared; /* whether renderers shared cores */
};

/* ---- where the time went, with bars: report_times.c ---- */

void put_run_times(const struct table *table, const struct run_times *time, bool resumed);
void put_rendering(const struct table *table, const struct report *report, const struct work *work);
void put_ranks(const struct table *table, const struct report *report);

#endif
