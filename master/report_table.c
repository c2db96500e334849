/* The table at the end of a run, in lines of flowing text; its figures with bars: report_times.c. */
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/figure.h"
#include "master/report_parts.h"

enum {
    COLUMNS_UNKNOWN = 80,
    COLUMNS_MIN = 40, /* the least that the columns of figures need */
    COLUMNS_MAX = 100,
    ROW_COLUMNS = 40, /* of a rank's row, without pixels and bar */
    SHARE_COLUMNS = 9,
    RANKS_MAX = 16, /* where there are more, not all are shown */
    RANKS_ENDS = 4, /* of these, so many of the busiest and of the idlest are shown */
    BAR_MIN = 6,
    BAR_MAX = 24,
};

struct table {
    FILE *out;
    int columns;
    int used; /* columns already used of the current line of flowing text */
};

static double share_of(double part, double whole)
{
    return whole > 0 ? fmax(part, 0) / whole : 0;
}

/* Ends a row with a bar in what is left of the line, if that is enough for one. */
static void end_with_bar(const struct table *table, int used, double fraction)
{
    int room = table->columns - used - 2;
    if (room > BAR_MAX) room = BAR_MAX;
    int length = (int)(fmin(fraction, 1) * room + 0.5);
    if (room >= BAR_MIN && length > 0) fputs("  ", table->out);
    if (room >= BAR_MIN)
        for (int i = 0; i < length; i++)
            fputc('#', table->out);
    fputc('\n', table->out);
}

/* With milliseconds below 9999 s, else in whole seconds; 8 characters for up to three years. */
static struct figure seconds_figure(double seconds)
{
    struct figure figure;
    snprintf(figure.text, sizeof figure.text, "%.*f", seconds < 9999 ? 3 : 0, fmin(seconds, 1e9));
    return figure;
}

/* Three significant digits; from 1000 to 1e9 whole seconds. */
static struct figure rough_seconds(double seconds)
{
    struct figure figure;
    bool many = seconds >= 999.5 && seconds < 1e9;
    snprintf(figure.text, sizeof figure.text, many ? "%.0f" : "%.3g", seconds);
    return figure;
}

static struct figure whole_figure(double count, double limit)
{
    if (!(count < limit)) return figure_count(count);
    struct figure figure;
    snprintf(figure.text, sizeof figure.text, "%.0f", count);
    return figure;
}

static void put_seconds(const struct table *table, const char *label, double seconds, double whole)
{
    double share = share_of(seconds, whole);
    int used = fprintf(table->out, "  %-16s %8s s %6.1f %%", label, seconds_figure(seconds).text,
                       100 * share);
    end_with_bar(table, used, share);
}

/* Allocating the picture's memory is shown if it takes at least this part of the whole time: with a hundred million
 * pixels it takes seconds. */
#define ROOM_TOLD 0.01

/* The times of starting MPI and of sharing the scene include waiting until all ranks are there. It happens inside MPI's
 * calls, so it cannot be measured separately. */
static void put_run(const struct table *table, const struct run_times *time, bool resumed)
{
    double rest = time->total - time->init - time->load - time->broadcast - time->build -
                  time->render - time->write - (resumed ? time->resume : 0);
    bool room_told = time->room >= ROOM_TOLD * time->total;
    if (room_told) rest -= time->room;
    fprintf(table->out, "\nWall time of rank 0\n");
    put_seconds(table, "starting MPI", time->init, time->total);
    put_seconds(table, "loading", time->load, time->total);
    if (room_told) put_seconds(table, "picture memory", time->room, time->total);
    if (resumed) put_seconds(table, "reading journal", time->resume, time->total);
    put_seconds(table, "sharing scene", time->broadcast, time->total);
    put_seconds(table, "building the BVH", time->build, time->total);
    put_seconds(table, "rendering", time->render, time->total);
    put_seconds(table, "writing", time->write, time->total);
    put_seconds(table, "other", fmax(rest, 0), time->total);
    fprintf(table->out, "  %-16s %8s s\n", "total", seconds_figure(time->total).text);
}

/* Cores count as shared if the CPU time is less than this part of the busy time, which is wall time. */
#define SHARED_CORE 0.9

/* Sums over all renderers, in seconds. */
struct work {
    double busy, cpu;
    double probe, intersect, shade; /* wall time of tiles: parts of busy */
    double wait;
    bool shared; /* cores were shared */
};

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

/* Where cores were shared, the CPU time is divided in proportion to the wall time of the parts of tiles, as preemption
 * hits all of these parts alike. It hits the time between two tiles more often, which is left out: the CPU time is
 * asked for there by a system call, at which the system tends to let others run. */
static double part_of(const struct work *work, double seconds)
{
    double parts = work->probe + work->intersect + work->shade;
    return work->shared ? work->cpu * share_of(seconds, parts) : seconds;
}

