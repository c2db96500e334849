/*
 * Prints the table at the end of a run (report_table() of report.h). This file prints its lines of text, which are
 * broken at the width of the terminal; report_times.c prints its figures with bars.
 */
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/figure.h"
#include "master/report_parts.h"

enum {
    COLUMNS_UNKNOWN = 80,
    COLUMNS_MIN = 40, /* the least width that the columns of figures need */
    COLUMNS_MAX = 100,
};

#define INDENT 2

/* Prints a piece of text after `join` on the current line if it fits there, else on a new, indented line. */
static void put_piece(struct table *table, const char *join, const char *format, va_list arguments)
{
    char piece[256];
    int length = (int)strlen(join) + vsnprintf(piece, sizeof piece, format, arguments);
    if (table->used && table->used + length > table->columns) {
        table->used = fprintf(table->out, "\n%*s", INDENT, "") - 1;
        join = "";
    }
    table->used += fprintf(table->out, "%s%s", table->used ? join : "", piece);
}

/* Prints the next item of a list, after a comma. */
static void flow(struct table *table, const char *format, ...) MESSAGE_FORMAT(2, 3);

static void flow(struct table *table, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    put_piece(table, ", ", format, arguments);
    va_end(arguments);
}

/* Prints a continuation of the last item, after a space. */
static void flow_on(struct table *table, const char *format, ...) MESSAGE_FORMAT(2, 3);

static void flow_on(struct table *table, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    put_piece(table, " ", format, arguments);
    va_end(arguments);
}

static void end_flow(struct table *table)
{
    if (table->used) fputc('\n', table->out);
    table->used = 0;
}

static void put_title(struct table *table, const struct report *report)
{
    flow(table, "farm %s", report->version);
    flow(table, "%u x %u pixels", report->image_width, report->image_height);
    flow(table, "%d renderer%s", report->renderer_count, report->renderer_count == 1 ? "" : "s");
    flow(table, "%s schedule", schedule_names[report->schedule]);
    const char *what = schedule_is_static(report->schedule) ? "band" : "tile";
    const char *plural = report->tiles == 1 ? "" : "s";
    flow(table, "%u %s%s of %u", report->tiles, what, plural, report->tile_edge);
    end_flow(table);
}

/* From so many reflected and refracted rays per sample on it is worth knowing what to change. In the sample scenes
 * there are 10 at most, among thousands of glass balls thousands. */
#define RAYS_MANY 100

/* Which setting makes the run shorter where samples take very many rays. */
static void put_many_rays(struct table *table, const struct render_counts *counts)
{
    double followed = (double)counts->rays[RAY_REFLECTION] + (double)counts->rays[RAY_REFRACTION];
    double each = share_of(followed, (double)counts->rays[RAY_PRIMARY]);
    if (each < RAYS_MANY) return;
    flow(table, "%s reflected and refracted rays per sample:", figure_count(round(each)).text);
    flow_on(table, "a larger render.cutoff takes fewer");
    end_flow(table);
}

static void put_rays(struct table *table, const struct report *report,
                     const struct render_counts *counts)
{
    static const char *const names[RAY_KINDS] = {"primary", "shadow", "reflection", "refraction"};
    double rays = 0;
    for (int kind = 0; kind < RAY_KINDS; kind++)
        rays += (double)counts->rays[kind];
    flow(table, "%s ray%s", figure_count(rays).text, rays == 1 ? "" : "s");
    flow(table, "%s per second", figure_count(share_of(rays, report->time.render)).text);
    end_flow(table);
    for (int kind = 0; kind < RAY_KINDS; kind++)
        if (counts->rays[kind])
            flow(table, "%s %s", figure_count((double)counts->rays[kind]).text, names[kind]);
    if (counts->bound_rays)
        flow(table, "%s more for the truncation bound",
             figure_count((double)counts->bound_rays).text);
    end_flow(table);
    put_many_rays(table, counts);
}

/* The path is never cut, however long it is: the user could not copy it. */
void report_path(FILE *out, const char *label, const char *path)
{
    char *name = printable_text(path);
    fprintf(out, "%-7s %s\n", label, name);
    free(name);
}

/* If there are more renderers than cores: how much faster than one renderer they can be at most. */
static void put_cores(struct table *table, const struct report *report)
{
    uint32_t most = report->processors;
    if (most == 0 || most >= (uint32_t)report->renderer_count) return;
    flow(table, "%d renderers", report->renderer_count);
    if (report->cores == most)
        flow_on(table, "on %u core%s:", most, most == 1 ? "" : "s");
    else /* the idle cores of one machine are of no use to the renderers of another */
        flow(table, "%u on a core at a time:", most);
    if (most == 1)
        flow_on(table, "no faster than one");
    else
        flow_on(table, "at most %u times as fast as one", most);
    end_flow(table);
}

