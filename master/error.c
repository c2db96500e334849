#include "master/error.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"

/* ---- estimates ---- */

/* z such that a normally distributed variable is outside +-z with probability miss: erfc(z / sqrt(2)) = miss. */
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
 * Standard deviation, by chance, of the logarithm of a sum of squared errors. Pixels are independent, and the variance
 * of a pixel's squared error is at most the mean of its fourth power.
 */
static double log_spread(const struct error_sum *sum)
{
    return sqrt(sum->fourths) / sum->squares;
}

double error_odd(uint32_t samples)
{
    uint32_t fewer = samples / 2, more = samples - fewer;
    return fewer > 0 ? log((double)more / fewer) : 0;
}

/* Standard deviation of the logarithm of the hidden squared error, beside that by chance: the squared error of eight
 * pictures of specks, dust, hairs and needles, much of which was hidden, was estimated as 0.6 to 1.7 times what it was
 * in the end. */
#define HIDDEN_SPREAD 0.6

/* The part of a run's misses that each kind of look may have. Passes have more, because wide intervals there cost
 * samples. */
static const double miss_parts[] = {[ERROR_LOOK_PASS] = 0.8, [ERROR_LOOK_BETWEEN] = 0.2};

struct error_estimate error_estimate(const struct error_breakdown *breakdown, uint64_t pixels,
                                     enum error_look look, unsigned number)
{
    const struct error_sum *sum = &breakdown->sum;
    if (pixels == 0 || !(sum->squares > 0)) return (struct error_estimate){0, 0, 0};
    double miss = (1 - ERROR_CONFIDENCE) * miss_parts[look] * 6 / (M_PI * M_PI * number * number);
    /* The estimate is compared with what these pixels' errors happen to be. Their sum is as uncertain as the estimate,
     * and independent of it except for the pixels that both share. */
    double luck = normal_quantile(miss) * M_SQRT2 * log_spread(sum);
    double less = (breakdown->hidden + breakdown->carried) / sum->squares * log(HIDDEN_LEAST);
    double more = breakdown->hidden / sum->squares * log(HIDDEN_MOST);
    double rmse = sqrt(sum->squares / (double)pixels);
    return (struct error_estimate){rmse, rmse * exp(-(hypot(luck, less) + breakdown->odd) / 2),
                                   rmse * exp((hypot(luck, more) + breakdown->odd) / 2)};
}

bool error_point(const struct error_breakdown *breakdown, uint64_t pixels, double seconds,
                 struct error_point *point)
{
    const struct error_sum *sum = &breakdown->sum;
    if (pixels == 0 || !(seconds > 0) || !(sum->squares > 0) || !isfinite(sum->squares))
        return false;
    double share = breakdown->hidden / sum->squares;
    *point = (struct error_point){.seconds = seconds,
                                  .rmse = sqrt(sum->squares / (double)pixels),
                                  .log_spread = hypot(log_spread(sum), HIDDEN_SPREAD * share) / 2};
    return true;
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
    fputs("elapsed_s,samples_per_pixel,estimated_rmse,estimated_low,estimated_high,true_rmse,"
          "sampled_share\n",
          out);
}

void error_row_csv(FILE *out, const struct error_row *row)
{
    put_cell(out, row->elapsed_s, ",");
    put_cell(out, row->samples, ",");
    put_cell(out, row->estimate.rmse, ",");
    put_cell(out, row->estimate.low, ",");
    put_cell(out, row->estimate.high, ",");
    put_cell(out, row->true_rmse, ",");
    put_cell(out, row->sampled_share, "\n");
}
