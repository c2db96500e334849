/* The section "real": runs on this machine, in wall time where that is meaningful here. */
#include <unistd.h>

#include "bench/balance.h"
#include "bench/balance_run.h"
#include "bench/balance_trace.h"
#include "bench/median.h"
#include "bench/outside.h"

#define SAMPLES   16
#define SAMPLED   "sampling.samples=16"
#define PAIRS     5u /* pairs of runs with a slowed renderer and without */
/* Pairs of -n 1 and -n 2: odd. Ratios of single pairs were seen to differ by a third. */
#define TURNS     11u
#define MANY_RUNS 5u /* runs with forty-four ranks: odd */
#define ONE_FILE  KEPT_FOLDER "/one.pfm"
#define MANY_FILE KEPT_FOLDER "/many.pfm"
#define TRACE     KEPT_FOLDER "/real.trace.json"
#define TRACED    SAMPLED " output.trace=" TRACE

static bool same_bits(const char *a, const char *b)
{
    return run_shell("cmp -s %s %s", a, b) == 0;
}

/* ---- one processor against two ---- */

enum phase { STARTING, LOADING, SHARING, BUILDING, RENDERING, WRITING, TOTAL, PHASES };

static const char *const phases[PHASES] = {[STARTING] = "starting MPI",
                                           [LOADING] = "loading",
                                           [SHARING] = "sharing scene",
                                           [BUILDING] = "building the BVH",
                                           [RENDERING] = "rendering",
                                           [WRITING] = "writing",
                                           [TOTAL] = "total"};

static void phases_of(const struct farm_run *run, double seconds[PHASES])
{
    seconds[STARTING] = run->init_s;
    seconds[LOADING] = run->load_s;
    seconds[SHARING] = run->broadcast_s;
    seconds[BUILDING] = run->build_s;
    seconds[RENDERING] = run->render_s;
    seconds[WRITING] = run->write_s;
    seconds[TOTAL] = run->total_s;
}

/* Runs the farm; returns the CPU seconds of rendering of the rank that needs most. */
static double run_phases(const struct bench_scene *scene, unsigned ranks, const char *picture,
                         double seconds[PHASES])
{
    struct farm_run run = farm_run(ranks, scene->config, picture, SAMPLED);
    phases_of(&run, seconds);
    return most_cpu(&run);
}

/*
 * The throughput of two of these cores at the same time compared with one: two farms of one rank side by side,
 * against one farm that took render_s seconds. What the cores share (memory, power, other users of the machine)
 * is a loss that no schedule can recover.
 */
static double cores_gain(const struct bench_scene *scene, double render_s)
{
    return 2 * render_s / farm_run_side_by_side(scene->config, MANY_FILE, SAMPLED);
}

/* Runs of one process and of two, in turns. */
struct pairs {
    double one[PHASES][TURNS], two[PHASES][TURNS]; /* seconds */
    double speedup[TURNS], speedup_by_cpu[TURNS], speedup_of_all[TURNS];
    double gain[TURNS], of_gain[TURNS]; /* cores_gain(), and what part of it is reached */
    bool same;                          /* all pictures */
};

static void run_pairs(const struct bench_scene *scene, struct pairs *pairs)
{
    pairs->same = true;
    for (unsigned i = 0; i < TURNS; i++) {
        double a[PHASES], b[PHASES], cpu = 0, cpu_of_two;
        /* The order alternates: a machine that slows down meanwhile favours neither. */
        if (i % 2 == 0) cpu = run_phases(scene, 1, ONE_FILE, a);
        cpu_of_two = run_phases(scene, 2, MANY_FILE, b);
        if (i % 2 == 1) cpu = run_phases(scene, 1, ONE_FILE, a);
        pairs->same = pairs->same && same_bits(ONE_FILE, MANY_FILE);
        for (unsigned p = 0; p < PHASES; p++)
            pairs->one[p][i] = a[p], pairs->two[p][i] = b[p];
        pairs->speedup[i] = a[RENDERING] / b[RENDERING];
        pairs->speedup_by_cpu[i] = cpu / cpu_of_two;
        pairs->speedup_of_all[i] = a[TOTAL] / b[TOTAL];
        pairs->gain[i] = cores_gain(scene, a[RENDERING]);
        pairs->of_gain[i] = pairs->speedup[i] / pairs->gain[i];
    }
}

