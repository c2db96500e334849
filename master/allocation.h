/*
 * Which pixels are worth more samples: pixels by what their next samples remove from the squared error
 * per cost, and the limit above which that is worth while (master/adaptive.h has the rule).
 *
 * Of a pixel its expected squared error e and the cost of the samples that it has count. Twice as many
 * samples leave 2^-3/2 of e for twice the cost; so e / cost goes down by 2^5/2 with each doubling. What
 * an allocation leaves of the picture's error is reckoned from what the pixels' halves tell: e says
 * which pixels are alike, and over many alike their halves say what error they have.
 */
#ifndef FARM_MASTER_ALLOCATION_H
#define FARM_MASTER_ALLOCATION_H

#include "common/refinement.h"

struct allocation;

/* error: what a pixel's squared error is like, the mean, say; > 0, or nothing is known of it. Gains of 2^-120
 * to 2^100 of that are told from each other. */
struct allocation *allocation_create(double error);
void allocation_destroy(struct allocation *allocation);

/*
 * What so many samples in a pass are in effort, as a power of them: the more a pixel gets at a time, the
 * fewer seconds does each take. In seven scenes, from 5 to 77 samples per pixel and pass, seconds
 * went by powers of 0.8 to 0.98 of them, 0.87 in the mean of passes after the first.
 */
#define EFFORT_POWER 0.88

/* A pixel, that can be doubled so often: its gain e / cost, >= 0, what its halves tell, >= 0, and the
 * effort of doubling it once; finite. most <= LEVEL_MAX. */
void allocation_add(struct allocation *allocation, double gain, double told, double effort,
                    unsigned most);

/* Adds all pixels of another one, which was created with the same error. */
void allocation_join(struct allocation *allocation, const struct allocation *other);

/* What the halves of all pixels that were added tell. */
double allocation_told(const struct allocation *allocation);

/* What a limit comes to: the sum that it leaves of these errors, and the effort of the samples to come, all
 * of a pixel's taken at once. */
struct allocation_outcome {
    double left, effort;
};
struct allocation_outcome allocation_under(const struct allocation *allocation, double limit);

/* The highest limit, up to an eighth, that leaves at most so much; 0: none does. */
double allocation_limit(const struct allocation *allocation, double goal);

/* The lowest limit, up to an eighth, whose effort is at most so much; where even the least samples take more,
 * that which asks for these. 0: there are none to ask for. */
double allocation_limit_within(const struct allocation *allocation, double effort);

/* How often a pixel is doubled until e / cost is at most the limit. */
unsigned allocation_doublings(double gain, double limit, unsigned most);

#endif
