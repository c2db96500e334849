/*
 * State shared by the parts of adaptive sampling; all other modules use adaptive.h. These are its layers. Samples are
 * passed down the list, results come back up, and no layer knows those above it:
 *
 *   adaptive_tile.c   what a pass does in a tile, and what comes in of it
 *   adaptive.c        the passes of a run
 *   adaptive_first.c  passes for pixels that have no samples
 *   refine.h          passes for pixels that have some
 *   promise.h         how well passes have kept what was promised
 *   pixel_errors.h    errors of pixels
 *   pass_cost.h       what a pass takes in each part of the picture
 *   effort.h          what samples cost
 *   statistics.h      means, halves and spreads of each pixel's samples
 */
#ifndef FARM_MASTER_ADAPTIVE_STATE_H
#define FARM_MASTER_ADAPTIVE_STATE_H

#include "master/adaptive.h"
#include "master/effort.h"
#include "master/pass_cost.h"
#include "master/pixel_errors.h"
#include "master/promise.h"
#include "master/statistics.h"

/* The last pass that was planned. */
struct pass {
    unsigned count;   /* passes begun so far, pass 0 included */
    bool is_first;    /* pixels get their first samples */
    double limit;     /* adaptive_limit() */
    uint64_t missing; /* pixels that are still to come */
    uint64_t asked;   /* pixels that the pass asked for */
    uint8_t *next;    /* level of each pixel after the pass; owned */
};

struct adaptive {
    struct statistics statistics;
    struct effort effort;
    struct pass_cost *cost; /* owned */
    struct pixel_errors errors;
    struct promise promise;
    struct pass pass;
    struct thread_pool *pool; /* to plan with; NULL: the calling thread plans alone */
    double target;
    bool is_met; /* the target */
    /* Seconds of rendering: what a pixel without samples is expected to take, 0: unknown; what had been spent on first
     * samples when the pass was planned. */
    double unsampled_s, first_before_s;
};

/* Begins the next pass, which asks for so many pixels. */
static inline void pass_begin(struct pass *pass, bool is_first, double limit, uint64_t pixels)
{
    pass->count++;
    pass->is_first = is_first;
    pass->limit = limit;
    pass->missing = pass->asked = pixels;
}

/* adaptive_plan() and adaptive_replan() while there are pixels without samples. */
void adaptive_plan_first(struct adaptive *adaptive, double seconds);
bool adaptive_replan_first(struct adaptive *adaptive, double limit);

#endif
