/* The section "plan": simulated farms of up to 100,000 renderers. */
#include <math.h>
#include <stdlib.h>

#include "bench/balance.h"
#include "bench/balance_events.h"
#include "bench/balance_schedules.h"
#include "bench/outside.h"
#include "common/message.h"

/* A picture of 7680 x 4320: the middle of the measured one, each pixel of which becomes 12 x 12. */
#define SCALE 12
#define TOP   60

/* The network: seconds per byte at 100 Gbit/s, and seconds of an atomic operation on memory of another node. */
#define NETWORK_BYTE_S 0.08e-9
#define ATOMIC_S       0.2e-6

static struct picture_costs large_costs(const struct bench_scene *scene, uint32_t samples)
{
    struct picture_costs costs = scene_costs(scene, 16);
    costs.scale = SCALE;
    costs.top = TOP;
    costs.samples = samples;
    return costs;
}

/* A farm of nodes with node_cores cores each, with nothing but serving on rank 0. */
static struct machine large_machine(uint32_t renderers, uint32_t node_cores, double latency_s)
{
    struct machine machine = apart_machines(renderers / node_cores);
    machine.node_cores = node_cores;
    machine.master_renders = false;
    machine.messages.latency_s = latency_s;
    machine.messages.byte_s = NETWORK_BYTE_S;
    machine.messages.service_tile_s = machine.messages.service_tile_large_s;
    return machine;
}

/* Speeds from 0.5 to 2, uniform in the logarithm, in an order without a pattern. */
static double *uneven_speeds(uint32_t count, double *sum)
{
    double *speeds = allocate(count, sizeof *speeds);
    *sum = 0;
    for (uint32_t i = 0; i < count; i++) {
        double part = fmod(i * 0.6180339887498949, 1);
        speeds[i] = exp2(2 * part - 1);
        *sum += speeds[i];
    }
    return speeds;
}

struct plan {
    double render_s, efficiency;
    double master;   /* part of the time in which the master serves */
    double repeated; /* ratio of tiles that were handed out twice */
};

static struct plan plan_run(const struct machine *machine, const struct picture_costs *costs,
                            double speed)
{
    struct sim_outcome outcome;
    schedule_simulate(SCHEDULE_DYNAMIC, machine, costs, &outcome);
    struct plan plan = {.render_s = outcome.render_s,
                        .efficiency = outcome.useful_s / (speed * outcome.render_s),
                        .master = outcome.master_s / outcome.render_s,
                        .repeated = (double)outcome.repeated / outcome.tiles};
    sim_outcome_free(&outcome);
    return plan;
}

/* ---- an index in an RMA window ---- */

struct index_tile {
    struct tile tile;
    double cost;
};

static int dearest_first(const void *a, const void *b)
{
    const struct index_tile *x = a, *y = b;
    return (x->cost < y->cost) - (x->cost > y->cost);
}

/* Tiles of edge x edge, the most expensive first; their costs are assumed to be known, as after a pre-pass on
 * every rank. */
static struct index_tile *ordered_tiles(const struct picture_costs *costs, uint32_t edge,
                                        uint32_t *count)
{
    uint32_t columns = costs_width(costs) / edge, rows = costs_height(costs) / edge;
    struct index_tile *tiles = allocate((size_t)columns * rows, sizeof *tiles);
    *count = columns * rows;
    for (uint32_t i = 0; i < *count; i++) {
        struct tile tile = {
            .x = i % columns * edge, .y = i / columns * edge, .w = edge, .h = edge, .step = 1};
        tiles[i] = (struct index_tile){tile, costs_of(costs, &tile)};
    }
    qsort(tiles, *count, sizeof *tiles, dearest_first);
    return tiles;
}

/*
 * Simulates an index in an RMA window: every renderer gets the next index by an atomic operation on rank 0's
 * memory, where these operations are serialised, and writes its pixels to their place by one-sided messages,
 * which share rank 0's link.
 */
