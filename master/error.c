#include "master/error.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"

/* ---- estimates ---- */

/* z with erfc(z / sqrt(2)) = miss: the normal distribution is outside of +-z so often. */
static double normal_quantile(double miss)
{
    double low = 0, high = 40;
    for (int i = 0; i < 60; i++) {
        double middle = (low + high) / 2;
        if (erfc(middle * M_SQRT1_2) > miss)
            low = middle;
        else
            high = middle;
    }
    return high;
}

/*
 * The standard deviation of the logarithm of a sum of squared errors. Pixels are independent, and
 * the variance of one's squared error is at most its fourth power on average.
 */
static double log_spread(const struct error_sum *sum)
{
    return sqrt(sum->fourths) / sum->squares;
}

struct error_estimate error_estimate(const struct error_sum *sum, uint64_t pixels, unsigned look)
{
    if (pixels == 0 || !(sum->squares > 0)) return (struct error_estimate){0, 0, 0};
    double miss = (1 - ERROR_CONFIDENCE) * 6 / (M_PI * M_PI * look * look);
    /* What the estimate is compared with is itself the sum of what these pixels happen to have: as
     * uncertain as the estimate, and independent of it but for the pixels they share. */
    double spread = M_SQRT2 * log_spread(sum);
    double rmse = sqrt(sum->squares / (double)pixels);
    double factor = exp(normal_quantile(miss) * spread / 2);
    return (struct error_estimate){rmse, rmse / factor, rmse * factor};
}

/* ---- rows ---- */

void error_log_add(struct error_log *log, const struct error_row *row)
{
    log->rows = grow(log->rows, log->count, sizeof *log->rows);
    log->rows[log->count++] = *row;
}

void error_log_free(struct error_log *log)
{
    free(log->rows);
    *log = (struct error_log){0};
}

static void put_cell(FILE *out, double value, const char *end)
{
    if (isfinite(value)) fprintf(out, "%.9g", value);
    fputs(end, out);
}

void error_names_csv(FILE *out)
{
    fputs("elapsed_s,samples_per_pixel,estimated_rmse,estimated_low,estimated_high,true_rmse\n",
          out);
}

void error_row_csv(FILE *out, const struct error_row *row)
{
    put_cell(out, row->elapsed_s, ",");
    put_cell(out, row->samples, ",");
    put_cell(out, row->estimate.rmse, ",");
    put_cell(out, row->estimate.low, ",");
    put_cell(out, row->estimate.high, ",");
    put_cell(out, row->true_rmse, "\n");
}

/* ---- forecast ---- */

bool error_point(const struct error_sum *sum, uint64_t pixels, double seconds,
                 struct error_point *point)
{
    if (pixels == 0 || !(seconds > 0) || !(sum->squares > 0) || !isfinite(sum->squares))
        return false;
    *point = (struct error_point){.seconds = seconds,
                                  .rmse = sqrt(sum->squares / (double)pixels),
                                  .spread = log_spread(sum) / 2};
    return true;
}

/* The law from now to goal, a logarithm of time of `times` later, as far as the errors are known. */
static struct error_forecast law_to(const struct error_point *now, double goal, double times,
                                    double slope_spread)
{
    struct error_forecast forecast = {.rmse = now->rmse, .seconds = now->seconds};
    if (!(goal < now->rmse && times > 0 && times < HUGE_VAL)) return forecast;
    forecast.slope = log(now->rmse / goal) / times;
    /* FORECAST_SPREAD of what is still to come is less of all. */
    double foresight = FORECAST_SPREAD * -expm1(-times) * forecast.slope / times;
    forecast.slope_spread = hypot(foresight, slope_spread);
    forecast.known = true;
    return forecast;
}

struct error_forecast error_forecast_to(const struct error_point *now, double goal, double more)
{
    double times = log1p(more / now->seconds);
    return law_to(now, goal, times, now->spread / times);
}

/*
 * How many times the samples leave so much of the squared error (0..1), after ratio times the samples left
 * went^-1 of it; log(went) / log(ratio) is above 0.
 */
