/* The section "figures": the paper's figures 10 to 13, by the simulated farm. */
#include <math.h>
#include <stdlib.h>

#include "bench/balance.h"
#include "bench/balance_schedules.h"
#include "bench/outside.h"
#include "common/message.h"

#define SAMPLES 16

/* ---- running ---- */

static FILE *open_wide(const char *kind, const struct bench_scene *scene, const char *first)
{
    FILE *csv = open_to_write(OUT_FOLDER "/balance_%s_%s.csv", kind, scene->name);
    fprintf(csv, "%s", first);
    for (unsigned k = 0; k < SCHEDULES; k++)
        fprintf(csv, ",%s", schedule_names[compared[k]]);
    fputc('\n', csv);
    return csv;
}

/* Figures 10 and 11: time and speed-up against processors. */
static void sweep(const struct bench_scene *scene, uint32_t samples, FILE *times, FILE *speedups)
{
    struct picture_costs costs = scene_costs(scene, samples);
    double serial = serial_seconds(&costs), serving = kept_serving(scene, samples);
    value_set(serial, "%s.%u.serial", scene->name, samples);
    for (uint32_t processors = 2; processors <= PAPER_PROCESSORS; processors++) {
        struct machine machine = one_machine(processors, serving);
        if (times) fprintf(times, "%u", processors);
        if (speedups) fprintf(speedups, "%u", processors);
        for (unsigned k = 0; k < SCHEDULES; k++) {
            struct sim_outcome outcome;
            schedule_simulate(compared[k], &machine, &costs, &outcome);
            double speedup = serial / outcome.render_s;
            if (times) fprintf(times, ",%.6f", outcome.render_s);
            if (speedups) fprintf(speedups, ",%.3f", speedup);
            value_set(speedup, "%s.%u.%s.speedup.%u", scene->name, samples,
                      schedule_names[compared[k]], processors);
            value_set(sim_efficiency(&outcome, processors), "%s.%u.%s.efficiency.%u", scene->name,
                      samples, schedule_names[compared[k]], processors);
            value_set(sim_tail(&outcome, processors) / outcome.render_s, "%s.%u.%s.tail.%u",
                      scene->name, samples, schedule_names[compared[k]], processors);
            sim_outcome_free(&outcome);
        }
        if (times) fputc('\n', times);
        if (speedups) fputc('\n', speedups);
    }
}

static double finish_of(const struct sim_renderer *renderer)
{
    return renderer->finish_s;
}

/* Milliseconds. */
static double send_of(const struct sim_renderer *renderer)
{
    return 1e3 * renderer->send_s;
}

/* Figures 12 and 13: a value of each processor. */
static void each_processor(const struct bench_scene *scene, uint32_t processors, const char *kind,
                           double (*value)(const struct sim_renderer *))
{
    struct picture_costs costs = scene_costs(scene, SAMPLES);
    struct machine machine = one_machine(processors, kept_serving(scene, SAMPLES));
    struct sim_outcome outcomes[SCHEDULES];
    char *name = format_text("%s_%u", kind, processors);
    FILE *csv = open_wide(name, scene, "rank");
    for (unsigned k = 0; k < SCHEDULES; k++)
        schedule_simulate(compared[k], &machine, &costs, &outcomes[k]);
    for (uint32_t i = 0; i < processors; i++) {
        fprintf(csv, "%u", i);
        for (unsigned k = 0; k < SCHEDULES; k++)
            fprintf(csv, ",%.6f", value(&outcomes[k].renderers[i]));
        fputc('\n', csv);
    }
    for (unsigned k = 0; k < SCHEDULES; k++)
        sim_outcome_free(&outcomes[k]);
    close_written(csv);
    free(name);
}

/* One of 44 processors is four times slower: the largest loss beyond the missing share, over several places of
 * the slow one. */
