/*
 * The sampling error of the picture: estimates with confidence intervals, and a log of how they went down with time.
 * What a smaller error would cost: master/forecast.h.
 *
 * RMSE is the root of the mean, over pixels and components, of the squared difference between the picture and what it
 * would be with infinitely many samples; linear, 1 is full white.
 */
#ifndef FARM_MASTER_ERROR_H
#define FARM_MASTER_ERROR_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "common/protocol.h"

/* The share of runs in which all intervals of the run contain the errors that they are about. */
#define ERROR_CONFIDENCE 0.95

/* What is known of the errors of pixels, squared. */
struct error_breakdown {
    /* squares: including hidden and carried. fourths: bounds the variance of squares by chance. */
    struct error_sum sum;
    /* Parts of sum.squares that the pixels' halves do not show (master/hidden.h). */
    double hidden;  /* what samples have missed */
    double carried; /* what early samples had missed, and the means still contain */
    double odd;     /* error_odd() of the number of samples that each pixel has */
};

/*
 * By how much the logarithm of squares may be off because the halves of a pixel, of a and b samples, are not of the
 * same size, which they are only with an even number of samples. Whatever their squared errors are, that of all samples
 * is between b^2 / n^2 and a^2 / n^2 times their sum. The estimate assumes a part near a b / n^2 (share_of_square() in
 * worker/pixels.c), so this is log(a / b). Where colours change evenly, halves of 2^k samples err much less than
 * others, and much of that range is needed: with 3, 5, 7 and 9 samples the squared error is estimated 34 % too large,
 * 12 % too small, 20 % too large and 14 % too small. For random errors it is 11 % too small with three; at edges it is
 * right.
 */
double error_odd(uint32_t samples);

struct error_estimate {
    double rmse;
    /* Ends of the interval of ERROR_CONFIDENCE, for all looks of a run together. */
    double low, high;
};

/*
 * A run that is looked at again and again sooner or later has an interval that does not contain the error. So look
 * number k of a kind may miss with a probability of 6 / (pi k)^2 of what all looks of this kind together may; these
 * probabilities add up to that for any number of looks. Looks after whole passes decide whether there is another pass,
 * which must not depend on the number of looks in between. So the two kinds are counted separately.
 */
enum error_look { ERROR_LOOK_PASS, ERROR_LOOK_BETWEEN };

/*
 * The hidden error is over- or underestimated for much the same reasons at all looks of a run, so its part of the
 * interval does not widen with their number. The squared hidden error is taken to be at least HIDDEN_LEAST and at most
 * HIDDEN_MOST times its estimate. With these bounds, of 2304 runs of 400 pictures of discs, needles and hairs, 0.04 to
 * 2 pixels wide, 10 had an error below their interval and 25 had one above it. With bounds of half these logarithms the
 * numbers were 26 and 25, with bounds of twice these logarithms 8 and 23 (make bench-error ERROR_SECTIONS=fields).
 * Errors above the interval hardly depend on the bounds: in these runs something is hit that is unlike anything before.
 *
 * The carried error can be overestimated by as much. It is overestimated where later samples of a pixel make up for
 * earlier ones, as all its samples are spread evenly together. Besides, where much is carried, few samples that have
 * hit something decide which pixels get more samples, and the error of pixels that get none is overestimated. Of 300
 * hairs, 0.3 to 0.8 pixels wide (640 x 480), the estimate was up to 1.6 times the squared error in passes between; a
 * fifth to a third of that was carried.
 */
#define HIDDEN_LEAST (1.0 / 16)
#define HIDDEN_MOST  4.0

/*
 * The estimate from the errors of `pixels` pixels, at look `number` (1, 2, ...) of this kind. The interval is too
 * narrow for a single pixel, or where one pixel has nearly all of the error: a single error does not show how much such
 * a sum scatters.
 */
struct error_estimate error_estimate(const struct error_breakdown *breakdown, uint64_t pixels,
                                     enum error_look look, unsigned number);

/* An observed error, for a forecast. log_spread: standard deviation of the logarithm of rmse, at most. */
struct error_point {
    double seconds; /* of rendering; not always used */
    double rmse;
    double log_spread;
};

/* Sets a point from the errors of `pixels` pixels. false: no error has been observed. */
bool error_point(const struct error_breakdown *breakdown, uint64_t pixels, double seconds,
                 struct error_point *point);

/* A row of the log: a moment of a run. */
struct error_row {
    double elapsed_s; /* since the start of the program */
    double samples;   /* mean per pixel of the picture */
    struct error_estimate estimate;
    double true_rmse; /* measured against the reference; NAN without one */
    /* The part of the picture's pixels that have samples; the estimate is about these. */
    double sampled_share;
};

struct error_log {
    struct error_row *rows; /* owned */
    size_t count;
};

void error_log_add(struct error_log *log, const struct error_row *row);
void error_log_free(struct error_log *log);

/* Write CSV: the line of column names; a row. */
void error_names_csv(FILE *out);
void error_row_csv(FILE *out, const struct error_row *row);

#endif
