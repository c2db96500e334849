/* Forecasts what a smaller sampling error would cost. */
#ifndef FARM_MASTER_FORECAST_H
#define FARM_MASTER_FORECAST_H

#include "master/error.h"

/* RMSE = rmse * (t / seconds)^-slope after t seconds of rendering: a power law from the present error to the goal. */
struct error_forecast {
    bool known;
    /* It is unknown because no run with at most max_samples (uniform sampling: SAMPLES_MAX) gets that far. */
    bool beyond;
    double rmse, seconds;
    double goal;                /* the smaller RMSE to be reached */
    double slope, slope_spread; /* slope_spread: standard deviation of slope */
    double samples;             /* of each pixel, to reach the goal; 0: not the same for all */
    double scatter;             /* least uncertainty of the forecast, in seconds of rendering */
    uint32_t max_samples;       /* if it is beyond: those that it takes; 0: not known */
};

/*
 * Forecast for the same number of samples in every pixel, from how the error went down between samples_halfway() of
 * them and all of them: the two points. The seconds of the first point are not used. n samples that are spread evenly
 * (worker/sample.h) leave a squared error of n^-3/2 where an edge runs through a pixel (D. Mitchell, "Consequences of
 * stratified sampling in graphics", SIGGRAPH 1996), of up to n^-3 where the picture is smooth (A. Owen, "Scrambled net
 * variance for integrals of smooth functions", Ann. Stat. 25, 1997), and of n^-1 where detail is finer than the
 * samples. So a decline steeper than that of edges will not last: the squared error is modelled as the sum of a part
 * that goes down with the power FORECAST_EDGE and one that goes down with FORECAST_SMOOTH, as the smooth part did in
 * pictures of 19 scenes. A flatter decline is taken to go on as it is.
 *
 * A slope between two errors that are not known well is less reliable than the slopes of other scenes: both errors are
 * corrected by what is most likely if slopes scatter by FORECAST_SLOPE_SPREAD around FORECAST_SLOPE. These are the
 * means over 19 scenes of 200 x 150 pixels, from 4 samples up to 32.
 *
 * All this holds for numbers of samples that are powers of two, with which each half of a pixel's samples is spread as
 * evenly as can be. Between these the logarithm of the error is larger by FORECAST_UNEVEN than on a line from one power
 * to the next: the mean of 15 numbers from 10 to 60 in 8 scenes, 0.08 to 0.15 for each. So the next power of two is
 * often the smallest number that reaches the goal.
 *
 * The interval contains what both errors and the usual slope may be off by, besides FORECAST_SPREAD, as if these were
 * independent. It is rather too wide, as the first point's samples are among those of the second. It has no upper end
 * where the error may as well not go down. Nothing is known where the last point's error is so uncertain that it may be
 * at the goal already, as that of a single pixel. samples: those of the last point, 4 or more.
 */
#define FORECAST_EDGE         1.5
#define FORECAST_SMOOTH       2.25
#define FORECAST_SLOPE        0.83
#define FORECAST_SLOPE_SPREAD 0.08
#define FORECAST_UNEVEN       0.11
struct error_forecast error_forecast(const struct error_point points[2], uint32_t samples,
                                     double goal);

/* The power of the number of samples with which the squared error goes down from the last point to goal, by the same
 * model, between numbers that are powers of two; FORECAST_EDGE where there is none. */
double error_power(const struct error_point points[2], uint32_t samples, double goal);

/*
 * Seconds grow a little more slowly than the number n of samples, as n + FORECAST_ROOT n^1/2: with more samples, rays
 * find more of what they need in the caches, and more rays that go the same way. In CPU time twice as many samples
 * took, in the mean of 21 scenes of 200 x 150 pixels, 2^0.86 times as long from 4 on, 2^0.90 from 8, 2^0.92 from 16,
 * 2^0.94 from 32 and 2^0.95 from 64; the formula gives the same to 0.01. For single scenes it was from 2^0.70 (an
 * object in front of nothing) to 2^1.03, including the noise of the machine. In seven scenes of 640 x 480 it was
 * 2^0.87, 0.92, 0.94, 0.94 and 0.95.
 */
#define FORECAST_ROOT 0.9

/*
 * Forecast of a run that takes `more` further seconds of rendering from the point to the goal, below its error. more:
 * HUGE_VAL: nothing that is allowed reaches the goal; NaN, 0 or less: unknown. The slope is that between point and
 * goal. FORECAST_SPREAD is what such forecasts were off by, relative to the seconds that were still to come (make
 * bench-error, section forecast, prints it). It includes all causes, so the interval, to which the errors' uncertainty
 * is added, is rather too wide.
 */
#define FORECAST_SPREAD 0.2
struct error_forecast error_forecast_to(const struct error_point *now, double goal, double more);

/*
 * Sets the least uncertainty of a forecast. If hardly anything is still to come, the slope hardly matters, but equal
 * runs take different times. Their relative standard deviation is FORECAST_SCATTER, as measured in eight runs of 5 ms
 * on an otherwise idle machine (8 to 36 % where others used the processor, which cannot be foreseen). plan_s is added,
 * as what is still to come takes at least one pass, whose planning takes plan_s and is not part of the forecast.
 */
#define FORECAST_SCATTER 0.02
void forecast_set_scatter(struct error_forecast *forecast, double plan_s);

/* The steepest possible slope of error against time: the error of n samples is n^-3/2 at best, and they take at least
 * n^0.70 as long. A steeper slope means that a few pixels have most of the error, and will not last. */
#define FORECAST_STEEPEST (1.5 / 0.70)

/* Seconds of rendering until the error is rmse. *low and *high: the same with a slope that is one standard deviation
 * steeper or flatter, and at least `scatter` lower or higher; but scatter does not lower *low below the time so far. */
double forecast_seconds(const struct error_forecast *forecast, double rmse, double *low,
                        double *high);

/* The goal of a forecast: a round number (1, 1.5, 2, 3, 5 or 7 times a power of ten) that is at most half of rmse and
 * at least 0.3 of it. */
double forecast_goal(double rmse);

#endif
