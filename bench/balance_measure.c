/* The sections "messages" and "costs": the input of the simulated farm. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "bench/balance.h"
#include "bench/balance_costs_parts.h"
#include "bench/balance_run.h"
#include "bench/balance_schedules.h"
#include "bench/balance_trace.h"
#include "bench/median.h"
#include "bench/outside.h"
#include "common/message.h"
#include "common/nap.h"

/* ---- messages ---- */

#define MESSAGE_RUNS 5
#define AT(member)   offsetof(struct message_costs, member)

static const struct {
    const char *name, *what;
    size_t at; /* in struct message_costs */
} message_values[] = {
    {"latency_s", "from one rank to the other, an empty message", AT(latency_s)},
    {"byte_s", "for every byte more", AT(byte_s)},
    {"service_s", "of the master for one result and its answer", AT(service_s)},
    {"service_tile_s", "beside that, for every tile of a lot", AT(service_tile_s)},
    {"service_tile_large_s", "the same for 7680 x 4320 pixels and 10,000 renderers",
     AT(service_tile_large_s)},
    {"service_pixel_s", "beside that, for every pixel", AT(service_pixel_s)},
    {"fetch_s", "beside that, for a result that is fetched", AT(fetch_s)},
    {"tray_s", "of the master for one result and its answer, through a tray", AT(tray_s)},
    {"tray_pixel_s", "beside that, for every pixel", AT(tray_pixel_s)},
    {"send_s", "of a renderer in handing over a result", AT(send_s)},
    {"nap_s", "by how much a nap is longer than asked for", AT(nap_s)},
    {"tile_s", "of a renderer for every tile, beside rendering it", AT(tile_s)},
};

#define MESSAGE_VALUES (sizeof message_values / sizeof *message_values)
/* All but tile_s, which is measured in runs of the farm. */
#define BETWEEN_TWO    (MESSAGE_VALUES - 1)

static double *value_at(struct message_costs *costs, size_t i)
{
    return (void *)((char *)costs + message_values[i].at);
}

/* Measures tile_s in a run of many small tiles, by the rank that gets them in messages. There are thousands of
 * tiles: compared with them, the 2 ms that are spent once per run hardly count (MPI's first messages, first use
 * of memory, the start and the end). */
static double measure_tile(void)
{
    struct trace trace;
    struct farm_run run =
        farm_run(2, bench_scenes[0].config, KEPT_FOLDER "/tiles.pfm",
                 "sampling.samples=1 farm.tile=8 image.width=1920 image.height=1440 "
                 "output.trace=" KEPT_FOLDER "/tiles.trace.json");
    trace_read(&trace, KEPT_FOLDER "/tiles.trace.json");
    double seconds = trace_beside(&trace, 1, run.cpu_s[1]);
    trace_free(&trace);
    return seconds;
}

/* Adds what one run prints to the samples. */
static void run_messages(double samples[MESSAGE_VALUES][MESSAGE_RUNS], unsigned round)
{
    char *command = format_text("%s -n 2 %s", from_environment("MPIEXEC", "mpiexec"),
                                from_environment("MESSAGES", "build/bench/balance_messages"));
    FILE *pipe = popen(command, "r");
    char name[64];
    double value;
    unsigned found = 0;
    if (!pipe) fatal("cannot start %s", command);
    while (fscanf(pipe, "%63s %lf", name, &value) == 2)
        for (size_t i = 0; i < MESSAGE_VALUES; i++)
            if (strcmp(name, message_values[i].name) == 0) samples[i][round] = value, found++;
    if (pclose(pipe) != 0 || found != BETWEEN_TWO) fatal("failed: %s", command);
    free(command);
}

struct message_costs measure_messages(void)
{
    struct message_costs costs = {0};
    double samples[MESSAGE_VALUES][MESSAGE_RUNS];
    for (unsigned round = 0; round < MESSAGE_RUNS; round++) {
        fprintf(stderr, "measuring messages between two ranks: run %u of %d\n", round + 1,
                MESSAGE_RUNS);
        run_messages(samples, round);
    }
    for (size_t i = 0; i < BETWEEN_TWO; i++)
        *value_at(&costs, i) = median_of(samples[i], MESSAGE_RUNS);
    return costs;
}