static void put_shared_cores(struct table *table, const struct report *report,
                             const struct work *work)
{
    put_cores(table, report);
    if (!work->shared) return;
    flow(table, "CPU time is %.0f %% of busy time", 100 * work->cpu / work->busy);
    flow(table, "as cores were shared");
    if (work->cpu > 0 && report->renderer_count > 1)
        flow(table, "imbalance of CPU time %.3f", report_balance(report).cpu_imbalance);
    end_flow(table);
}

/* Three significant digits, and whole seconds from 1000 s on. */
static struct figure rough_seconds(double seconds)
{
    struct figure figure = figure_digits(seconds, 3);
    if (seconds >= 999.5 && seconds < 1e9)
        snprintf(figure.text, sizeof figure.text, "%.0f", seconds);
    return figure;
}

#define ERROR_DIGITS 2

static struct figure error_figure(double error)
{
    return figure_digits(error, ERROR_DIGITS);
}

/* The goal of the forecast: the target as it was typed, a round number of one or two digits, or half of the error. */
static struct figure goal_figure(const struct report *report)
{
    double goal = report->forecast.goal;
    return figure_round(goal == report->target ? goal : strtod(error_figure(goal).text, NULL));
}

/* An upper bound of an error in the same format, rounded up so that the figure is a bound, too. */
static struct figure bound_figure(double bound)
{
    struct figure figure = error_figure(bound);
    double shown = strtod(figure.text, NULL);
    return shown < bound ? error_figure(shown + pow(10, floor(log10(bound)) - 1)) : figure;
}

static void put_beyond(struct table *table, const struct report *report)
{
    flow(table, "an RMSE of %s", goal_figure(report).text);
    if (report->forecast.samples > 0)
        flow_on(table, "would take more than the %u samples that a run can have", SAMPLES_MAX);
    else
        flow_on(table, "is beyond sampling.max_samples = %u", report->max_samples);
    if (report->forecast.max_samples > 0)
        flow(table, "%u would be enough", report->forecast.max_samples);
    end_flow(table);
}

/* "an RMSE of 0.001 would take about 41.2 s (36.0 to 50.1), with 256 samples, ...". elapsed_s: seconds of this run, and
 * of the earlier run that it goes on with. The times printed are those of one run that renders everything itself. */
static void put_forecast(struct table *table, const struct report *report, double elapsed_s)
{
    const struct error_forecast *forecast = &report->forecast;
    if (forecast->beyond) {
        put_beyond(table, report);
        return;
    }
    if (!forecast->known) {
        flow(table, "what a smaller error would take is not known");
        end_flow(table);
        return;
    }
    double low, high;
    double others = elapsed_s - forecast->seconds;
    double seconds = forecast_seconds(forecast, forecast->goal, &low, &high);
    flow(table, "an RMSE of %s would take", goal_figure(report).text);
    flow_on(table, "about %s s", rough_seconds(others + seconds).text);
    if (high < HUGE_VAL)
        flow_on(table, "(%s to %s)", rough_seconds(others + low).text,
                rough_seconds(others + high).text);
    else
        flow_on(table, "(%s or more)", rough_seconds(others + low).text);
    if (forecast->samples > 0) flow(table, "with %.0f samples", forecast->samples);
    if (forecast->slope <= FORECAST_STEEPEST)
        flow(table, "slope %.2f +- %.2f", -forecast->slope, forecast->slope_spread);
    end_flow(table);
}

/* The line on the sampling error where none can be estimated, as with one sample per pixel: the error against the
 * reference, if there is one. */
static void put_unestimated(struct table *table, const struct report *report)
{
    if (report->has_reference)
        flow(table, "sampling error: RMSE %s against the reference",
             error_figure(report->truth.rmse).text);
    else if (report->max_samples == 1)
        flow(table, "sampling error: unknown with one sample per pixel");
    end_flow(table);
}

/* The RMSE of the whole picture, where `share` of its pixels have samples and an RMSE of `rmse`, and the colours of the
 * others are guessed. */
static void put_guessed(struct table *table, const struct report *report, double share, double rmse)
{
    if (report->unsampled == 0) return;
    if (isnan(report->guessed_rmse)) {
        flow(table, "the error of the guessed ones");
        flow_on(table, "is not known");
        return;
    }
    double squared =
        share * rmse * rmse + (1 - share) * report->guessed_rmse * report->guessed_rmse;
    flow(table, "about %s of the whole picture, %s of what is guessed",
         error_figure(sqrt(squared)).text, error_figure(report->guessed_rmse).text);
}

/* An error this many times larger than the upper end of its estimate is unlikely: rather, the reference shows another
 * view. */
#define UNLIKELY_ERROR 10

