/*
 * The errors of an adaptive picture: what the halves of pixels tell, what is expected of pixels by what is around them
 * (master/expect.h), what they have missed (master/hidden.h), and the sums of these over the picture.
 *
 * Sums are kept until a pixel changes: they are looked at more often, by a plan, a row of the log, a forecast and the
 * report, than there is something new in them.
 */
#ifndef FARM_MASTER_PIXEL_ERRORS_H
#define FARM_MASTER_PIXEL_ERRORS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/crew.h"
#include "master/error.h"
#include "master/hidden.h"
#include "master/statistics.h"

/* Sums over pixels that have samples. */
struct error_totals {
    struct error_sum halves; /* as these tell the errors */
    struct hidden_sum hidden;
    uint64_t pixels, samples;
};

/* Read and written by the functions below alone. */
struct pixel_errors {
    const struct statistics *statistics; /* the caller's */
    struct hidden *hidden;               /* what is missing in what halves tell */
    double *expected;                    /* squared error of each pixel */
    float *warned;                       /* its root, by what is around each pixel alone */
    bool is_expected;                    /* expected and warned are of the pixels as they are */
    bool is_summed;                      /* so are the totals */
    struct error_totals totals;
};

/* Memory that is kept for each pixel. */
size_t pixel_errors_bytes(void);

/* The statistics must outlive the errors. Freed by pixel_errors_free(). */
void pixel_errors_init(struct pixel_errors *errors, const struct statistics *statistics);
void pixel_errors_free(struct pixel_errors *errors);

/* The pixel has got more samples: what it was before; NULL: it had none. */
void pixel_errors_settle(struct pixel_errors *errors, size_t pixel, const struct known *before);

/* Whether a plan has still to tell if the pixel is left where it is by what is around it. */
bool pixel_errors_is_open(const struct pixel_errors *errors, size_t pixel);

/* The plan leaves it; or leaves it though what is around it warns of something, as its own samples have met nothing.
 * From several threads, of a pixel each; pixel_errors_left() when all are done. */
void pixel_errors_leave(struct pixel_errors *errors, size_t pixel);
void pixel_errors_leave_warned(struct pixel_errors *errors, size_t pixel);
void pixel_errors_left(struct pixel_errors *errors);

/* As the pixels are; valid until one changes. The crew is not to be busy with anything else; NULL: the caller alone. */
const struct error_totals *pixel_errors_totals(struct pixel_errors *errors, struct crew *crew);

/* The same, and the shares of what is hidden and, if all pixels have samples, what is expected of each are as these
 * tell, too. */
const struct error_totals *pixel_errors_expect(struct pixel_errors *errors, struct crew *crew);

/* Of these, as long as they are valid: the sum of squares as halves tell them; the errors with what is hidden. */
double pixel_errors_halves(const struct pixel_errors *errors);
struct error_told pixel_errors_told(const struct pixel_errors *errors);

/* Of a pixel that has samples, squared: as its own halves tell it; what it has missed. */
double pixel_errors_own(const struct pixel_errors *errors, size_t pixel);
double pixel_errors_hidden(const struct pixel_errors *errors, size_t pixel);

/* What is expected of it, by pixel_errors_expect(), and with what it has missed. */
static inline double pixel_errors_expected(const struct pixel_errors *errors, size_t pixel)
{
    return errors->expected[pixel];
}
double pixel_errors_in_all(const struct pixel_errors *errors, size_t pixel);

/* By what is around it alone. */
static inline double pixel_errors_warned(const struct pixel_errors *errors, size_t pixel)
{
    double root = (double)errors->warned[pixel];
    return root * root;
}

/* What is expected of all pixels. */
double pixel_errors_expected_sum(const struct pixel_errors *errors);

#endif
