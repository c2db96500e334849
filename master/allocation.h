/*
 * Decides which pixels are worth more samples: pixels are ordered by their gain, the squared error that their next
 * samples remove per cost, and those above a limit get more (master/adaptive.h has the rule).
 *
 * The gain of a pixel is e / cost, where e is its expected squared error and cost that of the samples it has. Twice as
 * many samples leave 2^-3/2 of e at twice the cost, so each doubling lowers the gain by 2^5/2. The error that an
 * allocation leaves in the picture is computed from errors estimated from the pixels' halves, not from e: e says which
 * pixels are alike, and over many alike pixels their halves show how large the error is.
 */
#ifndef FARM_MASTER_ALLOCATION_H
#define FARM_MASTER_ALLOCATION_H

#include "common/refinement.h"

struct allocation;

/* error: a typical squared error of a pixel, such as the mean; where it is not > 0, it is unknown, and 1 is taken.
 * Gains from 2^-120 to 2^100 times this are distinguished. Freed by allocation_destroy(), which accepts NULL. */
struct allocation *allocation_create(double error);
void allocation_destroy(struct allocation *allocation);

/*
 * The effort of samples that a pixel gets in one pass is their number to this power: the more a pixel gets at a time,
 * the fewer seconds each of them takes. In seven scenes, with 5 to 77 samples per pixel and pass, seconds grew as
 * powers of 0.8 to 0.98 of the number; in the mean of the passes after the first, as a power of 0.87.
 */
#define EFFORT_POWER 0.88

/* Adds a pixel. gain: e / cost, >= 0; square: squared error estimated from the halves, >= 0; effort: that of doubling
 * its samples once; all finite. most: how often they can be doubled, <= LEVEL_MAX. */
void allocation_add(struct allocation *allocation, double gain, double square, double effort,
                    unsigned most);

/* Adds all pixels of another allocation, which was created with the same error. */
void allocation_join(struct allocation *allocation, const struct allocation *other);

/* Sum of the squares of all pixels that were added. */
double allocation_squares(const struct allocation *allocation);

/* The outcome of a limit: what it leaves of all squares, and the effort of all further samples, if each pixel gets
 * its own in a single pass. */
struct allocation_outcome {
    double left, effort;
};
struct allocation_outcome allocation_under(const struct allocation *allocation, double limit);

/* The highest limit that leaves at most `goal` of the sum of squares, to an eighth of an octave; 0: none does. */
double allocation_limit(const struct allocation *allocation, double goal);

/* The lowest limit whose effort is at most `effort`, to an eighth of an octave; where even the fewest samples take
 * more, the limit that asks for these. 0: there are none to ask for. */
double allocation_limit_within(const struct allocation *allocation, double effort);

/* How often the samples of a pixel are doubled until its gain is at most the limit; `most` times at most. */
unsigned allocation_doublings(double gain, double limit, unsigned most);

#endif
