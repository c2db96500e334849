/*
 * Plans a pass that refines pixels: how many more samples each pixel gets under a limit, and which limit leads to a
 * given error or effort, over the whole picture. The rule is in master/adaptive.h; master/allocation.h applies it to a
 * pixel.
 */
#ifndef FARM_MASTER_REFINE_H
#define FARM_MASTER_REFINE_H

#include <stdint.h>

#include "common/thread_pool.h"
#include "master/allocation.h"
#include "master/effort.h"
#include "master/pixel_errors.h"
#include "master/statistics.h"

/* What a plan is made from. All pixels must have samples, and pixel_errors_expect() must have been called for their
 * present state. Everything is the caller's. The pool must be idle; NULL: the caller plans alone. */
struct candidates {
    const struct statistics *statistics;
    struct pixel_errors *errors;
    const struct effort *effort;
    struct thread_pool *pool;
};

/* An allocation with all pixels, to find a limit with; freed by allocation_destroy(). */
struct allocation *refine_allocation(const struct candidates *candidates);

/* The outcome of a plan: how many pixels get more samples, and the sum of squared errors, estimated from the halves of
 * all pixels, that is expected to be left. */
struct refined {
    uint64_t pixels;
    double left;
};

/* Sets in next the level of each pixel after the pass: its own, or a higher one where the limit asks for it. If any
 * pixel goes up, the errors record which pixels their neighbourhood leaves where they are (hidden_leave()). */
struct refined refine_levels(const struct candidates *candidates, double limit, uint8_t *next);

/* The effort of all samples beyond pixels' first ones, those that are there included, if a single pass took every pixel
 * from level 1 to where the limit takes it. */
double refine_effort(const struct candidates *candidates, double limit);

#endif