static double times_samples(double ratio, double went, double left)
{
    double edge = pow(ratio, FORECAST_EDGE), smooth = pow(ratio, FORECAST_SMOOTH);
    if (went <= edge) return pow(left, -log(ratio) / log(went));
    double share = fmin((went - edge) / (smooth - edge), 1); /* of what is smooth */
    double low = 1, high = pow(left, -1 / FORECAST_EDGE);    /* as if all were edges */
    for (int i = 0; i < 60; i++) {
        double middle = (low + high) / 2;
        if ((1 - share) * pow(middle, -FORECAST_EDGE) + share * pow(middle, -FORECAST_SMOOTH) >
            left)
            low = middle;
        else
            high = middle;
    }
    return high;
}

/* What error_forecast() takes. */
struct halfway {
    const struct error_point *points;
    double goal;
};

/* What is wrong, in logarithms: both points' errors, and the usual slope. */
struct off {
    double part, now, slope;
};

/* By how much the logarithm of time grows up to the goal if that is off; HUGE_VAL: errors do not go down. */
static double times_if_off(const struct halfway *it, struct off off)
{
    const struct error_point *points = it->points;
    double part = log(points[0].rmse) + off.part, now = log(points[1].rmse) + off.now;
    double ratio = points[1].seconds / points[0].seconds, log_ratio = log(ratio);
    /* Both errors are moved, each by its part of the variance, towards the usual slope. */
    double part_variance = pow(points[0].spread, 2), now_variance = pow(points[1].spread, 2);
    double scatter = pow(FORECAST_SLOPE_SPREAD * log_ratio, 2);
    double too_steep = part - now - (FORECAST_SLOPE + off.slope) * log_ratio;
    double step = too_steep / (part_variance + now_variance + scatter);
    part -= step * part_variance;
    now += step * now_variance;
    double went = exp(2 * (part - now)), left = pow(it->goal, 2) * exp(-2 * now);
    if (!(went > 1)) return HUGE_VAL;
    if (!(left < 1)) return 0;
    return FORECAST_TIME * log(times_samples(ratio, went, left));
}

/* What an error that may be off to both sides makes of the slope. */
static double slope_off(const struct halfway *it, double steep, double flat)
{
    return log(it->points[1].rmse / it->goal) * (1 / steep - 1 / flat) / 2;
}

struct error_forecast error_forecast(const struct error_point points[2], double goal)
{
    const struct halfway it = {points, goal};
    double a = points[0].spread, b = points[1].spread;
    if (!(points[1].seconds > points[0].seconds)) return (struct error_forecast){0};
    double s = FORECAST_SLOPE_SPREAD;
    double of_part = slope_off(&it, times_if_off(&it, (struct off){.part = a}),
                               times_if_off(&it, (struct off){.part = -a}));
    double of_now = slope_off(&it, times_if_off(&it, (struct off){.now = -b}),
                              times_if_off(&it, (struct off){.now = b}));
    double of_slope = slope_off(&it, times_if_off(&it, (struct off){.slope = s}),
                                times_if_off(&it, (struct off){.slope = -s}));
    return law_to(&points[1], goal, times_if_off(&it, (struct off){0}),
                  hypot(hypot(of_part, of_now), of_slope));
}

static double seconds_at(const struct error_forecast *forecast, double rmse, double slope)
{
    if (!(slope > 0)) return HUGE_VAL;
    return forecast->seconds * pow(forecast->rmse / rmse, 1 / slope);
}

double forecast_seconds(const struct error_forecast *forecast, double rmse, double *low,
                        double *high)
{
    *low = seconds_at(forecast, rmse, forecast->slope + forecast->slope_spread);
    *high = seconds_at(forecast, rmse, forecast->slope - forecast->slope_spread);
    return seconds_at(forecast, rmse, forecast->slope);
}

double forecast_goal(double rmse)
{
    double power = pow(10, floor(log10(rmse / 2)));
    double digit = rmse / 2 / power;
    return (digit >= 5 ? 5 : digit >= 2 ? 2 : 1) * power;
}
