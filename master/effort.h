/* What samples cost: in effort, which is the same on every machine (EFFORT_POWER in master/allocation.h), and in CPU
 * seconds, as measured while rendering. */
#ifndef FARM_MASTER_EFFORT_H
#define FARM_MASTER_EFFORT_H

#include "common/refinement.h"
#include "master/statistics.h"

/* Totals over samples. */
struct spent {
    double seconds; /* CPU seconds, added by whoever measures them */
    double effort;
};

struct effort {
    /* [from][to]: effort of a pixel's samples between two levels, at one ray per sample. */
    double of_levels[LEVEL_MAX + 1][LEVEL_MAX + 1];
    struct spent on_first, on_later; /* pixels' first samples, and all others */
};

/* Nothing is spent yet. */
void effort_init(struct effort *effort, const struct levels *levels);

/* Sets the effort between levels that have been extended; what is spent stays. */
void effort_set_levels(struct effort *effort, const struct levels *levels);

/* Effort of a pixel's samples from a level to a higher one, at one ray per sample. */
static inline double effort_between(const struct effort *effort, uint32_t from, uint32_t to)
{
    return effort->of_levels[from][to];
}

/* Adds the samples that have brought a pixel from a level to a higher one. rays: per sample. from = 0: they are its
 * first ones. */
void effort_add(struct effort *effort, uint32_t from, uint32_t to, double rays);

/* Predicted CPU seconds per effort of a pass that refines pixels. NaN: nothing is known. */
double effort_seconds_per_unit(const struct effort *effort);

#endif
