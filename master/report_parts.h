/* The parts of the table at the end of a run; for all others there is report.h. */
#ifndef FARM_MASTER_REPORT_PARTS_H
#define FARM_MASTER_REPORT_PARTS_H

#include <math.h>
#include <stdbool.h>

#include "master/report.h"

struct table {
    FILE *out;
    int columns;
    int used; /* columns of the current line, of text that flows */
};

/* 0 of nothing. */
static inline double share_of(double part, double whole)
{
    return whole > 0 ? fmax(part, 0) / whole : 0;
}

/* What all renderers did together, in seconds. */
struct work {
    double busy, cpu;
    double probe, intersect, shade; /* wall time of tiles: parts of busy */
    double wait;
    bool shared; /* cores were */
};

/* ---- where the time went, with bars: report_times.c ---- */

void put_run_times(const struct table *table, const struct run_times *time, bool resumed);
void put_rendering(const struct table *table, const struct report *report, const struct work *work);
void put_ranks(const struct table *table, const struct report *report);

#endif