static double measure_tiles(void)
{
    double samples[MESSAGE_RUNS];
    for (unsigned round = 0; round < MESSAGE_RUNS; round++) {
        fprintf(stderr, "measuring what a tile takes beside rendering it, by %s: run %u of %d\n",
                bench_scenes[0].config, round + 1, MESSAGE_RUNS);
        samples[round] = measure_tile();
    }
    return median_of(samples, MESSAGE_RUNS);
}

/* All of them, with tile_s, which are kept. */
static struct message_costs measure_and_keep(void)
{
    struct message_costs costs = measure_messages();
    costs.tile_s = measure_tiles();
    for (size_t i = 0; i < MESSAGE_VALUES; i++)
        value_set(*value_at(&costs, i), "%s", message_values[i].name);
    return costs;
}

struct message_costs kept_messages(void)
{
    struct message_costs costs = {0};
    for (size_t i = 0; i < MESSAGE_VALUES; i++) {
        *value_at(&costs, i) = value_get("%s", message_values[i].name);
        if (isnan(*value_at(&costs, i))) return measure_and_keep();
    }
    return costs;
}

static double measure_and_keep_serving(const struct bench_scene *scene, uint32_t samples)
{
    fprintf(stderr, "measuring how long the master serves %s, samples %u\n", scene->config,
            samples);
    double factor = measure_serving((unsigned)(scene - bench_scenes), samples);
    value_set(factor, "serving.%s.%u", scene->name, samples);
    return factor;
}

double kept_serving(const struct bench_scene *scene, uint32_t samples)
{
    samples = samples < FEW_SAMPLES ? 1 : SERVING_SAMPLES;
    double factor = value_get("serving.%s.%u", scene->name, samples);
    return isnan(factor) ? measure_and_keep_serving(scene, samples) : factor;
}

static void put_serving(FILE *out)
{
    fprintf(out,
            "\nIn runs of %d ranks on the cores of this machine the master serves that many "
            "times as long, as its data are evicted from the caches between two answers "
            "(medians). The simulated farms of the other sections take that into account:\n\n"
            "| scene | 1 sample | %u |\n|---|---|---|\n",
            PAPER_PROCESSORS, SERVING_SAMPLES);
    for (unsigned s = 0; s < SCENES; s++) {
        double single = measure_and_keep_serving(&bench_scenes[s], 1);
        double many = measure_and_keep_serving(&bench_scenes[s], SERVING_SAMPLES);
        fprintf(out, "| %s | %.1f | %.1f |\n", bench_scenes[s].name, single, many);
    }
}

void section_messages(FILE *out)
{
    struct message_costs costs = measure_and_keep();
    fprintf(
        out,
        "Measured between two ranks of this machine, medians of %d runs. Naps between two looks "
        "are %.0f to %.0f us long, and that much too long:\n\n| | seconds |\n|---|---|\n",
        MESSAGE_RUNS, 1e6 * NAP_SHORTEST, 1e6 * NAP_SELDOM);
    for (size_t i = 0; i < MESSAGE_VALUES; i++)
        fprintf(out, "| %s | %.2e |\n", message_values[i].what, *value_at(&costs, i));
    put_serving(out);
}

/* ---- costs ---- */

static void put_levels(FILE *out, FILE *csv, const struct bench_scene *scene, uint32_t samples)
{
    const struct tile_costs *map = scene_costs(scene, samples).map;
    fprintf(out, "| %s | %u | %.2e |", scene->name, samples, map->fixed);
    fprintf(csv, "%s,%u,%.9g", scene->name, samples, map->fixed);
    for (unsigned level = 0; level < COST_LEVELS; level++) {
        fprintf(out, " %.3f |", map->totals[level]);
        fprintf(csv, ",%.6f", map->totals[level]);
    }
    fputc('\n', out);
    fputc('\n', csv);
}