static struct plan index_run(const struct picture_costs *costs, uint32_t renderers, uint32_t edge,
                             double latency_s)
{
    uint32_t count;
    struct index_tile *tiles = ordered_tiles(costs, edge, &count);
    struct events events = {0};
    double atomic_free = 0, link_free = 0, end = 0, useful = 0;
    double pixels_s = edge * edge * 12 * NETWORK_BYTE_S;
    const double tile_s = kept_messages().tile_s;
    for (uint32_t who = 0; who < renderers; who++) {
        struct event asks = {.time = latency_s, .who = who};
        events_add(&events, &asks);
    }
    for (uint32_t next = 0; next < count; next++) {
        struct event asks = events_take(&events);
        atomic_free = fmax(atomic_free, asks.time) + ATOMIC_S;
        double done = atomic_free + latency_s + tiles[next].cost + tile_s;
        useful += tiles[next].cost;
        link_free = fmax(link_free, done + latency_s) + pixels_s;
        end = fmax(end, link_free);
        asks.time = done + latency_s;
        events_add(&events, &asks);
    }
    events_free(&events);
    free(tiles);
    return (struct plan){.render_s = end,
                         .efficiency = useful / (renderers * end),
                         .master = count * fmax(ATOMIC_S, pixels_s) / end};
}

/* ---- tables ---- */

/* A line's farm, and what it renders. */
struct farm {
    const struct bench_scene *scene;
    uint32_t renderers, samples;
    double latency_s;
};

static void put_plan(FILE *out, FILE *csv, const char *what, struct farm farm,
                     const struct plan *plan)
{
    fprintf(out, "| %s | %s | %u | %u | %.0f | %.3f | %.1f %% | %.1f %% | %.1f %% |\n", what,
            farm.scene->name, farm.renderers, farm.samples, 1e6 * farm.latency_s, plan->render_s,
            100 * plan->efficiency, 100 * plan->master, 100 * plan->repeated);
    fprintf(csv, "\"%s\",%s,%u,%u,%.1e,%.6f,%.5f,%.5f,%.5f\n", what, farm.scene->name,
            farm.renderers, farm.samples, farm.latency_s, plan->render_s, plan->efficiency,
            plan->master, plan->repeated);
    fflush(out);
    fflush(csv);
}

/* kind: in front of the scene in the name of the value. */
static void keep_efficiency(const char *kind, struct farm farm, const struct plan *plan)
{
    value_set(plan->efficiency, "plan.%s%s.%u.%u.%.0f", kind, farm.scene->name, farm.renderers,
              farm.samples, 1e6 * farm.latency_s);
}

static void one_master(FILE *out, FILE *csv, struct farm farm)
{
    struct picture_costs costs = large_costs(farm.scene, farm.samples);
    struct machine machine = large_machine(farm.renderers, 1, farm.latency_s);
    struct plan plan = plan_run(&machine, &costs, farm.renderers);
    put_plan(out, csv, "one master", farm, &plan);
    keep_efficiency("", farm, &plan);
}

static void uneven_master(FILE *out, FILE *csv, struct farm farm)
{
    struct picture_costs costs = large_costs(farm.scene, farm.samples);
    struct machine machine = large_machine(farm.renderers, 1, farm.latency_s);
    double sum, *speeds = uneven_speeds(farm.renderers, &sum);
    machine.speeds = speeds;
    struct plan plan = plan_run(&machine, &costs, sum);
    put_plan(out, csv, "one master, speeds 0.5 to 2", farm, &plan);
    keep_efficiency("uneven.", farm, &plan);
    free(speeds);
}

static void two_levels(FILE *out, FILE *csv, struct farm farm, uint32_t node_cores)
{
    struct picture_costs costs = large_costs(farm.scene, farm.samples);
    struct machine machine = large_machine(farm.renderers, node_cores, farm.latency_s);
    double cores = (double)machine.renderers * node_cores;
    struct plan plan = plan_run(&machine, &costs, cores);
    char *what = format_text("second level: nodes of %u", node_cores);
    put_plan(out, csv, what, farm, &plan);
    free(what);
}

static void window_index(FILE *out, FILE *csv, struct farm farm, uint32_t edge)
{
    struct picture_costs costs = large_costs(farm.scene, farm.samples);
    struct plan plan = index_run(&costs, farm.renderers, edge, farm.latency_s);
    char *what = format_text("index in a window, tiles of %u", edge);
    put_plan(out, csv, what, farm, &plan);
    free(what);
}