/* Of the pixels: those that the error is told of, unless it is all. */
static void put_share(struct table *table, double share)
{
    if (share >= 1) return;
    if (share < 0.01)
        flow_on(table, "of the %.2g %% of the pixels", 100 * share);
    else /* never rounded to all */
        flow_on(table, "of the %.1f %% of the pixels", floor(1000 * share) / 10);
    flow_on(table, "that have samples,");
}

static bool look_alike(double a, double b)
{
    return strcmp(error_figure(a).text, error_figure(b).text) == 0;
}

/* One digit more where the estimate would read like an end of its interval, as in large pictures. */
static void put_estimate(struct table *table, const struct error_estimate *estimate)
{
    bool alike =
        look_alike(estimate->rmse, estimate->low) || look_alike(estimate->rmse, estimate->high);
    int digits = alike ? ERROR_DIGITS + 1 : ERROR_DIGITS;
    flow(table, "sampling error: RMSE %s", figure_digits(estimate->rmse, digits).text);
    flow_on(table, "(%s to %s)", figure_digits(estimate->low, digits).text,
            figure_digits(estimate->high, digits).text);
}

/* "and 10.0 s of an earlier run (20.0 s of CPU time, divided by 2 cores)": by as many as work at a time in this run. */
static void put_earlier(struct table *table, const struct resumed *earlier)
{
    double cores = round(earlier->cpu_s / earlier->render_s);
    flow_on(table, "and %.1f s of an earlier run", earlier->render_s);
    if (cores > 1)
        flow_on(table, "(%.1f s of CPU time, divided by %.0f cores)", earlier->cpu_s, cores);
    else
        flow_on(table, "(%.1f s of CPU time)", earlier->cpu_s);
}

/* "sampling error: RMSE 0.0021 (0.0019 to 0.0024) after 12.4 s" */
static void put_error(struct table *table, const struct report *report)
{
    if (!report->errors || report->errors->count == 0) {
        put_unestimated(table, report);
        return;
    }
    const struct error_row *last = &report->errors->rows[report->errors->count - 1];
    double before = report->resumed.render_s, elapsed = last->elapsed_s + before;
    if (!(last->estimate.rmse > 0) && isnan(last->true_rmse)) return;
    put_estimate(table, &last->estimate);
    put_share(table, last->sampled_share);
    if (report_picture_counts(report).nonfinite) flow_on(table, "of what is finite,");
    if (last->elapsed_s < 1)
        flow_on(table, "after %s s", figure_digits(last->elapsed_s, 2).text);
    else
        flow_on(table, "after %.1f s", last->elapsed_s);
    if (before > 0) put_earlier(table, &report->resumed);
    put_guessed(table, report, last->sampled_share, last->estimate.rmse);
    if (!isnan(last->true_rmse))
        flow(table, "RMSE %s against the reference", error_figure(last->true_rmse).text);
    else if (report->has_reference) /* rows hold it only where all pixels have samples */
        flow(table, "RMSE %s of the whole picture against the reference",
             error_figure(report->truth.rmse).text);
    if (last->estimate.high > 0 && last->true_rmse > UNLIKELY_ERROR * last->estimate.high)
        flow_on(table, "(is it of this view?)");
    end_flow(table);
    if (last->estimate.rmse > 0) put_forecast(table, report, elapsed);
}

/* The bound of the light that depth and cutoff have left out. */
static void put_truncation(struct table *table, const struct report *report)
{
    double most = report_picture_counts(report).truncation;
    if (!(most > 0)) return;
    if (isfinite(most))
        flow(table, "truncation: at most %s anywhere", bound_figure(most).text);
    else
        flow(table, "truncation: without bound");
    end_flow(table);
}

/* Pixels that are brighter than the picture's file can store. */
static void put_clipped(struct table *table, const struct report *report)
{
    const struct quantisation *file = &report->quantisation;
    if (file->clipped == 0) return;
    flow(table, "clipped: %llu pixel%s", (unsigned long long)file->clipped,
         file->clipped == 1 ? "" : "s");
    flow_on(table, "beyond what the file can hold");
    if (file->clipped_rmse > 0) /* 0: all of them are infinite */
        flow(table, "RMSE %s", error_figure(file->clipped_rmse).text);
    end_flow(table);
}

static void put_nonfinite(struct table *table, const struct report *report)
{
    struct render_counts counts = report_picture_counts(report);
    if (counts.nonfinite == 0) return;
    flow(table, "%llu of %llu samples", (unsigned long long)counts.nonfinite,
         (unsigned long long)counts.rays[RAY_PRIMARY]);
    flow_on(table, "%s not finite,", counts.nonfinite == 1 ? "is" : "are");
    flow_on(table, "or too bright for floats");
    end_flow(table);
}

/* Where glass is open, or on other glass but for a rounding, the picture may not be what its maker meant; or it is the
 * half-space behind a plane. */