/* What the renderers did during the render phase, each counted from its start to its end. */
static void put_rendering(const struct table *table, const struct report *report,
                          const struct work *work)
{
    int renderers = report->renderer_count;
    double whole = report->time.render * renderers;
    /* All renderers wait during planning. */
    double plan = fmin(report->plan_s * renderers, work->wait);
    const struct {
        const char *label;
        double seconds;
        bool shown;
    } parts[] = {
        {"pre-pass", part_of(work, work->probe), work->probe > 0},
        {"intersection", part_of(work, work->intersect), true},
        {"shading", part_of(work, work->shade), true},
        {"without a core", work->busy - work->cpu, work->shared},
        {"planning passes", plan, plan > 0},
        {"waiting", work->wait - plan, true},
    };
    fprintf(table->out,
            renderers == 1 ? "\nOf rendering\n" : "\nOf rendering, mean of %d renderers\n",
            renderers);
    double rest = whole;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        if (!parts[i].shown) continue;
        put_seconds(table, parts[i].label, parts[i].seconds / renderers, whole / renderers);
        rest -= parts[i].seconds;
    }
    put_seconds(table, "sending, other", fmax(rest, 0) / renderers, whole / renderers);
}

/* A row of the table of ranks. For the mean, the counts have fractions. */
struct row {
    char label[16];
    const char *host; /* NULL: no such column */
    double tiles, pixels, busy_s, wait_s;
};

static bool hosts_differ(const struct report *report)
{
    const char *known = ""; /* a rank that never reported has none */
    for (int i = 0; i < report->renderer_count; i++) {
        const char *host = report->renderers[i].host;
        if (*known && *host && strcmp(host, known) != 0) return true;
        if (*host) known = host;
    }
    return false;
}

/* Whether there is room for pixels, their share and a bar. If not, only the share is shown. */
static bool shows_pixels(const struct table *table)
{
    return table->columns >= ROW_COLUMNS + SHARE_COLUMNS + 2 + BAR_MIN;
}

/* pixels: of the picture; most: the busiest rank's seconds, for the longest bar. */
static void put_row(const struct table *table, const struct row *row, double pixels, double most)
{
    int used = fprintf(table->out, "%6s %6s", row->label, whole_figure(row->tiles, 1e6).text);
    if (shows_pixels(table))
        used += fprintf(table->out, " %8s", whole_figure(row->pixels, 1e8).text);
    used += fprintf(table->out, " %6.1f %% %8s %8s", 100 * share_of(row->pixels, pixels),
                    seconds_figure(row->wait_s).text, seconds_figure(row->busy_s).text);
    if (row->host && used + 2 + 16 <= table->columns)
        used += fprintf(table->out, "  %-16.16s", row->host);
    end_with_bar(table, used, share_of(row->busy_s, most));
}

static void put_heading(const struct table *table, bool hosts)
{
    int used = fprintf(table->out, "\n%6s %6s", "rank", "tiles") - 1;
    if (shows_pixels(table)) used += fprintf(table->out, " %8s", "pixels");
    used += fprintf(table->out, " %8s %8s %8s", "share", "wait s", "busy s");
    if (hosts && used + 2 + 16 <= table->columns) fputs("  host", table->out);
    fputc('\n', table->out);
}

static struct row rank_row(const struct renderer_stats *stats, bool hosts)
{
    struct row row = {.host = hosts ? stats->host : NULL,
                      .tiles = stats->tiles,
                      .pixels = (double)stats->pixels,
                      .busy_s = stats->busy_s,
                      .wait_s = stats->wait_s};
    snprintf(row.label, sizeof row.label, "%u", stats->rank);
    return row;
}

static struct row mean_row(const struct report *report, bool hosts)
{
    struct row mean = {.label = "mean", .host = hosts ? "" : NULL};
    for (int i = 0; i < report->renderer_count; i++) {
        const struct renderer_stats *stats = &report->renderers[i];
        mean.tiles += (double)stats->tiles / report->renderer_count;
        mean.pixels += (double)stats->pixels / report->renderer_count;
        mean.busy_s += stats->busy_s / report->renderer_count;
        mean.wait_s += stats->wait_s / report->renderer_count;
    }
    return mean;
}

static double busiest(const struct report *report)
{
    double most = 0;
    for (int i = 0; i < report->renderer_count; i++)
        most = fmax(most, report->renderers[i].busy_s);
    return most;
}

static int busiest_first(const void *left, const void *right)
{
    const struct renderer_stats *a = *(const struct renderer_stats *const *)left;
    const struct renderer_stats *b = *(const struct renderer_stats *const *)right;
    if (a->busy_s != b->busy_s) return a->busy_s > b->busy_s ? -1 : 1;
    return a->rank < b->rank ? -1 : a->rank > b->rank;
}

