/* The section "model": the simulated farm compared with real runs; and how long its master serves in such runs. */
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

#include "bench/balance.h"
#include "bench/balance_run.h"
#include "bench/balance_schedules.h"
#include "bench/balance_trace.h"
#include "bench/median.h"
#include "common/message.h"

#define SAMPLES 16
#define RUNS    5u
#define PICTURE KEPT_FOLDER "/model.pfm"
#define TRACE   KEPT_FOLDER "/model.trace.json"

/* Messages without READY and STATS of each renderer on another rank, which are no answers. */
static double answers_of(const struct farm_run *run)
{
    return fmax(0, run->messages - 2.0 * (run->renderers - 1));
}

/* Seconds that the master spends serving answers. */
static double serving_of(const struct farm_run *run)
{
    return run->service_s * answers_of(run);
}

/* The message costs for a run: transfer times as between two ranks that do nothing else, CPU time besides tiles
 * as measured in that run. */
static struct message_costs messages_of(const struct farm_run *run, const struct trace *trace,
                                        const struct message_costs *alone)
{
    struct message_costs costs = *alone;
    costs.tile_s = fmax(0, all_cpu(run) - trace_cpu(trace)) / (double)trace->count;
    costs.looking_share = fmax(0, run->master_cpu_s - serving_of(run)) / run->render_s;
    return costs;
}

/* What is measured once for all rows, within the same minutes. */
struct surroundings {
    struct message_costs messages;
    double slice_s;
};

static unsigned cores(void)
{
    return (unsigned)sysconf(_SC_NPROCESSORS_ONLN);
}

/* A run that is simulated anew, and what it is given; replay_end() frees it. */
struct replay {
    struct machine machine;
    struct picture_costs costs;
    struct run_costs own;
    double *starts;
};

static void replay_begin(struct replay *replay, unsigned scene, uint32_t samples,
                         const struct farm_run *run, const struct trace *trace,
                         const struct surroundings *around)
{
    replay->machine = (struct machine){.renderers = run->renderers,
                                       .node_cores = 1,
                                       .cores = cores(),
                                       .slice_s = around->slice_s,
                                       .master_renders = true,
                                       .rings = true,
                                       .messages = messages_of(run, trace, &around->messages)};
    replay->costs = scene_costs(&bench_scenes[scene], samples);
    run_costs_init(&replay->own, trace, replay->costs.map);
    replay->costs.map = &replay->own.map;
    replay->costs.run = &replay->own;
    replay->starts = allocate(run->renderers, sizeof *replay->starts);
    trace_starts(trace, run->renderers, replay->starts);
    replay->machine.starts = replay->starts;
}

static void replay_end(struct replay *replay)
{
    run_costs_free(&replay->own);
    free(replay->starts);
}

/*
 * How many times as long the master serves in the run as without pause: between two answers its data are evicted from
 * the caches. It is taken to be the same for everything that it does.
 */
static double serving_factor(enum schedule schedule, const struct replay *replay,
                             const struct farm_run *run)
{
    struct sim_outcome outcome;
    schedule_simulate(schedule, &replay->machine, &replay->costs, &outcome);
    double factor = outcome.master_s > 0 ? serving_of(run) / outcome.master_s : 1;
    sim_outcome_free(&outcome);
    return factor;
}

static double simulated(unsigned scene, enum schedule schedule, const struct farm_run *run,
                        const struct trace *trace, const struct surroundings *around)
{
    struct replay replay;
    struct sim_outcome outcome;
    replay_begin(&replay, scene, SAMPLES, run, trace, around);
    scale_serving(&replay.machine.messages, serving_factor(schedule, &replay, run));
    schedule_simulate(schedule, &replay.machine, &replay.costs, &outcome);
    double seconds = outcome.render_s;
    sim_outcome_free(&outcome);
    replay_end(&replay);
    return seconds;
}

double measure_serving(unsigned scene, uint32_t samples)
{
    double factors[RUNS];
    struct surroundings around = {.messages = kept_messages(), .slice_s = measure_slice()};
    for (unsigned i = 0; i < RUNS; i++) {
        struct trace trace;
        struct replay replay;
        struct farm_run run = farm_run(PAPER_PROCESSORS, bench_scenes[scene].config, PICTURE,
                                       "sampling.samples=%u output.trace=" TRACE, samples);
        trace_read(&trace, TRACE);
        replay_begin(&replay, scene, samples, &run, &trace, &around);
        factors[i] = serving_factor(SCHEDULE_DYNAMIC, &replay, &run);
        replay_end(&replay);
        trace_free(&trace);
    }
    return median_of(factors, RUNS);
}

/*
 * Figures of a run: wall seconds of rendering as measured, as simulated, and in the ideal case that nothing but tiles
 * takes time and no rank waits; the average part of a core that ranks had while they rendered; the part of the cores'
 * time that the farm used; and the relative error of the simulation.
 */
enum { MEASURED, SIMULATED, IDEAL, SHARE, USED, OFF, FIGURES };

/* A row of the table. */
struct row {
    enum schedule schedule;
    unsigned ranks;
};

