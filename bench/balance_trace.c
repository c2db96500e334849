#include "bench/balance_trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench/report_values.h"
#include "common/message.h"
#include "common/scene.h"

#define NO_OWNER UINT32_MAX

/* ---- the file ---- */

/* The farm writes each bar on its own line. */
static bool read_kind(const char *line, enum traced_kind *kind)
{
    static const char *const categories[] = {[TRACED_TILE] = "\"cat\": \"tile\"",
                                             [TRACED_PROBES] = "\"cat\": \"pre-pass\"",
                                             [TRACED_IN_VAIN] = "\"cat\": \"wasted\""};
    for (size_t i = 0; i < sizeof categories / sizeof *categories; i++) {
        if (!strstr(line, categories[i])) continue;
        *kind = (enum traced_kind)i;
        return true;
    }
    return false;
}

/* A number of a bar, from 0 to most. */
static double number(const char *line, const char *key, double most)
{
    double value = report_number(line, key);
    if (!(value >= 0 && value <= most))
        fatal("a trace has a %s of %g, expected 0 to %g", key, value, most);
    return value;
}

static struct traced read_bar(const char *line, enum traced_kind kind)
{
    const double micro = 1e-6;
    return (struct traced){.tile = {.x = (uint32_t)number(line, "x", PICTURE_MAX_EDGE),
                                    .y = (uint32_t)number(line, "y", PICTURE_MAX_EDGE),
                                    .w = (uint32_t)number(line, "w", PICTURE_MAX_EDGE),
                                    .h = (uint32_t)number(line, "h", PICTURE_MAX_EDGE),
                                    .step = 1,
                                    .pass = kind == TRACED_PROBES ? TILE_PROBE : 0},
                           .kind = kind,
                           .rank = (uint32_t)number(line, "tid", UINT32_MAX),
                           .start_s = micro * number(line, "ts", 1e15),
                           .busy_s = micro * number(line, "dur", 1e15),
                           .cpu_s = micro * number(line, "cpu_us", 1e15)};
}

void trace_read(struct trace *trace, const char *path)
{
    char *text = report_text(path), *rest = text, *line;
    enum traced_kind kind;
    *trace = (struct trace){0};
    while ((line = strsep(&rest, "\n"))) {
        if (!read_kind(line, &kind)) continue;
        trace->bars = grow(trace->bars, trace->count, sizeof *trace->bars);
        trace->bars[trace->count++] = read_bar(line, kind);
    }
    free(text);
    if (trace->count == 0) fatal("%s has no tiles", path);
}

void trace_free(struct trace *trace)
{
    free(trace->bars);
    *trace = (struct trace){0};
}

double trace_cpu(const struct trace *trace)
{
    double sum = 0;
    for (size_t i = 0; i < trace->count; i++)
        sum += trace->bars[i].cpu_s;
    return sum;
}

double trace_beside(const struct trace *trace, uint32_t rank, double cpu_s)
{
    double bars = 0;
    for (size_t i = 0; i < trace->count; i++) {
        if (trace->bars[i].rank != rank) continue;
        cpu_s -= trace->bars[i].cpu_s;
        bars++;
    }
    if (bars == 0) fatal("rank %u has rendered nothing", rank);
    return fmax(0, cpu_s) / bars;
}

double trace_work(const struct trace *trace)
{
    double vain = 0;
    for (size_t i = 0; i < trace->count; i++)
        if (trace->bars[i].kind == TRACED_IN_VAIN) vain += trace->bars[i].cpu_s;
    return trace_cpu(trace) - vain;
}

double trace_share(const struct trace *trace, uint32_t rank)
{
    double cpu = 0, busy = 0;
    for (size_t i = 0; i < trace->count; i++) {
        if (trace->bars[i].rank != rank) continue;
        cpu += trace->bars[i].cpu_s;
        busy += trace->bars[i].busy_s;
    }
    return busy > 0 ? cpu / busy : 0;
}

