/* The section "model": what the simulated farm says against what was measured. */
#include <math.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bench/balance.h"
#include "bench/balance_run.h"
#include "bench/balance_schedules.h"
#include "common/message.h"

#define SAMPLES 16
#define RUNS    3
#define LEVEL   4 /* tiles of 16 x 16, as the farm's for a few ranks */
#define PICTURE KEPT_FOLDER "/model.pfm"

static unsigned cores(void)
{
    return (unsigned)sysconf(_SC_NPROCESSORS_ONLN);
}

/*
 * How fast this machine is now, with so many processes at work, beside when the tiles were measured: that
 * is hours ago, with one at work, and the same instructions were seen to take 15 % more from one hour to
 * the next, and more where processes share a core and its caches. As many processes render the picture
 * tile by tile; no schedule, no messages.
 */
static double speed_now(const struct bench_scene *scene, unsigned processes)
{
    double sum = 0, seconds;
    int ends[2];
    if (pipe(ends) != 0) fatal("cannot open a pipe");
    for (unsigned i = 0; i < processes; i++) {
        pid_t child = fork();
        if (child < 0) fatal("cannot start a process");
        if (child > 0) continue;
        seconds = costs_at_present(scene->config, PAPER_WIDTH, PAPER_HEIGHT, SAMPLES, LEVEL);
        _exit(write(ends[1], &seconds, sizeof seconds) != sizeof seconds);
    }
    for (unsigned i = 0; i < processes; i++) {
        int status;
        if (wait(&status) < 0 || status != 0 ||
            read(ends[0], &seconds, sizeof seconds) != sizeof seconds)
            fatal("cannot measure how fast this machine is");
        sum += seconds;
    }
    close(ends[0]);
    close(ends[1]);
    return scene_costs(scene, SAMPLES).map->totals[LEVEL] * processes / sum;
}

static double simulated(const struct bench_scene *scene, unsigned ranks, double speed)
{
    struct picture_costs costs = scene_costs(scene, SAMPLES);
    struct machine machine = plain_machine(ranks);
    struct sim_outcome outcome;
    double *speeds = allocate(ranks, sizeof *speeds);
    for (unsigned i = 0; i < ranks; i++)
        speeds[i] = speed;
    machine.speeds = speeds;
    machine.cores = cores();
    schedule_simulate(FULL, &machine, &costs, &outcome);
    double seconds = outcome.render_s;
    sim_outcome_free(&outcome);
    free(speeds);
    return seconds;
}

/* Render phase, and the machine's speed, in turns: the medians. */
struct comparison {
    double render_s, speed;
};

static struct comparison measured(const struct bench_scene *scene, unsigned ranks, unsigned runs)
{
    double times[RUNS], speeds[RUNS];
    for (unsigned i = 0; i < runs; i++) {
        struct farm_run run;
        char *options = format_text("sampling.samples=%d", SAMPLES);
        farm_run(&run, ranks, scene->config, PICTURE, options);
        times[i] = run.render_s;
        farm_run_free(&run);
        free(options);
        speeds[i] = speed_now(scene, ranks);
    }
    return (struct comparison){median_of(times, runs), median_of(speeds, runs)};
}

void section_model(bool quick)
{
    static const unsigned ranks[] = {1, 2, 4, 8};
    FILE *out = open_section("model", "The simulated farm against the real one");
    fprintf(
        out,
        "Render phase, wall seconds, %d samples, full schedule, %ld cores shared by all ranks. "
        "**Measured**: medians of %u runs. **Simulated**: the costs below, which were measured "
        "before, not fitted, times how fast the machine is now: as many processes as ranks "
        "render the picture tile by tile, in turn with the runs.\n\n"
        "| scene | ranks | measured | speed | simulated | off by |\n|---|---|---|---|---|---|\n",
        SAMPLES, sysconf(_SC_NPROCESSORS_ONLN), quick ? 1 : RUNS);
    double worst = 0;
    for (unsigned s = 0; s < SCENES; s++)
        for (unsigned i = 0; i < (quick ? 1 : 4); i++) {
            struct comparison real = measured(&bench_scenes[s], ranks[i], quick ? 1 : RUNS);
            double model = simulated(&bench_scenes[s], ranks[i], real.speed);
            double off = model / real.render_s - 1;
            worst = fmax(worst, fabs(off));
            fprintf(out, "| %s | %u | %.3f | %.3f | %.3f | %+.1f %% |\n", bench_scenes[s].name,
                    ranks[i], real.render_s, real.speed, model, 100 * off);
        }
    value_set(worst, "model.worst");
    fclose(out);
}
