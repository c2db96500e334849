/* The section "adaptive": adaptive runs, whose passes are shared out one after the other. */

#include "bench/balance.h"
#include "bench/balance_passes.h"
#include "bench/balance_run.h"
#include "bench/balance_schedules.h"
#include "bench/median.h"

/* Scenes and target errors: about those that 16 and 64 samples of every pixel leave (bench/README.md). */
static const struct adaptive_case {
    unsigned scene; /* of bench_scenes */
    double target;
} cases[] = {{0, 0.0025}, {0, 0.00087}, {1, 0.0096}, {1, 0.0037}};

#define CASES (sizeof cases / sizeof *cases)

static const unsigned processors[] = {1, 2, 4, 8, 16, 32, 44};
enum { COUNTS = sizeof processors / sizeof *processors, REAL_PAIRS = 5 };

/* Simulates the run on so many processors of one machine. */
static void simulate_run(const struct bench_scene *scene, const struct record *record,
                         unsigned count, struct sim_outcome *outcome)
{
    struct picture_costs costs = scene_costs(scene, record->view.min_samples);
    struct machine machine =
        one_machine(count, count > 1 ? kept_serving(scene, SERVING_SAMPLES) : 1);
    costs.record = record;
    schedule_simulate(SCHEDULE_DYNAMIC, &machine, &costs, outcome);
}

static void put_row(FILE *out, const struct bench_scene *scene, const struct adaptive_case *it,
                    const struct record *record)
{
    double serial = 0;
    fprintf(out, "| %s, %g | %.1f | %u |", scene->name, it->target, record->samples, record->count);
    for (unsigned i = 0; i < COUNTS; i++) {
        struct sim_outcome outcome;
        simulate_run(scene, record, processors[i], &outcome);
        if (i == 0) serial = outcome.render_s;
        value_set(outcome.render_s, "%s.adaptive.%g.render.%u", scene->name, it->target,
                  processors[i]);
        value_set(serial / outcome.render_s, "%s.adaptive.%g.speedup.%u", scene->name, it->target,
                  processors[i]);
        if (i > 0) fprintf(out, " %.1f |", serial / outcome.render_s);
        if (i + 1 == COUNTS) fprintf(out, " %.1f |", 100 * outcome.plans_s / outcome.render_s);
        sim_outcome_free(&outcome);
    }
    fputc('\n', out);
}

static double real_seconds(const struct bench_scene *scene, unsigned ranks, double target)
{
    return farm_run(ranks, scene->config, KEPT_FOLDER "/adaptive.pfm",
                    "image.width=%u image.height=%u sampling.target_error=%.17g", PAPER_WIDTH,
                    PAPER_HEIGHT, target)
        .render_s;
}

/* Pairs of -n 1 and -n 2, in turn, as the machine's speed changes. */
static void put_real(FILE *out, const struct bench_scene *scene, double target)
{
    double one[REAL_PAIRS], ratio[REAL_PAIRS];
    for (unsigned i = 0; i < REAL_PAIRS; i++) {
        one[i] = real_seconds(scene, 1, target);
        ratio[i] = one[i] / real_seconds(scene, 2, target);
    }
    fprintf(out, "| %s, %g | %.3f | %.3f | %.2f | %.2f |\n", scene->name, target,
            median_of(one, REAL_PAIRS), value_get("%s.adaptive.%g.render.1", scene->name, target),
            median_of(ratio, REAL_PAIRS),
            value_get("%s.adaptive.%g.speedup.2", scene->name, target));
}

void section_adaptive(FILE *out)
{
    fprintf(out,
            "Simulated speed-up of adaptive runs, %u x %u pixels, by processors; and the part of "
            "the time on %d in which passes are planned, taken to be shared by all of them:\n\n"
            "| scene, target error | samples | passes |",
            PAPER_WIDTH, PAPER_HEIGHT, PAPER_PROCESSORS);
    for (unsigned i = 1; i < COUNTS; i++)
        fprintf(out, " %u |", processors[i]);
    fputs(" plans, % |\n|---|---|---|", out);
    for (unsigned i = 0; i < COUNTS; i++)
        fputs("---|", out);
    fputc('\n', out);
    for (size_t i = 0; i < CASES; i++) {
        struct record record;
        const struct bench_scene *scene = &bench_scenes[cases[i].scene];
        fprintf(stderr, "rendering %s to an error of %g, pass by pass\n", scene->name,
                cases[i].target);
        record_make(&record, scene->config, PAPER_WIDTH, PAPER_HEIGHT, cases[i].target,
                    bench_rounds);
        put_row(out, scene, &cases[i], &record);
        record_free(&record);
    }
    fprintf(out,
            "\nReal runs, medians of %d pairs, beside simulated ones:\n\n| scene, target error | "
            "-n 1, s | "
            "simulated | -n 1 / -n 2 | simulated |\n|---|---|---|---|---|\n",
            REAL_PAIRS);
    for (size_t i = 0; i < CASES; i++)
        put_real(out, &bench_scenes[cases[i].scene], cases[i].target);
}
