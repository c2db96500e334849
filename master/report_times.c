/* The part of the table that shows where the time went: on rank 0, over all renderers, and rank by rank. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/figure.h"
#include "master/report_parts.h"
#include "master/start_times.h"

enum {
    ROW_COLUMNS = 40,   /* a rank's row without pixels, host and bar */
    PIXELS_COLUMNS = 9, /* what the column of pixels takes besides */
    RANKS_MAX = 16,     /* of more ranks than this only some are shown, */
    RANKS_ENDS = 4,     /* namely this many of the busiest and of the idlest */
    BAR_MIN = 6,
    BAR_MAX = 24,
};

/* Ends a row with a bar of length `fraction`, if the rest of the line has room for one; used: columns of the row. */
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

/* With milliseconds below 9999 s; at most 8 characters for times up to three years. */
static struct figure seconds_figure(double seconds)
{
    struct figure figure;
    snprintf(figure.text, sizeof figure.text, "%.*f", seconds < 9999 ? 3 : 0, fmin(seconds, 1e9));
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

/* The times to allocate the picture's memory and to open a journal from which nothing is read have rows of their own if
 * they are at least this fraction of the total. They take seconds for a picture of a hundred million pixels, or for a
 * scene of gigabytes, a hash of which is in the journal. */
#define SHOWN_FROM 0.01

/* "starting MPI" and "sharing scene" include the time for which MPI's calls wait until all ranks have got there; MPI
 * does not tell how much that is. */
void put_run_times(const struct table *table, const struct run_times *time, bool resumed)
{
    struct start_phase phases[START_PHASES];
    double rest = time->total - time->render - time->write;
    start_phases(time, phases);
    if (resumed) phases[START_JOURNAL].name = "reading journal";
    fprintf(table->out, "\nWall time of rank 0\n");
    for (unsigned i = 0; i < START_PHASES; i++) {
        bool is_optional = i == START_ROOM || (i == START_JOURNAL && !resumed);
        if (is_optional && phases[i].seconds < SHOWN_FROM * time->total) continue;
        put_seconds(table, phases[i].name, phases[i].seconds, time->total);
        rest -= phases[i].seconds;
    }
    put_seconds(table, "rendering", time->render, time->total);
    put_seconds(table, "writing", time->write, time->total);
    put_seconds(table, "other", fmax(rest, 0), time->total);
    fprintf(table->out, "  %-16s %8s s\n", "total", seconds_figure(time->total).text);
}

/*
 * The CPU time of a part of rendering, whose wall time is `seconds`. Where cores were shared, the CPU time of all tiles
 * is divided in proportion to the wall times of the parts, as preemption falls on all parts alike. Seconds are not
 * scaled by CPU time / busy time, as busy time also contains what falls between two tiles: reading the CPU time is a
 * system call, at which the operating system tends to preempt.
 */
static double part_of(const struct work *work, double seconds)
{
    double parts = work->probe + work->intersect + work->shade;
    return work->shared ? work->cpu * share_of(seconds, parts) : seconds;
}

/* What the renderers did during the render phase, each from the start to the end of it. */
void put_rendering(const struct table *table, const struct report *report, const struct work *work)
{
    int renderers = report->renderer_count;
    double whole = report->time.render * renderers;
    double plan = fmin(report->plan_s * renderers, work->wait); /* all of them wait meanwhile */
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

/* A line of the table of ranks. The counts are doubles because means have fractions. */
struct row {
    char label[16];
    const char *host; /* NULL: no such column */
    double tiles, pixels, busy_s, wait_s;
};

static bool hosts_differ(const struct report *report)
{
    const char *known = ""; /* a renderer that has never reported has no host */
    for (int i = 0; i < report->renderer_count; i++) {
        const char *host = report->renderers[i].host;
        if (*known && *host && strcmp(host, known) != 0) return true;
        if (*host) known = host;
    }
    return false;
}

/* Whether a line has room for the number of pixels besides their share and a bar. */
static bool shows_pixels(const struct table *table)
{
    return table->columns >= ROW_COLUMNS + PIXELS_COLUMNS + 2 + BAR_MIN;
}

/* pixels: all those rendered; most: busy seconds of the busiest rank, which has the longest bar. */
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

/* The ranks in the order in which they are shown: the busiest first, or in rank order if all are shown. The caller
 * frees it. */
static const struct renderer_stats **order_ranks(const struct report *report)
{
    size_t count = report->renderer_count > 0 ? (size_t)report->renderer_count : 0;
    const struct renderer_stats **order = allocate(count, sizeof *order);
    for (size_t i = 0; i < count; i++)
        order[i] = &report->renderers[i];
    if (count > RANKS_MAX) qsort(order, count, sizeof *order, busiest_first);
    return order;
}

void put_ranks(const struct table *table, const struct report *report)
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
