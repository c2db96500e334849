/*
 * The errors of the pixels of an adaptive picture: estimated from their halves, predicted from their neighbourhood
 * (master/expect.h), missed by their samples (master/hidden.h), and the sums of these over the picture.
 *
 * The sums are cached until a pixel changes: plans, rows of the error log, forecasts and the report ask for them more
 * often than that. Errors of single pixels and their sums are squared.
 */
#ifndef FARM_MASTER_PIXEL_ERRORS_H
#define FARM_MASTER_PIXEL_ERRORS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/thread_pool.h"
#include "master/error.h"
#include "master/hidden.h"
#include "master/statistics.h"

/* Sums over pixels that have samples. */
struct error_totals {
    struct error_sum halves; /* errors as estimated from the halves */
    struct hidden_sum hidden;
    uint64_t pixels, samples;
};

/* To be read and written by the functions below alone, but for hidden. */
struct pixel_errors {
    const struct statistics *statistics; /* the caller's */
    struct hidden *hidden;               /* what the halves do not show; owned */
    double *expected;                    /* expected squared error of each pixel; owned */
    /* Root of each pixel's squared error, predicted from its neighbourhood alone; owned. */
    float *predicted_rms;
    bool is_expected; /* expected and predicted_rms are up to date */
    bool is_summed;   /* totals are up to date */
    struct error_totals totals;
};

/* Bytes of memory kept for each pixel. */
size_t pixel_errors_bytes(void);

/* The statistics must outlive the errors. Freed by pixel_errors_free(). */
void pixel_errors_init(struct pixel_errors *errors, const struct statistics *statistics);
void pixel_errors_free(struct pixel_errors *errors);

/* To be called when a pixel has got samples. before: what was known of it without these; NULL: it had none. */
void pixel_errors_settle(struct pixel_errors *errors, size_t pixel,
                         const struct pixel_statistics *before);

/* To be called when a plan has told errors->hidden which pixels it leaves where they are. */
void pixel_errors_left(struct pixel_errors *errors);

/* The sums over the pixels as they are, valid until one changes. The pool must be idle; NULL: the caller works alone.
 */
const struct error_totals *pixel_errors_totals(struct pixel_errors *errors,
                                               struct thread_pool *pool);

/* The same. It also updates each pixel's part of the hidden error and, if all pixels have samples, its expected
 * error. */
const struct error_totals *pixel_errors_expect(struct pixel_errors *errors,
                                               struct thread_pool *pool);

/* From the totals, while they are valid: the sum of squared errors estimated from the halves; the picture's error
 * including the hidden part. */
double pixel_errors_halves(const struct pixel_errors *errors);
struct error_breakdown pixel_errors_breakdown(const struct pixel_errors *errors);

/* Squared errors of a pixel that has samples: estimated from its own halves; missed by its samples. */
double pixel_errors_own(const struct pixel_errors *errors, size_t pixel);
double pixel_errors_hidden(const struct pixel_errors *errors, size_t pixel);

/* The pixel's expected squared error as pixel_errors_expect() has found it; and the same plus what it has missed. */
static inline double pixel_errors_expected(const struct pixel_errors *errors, size_t pixel)
{
    return errors->expected[pixel];
}
double pixel_errors_with_hidden(const struct pixel_errors *errors, size_t pixel);

/* Root of the squared error predicted from the pixel's neighbourhood alone. */
static inline float pixel_errors_predicted_rms(const struct pixel_errors *errors, size_t pixel)
{
    return errors->predicted_rms[pixel];
}

/* Sum of the expected squared errors of all pixels. */
double pixel_errors_expected_sum(const struct pixel_errors *errors);

#endif