/* Makes the i-th run of a row. */
static void run_row(unsigned scene, const struct row *row, const struct surroundings *around,
                    double figures[FIGURES][RUNS], unsigned i)
{
    double busy = fmin(row->ranks, cores());
    struct trace trace;
    struct farm_run run = farm_run(row->ranks, bench_scenes[scene].config, PICTURE,
                                   "sampling.samples=%d output.trace=" TRACE " farm.schedule=%s",
                                   SAMPLES, schedule_names[row->schedule]);
    trace_read(&trace, TRACE);
    figures[MEASURED][i] = run.render_s;
    figures[SIMULATED][i] = simulated(scene, row->schedule, &run, &trace, around);
    figures[IDEAL][i] = trace_cpu(&trace) / busy;
    figures[USED][i] = (all_cpu(&run) + run.master_cpu_s) / busy / run.render_s;
    figures[OFF][i] = figures[SIMULATED][i] / figures[MEASURED][i] - 1;
    figures[SHARE][i] = 0;
    for (unsigned rank = 0; rank < row->ranks; rank++)
        figures[SHARE][i] += trace_share(&trace, rank) / row->ranks;
    trace_free(&trace);
}

/* Prints a row; returns the relative error of the simulation, the median over runs. */
static double put_row(FILE *out, unsigned scene, const struct row *row,
                      const struct surroundings *around)
{
    double figures[FIGURES][RUNS], medians[FIGURES];
    for (unsigned i = 0; i < RUNS; i++)
        run_row(scene, row, around, figures, i);
    for (unsigned k = 0; k < FIGURES; k++)
        medians[k] = median_of(figures[k], RUNS); /* which sorts them */
    if (!isfinite(medians[OFF])) fatal("what the simulated farm says is no time");
    fprintf(out,
            "| %s | %s | %u | %.3f | %.3f | %.3f | %.3f | %.3f | %+.1f %% | %+.1f to %+.1f %% |\n",
            bench_scenes[scene].name, schedule_names[row->schedule], row->ranks, medians[SHARE],
            medians[USED], medians[IDEAL], medians[MEASURED], medians[SIMULATED],
            100 * medians[OFF], 100 * figures[OFF][0], 100 * figures[OFF][RUNS - 1]);
    fflush(out);
    return medians[OFF];
}

static void put_heading(FILE *out, const struct surroundings *around)
{
    fprintf(
        out,
        "Render phase, wall seconds, %d samples, %u cores shared by all ranks; "
        "medians of %u runs. The speed of a machine changes by tenths from one minute to the "
        "next, so every run is compared with itself.\n\n"
        "* **Measured**: `render_s` of the run's report.\n"
        "* **Simulated**: the real queue in virtual time. It is given the CPU seconds of each "
        "tile of that run (`output.trace`) and what its master and renderers spent beside "
        "tiles (its report); when each rank began its first tile; and what was "
        "measured just before: messages, naps (%.0f us too long), slices of a core that "
        "ranks share (%.1f ms). Who gets which tile, in what order and lots, who waits from then "
        "on, what is rendered in vain "
        "and how the run ends is the model's own. With more ranks than cores somebody always "
        "has work, so these rows test messages and shared cores; the order of tiles "
        "shows where shares are fixed or tiles large (strips, tiles).\n"
        "* **Tiles alone**: CPU seconds of all bars of the trace / processors at work: "
        "what a model would say that knows no waiting.\n"
        "* **Off by, median**: by how much more or less than measured, the median of the %u runs "
        "with their signs; single runs are off by more (from, to). -n 1 is nearly given: it has "
        "nobody to wait for, and what its tiles took is told to the model.\n"
        "* **Of a core**: CPU seconds of bars / their wall seconds, mean of the ranks. Where no "
        "two ranks share a core, what is missing to 1 others took, and is missing in the "
        "simulated time.\n"
        "* **Of all**: CPU seconds of ranks and master (report) / wall seconds of the cores. With "
        "more ranks than cores, what is missing to 1 others took, and is missing in the simulated "
        "time, or nobody used, which is for the model to say.\n\n"
        "| scene | schedule | ranks | of a core | of all | tiles alone | measured | simulated | "
        "off by, median | "
        "from, to |\n|---|---|---|---|---|---|---|---|---|---|\n",
        SAMPLES, cores(), RUNS, 1e6 * around->messages.nap_s, 1e3 * around->slice_s, RUNS);
}

void section_model(FILE *out)
{
    static const struct row rows[] = {{SCHEDULE_DYNAMIC, 1}, {SCHEDULE_DYNAMIC, 2},
                                      {SCHEDULE_STRIPS, 2},  {SCHEDULE_CYCLIC_ROWS, 2},
                                      {SCHEDULE_TILES, 2},   {SCHEDULE_DYNAMIC, 4},
                                      {SCHEDULE_DYNAMIC, 8}, {SCHEDULE_DYNAMIC, PAPER_PROCESSORS}};
    const unsigned count = sizeof rows / sizeof *rows;
    struct surroundings around = {.messages = measure_messages(), .slice_s = measure_slice()};
    put_heading(out, &around);
    double worst = 0;
    for (unsigned s = 0; s < SCENES; s++)
        for (unsigned i = 0; i < count; i++)
            worst = fmax(worst, fabs(put_row(out, s, &rows[i], &around)));
    value_set(worst, "model.worst");
}