/* In rank order if all of them are shown, else the busiest first. */
static const struct renderer_stats **order_ranks(const struct report *report)
{
    size_t count = report->renderer_count > 0 ? (size_t)report->renderer_count : 0;
    const struct renderer_stats **order = allocate(count, sizeof *order);
    for (size_t i = 0; i < count; i++)
        order[i] = &report->renderers[i];
    if (count > RANKS_MAX) qsort(order, count, sizeof *order, busiest_first);
    return order;
}

static void put_ranks(const struct table *table, const struct report *report)
{
    bool hosts = hosts_differ(report);
    int count = report->renderer_count;
    struct row mean = mean_row(report, hosts);
    double pixels = mean.pixels * count, most = busiest(report);
    const struct renderer_stats **order = order_ranks(report);
    put_heading(table, hosts);
    for (int i = 0; i < count; i++) {
        if (count > RANKS_MAX && i == RANKS_ENDS) {
            i = count - RANKS_ENDS;
            fprintf(table->out, "%6s  %d more, then the idlest\n", "...", count - 2 * RANKS_ENDS);
        }
        struct row row = rank_row(order[i], hosts);
        put_row(table, &row, pixels, most);
    }
    if (count > 1) put_row(table, &mean, pixels, most);
    free(order);
}

#define INDENT 2

/* Puts a piece of flowing text on the current line if it fits there, else on a new, indented line. */
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

/* An item of a list, separated by a comma. */
static void flow(struct table *table, const char *format, ...) MESSAGE_FORMAT(2, 3);

static void flow(struct table *table, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    put_piece(table, ", ", format, arguments);
    va_end(arguments);
}

/* More text of the last item, separated by a space. */
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
    end_flow(table);
}

/* The path is never shortened: a shortened one could not be used. */
void report_path(FILE *out, const char *label, const char *path)
{
    char *name = printable_text(path);
    fprintf(out, "%-7s %s\n", label, name);
    free(name);
}

/* The largest speed-up that is possible with more renderers than cores. */
static void put_cores(struct table *table, const struct report *report)
{
    uint32_t most = report->processors;
    if (most == 0 || most >= (uint32_t)report->renderer_count) return;
    flow(table, "%d renderers", report->renderer_count);
    if (report->cores == most)
        flow_on(table, "on %u core%s:", most, most == 1 ? "" : "s");
    else /* cores of one machine are of no use to renderers of another one */
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
        flow(table, "its imbalance is %.3f", report_balance(report).cpu_imbalance);
    end_flow(table);
}

/* An error with two significant digits, as 0.00005, not as 5e-05. */
static struct figure error_figure(double error)
{
    struct figure figure;
    int decimals = error > 0 && error < 1 ? 1 - (int)floor(log10(error)) : 0;
    if (error >= 1 || decimals > 8) decimals = 0;
    snprintf(figure.text, sizeof figure.text, decimals ? "%.*f" : "%.*g", decimals ? decimals : 2,
             error);
    size_t end = strlen(figure.text);
    if (decimals == 0) return figure;
    while (end > 1 && figure.text[end - 1] == '0')
        figure.text[--end] = '\0';
    if (figure.text[end - 1] == '.') figure.text[end - 1] = '\0';
    return figure;
}

/* The same for an upper bound: rounded up. */
static struct figure bound_figure(double bound)
{
    struct figure figure = error_figure(bound);
    double shown = strtod(figure.text, NULL);
    return shown < bound ? error_figure(shown + pow(10, floor(log10(bound)) - 1)) : figure;
}

static void put_beyond(struct table *table, double goal, uint32_t most_samples)
{
    flow(table, "%s is beyond sampling.max_samples = %u", error_figure(goal).text, most_samples);
    end_flow(table);
}

/* "0.001 would take about 41 s (36 to 50), with 256 samples, ...", as if this run had rendered an earlier run's part,
 * too. */
static void put_forecast(struct table *table, const struct error_forecast *forecast,
                         uint32_t most_samples, double elapsed_s)
{
    if (forecast->beyond) {
        put_beyond(table, forecast->goal, most_samples);
        return;
    }
    if (!forecast->known) {
        flow(table, "what less would take is not known");
        end_flow(table);
        return;
    }
    double low, high;
    double others = elapsed_s - forecast->seconds;
    double seconds = forecast_seconds(forecast, forecast->goal, &low, &high);
    flow(table, "%s would take about %s s", error_figure(forecast->goal).text,
         rough_seconds(others + seconds).text);
    flow_on(table, "(%s to %s)", rough_seconds(others + low).text,
            rough_seconds(others + high).text);
    if (forecast_tells_samples(forecast)) flow(table, "with %.0f samples", forecast->samples);
    if (forecast->slope <= FORECAST_STEEPEST)
        flow(table, "slope %.2f +- %.2f", -forecast->slope, forecast->slope_spread);
    end_flow(table);
}

