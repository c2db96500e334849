#include "master/timeline.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/json.h"

/* Seconds; shorter pauses are not shown: they are a message under way, or the resolution of the clock. */
#define PAUSE_SHOWN 1e-4

void timeline_free(struct timeline *timeline)
{
    free(timeline->entries);
    free(timeline->plans);
    free(timeline->services);
    free(timeline->costs);
    *timeline = (struct timeline){0};
}

void timeline_add(struct timeline *timeline, enum timeline_kind kind, uint32_t renderer,
                  const struct tile *tile, const struct result_header *header)
{
    timeline->entries = grow(timeline->entries, timeline->count, sizeof *timeline->entries);
    timeline->entries[timeline->count++] =
        (struct timeline_entry){.tile = *tile,
                                .renderer = renderer,
                                .kind = kind,
                                .pixels = header->pixels == RESULT_DROPPED ? 0 : header->pixels,
                                .samples = header->counts.rays[RAY_PRIMARY],
                                .start_s = header->start_s,
                                .busy_s = (float)header->busy_s,
                                .cpu_s = (float)header->cpu_s};
}

void timeline_record_costs(struct timeline *timeline, uint32_t width, uint32_t height)
{
    timeline->costs = allocate_prefaulted((size_t)width * height, sizeof *timeline->costs);
    timeline->width = width;
}

void timeline_spread(struct timeline *timeline, const struct tile *tile, double seconds)
{
    uint32_t pixels = tile_pixels(tile), x, y;
    float each = (float)(seconds / pixels);
    for (uint32_t k = 0; k < pixels; k++) {
        tile_pixel(tile, k, &x, &y);
        timeline->costs[(size_t)y * timeline->width + x] += each;
    }
}

void timeline_add_plan(struct timeline *timeline, const struct timeline_plan *plan)
{
    timeline->plans = grow(timeline->plans, timeline->plan_count, sizeof *timeline->plans);
    timeline->plans[timeline->plan_count++] = *plan;
}

void timeline_add_service(struct timeline *timeline, const struct timeline_service *service)
{
    timeline->services =
        grow(timeline->services, timeline->service_count, sizeof *timeline->services);
    timeline->services[timeline->service_count++] = *service;
}

/* ---- the trace ---- */

static int by_renderer_and_start(const void *a, const void *b)
{
    const struct timeline_entry *x = *(const struct timeline_entry *const *)a,
                                *y = *(const struct timeline_entry *const *)b;
    if (x->renderer != y->renderer) return x->renderer < y->renderer ? -1 : 1;
    return (x->start_s > y->start_s) - (x->start_s < y->start_s);
}

static const struct timeline_entry **in_rows(const struct timeline *timeline)
{
    const struct timeline_entry **rows = allocate(timeline->count, sizeof *rows);
    for (size_t i = 0; i < timeline->count; i++)
        rows[i] = &timeline->entries[i];
    qsort(rows, timeline->count, sizeof *rows, by_renderer_and_start);
    return rows;
}

/* Begins an event in the row of this rank; its special fields follow, then json_close(). */
static void open_event(struct json *json, const char *name, const char *phase, uint32_t rank)
{
    json_open_inline(json, NULL, '{');
    json_string(json, "name", name);
    json_string(json, "ph", phase);
    json_count(json, "pid", 0);
    json_count(json, "tid", rank);
}

/* Times are in microseconds in this format, with three decimals. */
static void put_span(struct json *json, double start_s, double length_s)
{
    json_fixed(json, "ts", 1e6 * start_s, 3);
    json_fixed(json, "dur", 1e6 * length_s, 3);
}

/* Names this rank's row, or with "process_name" all rows together. */
static void put_label(struct json *json, const char *what, const char *name, uint32_t rank)
{
    open_event(json, what, "M", rank);
    json_open(json, "args", '{');
    json_string(json, "name", name);
    json_close(json, '}');
    json_close(json, '}');
}

static void put_row(struct json *json, const struct renderer_stats *stats)
{
    char *name = format_text("rank %u, %s", stats->rank, stats->host);
    put_label(json, "thread_name", name, stats->rank);
    free(name);
    open_event(json, "thread_sort_index", "M", stats->rank);
    json_open(json, "args", '{');
    json_count(json, "sort_index", stats->rank);
    json_close(json, '}');
    json_close(json, '}');
}

static void put_entry(struct json *json, const struct timeline_entry *entry, double end,
                      uint32_t rank)
{
    static const char *const kinds[TIMELINE_KINDS] = {"tile", "pre-pass", "wasted"};
    const struct tile *tile = &entry->tile;
    /* The viewer gives names that differ in numbers alone the same colour. */
    uint32_t x, y;
    tile_pixel(tile, 0, &x, &y);
    char *name = format_text("%s %u,%u", kinds[entry->kind], x, y);
    open_event(json, name, "X", rank);
    json_string(json, "cat", kinds[entry->kind]);
    put_span(json, entry->start_s, end - entry->start_s);
    json_open(json, "args", '{');
    json_count(json, "x", tile->x);
    json_count(json, "y", tile->y);
    json_count(json, "w", tile->w);
    json_count(json, "h", tile->h);
    if (tile->step > 1) {
        json_count(json, "phase", tile->phase);
        json_count(json, "step", tile->step);
    }
    json_count(json, "pixels", entry->pixels);
    if (entry->kind != TIMELINE_PROBES) {
        json_count(json, "pass", tile->pass);
        json_count(json, "samples", entry->samples);
    }
    json_fixed(json, "cpu_us", 1e6 * (double)entry->cpu_s, 3);
    if (entry->pixels > 0)
        json_fixed(json, "cpu_us_per_pixel", 1e6 * (double)entry->cpu_s / entry->pixels, 3);
    json_close(json, '}');
    json_close(json, '}');
    free(name);
}