void trace_starts(const struct trace *trace, uint32_t ranks, double *starts)
{
    for (uint32_t i = 0; i < ranks; i++)
        starts[i] = HUGE_VAL;
    for (size_t i = 0; i < trace->count; i++) {
        const struct traced *bar = &trace->bars[i];
        if (bar->rank < ranks) starts[bar->rank] = fmin(starts[bar->rank], bar->start_s);
    }
    for (uint32_t i = 0; i < ranks; i++)
        if (starts[i] == HUGE_VAL) starts[i] = 0;
}

/* ---- costs ---- */

static bool is_within(const struct tile *tile, const struct tile_costs *map)
{
    return tile->x < map->width && tile->w <= map->width - tile->x && tile->y < map->height &&
           tile->h <= map->height - tile->y;
}

/* Tiles that were broken into pieces overlap these if both came back: the last one counts. */
static void find_owners(struct run_costs *costs)
{
    size_t pixels = (size_t)costs->map.width * costs->map.height;
    costs->owners = allocate(pixels, sizeof *costs->owners);
    for (size_t i = 0; i < pixels; i++)
        costs->owners[i] = NO_OWNER;
    for (size_t i = 0; i < costs->trace->count; i++) {
        const struct traced *bar = &costs->trace->bars[i];
        if (bar->kind != TRACED_TILE) continue;
        if (!is_within(&bar->tile, &costs->map)) fatal("the trace is of another picture");
        for (uint32_t k = 0; k < tile_pixels(&bar->tile); k++) {
            uint32_t x, y;
            tile_pixel(&bar->tile, k, &x, &y);
            costs->owners[(size_t)y * costs->map.width + x] = (uint32_t)i;
        }
    }
    for (size_t i = 0; i < pixels; i++)
        if (costs->owners[i] == NO_OWNER) fatal("the trace is not of all of the picture");
}

/* Distributes the tile's CPU time among its pixels, in proportion to the map. */
static void share_out(struct run_costs *costs, const struct traced *bar,
                      const struct tile_costs *map)
{
    uint32_t pixels = tile_pixels(&bar->tile);
    double sum = 0, spread = costs_spread(map, (double)pixels * map->samples);
    double cost = fmax(0, bar->cpu_s - map->fixed) / spread;
    for (unsigned pass = 0; pass < 2; pass++)
        for (uint32_t k = 0; k < pixels; k++) {
            uint32_t x, y;
            tile_pixel(&bar->tile, k, &x, &y);
            size_t at = (size_t)y * map->width + x;
            if (pass == 0)
                sum += map->base[at];
            else if (&costs->trace->bars[costs->owners[at]] == bar)
                costs->map.base[at] = sum > 0 ? cost * map->base[at] / sum : cost / pixels;
        }
}

void run_costs_init(struct run_costs *costs, const struct trace *trace,
                    const struct tile_costs *map)
{
    *costs = (struct run_costs){.trace = trace, .map = *map};
    memset(costs->map.levels, 0, sizeof costs->map.levels);
    costs->map.base = allocate((size_t)map->width * map->height, sizeof *costs->map.base);
    find_owners(costs);
    for (size_t i = 0; i < trace->count; i++)
        if (trace->bars[i].kind == TRACED_TILE) share_out(costs, &trace->bars[i], map);
    costs_integrate(&costs->map);
}

void run_costs_free(struct run_costs *costs)
{
    free(costs->owners);
    costs_free(&costs->map);
    *costs = (struct run_costs){0};
}

static bool is_alike(const struct tile *a, const struct tile *b)
{
    return a->x == b->x && a->y == b->y && a->w == b->w && a->h == b->h;
}

/* Probes are few. */
static double find_probes(const struct trace *trace, const struct tile *tile)
{
    for (size_t i = 0; i < trace->count; i++) {
        const struct traced *bar = &trace->bars[i];
        if (bar->kind == TRACED_PROBES && is_alike(&bar->tile, tile)) return bar->cpu_s;
    }
    return -1;
}

double run_costs_of(const struct run_costs *costs, const struct tile *tile)
{
    if (tile->pass == TILE_PROBE) return find_probes(costs->trace, tile);
    size_t at = (size_t)tile->y * costs->map.width + tile->x;
    const struct traced *bar = &costs->trace->bars[costs->owners[at]];
    return is_alike(&bar->tile, tile) ? bar->cpu_s : -1;
}
