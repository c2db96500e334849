#include "master/forecast.h"

#include <math.h>

/* The power law from now to goal. log_time: by how much the logarithm of time grows until the goal is reached.
 * slope_spread: standard deviation of the slope that comes from the uncertainty of the errors. */
static struct error_forecast law_to(const struct error_point *now, double goal, double log_time,
                                    double slope_spread)
{
    struct error_forecast forecast = {.rmse = now->rmse, .seconds = now->seconds, .goal = goal};
    if (!(goal < now->rmse && log_time > 0 && log_time < HUGE_VAL)) return forecast;
    forecast.slope = log(now->rmse / goal) / log_time;
    /* FORECAST_SPREAD is relative to what is still to come, which is less than the whole time. */
    double foresight = FORECAST_SPREAD * -expm1(-log_time) * forecast.slope / log_time;
    forecast.slope_spread = hypot(foresight, slope_spread);
    forecast.known = forecast.slope_spread < HUGE_VAL;
    return forecast;
}

struct error_forecast error_forecast_to(const struct error_point *now, double goal, double more)
{
    double log_time = log1p(more / now->seconds);
    struct error_forecast forecast = law_to(now, goal, log_time, now->log_spread / log_time);
    forecast.beyond = more == HUGE_VAL;
    return forecast;
}

/* How the squared error goes down with the number of samples: `smooth_share` of it with the power FORECAST_SMOOTH,
 * the rest with `power`. This is FORECAST_EDGE, or less if share is 0. */
struct decline {
    double power, smooth_share;
};

/* The decline of a squared error that was divided by `error_ratio` when the number of samples was multiplied by
 * `ratio`; both are above 1. */
static struct decline decline_of(double ratio, double error_ratio)
{
    double edge = pow(ratio, FORECAST_EDGE), smooth = pow(ratio, FORECAST_SMOOTH);
    if (error_ratio <= edge) return (struct decline){log(error_ratio) / log(ratio), 0};
    return (struct decline){FORECAST_EDGE, fmin((error_ratio - edge) / (smooth - edge), 1)};
}

/* The part of the squared error that is left with `ratio` times as many samples. */
static double left_after(const struct decline *decline, double ratio)
{
    return (1 - decline->smooth_share) * pow(ratio, -decline->power) +
           decline->smooth_share * pow(ratio, -FORECAST_SMOOTH);
}

/* The factor on the number of samples that leaves the part `left`, below 1, of the squared error. */
static double times_samples(const struct decline *decline, double left)
{
    double low = 1, high = pow(left, -1 / decline->power); /* bound: nothing is smooth */
    for (int i = 0; i < 60; i++) {
        double middle = (low + high) / 2;
        if (left_after(decline, middle) > left)
            low = middle;
        else
            high = middle;
    }
    return high;
}

static bool is_power_of_two(uint32_t samples)
{
    return (samples & (samples - 1)) == 0;
}

/* The arguments of error_forecast(). */
struct observation {
    const struct error_point *points;
    uint32_t samples;
    double goal;
};

/* The uncertainty of the inputs is propagated by repeating the computation with one of them perturbed by its standard
 * deviation. What is added to the inputs: to the logarithms of both points' errors, and to the usual slope. */
struct perturbation {
    double first, last, slope;
};

/* A run with this number of samples, and the error expected of it. */
struct expected_run {
    double samples, rmse;
};

/* The logarithms of both points' errors, corrected to powers of two; the logarithm of the ratio of their samples; by
 * how much the errors are farther apart than with the usual slope, and the variance of that. */
struct log_errors {
    double first, last, log_ratio;
    double too_steep, variance;
};

static struct log_errors log_errors_of(const struct observation *it, struct perturbation by)
{
    const struct error_point *points = it->points;
    uint32_t half = samples_halfway(it->samples);
    struct log_errors logs = {.first = log(points[0].rmse) + by.first,
                              .last = log(points[1].rmse) + by.last,
                              .log_ratio = log((double)it->samples / half)};
    if (!is_power_of_two(half)) logs.first -= FORECAST_UNEVEN;
    if (!is_power_of_two(it->samples)) logs.last -= FORECAST_UNEVEN;
    logs.too_steep = logs.first - logs.last - (FORECAST_SLOPE + by.slope) * logs.log_ratio;
    logs.variance = pow(points[0].log_spread, 2) + pow(points[1].log_spread, 2) +
                    pow(FORECAST_SLOPE_SPREAD * logs.log_ratio, 2);
    return logs;
}

/* Whether the error has gone up by more than both errors may be off by, CONTRADICTION standard deviations: a few pixels
 * have most of it, and half of the samples had missed what is in them. */
#define CONTRADICTION 3
static bool has_gone_up(const struct observation *it)
{
    struct log_errors logs = log_errors_of(it, (struct perturbation){0});
    double spread = hypot(it->points[0].log_spread, it->points[1].log_spread);
    return logs.last - logs.first > CONTRADICTION * spread;
}

/* How the error goes down from the last point on; *at: the logarithm of its error, corrected to powers of two and by
 * the usual slope. false: it does not go down. */
static bool fit_decline(const struct observation *it, struct perturbation by,
                        struct decline *decline, double *at)
{
    struct log_errors logs = log_errors_of(it, by);
    /* Both errors are moved towards the usual slope, each by its part of the variance. */
    double step = logs.too_steep / logs.variance;
    double first = logs.first - step * pow(it->points[0].log_spread, 2);
    double last = logs.last + step * pow(it->points[1].log_spread, 2);
    *at = last;
    if (!(first > last)) return false;
    *decline = decline_of(exp(logs.log_ratio), exp(2 * (first - last)));
    return true;
}

