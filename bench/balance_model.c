/* The section "model": what the simulated farm says against what was measured. */
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

#include "bench/balance.h"
#include "bench/balance_run.h"
#include "bench/balance_schedules.h"
#include "common/message.h"

#define SAMPLES 16
#define RUNS    3
#define PICTURE KEPT_FOLDER "/model.pfm"

static double simulated(const struct bench_scene *scene, unsigned ranks)
{
    struct picture_costs costs = scene_costs(scene, SAMPLES);
    struct machine machine = plain_machine(ranks);
    struct sim_outcome outcome;
    machine.cores = (uint32_t)sysconf(_SC_NPROCESSORS_ONLN);
    schedule_simulate(FULL, &machine, &costs, &outcome);
    double seconds = outcome.render_s;
    sim_outcome_free(&outcome);
    return seconds;
}

static double measured(const struct bench_scene *scene, unsigned ranks, unsigned runs)
{
    double times[RUNS];
    for (unsigned i = 0; i < runs; i++) {
        struct farm_run run;
        char *options = format_text("sampling.samples=%d", SAMPLES);
        farm_run(&run, ranks, scene->config, PICTURE, options);
        times[i] = run.render_s;
        farm_run_free(&run);
        free(options);
    }
    return median_of(times, runs);
}

void section_model(bool quick)
{
    static const unsigned ranks[] = {1, 2, 4, 8};
    FILE *out = open_section("model", "The simulated farm against the real one");
    fprintf(out,
            "Render phase, wall seconds, %d samples, full schedule, %ld cores shared by all ranks. "
            "**Measured**: medians of %u runs. **Simulated**: the costs below, which were measured "
            "before, not fitted.\n\n| scene | ranks | measured | simulated | off by |\n"
            "|---|---|---|---|---|\n",
            SAMPLES, sysconf(_SC_NPROCESSORS_ONLN), quick ? 1 : RUNS);
    double worst = 0;
    for (unsigned s = 0; s < SCENES; s++)
        for (unsigned i = 0; i < (quick ? 1 : 4); i++) {
            double real = measured(&bench_scenes[s], ranks[i], quick ? 1 : RUNS);
            double model = simulated(&bench_scenes[s], ranks[i]), off = model / real - 1;
            worst = fmax(worst, fabs(off));
            fprintf(out, "| %s | %u | %.3f | %.3f | %+.1f %% |\n", bench_scenes[s].name, ranks[i],
                    real, model, 100 * off);
        }
    value_set(worst, "model.worst");
    fclose(out);
}
