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

struct error_forecast error_forecast(const struct error_point *points, size_t count)
{
    struct error_forecast forecast = {0};
    if (count < 2) return forecast;
    if (count > FORECAST_POINTS) {
        points += count - FORECAST_POINTS;
        count = FORECAST_POINTS;
    }
    /* Least squares of the logarithms, measured from the last point. */
    const struct error_point *last = &points[count - 1];
    double xx = 0, xy = 0, noise = 0;
    for (size_t i = 0; i + 1 < count; i++) {
        double x = log(last->seconds / points[i].seconds);
        xx += x * x;
        xy += x * log(points[i].rmse / last->rmse);
        noise += x * x * (points[i].spread * points[i].spread + last->spread * last->spread);
    }
    if (!(xx > 0)) return forecast;
    forecast.rmse = last->rmse;
    forecast.seconds = last->seconds;
    forecast.slope = xy / xx;
    double rest = 0;
    for (size_t i = 0; i + 1 < count; i++) {
        double x = log(last->seconds / points[i].seconds);
        double miss = log(points[i].rmse / last->rmse) - forecast.slope * x;
        rest += miss * miss;
    }
    if (count > 2) rest /= (double)count - 2;
    forecast.slope_spread = sqrt(noise / (xx * xx) + rest / xx);
    forecast.known = forecast.slope > 0 && isfinite(forecast.slope);
    return forecast;
}

struct error_forecast error_forecast_to(const struct error_point *now, double goal, double more)
{
    struct error_forecast forecast = {.rmse = now->rmse, .seconds = now->seconds};
    double times = log1p(more / now->seconds);
    if (!(goal < now->rmse && times > 0 && times < HUGE_VAL)) return forecast;
    forecast.slope = log(now->rmse / goal) / times;
    /* Uncertain is what is to come, and where it begins. */
    double spread =
        hypot(FORECAST_SPREAD * more / (now->seconds + more), now->spread / forecast.slope);
    forecast.slope_spread = forecast.slope * spread / times;
    forecast.known = true;
    return forecast;
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
