/* What samples cost: in effort, the same on every machine, and in seconds, as rendering shows. */
#ifndef FARM_MASTER_EFFORT_H
#define FARM_MASTER_EFFORT_H

#include <stdbool.h>

#include "common/refinement.h"
#include "master/statistics.h"

/* What samples have taken. */
struct spent {
    double seconds, effort;
};

struct effort {
    /* Of samples that take a ray each, from a level to another one. */
    double of_levels[LEVEL_MAX + 1][LEVEL_MAX + 1];
    struct spent on_first, on_later; /* on first samples, and on all others */
};

void effort_init(struct effort *effort, const struct levels *levels);

/* Of a pixel's samples from a level to a higher one, that take a ray each: master/allocation.h. */
static inline double effort_between(const struct effort *effort, uint32_t from, uint32_t to)
{
    return effort->of_levels[from][to];
}

/* A processor has spent so many seconds on pixels' first samples, or on later ones. */
void effort_add_seconds(struct effort *effort, bool first, double seconds);

/* The samples are in that have brought a pixel from a level, 0: they are its first ones, to a higher one, and have
 * taken so many rays each. */
void effort_add(struct effort *effort, uint32_t from, uint32_t to, double rays);

/* Of a processor, so far: on first samples; on all others. */
double effort_first_seconds(const struct effort *effort);
double effort_later_seconds(const struct effort *effort);

/* Seconds per effort of a pass to come that refines pixels. NaN: nothing is known. */
double effort_seconds(const struct effort *effort);

#endif