/* The run with the fewest samples, an even number or a power of two, that reach the goal; HUGE_VAL samples: errors do
 * not go down. */
static struct expected_run shortest_run(const struct observation *it, struct perturbation by)
{
    struct decline decline;
    double now;
    if (!fit_decline(it, by, &decline, &now)) return (struct expected_run){HUGE_VAL, 0};
    double left = pow(it->goal, 2) * exp(-2 * now), left_even = fmin(left, 1),
           left_uneven = fmin(left * exp(-2 * FORECAST_UNEVEN), 1);
    double uneven = it->samples * times_samples(&decline, left_uneven);
    double even = exp2(ceil(log2(it->samples * times_samples(&decline, left_even)) - 1e-9));
    double samples = fmin(2 * ceil(uneven / 2), even);
    double above = samples < even ? FORECAST_UNEVEN : 0;
    double left_then = left_after(&decline, samples / it->samples);
    return (struct expected_run){samples, exp(now + above) * sqrt(left_then)};
}

/* The logarithm, up to a constant, of the time that this number of samples takes. */
static double log_effort(double samples)
{
    return log(samples + FORECAST_ROOT * sqrt(samples));
}

/* By how much the logarithm of time grows until the goal is reached, along a straight line to the expected run;
 * HUGE_VAL: errors do not go down. */
static double log_time_to_goal(const struct observation *it, struct perturbation by)
{
    struct expected_run to = shortest_run(it, by);
    double now = it->points[1].rmse;
    if (!(to.samples < HUGE_VAL)) return HUGE_VAL;
    if (!(it->goal < now && to.rmse < now && to.samples > it->samples)) return 0;
    double log_time = log_effort(to.samples) - log_effort(it->samples);
    return log_time * log(now / it->goal) / log(now / to.rmse);
}

/* Uncertainty of the slope by one input: half of the difference between the slopes with this perturbation, to the steep
 * side, and with the opposite one. HUGE_VAL: on the steep side the goal is reached already. */
static double slope_uncertainty(const struct observation *it, struct perturbation steep)
{
    struct perturbation flat = {-steep.first, -steep.last, -steep.slope};
    double slopes_apart = 1 / log_time_to_goal(it, steep) - 1 / log_time_to_goal(it, flat);
    return log(it->points[1].rmse / it->goal) * slopes_apart / 2;
}

struct error_forecast error_forecast(const struct error_point points[2], uint32_t samples,
                                     double goal)
{
    const struct observation it = {points, samples, goal};
    const struct perturbation none = {0};
    if (has_gone_up(&it)) return law_to(&points[1], goal, 0, 0);
    double a = points[0].log_spread, b = points[1].log_spread, s = FORECAST_SLOPE_SPREAD;
    double by_first = slope_uncertainty(&it, (struct perturbation){.first = a});
    double by_last = slope_uncertainty(&it, (struct perturbation){.last = -b});
    double by_slope = slope_uncertainty(&it, (struct perturbation){.slope = s});
    struct error_forecast forecast = law_to(&points[1], goal, log_time_to_goal(&it, none),
                                            hypot(hypot(by_first, by_last), by_slope));
    forecast.samples = shortest_run(&it, none).samples;
    return forecast;
}

double error_power(const struct error_point points[2], uint32_t samples, double goal)
{
    const struct observation it = {points, samples, goal};
    struct decline decline;
    double now;
    if (!fit_decline(&it, (struct perturbation){0}, &decline, &now)) return FORECAST_EDGE;
    double left = pow(goal, 2) * exp(-2 * now);
    if (!(left < 1)) return FORECAST_EDGE;
    return -log(left) / log(times_samples(&decline, left));
}

static double seconds_at(const struct error_forecast *forecast, double rmse, double slope)
{
    if (!(slope > 0)) return HUGE_VAL;
    return forecast->seconds * pow(forecast->rmse / rmse, 1 / slope);
}

void forecast_set_scatter(struct error_forecast *forecast, double plan_s)
{
    forecast->scatter = FORECAST_SCATTER * forecast->seconds + plan_s;
}

double forecast_seconds(const struct error_forecast *forecast, double rmse, double *low,
                        double *high)
{
    double seconds = seconds_at(forecast, rmse, forecast->slope);
    double least = fmax(seconds - forecast->scatter, fmin(forecast->seconds, seconds));
    *low = fmin(seconds_at(forecast, rmse, forecast->slope + forecast->slope_spread), least);
    *high = fmax(seconds_at(forecast, rmse, forecast->slope - forecast->slope_spread),
                 seconds + forecast->scatter);
    return seconds;
}

/* digit times the power of ten, correctly rounded: 0.0003 itself, which the product of 3 and 0.0001 is not. */
static double scaled(double digit, double power)
{
    return power < 0 ? digit / pow(10, -power) : digit * pow(10, power);
}

double forecast_goal(double rmse)
{
    static const double digits[] = {1, 1.5, 2, 3, 5, 7};
    double power = floor(log10(rmse / 2));
    size_t i = sizeof digits / sizeof *digits - 1;
    while (i > 0 && scaled(digits[i], power) > rmse / 2)
        i--;
    return scaled(digits[i], power);
}
