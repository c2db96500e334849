/*
 * The plan of a pass that refines pixels: which get how many more samples under a limit, and what limit an aim or a
 * time asks for, over the whole picture. The rule is in master/adaptive.h, of a single pixel in master/allocation.h.
 */
#ifndef FARM_MASTER_REFINE_H
#define FARM_MASTER_REFINE_H

#include <stdint.h>

#include "common/crew.h"
#include "master/allocation.h"
#include "master/effort.h"
#include "master/pixel_errors.h"
#include "master/statistics.h"

/* What a plan is made from: pixels that all have samples, and what is expected of them as they are
 * (pixel_errors_expect()). All are the caller's. The crew is not busy with anything else; NULL: the caller plans alone.
 */
struct candidates {
    const struct statistics *statistics;
    struct pixel_errors *errors;
    const struct effort *effort;
    struct crew *crew;
};

/* Of all pixels, to find a limit with; freed by allocation_destroy(). */
struct allocation *refine_allocation(const struct candidates *candidates);

/* How many pixels get more samples, and what is expected to be left then of the errors as the halves of all pixels
 * tell them: the sum of their squares. */
struct refined {
    uint64_t pixels;
    double left;
};

/* Sets the level that each pixel is to have behind the pass: its own, or a higher one where the limit asks for it.
 * Where any is to have that, the others are left as they are, which their errors take down. */
struct refined refine_levels(const struct candidates *candidates, double limit, uint8_t *next);

/* The effort of all samples behind the first ones, also those that are there, if a single pass took them to where the
 * limit does. */
double refine_effort(const struct candidates *candidates, double limit);

#endif
