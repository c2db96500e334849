#include "master/watch.h"

#include <errno.h>
#include <math.h>
#include <string.h>

#include "common/clock.h"
#include "common/message.h"
#include "master/output_file.h"
#include "master/truth.h"

#define FIRST_ROW 0.5 /* seconds after the start */

/* The first failure tells why: later ones may have no errno of their own. */
static void flush_rows(struct watch *watch)
{
    errno = 0;
    if ((fflush(watch->csv) == 0 && !ferror(watch->csv)) || watch->csv_error) return;
    watch->csv_error = errno ? errno : EIO;
}

bool watch_start(struct watch *watch, const char *csv)
{
    watch->next = watch->begin + FIRST_ROW;
    watch->snapshot.due = watch->begin + watch->snapshot.seconds;
    if (!csv || !csv[0]) return true;
    watch->csv = open_in_place(csv);
    if (watch->csv) {
        error_names_csv(watch->csv);
        flush_rows(watch);
    } else {
        watch->csv_error = errno;
    }
    if (!watch->csv_error) return true;
    user_error(NULL, 0, "output.error = %s cannot be written: %s", csv, strerror(watch->csv_error));
    return false;
}

void watch_add(struct watch *watch, uint64_t pixels, const struct result_header *header)
{
    watch->pixels_finished += pixels;
    watch->work_s += header->cpu_s;
    error_sum_add(&watch->sampling, &header->counts.sampling);
    error_sum_add(&watch->halfway, &header->counts.halfway);
}

/* The state of the picture at a moment. */
struct look {
    struct error_breakdown breakdown;
    uint64_t pixels, samples;
};

static struct look look_at(const struct watch *watch)
{
    struct look look = {{.sum = watch->sampling, .odd = error_odd(watch->samples)},
                        watch->pixels_finished,
                        watch->pixels_finished * watch->samples};
    if (watch->adaptive)
        look.breakdown = adaptive_errors(watch->adaptive, &look.pixels, &look.samples);
    return look;
}

/* pass: the one that is complete, or 0. */
static void add_row(struct watch *watch, double now, unsigned pass)
{
    struct look look = look_at(watch);
    /* Single samples in the middle of every pixel tell nothing about the error. */
    if (look.samples <= look.pixels) return;
    enum error_look kind = pass ? ERROR_LOOK_PASS : ERROR_LOOK_BETWEEN;
    unsigned number = pass ? pass : ++watch->looks;
    struct error_row row = {
        .elapsed_s = now - watch->begin,
        .samples = (double)look.samples / (double)canvas_pixels(watch->canvas),
        .estimate = error_estimate(&look.breakdown, look.pixels, kind, number),
        .true_rmse = (double)NAN,
        .sampled_share = (double)look.pixels / (double)canvas_pixels(watch->canvas),
    };
    if (watch->reference && look.pixels == canvas_pixels(watch->canvas))
        row.true_rmse = truth_rmse(watch->canvas, watch->reference);
    error_log_add(&watch->log, &row);
    if (!watch->csv) return;
    error_row_csv(watch->csv, &row);
    flush_rows(watch);
}

/* A row that is added for another reason also counts as the next periodic one, if that is due. */
static void add_row_now(struct watch *watch, double now, unsigned pass)
{
    double started = clock_wall();
    add_row(watch, now, pass);
    if (now < watch->next) return;
    watch->next = watch->begin + watch_next_row(now - watch->begin, clock_wall() - started);
}

void watch_look(struct watch *watch, double now)
{
    snapshot_look(&watch->snapshot, watch->canvas, now);
    if (now >= watch->next) add_row_now(watch, now, 0);
}

void watch_pass(struct watch *watch, double now)
{
    add_row_now(watch, now, adaptive_passes(watch->adaptive));
}

/* Sets two points of the error: half way through the only pass, or the first one, and at its end; false: they
 * are not known. */
static bool points_of(const struct watch *watch, struct error_point points[2])
{
    const struct error_breakdown halfway = {.sum = watch->halfway}, all = {.sum = watch->sampling};
    return error_point(&halfway, watch->pixels_finished, watch->work_s, &points[0]) &&
           error_point(&all, watch->pixels_finished, watch->work_s, &points[1]);
}

/* The forecast from these two points to a goal, which may need more samples than a run can have. */
static struct error_forecast forecast_of_samples(const struct watch *watch,
                                                 const struct error_point points[2], double goal)
{
    struct error_forecast forecast = error_forecast(points, watch->samples, goal);
    forecast.beyond = forecast.known && forecast.samples > SAMPLES_MAX;
    forecast.known &= !forecast.beyond;
    return forecast;
}

/* The forecast of a run with a single pass: from its middle and its end. The round goal may be beyond, half of the
 * error may not. */
