#include "master/watch.h"

#include <errno.h>
#include <math.h>
#include <string.h>

#include "common/message.h"

/* The first row comes this many seconds after the start, every further one when the time has grown
 * by this factor: evenly spread where error is drawn against time, both logarithmic. */
#define FIRST_ROW  0.5
#define ROW_FACTOR 1.25

bool watch_start(struct watch *watch, const char *csv)
{
    watch->next = watch->begin + FIRST_ROW;
    if (!csv || !csv[0]) return true;
    watch->csv = fopen(csv, "w");
    if (watch->csv) {
        error_names_csv(watch->csv);
        fflush(watch->csv);
        return true;
    }
    user_error(NULL, 0, "output.error = %s cannot be written: %s", csv, strerror(errno));
    return false;
}

void watch_add(struct watch *watch, uint64_t pixels, const struct render_counts *counts)
{
    watch->finished += pixels;
    error_sum_add(&watch->sampling, &counts->sampling);
    error_sum_add(&watch->halfway, &counts->halfway);
}

static void add_row(struct watch *watch, double now)
{
    unsigned look = (unsigned)watch->log.count + 1;
    struct error_row row = {
        .elapsed_s = now - watch->begin,
        .samples = (double)watch->finished * watch->samples / (double)watch->pixels,
        .estimate = error_estimate(&watch->sampling, watch->finished, look),
        .true_rmse = NAN,
    };
    error_log_add(&watch->log, &row);
    if (!watch->csv) return;
    error_row_csv(watch->csv, &row);
    fflush(watch->csv);
}

/* A single sample in the middle of every pixel tells nothing about its error. */
static bool sees_error(const struct watch *watch)
{
    return watch->samples > 1 && watch->finished > 0;
}

void watch_look(struct watch *watch, double now)
{
    if (now < watch->next || !sees_error(watch)) return;
    add_row(watch, now);
    watch->next = watch->begin + (now - watch->begin) * ROW_FACTOR;
}

bool watch_end(struct watch *watch, double now, double render_s, struct error_forecast *forecast)
{
    if (sees_error(watch)) add_row(watch, now);
    struct error_point points[2];
    uint32_t half = samples_halfway(watch->samples);
    double share = (double)half / watch->samples;
    size_t count = 0;
    if (half > 0)
        count += error_point(&watch->halfway, watch->finished, render_s * share, &points[count]);
    count += error_point(&watch->sampling, watch->finished, render_s, &points[count]);
    *forecast = error_forecast(points, count);
    if (!watch->csv) return true;
    bool written = !ferror(watch->csv);
    written &= fclose(watch->csv) == 0;
    watch->csv = NULL;
    if (!written) user_error(NULL, 0, "output.error could not be written: %s", strerror(errno));
    return written;
}

void watch_free(struct watch *watch)
{
    if (watch->csv) fclose(watch->csv);
    watch->csv = NULL;
    error_log_free(&watch->log);
}