static void put_phases(FILE *out, struct pairs *pairs)
{
    fputs("| |", out);
    for (unsigned p = 0; p < PHASES; p++)
        fprintf(out, " %s |", phases[p]);
    fprintf(out, "\n|---|---|---|---|---|---|---|---|\n| -n 1 |");
    for (unsigned p = 0; p < PHASES; p++)
        fprintf(out, " %.3f |", median_of(pairs->one[p], TURNS));
    fprintf(out, "\n| -n 2 |");
    for (unsigned p = 0; p < PHASES; p++)
        fprintf(out, " %.3f |", median_of(pairs->two[p], TURNS));
}

static void compare_pairs(FILE *out, const struct bench_scene *scene)
{
    struct pairs pairs;
    run_pairs(scene, &pairs);
    fprintf(out, "\n**%s**, seconds:\n\n", scene->name);
    put_phases(out, &pairs);
    double speedup = median_of(pairs.speedup, TURNS); /* which sorts them */
    const unsigned quarter = (TURNS - 1) / 4;         /* of 11 the third from either end */
    fprintf(
        out,
        "\n\nRendering: %.3f times as fast (the middle half of the pairs from %.3f to %.3f, "
        "all from %.3f to "
        "%.3f); by CPU seconds of the rank that needs most, in which it does not count who else "
        "had the cores, %.3f times; the whole run: %.3f times. Two farms of one process at the "
        "same time get %.3f times as much done as one alone; -n 2 reaches %.3f of that. Pictures: "
        "%s.\n",
        speedup, pairs.speedup[quarter], pairs.speedup[TURNS - 1 - quarter], pairs.speedup[0],
        pairs.speedup[TURNS - 1], median_of(pairs.speedup_by_cpu, TURNS),
        median_of(pairs.speedup_of_all, TURNS), median_of(pairs.gain, TURNS),
        median_of(pairs.of_gain, TURNS), pairs.same ? "the same bits" : "THEY DIFFER");
    value_set(speedup, "%s.real.speedup.2", scene->name);
    value_set(pairs.same, "%s.real.same.2", scene->name);
}

/* ---- forty-four ---- */

/* Another run for the pictures of who rendered what, which cost rank 0 a little: apart from the measured runs. */
static void draw_many(const struct bench_scene *scene)
{
    (void)farm_run(PAPER_PROCESSORS, scene->config, MANY_FILE,
                   SAMPLED " output.trace=" KEPT_FOLDER "/%s.trace.json output.ranks=" OUT_FOLDER
                           "/balance_ranks_%s.png output.heatmap=" OUT_FOLDER
                           "/balance_heatmap_%s.png",
                   scene->name, scene->name, scene->name);
}

static void run_many(FILE *out, const struct bench_scene *scene)
{
    double render[MANY_RUNS], total[MANY_RUNS], messages[MANY_RUNS], cpu[MANY_RUNS];
    double master[MANY_RUNS], tail[MANY_RUNS];
    bool same = true;
    for (unsigned i = 0; i < MANY_RUNS; i++) {
        struct farm_run run = farm_run(PAPER_PROCESSORS, scene->config, MANY_FILE, SAMPLED);
        render[i] = run.render_s, total[i] = run.total_s, messages[i] = run.messages;
        cpu[i] = all_cpu(&run), tail[i] = run.tail_s;
        master[i] = run.master_cpu_s / run.render_s;
        same = same && same_bits(ONE_FILE, MANY_FILE);
    }
    double share = median_of(master, MANY_RUNS);
    fprintf(out, "| %s | %d | %.3f | %.2f | %.0f | %.3f | %.3f %% (%.3f to %.3f) | %.3f | %s |\n",
            scene->name, PAPER_PROCESSORS, median_of(render, MANY_RUNS),
            median_of(total, MANY_RUNS), median_of(messages, MANY_RUNS), median_of(cpu, MANY_RUNS),
            100 * share, 100 * master[0], 100 * master[MANY_RUNS - 1], median_of(tail, MANY_RUNS),
            same ? "the same bits" : "THEY DIFFER");
    value_set(same, "%s.real.same.44", scene->name);
    value_set(share, "%s.real.master.44", scene->name);
}

/* ---- a rank that waits ---- */

/* A picture of one row, in strips: rank 0 has all of it, the others nothing. */
static void report_waiting(FILE *out)
{
    const unsigned ranks = 4;
    unsigned looks;
    double share = measure_waiting(ranks, bench_scenes[1].config, MANY_FILE,
                                   "farm.schedule=strips 'image.region=0 240 640 1' "
                                   "sampling.samples=20000",
                                   &looks);
    value_set(share, "waiting");
    fprintf(out,
            "\nA rank that waits uses %.2f %% of a core (one rank renders while %u wait; median of "
            "%u seconds, CPU time of all threads).\n",
            100 * share, ranks - 1, looks);
}

/* ---- a renderer of a quarter of the speed ---- */

