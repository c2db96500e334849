/* The section "static": the static schedules in real runs with any number of processors, by the CPU time of
 * every rank. */
#include <math.h>

#include "bench/balance.h"
#include "bench/balance_run.h"
#include "bench/balance_schedules.h"
#include "bench/median.h"
#include "bench/outside.h"
#include "common/message.h"

#define SAMPLES 16
#define PICTURE KEPT_FOLDER "/static.pfm"

static double cpu_of(const struct bench_scene *scene, unsigned processors, const char *options)
{
    struct farm_run run =
        farm_run(processors, scene->config, PICTURE, "sampling.samples=%d %s", SAMPLES, options);
    return most_cpu(&run);
}

static const unsigned counts[] = {2, 4, 8, 14, 16, 18, 24, 32, 44};

static void put_row(FILE *out, FILE *csv, const struct bench_scene *scene, unsigned processors,
                    double serial)
{
    fprintf(out, "| %s | %u |", scene->name, processors);
    fprintf(csv, "%s,%u", scene->name, processors);
    for (unsigned k = 0; k < SCHEDULES_COMPARED; k++) {
        const struct bench_schedule *schedule = &bench_schedules[k];
        if (!schedule->is_static) continue;
        double speedup = serial / cpu_of(scene, processors, schedule->options);
        double predicted =
            value_get("%s.%d.%s.speedup.%u", scene->name, SAMPLES, schedule->name, processors);
        fprintf(out, " %.2f |", speedup);
        fprintf(csv, ",%.4f,", speedup);
        if (isnan(predicted)) {
            fputs(" |", out);
        } else {
            fprintf(out, " %.2f |", predicted);
            fprintf(csv, "%.4f", predicted);
        }
    }
    fputc('\n', out);
    fputc('\n', csv);
}

void section_static(FILE *out)
{
    FILE *csv = open_to_write(OUT_FOLDER "/balance_static.csv");
    fprintf(
        out,
        "**Measured**: mpiexec -n P, %d samples. Speed-up: CPU seconds of -n 1 against those of "
        "the rank that needs most, so that who else has the cores does not count, but for what "
        "he does to caches and clock; beside it what the simulated farm says (section figures, "
        "where it was made).\n\n| scene | "
        "processors |",
        SAMPLES);
    fprintf(csv, "scene,processors");
    for (unsigned k = 0; k < SCHEDULES_COMPARED; k++) {
        if (!bench_schedules[k].is_static) continue;
        fprintf(out, " %s | simulated |", bench_schedules[k].name);
        fprintf(csv, ",%s,%s_simulated", bench_schedules[k].name, bench_schedules[k].name);
    }
    fprintf(out, "\n|---|---|---|---|---|---|---|---|\n");
    fputc('\n', csv);
    for (unsigned s = 0; s < SCENES; s++) {
        double runs[3];
        for (unsigned i = 0; i < 3; i++)
            runs[i] = cpu_of(&bench_scenes[s], 1, "");
        double serial = median_of(runs, 3);
        for (unsigned i = 0; i < sizeof counts / sizeof *counts; i++)
            put_row(out, csv, &bench_scenes[s], counts[i], serial);
    }
    close_written(csv);
}