/* The error where there is no estimate, as with one sample per pixel: only a reference can show it. */
static void put_unestimated(struct table *table, const struct report *report)
{
    if (report->has_reference)
        flow(table, "sampling error: RMSE %s against the reference",
             error_figure(report->truth.rmse).text);
    else if (report->max_samples == 1)
        flow(table, "sampling error: unknown with one sample a pixel");
    end_flow(table);
}

/* The error of the whole picture. share: part of its pixels that have samples, with this RMSE. */
static void put_guessed(struct table *table, const struct report *report, double share, double rmse)
{
    if (report->unsampled == 0) return;
    if (isnan(report->guessed_rmse)) {
        flow(table, "that of what is guessed is not known");
        return;
    }
    double squared =
        share * rmse * rmse + (1 - share) * report->guessed_rmse * report->guessed_rmse;
    flow(table, "about %s of the whole picture, %s of what is guessed",
         error_figure(sqrt(squared)).text, error_figure(report->guessed_rmse).text);
}

/* Where the true error is more than this many times the upper end of the estimate, the reference is probably of another
 * view. */
#define UNLIKELY_ERROR 10

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
    flow(table, "sampling error: RMSE %s", error_figure(last->estimate.rmse).text);
    flow_on(table, "(%s to %s)", error_figure(last->estimate.low).text,
            error_figure(last->estimate.high).text);
    if (last->share < 0.01)
        flow_on(table, "of the %.2g %% that has samples", 100 * last->share);
    else if (last->share < 1) /* never rounded to all */
        flow_on(table, "of the %.1f %% that has samples", floor(1000 * last->share) / 10);
    flow_on(table, last->elapsed_s < 1 ? "after %.2g s" : "after %.1f s", last->elapsed_s);
    if (before > 0) {
        bool shared = report->resumed.cpu_s > before;
        flow_on(table, "and %.1f s of an earlier run", before);
        flow_on(table, "(%.1f s of CPU time%s)", report->resumed.cpu_s, shared ? ", shared" : "");
    }
    put_guessed(table, report, last->share, last->estimate.rmse);
    if (!isnan(last->true_rmse))
        flow(table, "RMSE %s against the reference", error_figure(last->true_rmse).text);
    else if (report->has_reference) /* rows have it only where all pixels have samples */
        flow(table, "RMSE %s of the whole picture against the reference",
             error_figure(report->truth.rmse).text);
    if (last->estimate.high > 0 && last->true_rmse > UNLIKELY_ERROR * last->estimate.high)
        flow_on(table, "(is it of this view?)");
    end_flow(table);
    if (last->estimate.rmse > 0)
        put_forecast(table, &report->forecast, report->max_samples, elapsed);
}

/* The bound of the error that max_depth and cutoff can have caused. */
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

/* Pixels that are brighter than the picture's file can hold. */
static void put_clipped(struct table *table, const struct report *report)
{
    const struct quantisation *file = &report->quantisation;
    if (file->clipped == 0) return;
    flow(table, "clipped: %llu pixel%s", (unsigned long long)file->clipped,
         file->clipped == 1 ? "" : "s");
    flow_on(table, "beyond what the file can hold");
    flow(table, "RMSE %s", error_figure(file->clipped_rmse).text);
    end_flow(table);
}

/* What ended adaptive sampling. */
static void put_end(struct table *table, const struct report *report)
{
    if (report->ended == ENDED_BY_TIME) flow(table, "stopped by sampling.time_limit");
    /* Pixels without any sample are reported in another line. */
    if (report->missing_share > 0 && report->unsampled == 0) {
        flow(table, "pass %u was cut off:", report->passes);
        flow_on(table, "%.1f %% of its pixels are missing", fmax(100 * report->missing_share, 0.1));
    }
    if (report->ended == ENDED_BY_MAX_SAMPLES) flow(table, "stopped by sampling.max_samples");
    if (report->target > 0)
        flow(table, "sampling.target_error = %g is %s", report->target,
             report->ended == ENDED_BY_TARGET ? "met" : "not met");
    end_flow(table);
}

/* Whether the journal of an earlier run had everything. */
static bool rendered_nothing(const struct report *report, const struct render_counts *counts)
{
    return report->resumed.pixels > 0 && counts->rays[RAY_PRIMARY] == 0;
}

/* How well the renderers were used, and what for. */
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
    uint64_t nonfinite = report_picture_counts(report).nonfinite;
    if (nonfinite) {
        flow(table, "%llu sample%s not finite", (unsigned long long)nonfinite,
             nonfinite == 1 ? " is" : "s are");
        end_flow(table);
    }
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
