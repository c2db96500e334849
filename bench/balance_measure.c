/* The sections "messages" and "costs": the input of the simulated farm. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench/balance.h"
#include "bench/balance_run.h"
#include "bench/balance_schedules.h"
#include "bench/balance_trace.h"
#include "bench/median.h"
#include "bench/outside.h"
#include "common/message.h"
#include "common/nap.h"

/* ---- messages ---- */

#define MESSAGE_RUNS 5

static const struct {
    const char *name, *what;
} message_values[] = {
    {"latency_s", "from one rank to the other, an empty message"},
    {"byte_s", "for every byte more"},
    {"service_s", "of the master for one result and its answer"},
    {"service_tile_s", "beside that, for every tile of a lot"},
    {"service_pixel_s", "beside that, for every pixel"},
    {"fetch_s", "beside that, for a result that is fetched"},
    {"tray_s", "of the master for one result and its answer, through a tray"},
    {"tray_pixel_s", "beside that, for every pixel"},
    {"send_s", "of a renderer in handing over a result"},
    {"nap_s", "by how much a nap is longer than asked for"},
    {"tile_s", "of a renderer for every tile, beside rendering it"},
};

#define MESSAGE_VALUES (sizeof message_values / sizeof *message_values)

/* The last value is measured in runs of the farm. */
#define TILE_VALUE (MESSAGE_VALUES - 1)

/* Measures tile_s in a run of many small tiles, by the rank that gets them in messages. There are thousands of
 * tiles: compared with them, the 2 ms that are spent once per run hardly count (MPI's first messages, first use
 * of memory, the start and the end). */
static double measure_tile(void)
{
    struct farm_run run;
    struct trace trace;
    farm_run(&run, 2, bench_scenes[0].config, KEPT_FOLDER "/tiles.pfm",
             "sampling.samples=1 farm.tile=8 image.width=1920 image.height=1440 "
             "output.trace=" KEPT_FOLDER "/tiles.trace.json");
    trace_read(&trace, KEPT_FOLDER "/tiles.trace.json");
    double seconds = trace_beside(&trace, 1, run.cpu_s[1]);
    trace_free(&trace);
    farm_run_free(&run);
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
    if (pclose(pipe) != 0 || found != TILE_VALUE) fatal("failed: %s", command);
    free(command);
}

/* Measures all values but the last one, which is set to 0. */
static void measure_values(double values[MESSAGE_VALUES])
{
    double samples[MESSAGE_VALUES][MESSAGE_RUNS];
    for (unsigned round = 0; round < MESSAGE_RUNS; round++) {
        fprintf(stderr, "measuring messages between two ranks: run %u of %d\n", round + 1,
                MESSAGE_RUNS);
        run_messages(samples, round);
    }
    for (size_t i = 0; i < TILE_VALUE; i++)
        values[i] = median_of(samples[i], MESSAGE_RUNS);
    values[TILE_VALUE] = 0;
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

static struct message_costs costs_of_values(const double values[MESSAGE_VALUES])
{
    return (struct message_costs){.latency_s = values[0],
                                  .byte_s = values[1],
                                  .service_s = values[2],
                                  .service_tile_s = values[3],
                                  .service_pixel_s = values[4],
                                  .fetch_s = values[5],
                                  .tray_s = values[6],
                                  .tray_pixel_s = values[7],
                                  .send_s = values[8],
                                  .nap_s = values[9],
                                  .tile_s = values[TILE_VALUE]};
}

struct message_costs measure_messages(void)
{
    double values[MESSAGE_VALUES];
    measure_values(values);
    return costs_of_values(values);
}

/* All of them, the last one, too, and keeps them. */
static void keep_values(double values[MESSAGE_VALUES])
{
    measure_values(values);
    values[TILE_VALUE] = measure_tiles();
    for (size_t i = 0; i < MESSAGE_VALUES; i++)
        value_set(values[i], "%s", message_values[i].name);
}

struct message_costs kept_messages(void)
{
    double values[MESSAGE_VALUES];
    bool known = true;
    for (size_t i = 0; i < MESSAGE_VALUES; i++) {
        values[i] = value_get("%s", message_values[i].name);
        known = known && !isnan(values[i]);
    }
    if (!known) keep_values(values);
    return costs_of_values(values);
}

void section_messages(FILE *out)
{
    double values[MESSAGE_VALUES];
    keep_values(values);
    fprintf(
        out,
        "Measured between two ranks of this machine, medians of %d runs. Naps between two looks "
        "are %.0f to %.0f us long, and that much too long:\n\n| | seconds |\n|---|---|\n",
        MESSAGE_RUNS, 1e6 * NAP_SHORTEST, 1e6 * NAP_SELDOM);
    for (size_t i = 0; i < MESSAGE_VALUES; i++)
        fprintf(out, "| %s | %.2e |\n", message_values[i].what, values[i]);
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
    uint32_t edge = 1u << level;
    size_t tiles = (size_t)((map->width + edge - 1) / edge) * ((map->height + edge - 1) / edge);
    double dearest = 0;
    for (size_t i = 0; i < tiles; i++)
        if ((double)map->levels[level][i] > dearest) dearest = (double)map->levels[level][i];
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
    FILE *csv = open_out("balance_costs.csv");
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
    fclose(csv);
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
