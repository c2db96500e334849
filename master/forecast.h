/* What less of the sampling error would cost. */
#ifndef FARM_MASTER_FORECAST_H
#define FARM_MASTER_FORECAST_H

#include "master/error.h"

/* RMSE = rmse * (seconds of rendering / seconds)^-slope, between now and what is asked for. */
struct error_forecast {
    bool known;
    bool beyond; /* it is not, for no run with so few samples at most comes so far */
    double rmse, seconds;
    double goal;                /* the smaller error that it is for */
    double slope, slope_spread; /* and its standard deviation */
    double samples;             /* of each pixel, to reach that; 0: they differ */
    double scatter;             /* seconds of rendering that it is uncertain by at least */
};

/* Whether there is a number of samples to ask for. */
static inline bool forecast_tells_samples(const struct error_forecast *forecast)
{
    return forecast->samples > 0 && forecast->samples <= SAMPLES_MAX;
}

/*
 * With the same number of samples everywhere, from how the error went down between samples_halfway() of
 * them and all, the two points; the first one's seconds do not matter. n samples that are spread evenly
 * (worker/sample.h) leave a squared error of n^-3/2 where an edge runs through a pixel (D. Mitchell,
 * "Consequences of stratified sampling in graphics", SIGGRAPH 1996), of up to n^-3 where it is smooth (A.
 * Owen, "Scrambled net variance for integrals of smooth functions", Ann. Stat. 25, 1997), and of n^-1
 * where detail is finer than they are. So what is steeper than edges are will not stay so: it is reckoned
 * as the sum of what goes down by FORECAST_EDGE and by FORECAST_SMOOTH, the latter as it went down in
 * pictures of 19 scenes; what is flatter goes on as it is.
 *
 * A slope between two errors that are not known well is worth less than what slopes are like elsewhere:
 * both errors are taken to be off by what is most likely if slopes scatter by FORECAST_SLOPE_SPREAD around
 * FORECAST_SLOPE. These are the means over 19 scenes of 200 x 150 pixels, from 4 samples up to 32.
 *
 * All that goes for numbers of samples that are powers of two, of which each half of a pixel's is spread as
 * evenly as can be. Between them the logarithm of the error is FORECAST_UNEVEN larger than on a line from
 * one to the next: the mean of 15 numbers from 10 to 60 in 8 scenes, 0.08 to 0.15 for each. So often
 * the next power of two is what reaches the goal first.
 *
 * The interval has what both errors and the usual slope may be off by, besides FORECAST_SPREAD, as if one
 * had nothing to do with the other: it is rather too wide, as the part's samples are among all. It has no
 * upper end where an error may as well not go down. samples: of the last point, 4 or more; goal: below
 * its error by more than what that may be off by.
 */
#define FORECAST_EDGE         1.5
#define FORECAST_SMOOTH       2.25
#define FORECAST_SLOPE        0.83
#define FORECAST_SLOPE_SPREAD 0.08
#define FORECAST_UNEVEN       0.11
struct error_forecast error_forecast(const struct error_point points[2], uint32_t samples,
                                     double goal);

/* The power of samples, by whole doublings, that the squared error goes down with from the last point to
 * goal, by the same law; FORECAST_EDGE where there is none. */
double error_power(const struct error_point points[2], uint32_t samples, double goal);

/*
 * Seconds grow with samples a little slower than these, as n + FORECAST_ROOT n^1/2: rays find more of the caches filled
 * and more rays that go the same way. By CPU time twice as many took, in the mean of 21 scenes of 200 x 150 pixels,
 * 2^0.86 times as long from 4 on, 2^0.90 from 8, 2^0.92 from 16, 2^0.94 from 32 and 2^0.95 from 64, as this does to
 * 0.01; single scenes from 2^0.70 (an object in front of nothing) to 2^1.03, with what the machine was off by. In
 * seven scenes of 640 x 480 it was 2^0.87, 0.92, 0.94, 0.94 and 0.95.
 */
#define FORECAST_ROOT 0.9

/*
 * That so many seconds more lower the error from a point to goal, below it; HUGE_VAL: nothing that is allowed
 * does; NaN, 0 or less: nobody knows. The slope is that between the two. FORECAST_SPREAD is what such foresight was
 * off by, relative to what was still to come then (make bench-error, section forecast, prints it): all in all, so
 * that an interval with what the errors are off by beside it is rather too wide.
 */
#define FORECAST_SPREAD 0.2
struct error_forecast error_forecast_to(const struct error_point *now, double goal, double more);

/*
 * Where hardly anything is still to come the slope hardly matters, but a run takes more or less time than another one
 * just like it: by FORECAST_SCATTER, the standard deviation of eight runs of 5 ms by themselves (8 to 36 % where others
 * used the processor, too, which nobody foresees). What is to come takes at least a pass, whose planning takes plan_s
 * and is not foreseen.
 */
#define FORECAST_SCATTER 0.02
void forecast_scatters(struct error_forecast *forecast, double plan_s);

/* No slope by which errors go down is steeper: of n samples the error is at best n^-3/2, and they take n^0.70 as long
 * at least. What is steeper says that a few pixels have most of the error, and is no law. */
#define FORECAST_STEEPEST (1.5 / 0.70)

/* Seconds of rendering until the error is rmse; *low and *high: +- one standard deviation of the slope, and what time
 * scatters by at least, but none is less than what there has been. */
double forecast_seconds(const struct error_forecast *forecast, double rmse, double *low,
                        double *high);

/* A round number (1, 1.5, 2, 3, 5 or 7 times a power of ten) at most half of rmse, and 0.3 of it at
 * least: what less would be. */
double forecast_goal(double rmse);

#endif
