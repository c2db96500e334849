/*
 * What the parts of adaptive sampling share; for all others there is adaptive.h. What comes in goes down this list, and
 * what is told of it back up; none of them knows those above it:
 *
 *   adaptive_tile.c   what a pass is in a tile, and what comes in of it
 *   adaptive.c        the passes of a run
 *   adaptive_first.c  passes for pixels that have no samples
 *   refine.h          passes for pixels that have some
 *   promise.h         what passes have kept of what was promised
 *   pixel_errors.h    what errors pixels have
 *   effort.h          what samples cost
 *   statistics.h      what samples tell of each pixel
 */
#ifndef FARM_MASTER_ADAPTIVE_STATE_H
#define FARM_MASTER_ADAPTIVE_STATE_H

#include "master/adaptive.h"
#include "master/effort.h"
#include "master/pixel_errors.h"
#include "master/promise.h"
#include "master/statistics.h"

/* The last one that was planned. */
struct pass {
    unsigned number;  /* 1 is pass 0 */
    bool is_first;    /* pixels get their first samples */
    double limit;     /* adaptive_limit() */
    uint64_t missing; /* pixels that are to come */
    uint64_t asked;   /* for in all */
    uint8_t *next;    /* level of each pixel that the pass brings it to */
};

struct adaptive {
    struct statistics statistics;
    struct effort effort;
    struct pixel_errors errors;
    struct promise promise;
    struct pass pass;
    struct crew *crew; /* that plans; NULL: who calls does, alone */
    double target;
    bool is_met; /* the target */
    /* Of rendering: that a pixel without samples is expected to take, 0: nobody knows; and that had been spent on first
     * samples when the pass was planned. */
    double unsampled_s, first_before_s;
};

/* Begins the next pass, which asks for so many pixels. */
static inline void pass_begin(struct pass *pass, bool is_first, double limit, uint64_t pixels)
{
    pass->number++;
    pass->is_first = is_first;
    pass->limit = limit;
    pass->missing = pass->asked = pixels;
}

/* Whether a pixel is still to come of the pass. */
static inline bool adaptive_comes(const struct adaptive *adaptive, size_t pixel)
{
    return adaptive->pass.next[pixel] > adaptive->statistics.level[pixel];
}

/* adaptive_plan() and adaptive_plan_again() while pixels have no samples. */
void adaptive_plan_first(struct adaptive *adaptive, double seconds);
bool adaptive_plan_first_again(struct adaptive *adaptive, double limit);

#endif
