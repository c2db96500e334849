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
struct halfway {
    const struct error_point *points;
    uint32_t samples;
    double goal;
};

/* Assumed errors of the inputs: of the logarithms of both points' errors, and of the usual slope. */
struct input_errors {
    double part, now, slope;
};

/* A run with this number of samples, and the error expected of it. */
struct prospect {
    double samples, rmse;
};

/* The logarithms of both points' errors, corrected to powers of two; the logarithm of the ratio of their samples; by
 * how much the errors are farther apart than with the usual slope, and the variance of that. */
struct apart {
    double part, now, log_ratio;
    double too_steep, variance;
};

static struct apart apart_if_off(const struct halfway *it, struct input_errors off)
{
    const struct error_point *points = it->points;
    uint32_t half = samples_halfway(it->samples);
    struct apart apart = {.part = log(points[0].rmse) + off.part,
                          .now = log(points[1].rmse) + off.now,
                          .log_ratio = log((double)it->samples / half)};
    if (!is_power_of_two(half)) apart.part -= FORECAST_UNEVEN;
    if (!is_power_of_two(it->samples)) apart.now -= FORECAST_UNEVEN;
    apart.too_steep = apart.part - apart.now - (FORECAST_SLOPE + off.slope) * apart.log_ratio;
    apart.variance = pow(points[0].log_spread, 2) + pow(points[1].log_spread, 2) +
                     pow(FORECAST_SLOPE_SPREAD * apart.log_ratio, 2);
    return apart;
}

/* Whether the error has gone up by more than both errors may be off by, CONTRADICTION standard deviations: a few pixels
 * have most of it, and half of the samples had missed what is in them. */
#define CONTRADICTION 3
static bool has_gone_up(const struct halfway *it)
{
    struct apart apart = apart_if_off(it, (struct input_errors){0});
    double spread = hypot(it->points[0].log_spread, it->points[1].log_spread);
    return apart.now - apart.part > CONTRADICTION * spread;
}

/* How the error goes down from the last point on; *at: the logarithm of its error, corrected to powers of two and by
 * the usual slope. false: it does not go down. */
static bool decline_if_off(const struct halfway *it, struct input_errors off,
                           struct decline *decline, double *at)
{
    struct apart apart = apart_if_off(it, off);
    /* Both errors are moved towards the usual slope, each by its part of the variance. */
    double step = apart.too_steep / apart.variance;
    double part = apart.part - step * pow(it->points[0].log_spread, 2);
    double now = apart.now + step * pow(it->points[1].log_spread, 2);
    *at = now;
    if (!(part > now)) return false;
    *decline = decline_of(exp(apart.log_ratio), exp(2 * (part - now)));
    return true;
}

/* The run with the fewest samples, an even number or a power of two, that reach the goal; HUGE_VAL samples: errors do
 * not go down. */
static struct prospect prospect_if_off(const struct halfway *it, struct input_errors off)
{
    struct decline decline;
    double now;
    if (!decline_if_off(it, off, &decline, &now)) return (struct prospect){HUGE_VAL, 0};
    double left = pow(it->goal, 2) * exp(-2 * now), left_even = fmin(left, 1),
           left_uneven = fmin(left * exp(-2 * FORECAST_UNEVEN), 1);
    double uneven = it->samples * times_samples(&decline, left_uneven);
    double even = exp2(ceil(log2(it->samples * times_samples(&decline, left_even)) - 1e-9));
    double samples = fmin(2 * ceil(uneven / 2), even);
    double above = samples < even ? FORECAST_UNEVEN : 0;
    return (struct prospect){samples,
                             exp(now + above) * sqrt(left_after(&decline, samples / it->samples))};
}

/* The logarithm, up to a constant, of the time that this number of samples takes. */
static double log_effort(double samples)
{
    return log(samples + FORECAST_ROOT * sqrt(samples));
}

/* By how much the logarithm of time grows until the goal is reached, along a straight line to the expected run, if the
 * inputs are off by `off`; HUGE_VAL: errors do not go down. */
static double log_time_if_off(const struct halfway *it, struct input_errors off)
{
    struct prospect to = prospect_if_off(it, off);
    double now = it->points[1].rmse;
    if (!(to.samples < HUGE_VAL)) return HUGE_VAL;
    if (!(it->goal < now && to.rmse < now && to.samples > it->samples)) return 0;
    double log_time = log_effort(to.samples) - log_effort(it->samples);
    return log_time * log(now / it->goal) / log(now / to.rmse);
}

/* Uncertainty of the slope by an input that may be off to both sides: half of the difference between the slopes for
 * `steep` and `flat`, what log_time_if_off() is then. HUGE_VAL: on the steep side the goal is reached already. */
static double slope_off(const struct halfway *it, double steep, double flat)
{
    return log(it->points[1].rmse / it->goal) * (1 / steep - 1 / flat) / 2;
}

struct error_forecast error_forecast(const struct error_point points[2], uint32_t samples,
                                     double goal)
{
    const struct halfway it = {points, samples, goal};
    if (has_gone_up(&it)) return law_to(&points[1], goal, 0, 0);
    double a = points[0].log_spread, b = points[1].log_spread;
    double s = FORECAST_SLOPE_SPREAD;
    double of_part = slope_off(&it, log_time_if_off(&it, (struct input_errors){.part = a}),
                               log_time_if_off(&it, (struct input_errors){.part = -a}));
    double of_now = slope_off(&it, log_time_if_off(&it, (struct input_errors){.now = -b}),
                              log_time_if_off(&it, (struct input_errors){.now = b}));
    double of_slope = slope_off(&it, log_time_if_off(&it, (struct input_errors){.slope = s}),
                                log_time_if_off(&it, (struct input_errors){.slope = -s}));
    struct error_forecast forecast =
        law_to(&points[1], goal, log_time_if_off(&it, (struct input_errors){0}),
               hypot(hypot(of_part, of_now), of_slope));
    forecast.samples = prospect_if_off(&it, (struct input_errors){0}).samples;
    return forecast;
}

double error_power(const struct error_point points[2], uint32_t samples, double goal)
{
    const struct halfway it = {points, samples, goal};
    struct decline decline;
    double now;
    if (!decline_if_off(&it, (struct input_errors){0}, &decline, &now)) return FORECAST_EDGE;
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