/* Begins a bar that belongs to no tile; its special fields follow, then json_close(). */
static void open_bar(struct json *json, const char *what, double from, double to, uint32_t rank)
{
    open_event(json, what, "X", rank);
    json_string(json, "cat", what);
    put_span(json, from, to - from);
}

/* What a renderer waited for that was not planning. */
#define FOR_WORK "work"
#define FOR_PASS "end of the pass"
#define FOR_END  "end of the run"

/* Begins a bar with arguments; false: the pause is too short to be shown. */
static bool open_pause(struct json *json, const char *what, double from, double to, uint32_t rank)
{
    if (to - from < PAUSE_SHOWN) return false;
    open_bar(json, what, from, to, rank);
    json_open(json, "args", '{');
    return true;
}

static void close_pause(struct json *json)
{
    json_close(json, '}');
    json_close(json, '}');
}

static void put_wait(struct json *json, double from, double to, uint32_t rank, const char *reason)
{
    if (!open_pause(json, "waiting", from, to, rank)) return;
    json_string(json, "for", reason);
    close_pause(json);
}

static void put_plan(struct json *json, double from, double to, uint32_t rank, unsigned pass)
{
    if (!open_pause(json, "planning", from, to, rank)) return;
    json_count(json, "pass", pass);
    close_pause(json);
}

/* Draws the pauses between the end of a bar and the start of the next one, or the end of the run. A renderer that had
 * nothing to do when a pass was planned had waited for others to finish the last one. */
static void put_gap(struct json *json, const struct timeline *timeline, double from, double to,
                    uint32_t rank, const char *reason)
{
    for (size_t i = 0; i < timeline->plan_count; i++) {
        const struct timeline_plan *plan = &timeline->plans[i];
        double begin = fmax(plan->start_s, from), end = fmin(plan->end_s, to);
        if (begin >= end) continue;
        put_wait(json, from, begin, rank, FOR_PASS);
        put_plan(json, begin, end, rank, plan->pass);
        from = end;
    }
    put_wait(json, from, to, rank, reason);
}

/* What a renderer was working on when it was told to stop is not in any message. But the renderer was busy for
 * longer than the sum of its bars, and it is known until when. Draws that as a bar; returns when the renderer
 * was free after it, or free_since if there is no such bar. */
static double put_given_up(struct json *json, const struct timeline *timeline,
                           const struct renderer_stats *stats, double bars_s, double free_since)
{
    double end = stats->finish_s, begin = fmax(free_since, end - (stats->busy_s - bars_s));
    if (end - begin < PAUSE_SHOWN) return free_since;
    put_gap(json, timeline, free_since, begin, stats->rank, FOR_WORK);
    open_bar(json, "given up", begin, end, stats->rank);
    json_close(json, '}');
    return end;
}

static void put_rows(struct json *json, const struct timeline *timeline,
                     const struct renderer_stats *stats, uint32_t count, double render_s)
{
    const struct timeline_entry **rows = in_rows(timeline);
    size_t next = 0;
    for (uint32_t i = 0; i < count; i++) {
        double free_since = 0, bars_s = 0;
        put_row(json, &stats[i]);
        for (; next < timeline->count && rows[next]->renderer == i; next++) {
            const struct timeline_entry *entry = rows[next];
            double end = fmin(entry->start_s + (double)entry->busy_s, render_s);
            /* In vain, after the end of the render phase. */
            if (entry->start_s >= render_s) continue;
            put_gap(json, timeline, free_since, entry->start_s, stats[i].rank, FOR_WORK);
            put_entry(json, entry, end, stats[i].rank);
            free_since = end;
            bars_s += end - entry->start_s;
        }
        free_since = put_given_up(json, timeline, &stats[i], bars_s, free_since);
        put_gap(json, timeline, free_since, render_s, stats[i].rank, FOR_END);
    }
    free(rows);
}

/* A counter keeps its value until the next event of its name. */
static void put_counter(struct json *json, double at_s, double share)
{
    open_event(json, "rank 0 serves", "C", 0);
    json_fixed(json, "ts", 1e6 * at_s, 3);
    json_open(json, "args", '{');
    json_fixed(json, "% of a core", 100 * share, 2);
    json_close(json, '}');
    json_close(json, '}');
}

static void put_services(struct json *json, const struct timeline *timeline, double render_s)
{
    double end = 0;
    for (size_t i = 0; i < timeline->service_count; i++) {
        const struct timeline_service *service = &timeline->services[i];
        if (service->start_s >= render_s || !(service->end_s > service->start_s)) continue;
        put_counter(json, service->start_s, service->cpu_s / (service->end_s - service->start_s));
        end = fmin(service->end_s, render_s);
    }
    if (end > 0) put_counter(json, end, 0);
}

void timeline_trace(const struct timeline *timeline, const struct renderer_stats *stats,
                    uint32_t count, double render_s, FILE *out)
{
    struct json json;
    json_begin_in(&json, out);
    json_open(&json, NULL, '{');
    json_string(&json, "displayTimeUnit", "ms");
    json_open(&json, "traceEvents", '[');
    put_label(&json, "process_name", "farm", 0);
    put_rows(&json, timeline, stats, count, render_s);
    put_services(&json, timeline, render_s);
    json_close(&json, ']');
    json_close(&json, '}');
    fputc('\n', out);
}