static void put_head(FILE *out)
{
    fprintf(out, "\n| | scene | renderers | samples | latency us | render s | efficiency | master "
                 "busy | repeated |\n|---|---|---|---|---|---|---|---|---|\n");
}

/* Samples per pixel: for a preview, for a good picture, and for about the paper's cost per pixel. */
static const uint32_t plan_samples[] = {16, 256, 4096};

static void put_saturation(FILE *out, FILE *csv)
{
    const struct bench_scene *garden = &bench_scenes[1];
    fprintf(out, "\n**Where one master saturates**\n");
    put_head(out);
    for (uint32_t renderers = 1000; renderers <= 100000; renderers *= 10)
        for (unsigned i = 0; i < 3; i++)
            one_master(out, csv, (struct farm){garden, renderers, plan_samples[i], 1e-5});
    for (uint32_t renderers = 1000; renderers <= 10000; renderers *= 10)
        one_master(out, csv, (struct farm){&bench_scenes[0], renderers, 4096, 1e-5});
}

static void put_latencies(FILE *out, FILE *csv)
{
    const struct bench_scene *garden = &bench_scenes[1];
    fprintf(out, "\n**Latency, and speeds that differ by a factor of 4**\n");
    put_head(out);
    one_master(out, csv, (struct farm){garden, 10000, 4096, 1e-6});
    one_master(out, csv, (struct farm){garden, 10000, 4096, 1e-4});
    uneven_master(out, csv, (struct farm){garden, 1000, 4096, 1e-5});
    for (double latency = 1e-6; latency < 2e-4; latency *= 10)
        uneven_master(out, csv, (struct farm){garden, 10000, 4096, latency});
    uneven_master(out, csv, (struct farm){garden, 100000, 4096, 1e-5});
}

static void put_further(FILE *out, FILE *csv)
{
    const struct bench_scene *garden = &bench_scenes[1];
    fprintf(
        out,
        "\n**What carries on from there**: a second level (the first rank of every node hands "
        "out to the node's cores what it gets in lots), or no master in the way of handing "
        "out (a list of tiles, dear ones first, the same on every rank; the next index by "
        "fetch-and-add in a window of rank 0; pixels by one-sided messages; the list is taken to "
        "know what tiles cost, not what probes predict). Neither is in the farm.\n");
    put_head(out);
    two_levels(out, csv, (struct farm){garden, 10000, 256, 1e-5}, 16);
    two_levels(out, csv, (struct farm){garden, 100000, 4096, 1e-5}, 16);
    two_levels(out, csv, (struct farm){garden, 100000, 4096, 1e-5}, 32);
    window_index(out, csv, (struct farm){garden, 10000, 256, 1e-5}, 16);
    window_index(out, csv, (struct farm){garden, 10000, 256, 1e-5}, 8);
    window_index(out, csv, (struct farm){garden, 100000, 4096, 1e-5}, 8);
}

void section_plan(FILE *out)
{
    const struct bench_scene *garden = &bench_scenes[1];
    struct picture_costs costs = large_costs(garden, 16);
    FILE *csv = open_to_write(OUT_FOLDER "/balance_plan.csv");
    fprintf(csv, "what,scene,renderers,samples,latency_s,render_s,efficiency,master,repeated\n");
    fprintf(
        out,
        "**Simulated**: the real queue, 7680 x 4320 pixels (costs scaled up from the measured "
        "ones), rank 0 only serves, 100 Gbit/s, the measured service times. Efficiency: of "
        "the time of all renderers, by their speed, the part that went into tiles that count. "
        "What decides is how long there is something to do: %s with 16 samples is %.0f s of work, "
        "%.3f s for each of 10,000 renderers, in which "
        "rank 0 gets 398 MB of pixels; the paper's pictures, 14.8 ms a pixel, would be 49 s for "
        "each at this size.\n\n![Efficiency, and how busy rank 0 is](balance_plan.svg)\n",
        garden->name, costs_total(&costs), costs_total(&costs) / 10000);
    put_saturation(out, csv);
    put_latencies(out, csv);
    put_further(out, csv);
    close_written(csv);
}