static struct error_forecast forecast_by_middle(const struct watch *watch)
{
    struct error_point points[2];
    if (samples_halfway(watch->samples) == 0 || !points_of(watch, points))
        return (struct error_forecast){0};
    double rmse = points[1].rmse;
    struct error_forecast forecast = forecast_of_samples(watch, points, forecast_goal(rmse));
    return forecast.beyond ? forecast_of_samples(watch, points, rmse / 2) : forecast;
}

/* The power of the number of samples with which the squared error falls after the first pass, as long as that is
 * the only one. */
static double first_power(const struct watch *watch, double goal)
{
    struct error_point points[2];
    if (!points_of(watch, points)) return FORECAST_EDGE;
    return error_power(points, adaptive_first_samples(watch->adaptive), goal);
}

/* The error with which a run ends, as a part of its target, in the mean: the upper end of a confidence interval
 * has to be below the target, and samples double. 0.77 to 0.99 in 20 runs of four scenes at 200 x 150 and 640 x
 * 480. */
#define TARGET_REACHED 0.88

/* The further seconds of a run that has this goal as its target; HUGE_VAL: it needs a larger max_samples. */
static double seconds_to(const struct watch *watch, double goal, uint32_t max_samples)
{
    double power = first_power(watch, goal);
    return adaptive_forecast(watch->adaptive, TARGET_REACHED * goal, power, max_samples);
}

/* The forecast of a run that has this goal as its target. */
static struct error_forecast forecast_to(const struct watch *watch, const struct error_point *now,
                                         double goal)
{
    return error_forecast_to(now, goal, seconds_to(watch, goal, watch->samples));
}

/* Half of the error is beyond max_samples. Tells of the target, if it was missed, or else of that half. No seconds are
 * foretold for a larger max_samples: in 12 cases they were 0.3 to 1.4 times what such a run took. But in all of 17
 * cases the max_samples that is found reached the goal, and half of it did not. */
static struct error_forecast forecast_beyond(const struct watch *watch,
                                             const struct error_point *now)
{
    double target = adaptive_target(watch->adaptive);
    double goal = target > 0 && target < now->rmse ? target : now->rmse / 2;
    struct error_forecast forecast = forecast_to(watch, now, goal);
    uint32_t most = watch->samples;
    while (forecast.beyond && forecast.max_samples == 0 && most <= SAMPLES_MAX / 2) {
        most *= 2;
        if (seconds_to(watch, goal, most) < HUGE_VAL) forecast.max_samples = most;
    }
    return forecast;
}

/* The round goal may need more than the most samples per pixel; half of the error may not. */
static struct error_forecast forecast_by_plan(const struct watch *watch)
{
    struct error_point now;
    struct look look = look_at(watch);
    if (!error_point(&look.breakdown, look.pixels, adaptive_seconds(watch->adaptive), &now))
        return (struct error_forecast){0};
    struct error_forecast forecast = forecast_to(watch, &now, forecast_goal(now.rmse));
    if (forecast.beyond) forecast = forecast_to(watch, &now, now.rmse / 2);
    return forecast.beyond ? forecast_beyond(watch, &now) : forecast;
}

/* Forecasts CPU seconds of rendering, which other programs do not lengthen, and scales them to wall seconds of
 * this run. */
static struct error_forecast forecast_of(const struct watch *watch, double render_s)
{
    struct error_forecast forecast =
        watch->adaptive ? forecast_by_plan(watch) : forecast_by_middle(watch);
    if (watch->work_s > 0) forecast.seconds *= render_s / watch->work_s;
    return forecast;
}

/* Whether the last row already describes the picture as it is: it follows the last pass. */
static bool is_told(const struct watch *watch)
{
    if (watch->log.count == 0) return false;
    const struct error_row *last = &watch->log.rows[watch->log.count - 1];
    double told = last->samples * (double)canvas_pixels(watch->canvas);
    return (double)look_at(watch).samples <= told + 0.5;
}

bool watch_end(struct watch *watch, double now, double render_s, struct error_forecast *forecast)
{
    bool whole = !watch->adaptive && watch->pixels_finished == canvas_pixels(watch->canvas);
    if (!watch->adaptive || !is_told(watch)) add_row(watch, now, whole ? 1 : 0);
    *forecast = forecast_of(watch, render_s);
    if (!watch->csv) return true;
    flush_rows(watch);
    if (fclose(watch->csv) != 0 && !watch->csv_error) watch->csv_error = errno;
    watch->csv = NULL;
    if (!watch->csv_error) return true;
    user_error(NULL, 0, "output.error could not be written: %s", strerror(watch->csv_error));
    return false;
}

void watch_free(struct watch *watch)
{
    snapshot_end(&watch->snapshot);
    if (watch->csv) fclose(watch->csv);
    watch->csv = NULL;
    error_log_free(&watch->log);
}
