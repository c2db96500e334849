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

static double cpu_of(const struct bench_scene *scene, unsigned processors, enum schedule schedule)
{
    struct farm_run run =
        farm_run(processors, scene->config, PICTURE, "sampling.samples=%d farm.schedule=%s",
                 SAMPLES, schedule_names[schedule]);
    return most_cpu(&run);
}

static const unsigned counts[] = {2, 4, 8, 14, 16, 18, 24, 32, 44};

static void put_row(FILE *out, FILE *csv, const struct bench_scene *scene, unsigned processors,
                    double serial)
{
    fprintf(out, "| %s | %u |", scene->name, processors);
    fprintf(csv, "%s,%u", scene->name, processors);
    for (unsigned k = 0; k < SCHEDULES; k++) {
        if (!schedule_is_static(compared[k])) continue;
        double speedup = serial / cpu_of(scene, processors, compared[k]);
        double predicted = value_get("%s.%d.%s.speedup.%u", scene->name, SAMPLES,
                                     schedule_names[compared[k]], processors);
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
    for (unsigned k = 0; k < SCHEDULES; k++) {
        if (!schedule_is_static(compared[k])) continue;
        const char *name = schedule_names[compared[k]];
        fprintf(out, " %s | simulated |", name);
        fprintf(csv, ",%s,%s_simulated", name, name);
    }
    fprintf(out, "\n|---|---|---|---|---|---|---|---|\n");
    fputc('\n', csv);
    for (unsigned s = 0; s < SCENES; s++) {
        double runs[3];
        for (unsigned i = 0; i < 3; i++)
            runs[i] = cpu_of(&bench_scenes[s], 1, SCHEDULE_DYNAMIC);
        double serial = median_of(runs, 3);
        for (unsigned i = 0; i < sizeof counts / sizeof *counts; i++)
            put_row(out, csv, &bench_scenes[s], counts[i], serial);
    }
    close_written(csv);
}