static void slow_one(const struct bench_scene *scene)
{
    struct picture_costs costs = scene_costs(scene, SAMPLES);
    struct machine machine = one_machine(PAPER_PROCESSORS, kept_serving(scene, SAMPLES));
    double speeds[PAPER_PROCESSORS], worst = 0;
    struct sim_outcome outcome;
    schedule_simulate(SCHEDULE_DYNAMIC, &machine, &costs, &outcome);
    double even = outcome.render_s;
    sim_outcome_free(&outcome);
    for (uint32_t slow = 0; slow < PAPER_PROCESSORS; slow += 7) {
        for (uint32_t i = 0; i < PAPER_PROCESSORS; i++)
            speeds[i] = i == slow ? 0.25 : 1;
        machine.speeds = speeds;
        schedule_simulate(SCHEDULE_DYNAMIC, &machine, &costs, &outcome);
        double fair = even * PAPER_PROCESSORS / (PAPER_PROCESSORS - 0.75);
        worst = fmax(worst, outcome.render_s / fair - 1);
        sim_outcome_free(&outcome);
    }
    value_set(worst, "%s.slow.44", scene->name);
}

/* ---- the section ---- */

static const uint32_t finish_processors[] = {14, 16, 18};

static void put_table(FILE *out, const struct bench_scene *scene, uint32_t samples)
{
    static const uint32_t shown[] = {2, 4, 8, 14, 16, 18, 24, 32, 40, 44};
    fprintf(out,
            "\n**%s, %u sample%s per pixel** (serial: %.3f s; the paper's strips on 44: %.0f)\n\n| "
            "processors |",
            scene->name, samples, samples == 1 ? "" : "s",
            value_get("%s.%u.serial", scene->name, samples), scene->paper_speedup);
    for (unsigned k = 0; k < SCHEDULES; k++)
        fprintf(out, " %s |", schedule_names[compared[k]]);
    fprintf(out, "\n|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < sizeof shown / sizeof *shown; i++) {
        fprintf(out, "| %u |", shown[i]);
        for (unsigned k = 0; k < SCHEDULES; k++)
            fprintf(out, " %.2f |",
                    value_get("%s.%u.%s.speedup.%u", scene->name, samples,
                              schedule_names[compared[k]], shown[i]));
        fputc('\n', out);
    }
    fprintf(out, "| %d, efficiency |", PAPER_PROCESSORS);
    for (unsigned k = 0; k < SCHEDULES; k++)
        fprintf(out, " %.1f %% |",
                100 * value_get("%s.%u.%s.efficiency.%d", scene->name, samples,
                                schedule_names[compared[k]], PAPER_PROCESSORS));
    fputc('\n', out);
}

void section_figures(FILE *out)
{
    for (unsigned s = 0; s < SCENES; s++) {
        const struct bench_scene *scene = &bench_scenes[s];
        FILE *times = open_wide("time", scene, "processors");
        FILE *speedups = open_wide("speedup", scene, "processors");
        sweep(scene, SAMPLES, times, speedups);
        close_written(times);
        close_written(speedups);
        sweep(scene, 1, NULL, NULL);
        for (unsigned i = 0; i < 3; i++)
            each_processor(scene, finish_processors[i], "finish", finish_of);
        each_processor(scene, 16, "send", send_of);
        slow_one(scene);
    }
    fprintf(
        out,
        "**Simulated**: the real queue in virtual time, one machine with a core for each processor "
        "(rank 0 included), tiles, what there is beside them and messages as dear as they were "
        "measured. Speed-up of the render phase against the full schedule on one "
        "processor, which has tiles of another size: in these the same pixels were "
        "measured to cost up to some per cent more or less, and speed-up is off by as "
        "much. Efficiency is free of that: the part of the processors' time that went "
        "into tiles that count, without the pre-pass, what is rendered in vain, what "
        "there is beside tiles, serving and waiting; nor does it show that cyclic shares take more "
        "time for the same pixels.\n\n"
        "![Time against processors](balance_fig10.svg)\n\n"
        "![Speed-up against processors](balance_fig11.svg)\n");
    for (unsigned s = 0; s < SCENES; s++) {
        put_table(out, &bench_scenes[s], SAMPLES);
        put_table(out, &bench_scenes[s], 1);
    }
    fprintf(out, "\n![When every processor finishes](balance_fig12.svg)\n\n"
                 "![What every processor spends in sending](balance_fig13.svg)\n");
}