static double dearest_share(const struct tile_costs *map, unsigned level)
{
    double dearest = 0;
    for (size_t i = 0; i < level_tiles(map, level); i++)
        dearest = fmax(dearest, (double)map->levels[level][i]);
    return dearest / map->totals[COST_BASE];
}

static const uint32_t apart_shown[] = {2, 4, 8, 14, 16, 18, 24, 32, 40, 44};

/* Prints how much more shares cost because their pixels are distant. */
static void put_apart(FILE *out, const struct bench_scene *scene, uint32_t samples)
{
    static const char *const names[APART_SCHEDULES] = {"cyclic", "cyclic-rows"};
    const struct tile_costs *map = scene_costs(scene, samples).map;
    for (unsigned i = 0; i < APART_SCHEDULES; i++) {
        fprintf(out, "| %s | %u | %s |", scene->name, samples, names[i]);
        for (size_t k = 0; k < sizeof apart_shown / sizeof *apart_shown; k++)
            fprintf(out, " %.2f |", map->apart_ratio[i][apart_shown[k]]);
        fputc('\n', out);
    }
}

static const uint32_t cost_samples[] = {1, 16};

static void put_level_table(FILE *out)
{
    FILE *csv = open_to_write(OUT_FOLDER "/balance_costs.csv");
    fprintf(out,
            "The picture (%u x %u), rendered in this process in tiles of one size: CPU seconds "
            "of all of them, every tile the median of %u. fixed: of a tile, whatever is in "
            "it. Small tiles are dearer because their waves of rays are small.\n\n"
            "| scene | samples | fixed |",
            PAPER_WIDTH, PAPER_HEIGHT, bench_rounds);
    fprintf(csv, "scene,samples,fixed_s");
    for (unsigned level = 0; level < COST_LEVELS; level++) {
        fprintf(out, " %u x %u |", 1u << level, 1u << level);
        fprintf(csv, ",edge_%u_s", 1u << level);
    }
    fprintf(out, "\n|---|---|---|---|---|---|---|---|---|---|\n");
    fputc('\n', csv);
    for (unsigned s = 0; s < SCENES; s++)
        for (unsigned i = 0; i < 2; i++)
            put_levels(out, csv, &bench_scenes[s], cost_samples[i]);
    close_written(csv);
}

static void put_dearest(FILE *out)
{
    fprintf(out,
            "\nThe dearest tile, as a share of the whole picture (with 44 processors each has "
            "%.2f %% to do):\n\n",
            100.0 / PAPER_PROCESSORS);
    for (unsigned s = 0; s < SCENES; s++) {
        const struct tile_costs *map = scene_costs(&bench_scenes[s], cost_samples[1]).map;
        fprintf(out, "* %s: %.2f %% in a tile of 32, %.2f %% of 8, %.2f %% of 1\n",
                bench_scenes[s].name, 100 * dearest_share(map, 5), 100 * dearest_share(map, 3),
                100 * dearest_share(map, 0));
    }
}

static void put_apart_table(FILE *out)
{
    fprintf(
        out,
        "\nShares of cyclic pixels and rows were measured, too, of so many renderers: how many "
        "times "
        "the CPU time that their tiles would take if the pixels lay together, medians of %u "
        "(another "
        "renderer's share each time). Rays of pixels that lie apart have little in common. Figures "
        "are simulated with it.\n\n| scene | samples | shares |",
        bench_rounds);
    for (size_t k = 0; k < sizeof apart_shown / sizeof *apart_shown; k++)
        fprintf(out, " %u |", apart_shown[k]);
    fprintf(out, "\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (unsigned s = 0; s < SCENES; s++)
        for (unsigned i = 0; i < 2; i++)
            put_apart(out, &bench_scenes[s], cost_samples[i]);
}

void section_costs(FILE *out)
{
    put_level_table(out);
    put_dearest(out);
    put_apart_table(out);
}