static void put_media(struct table *table, const struct report *report)
{
    struct render_counts counts = report_picture_counts(report);
    double unmatched = (double)counts.unmatched_media, open = (double)counts.open_media;
    if (unmatched > 0)
        flow(table, "rays left glass unentered %s time%s", figure_count(unmatched).text,
             unmatched == 1 ? "" : "s");
    if (open > 0)
        flow(table, "%s ray%s never came out of glass", figure_count(open).text,
             open == 1 ? "" : "s");
    end_flow(table);
}

/* What adaptive sampling came to: how many samples, and what ended it. */
static void put_end(struct table *table, const struct report *report)
{
    const struct error_log *errors = report->errors;
    if (report->passes > 0 && errors && errors->count > 0)
        flow(table, "%s samples per pixel",
             figure_digits(errors->rows[errors->count - 1].samples, 3).text);
    end_flow(table);
    if (report->ended == ENDED_BY_TIME) flow(table, "stopped by sampling.time_limit");
    /* put_error() has already told of pixels without any sample. */
    if (report->missing_share > 0 && report->unsampled == 0) {
        if (report->missing_share < 1) {
            flow(table, "pass %u was cut off:", report->passes);
            flow_on(table, "%.1f %% of its pixels got none of its samples",
                    fmax(100 * report->missing_share, 0.1));
        } else {
            flow(table, "pass %u was planned, but nothing of it was done", report->passes);
        }
    }
    if (report->ended == ENDED_BY_MAX_SAMPLES) flow(table, "stopped by sampling.max_samples");
    if (report->ended == ENDED_WITHOUT_ERROR) flow(table, "stopped as samples show no error");
    if (report->target > 0) {
        flow(table, "sampling.target_error = %s is %s", figure_round(report->target).text,
             report->ended == ENDED_BY_TARGET ? "met" : "not met");
        if (report_picture_counts(report).nonfinite) flow_on(table, "by what is finite");
    }
    end_flow(table);
}

/* Cores count as shared where the CPU time is less than this fraction of the busy time, which is wall time. */
#define SHARED_CORE 0.9

static struct work work_of(const struct report *report, const struct render_counts *counts)
{
    struct work work = {.intersect = counts->intersect_s, .shade = counts->shade_s};
    for (int i = 0; i < report->renderer_count; i++) {
        const struct renderer_stats *stats = &report->renderers[i];
        work.busy += stats->busy_s;
        work.cpu += stats->cpu_s;
        work.wait += stats->wait_s;
    }
    work.shared = work.cpu < SHARED_CORE * work.busy;
    work.probe = fmin(report->time.probe * report->renderer_count,
                      fmax(work.busy - work.intersect - work.shade, 0));
    return work;
}

/* Whether the whole picture was in the journal of an earlier run. */
static bool rendered_nothing(const struct report *report, const struct render_counts *counts)
{
    return report->resumed.pixels > 0 && counts->rays[RAY_PRIMARY] == 0;
}

/* Efficiency and balance of the renderers, and the rays that they traced. */
static void put_use(struct table *table, const struct report *report,
                    const struct render_counts *counts, const struct work *work)
{
    struct balance balance = report_balance(report);
    flow(table, "efficiency %.1f %%", 100 * balance.efficiency);
    flow(table, "imbalance %.3f", balance.imbalance);
    flow(table, "tail %.3f s", balance.tail_s);
    end_flow(table);
    put_shared_cores(table, report, work);
    put_rays(table, report, counts);
}

static void put_summary(struct table *table, const struct report *report,
                        const struct render_counts *counts, const struct work *work)
{
    fputc('\n', table->out);
    if (rendered_nothing(report, counts)) {
        flow(table, "nothing was rendered");
        flow(table, "all was in the journal");
        end_flow(table);
    } else {
        put_use(table, report, counts, work);
    }
    put_error(table, report);
    put_end(table, report);
    put_truncation(table, report);
    put_clipped(table, report);
    put_nonfinite(table, report);
    put_media(table, report);
    report_path(table->out, "picture", report->image_file);
}

void report_table(FILE *out, const struct report *report, int columns)
{
    struct render_counts counts = report_counts(report);
    struct work work = work_of(report, &counts);
    struct table table = {.out = out, .columns = columns > 0 ? columns : COLUMNS_UNKNOWN};
    if (table.columns < COLUMNS_MIN) table.columns = COLUMNS_MIN;
    if (table.columns > COLUMNS_MAX) table.columns = COLUMNS_MAX;
    put_title(&table, report);
    put_run_times(&table, &report->time, report->resumed.records > 0);
    if (report->renderer_count > 0 && !rendered_nothing(report, &counts)) {
        put_rendering(&table, report, &work);
        put_ranks(&table, report);
    }
    put_summary(&table, report, &counts, &work);
}