/*
 * A run of two ranks. best_s: the ideal time, which is the cost of its tiles and probes divided by the cores
 * that the ranks had: one, and the part `share` of the other one that rank 1 got.
 */
struct two_ranks {
    double render_s, best_s, share;
};

static struct two_ranks run_two(const struct bench_scene *scene, bool slow)
{
    struct trace trace;
    struct farm_run run = slow ? farm_run_slow(scene->config, MANY_FILE, TRACED)
                               : farm_run(2, scene->config, MANY_FILE, TRACED);
    trace_read(&trace, TRACE);
    double share = slow ? trace_share(&trace, 1) : 1;
    struct two_ranks two = {run.render_s, trace_work(&trace) / (1 + share), share};
    trace_free(&trace);
    return two;
}

/*
 * Measures how much of the cores' time the farm loses when rank 1 shares its core with three processes that do
 * nothing but use it, compared with its loss without them. Each run is compared with the cost of its own tiles,
 * as the machine's speed varies from minute to minute by more than the effect. For comparison, the same by wall
 * time alone.
 */
static void measure_slow(FILE *out, const struct bench_scene *scene)
{
    double shares[PAIRS], times[PAIRS], best[PAIRS], lost[PAIRS], lost_evenly[PAIRS];
    double more[PAIRS], by_wall[PAIRS];
    for (unsigned i = 0; i < PAIRS; i++) {
        struct two_ranks even = run_two(scene, false), slow = run_two(scene, true);
        shares[i] = slow.share;
        times[i] = slow.render_s;
        best[i] = slow.best_s;
        lost[i] = slow.render_s / slow.best_s - 1;
        lost_evenly[i] = even.render_s / even.best_s - 1;
        more[i] = (1 + lost[i]) / (1 + lost_evenly[i]) - 1;
        by_wall[i] = slow.render_s / (even.render_s * 2 / (1 + slow.share)) - 1;
    }
    double worse = median_of(more, PAIRS);
    value_set(worse, "%s.real.slow", scene->name);
    fprintf(out, "| %s | %.3f | %.3f | %.3f | %.2f %% | %.2f %% | %.2f %% | %.2f %% |\n",
            scene->name, median_of(shares, PAIRS), median_of(times, PAIRS), median_of(best, PAIRS),
            100 * median_of(lost, PAIRS), 100 * median_of(lost_evenly, PAIRS), 100 * worse,
            100 * median_of(by_wall, PAIRS));
}

static void put_slow(FILE *out)
{
    fprintf(
        out,
        "\n**A renderer slowed fourfold**: -n 2, rank 1 shares its core with three processes "
        "that use all they get; in %u pairs with -n 2 without them. At best: CPU seconds of the "
        "run's tiles and probes (`output.trace`) / (1 + its share of the core), the cores' "
        "time without any loss. Lost: what the run took longer than that. More: what is lost "
        "with the slowed renderer beyond what -n 2 loses anyhow; by the wall: the run against "
        "2 / (1 + share) of the -n 2 beside it, in which the machine's own speed, which is "
        "another one from run to run, shows.\n\n"
        "| scene | share of its core | render s | at best s | lost | lost without | more | "
        "by the wall |\n|---|---|---|---|---|---|---|---|\n",
        PAIRS);
    for (unsigned s = 0; s < SCENES; s++)
        measure_slow(out, &bench_scenes[s]);
}

void section_real(FILE *out)
{
    fprintf(out,
            "**Measured** in wall time on this machine, %ld cores, %u x %u pixels, %d samples; "
            "medians of %u pairs of -n 1 and -n 2 in turn.\n",
            sysconf(_SC_NPROCESSORS_ONLN), PAPER_WIDTH, PAPER_HEIGHT, SAMPLES, TURNS);
    for (unsigned s = 0; s < SCENES; s++)
        compare_pairs(out, &bench_scenes[s]);
    fprintf(
        out,
        "\n**Many ranks on these cores**, medians of %u runs: what the master costs, and whether "
        "the picture is that of -n 1.\n\n| scene | ranks | render s | total s | messages | CPU s "
        "of "
        "rendering | master, of a core | tail s | picture |\n"
        "|---|---|---|---|---|---|---|---|---|\n",
        MANY_RUNS);
    for (unsigned s = 0; s < SCENES; s++) {
        double unused[PHASES];
        run_phases(&bench_scenes[s], 1, ONE_FILE, unused);
        run_many(out, &bench_scenes[s]);
        draw_many(&bench_scenes[s]);
    }
    report_waiting(out);
    unsigned two[2];
    if (two_processors(two)) put_slow(out);
}
