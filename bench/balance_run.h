/* Real runs of the farm, and values of their reports. */
#ifndef FARM_BENCH_BALANCE_RUN_H
#define FARM_BENCH_BALANCE_RUN_H

#include <stdbool.h>

/* Most ranks of a run. */
#define RUN_RANKS 44

struct farm_run {
    double total_s, init_s, load_s, broadcast_s, build_s, render_s, write_s;
    double master_cpu_s, messages, service_s, tail_s;
    unsigned renderers;
    double cpu_s[RUN_RANKS]; /* of each renderer */
};

/* The path of the program. */
const char *farm_program(void);

/*
 * Runs `mpiexec -n ranks farm config options`, with the picture in `picture` (.pfm) and its report beside it,
 * which both stay. options are formatted as by printf and separated by spaces. Ends the program when the farm fails.
 */
struct farm_run farm_run(unsigned ranks, const char *config, const char *picture,
                         const char *options, ...) __attribute__((format(printf, 4, 5)));

/*
 * The same for two independent farms of one rank each at the same time; returns the mean of their render times.
 * Where one takes longer than the other, it has the machine to itself at the end. Their outputs are in `picture`
 * and beside it.
 */
double farm_run_side_by_side(const char *config, const char *picture, const char *options);

/* Sets two of the processors that this process may run on: in a container, or if it is bound, these need not be
 * the first ones. false: there is no second one. */
bool two_processors(unsigned two[2]);

/*
 * Runs two ranks, each bound to one of two_processors(); rank 1 shares its processor with three processes that
 * use all they get, which makes it a renderer of a quarter of the speed.
 */
struct farm_run farm_run_slow(const char *config, const char *picture, const char *options);

/* CPU seconds of the rendering threads of all ranks. */
double all_cpu(const struct farm_run *run);

/* The same of the rank with the most. */
double most_cpu(const struct farm_run *run);

#endif
