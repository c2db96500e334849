/*
 * Estimates the error that the samples of an adaptive picture have missed without any sign of it: features smaller than
 * a pixel that no sample has hit, in pixels whose neighbours do not hint at them.
 *
 * The halves of the pixels (worker/task.h) do not show this error once a plan has used the pixels' own samples. Of
 * small features that stand apart, those that were hit by chance attract more samples, after which the halves show
 * little error; those that were missed show none. So consider those pixels of a level that a plan would leave at that
 * level because of their neighbourhood alone. This choice does not depend on their own samples, so the halves of all
 * these pixels together estimate their error correctly. For features that some of them have hit, others were missed.
 * How many follows from how small the features are, which is known when the pixels that hit something have got more
 * samples.
 *
 * In this module a pixel is warned of an error if its neighbourhood predicts one, and a plan leaves it where the
 * neighbourhood alone gives no reason for more samples.
 */
#ifndef FARM_MASTER_HIDDEN_H
#define FARM_MASTER_HIDDEN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/refinement.h"
#include "master/error.h"
#include "master/statistics.h"

struct hidden;

/* Bytes of memory kept for each pixel. */
size_t hidden_pixel_bytes(void);

/* For a picture of this number of pixels, none of which a plan has looked at yet. Freed by hidden_destroy(), which
 * accepts NULL. */
struct hidden *hidden_create(size_t pixels);
void hidden_destroy(struct hidden *hidden);

/* Whether no plan has decided yet if the pixel's neighbourhood alone would leave it at its present level. */
bool hidden_is_open(const struct hidden *hidden, size_t pixel);

/* The plan leaves the pixel, by its neighbourhood. predicted_rms: root of the squared error that it predicts.
 * May be called from several threads, each for other pixels. */
void hidden_leave(struct hidden *hidden, size_t pixel, float predicted_rms);

/* The plan leaves the pixel although it is warned, because its own samples have hit nothing. Same thread safety as
 * hidden_leave(). */
void hidden_leave_warned(struct hidden *hidden, size_t pixel);

/* To be called when a pixel that had samples has got more. before: what was known of it without these; now: with them.
 */
void hidden_settle(struct hidden *hidden, const struct statistics *now, size_t pixel,
                   const struct pixel_statistics *before);

/* Sums over the unwarned pixels of one level, of all or part of the picture. Errors are squared. */
struct level_sum {
    uint64_t pixels; /* unwarned pixels that are at this level */
    uint64_t warned; /* pixels left at it although they were warned */
    /* Error that all unwarned pixels of the level had missed at first, estimated by those that had hit something. */
    double expected;
    double variance;  /* variance of expected */
    double shortfall; /* the most that a single contribution to expected may be too small by */
};

struct hidden_sum {
    struct level_sum levels[LEVEL_MAX + 1];
    /* What the halves omit: pixels whose mean still contains early samples that missed what later ones have found. */
    struct error_sum carried;
};

/* Adds a pixel that has samples to the sum. */
void hidden_add(const struct hidden *hidden, const struct statistics *now, size_t pixel,
                struct hidden_sum *sum);
void hidden_join(struct hidden_sum *all, const struct hidden_sum *more);

/* The errors of the picture including what is hidden. sum: of all pixels; halves: their errors as estimated from the
 * halves. */
struct error_breakdown hidden_errors(const struct hidden *hidden, const struct hidden_sum *sum,
                                     struct error_sum halves);

/* Divides the hidden error of this sum among the pixels; hidden_of() returns the parts from then on. */
void hidden_share(struct hidden *hidden, const struct hidden_sum *sum);

/* The pixel's part of the hidden squared error. level: that of the pixel. */
double hidden_of(const struct hidden *hidden, size_t pixel, unsigned level);

#endif
