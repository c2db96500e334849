/*
 * The sampling error of the picture: estimates of it with an interval, and how they went down with time.
 * What less of it would cost: master/forecast.h.
 *
 * RMSE is the root of the mean over pixels and components of the squared difference between the
 * picture and what it would be with infinitely many samples; linear, 1 is full white.
 */
#ifndef FARM_MASTER_ERROR_H
#define FARM_MASTER_ERROR_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "common/protocol.h"

/* Share of runs in which all intervals of the run hold the errors that they are about. */
#define ERROR_CONFIDENCE 0.95

/* What is known of the errors of pixels. */
struct error_told {
    struct error_sum sum; /* fourths: of what is off by luck, also in what is hidden */
    /* Parts of sum.squares that pixels do not tell themselves (master/hidden.h). */
    double hidden;  /* what they have missed */
    double carried; /* what they had missed before, and their mean has still */
};

struct error_estimate {
    double rmse;
    double low, high; /* of ERROR_CONFIDENCE, over all looks of a run together */
};

/*
 * Looking at a run again and again finds an interval that does not hold sooner or later. So look k of a
 * kind may miss with a chance of 6 / (pi k)^2 of what all of this kind together may, which adds up to it
 * however many there are. Looks behind whole passes decide whether there is another pass, which must not
 * depend on how often somebody has looked in between: they are counted by themselves.
 */
enum error_look { ERROR_LOOK_PASS, ERROR_LOOK_BETWEEN };

/*
 * What is hidden is told too large or too small for much the same reasons at all looks of a run, so that it gets no
 * wider with their number. Its square is taken to be this many times what is told, at least and at most. Of 2304 runs
 * of 400 pictures of discs, needles and hairs, 0.04 to 2 pixels wide, 11 then had an interval that the error was below
 * and 24 one that it was above; judged by bounds of half their logarithms 32 and 24, of twice these 8 and 22 (make
 * bench-error ERROR_SECTIONS=fields). Misses above hardly depend on them: there something is met that nothing was like.
 *
 * What is carried can be as much less. It is told too large where later samples of a pixel make up for earlier ones, as
 * they are spread together; and where there is much of it, it depends on what few samples have met which pixels get
 * more, and those that get none tell too much. Of 300 hairs, 0.3 to 0.8 pixels wide (640 x 480), up to 1.6 times the
 * square was told in passes between; a fifth to a third of that was carried.
 */
#define HIDDEN_LEAST (1.0 / 16)
#define HIDDEN_MOST  4.0

/*
 * From the errors of so many pixels, at the number-th (1, 2, ...) look of this kind. Of one pixel, or where
 * one has nearly all of the error, the interval is too narrow: how much such a sum scatters a single error
 * does not tell.
 */
struct error_estimate error_estimate(const struct error_told *told, uint64_t pixels,
                                     enum error_look look, unsigned number);

/* An error that was seen, for a forecast: its logarithm has the standard deviation spread, at most. */
struct error_point {
    double seconds; /* of rendering, where it matters */
    double rmse;
    double spread;
};

/* A point from errors of so many pixels; false: there is no error to be seen. */
bool error_point(const struct error_told *told, uint64_t pixels, double seconds,
                 struct error_point *point);

/* A moment of a run. */
struct error_row {
    double elapsed_s; /* since the start of the program */
    double samples;   /* per pixel of the picture, mean */
    struct error_estimate estimate;
    double true_rmse; /* against the reference; NAN without one */
    double share; /* of the picture's pixels: those that have samples, of which the estimate is */
};

struct error_log {
    struct error_row *rows; /* owned */
    size_t count;
};

void error_log_add(struct error_log *log, const struct error_row *row);
void error_log_free(struct error_log *log);

/* CSV: the line of names, and a row's. */
void error_names_csv(FILE *out);
void error_row_csv(FILE *out, const struct error_row *row);

#endif
