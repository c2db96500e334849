/* Real runs of the farm, and what their reports say. */
#ifndef FARM_BENCH_BALANCE_RUN_H
#define FARM_BENCH_BALANCE_RUN_H

#include <stdbool.h>

struct farm_run {
    double total_s, init_s, load_s, broadcast_s, build_s, render_s, write_s;
    double master_cpu_s, messages, service_s, tail_s;
    unsigned renderers;
    double *cpu_s; /* of each renderer; owned */
};

/* Its file. */
const char *farm_program(void);

/*
 * mpiexec -n ranks farm config options, a picture in picture (.pfm) and its report beside it, both
 * kept. options are separated by spaces. Ends the program when the farm fails.
 */
void farm_run(struct farm_run *run, unsigned ranks, const char *config, const char *picture,
              const char *options);

/* The same with one rank twice at the same time: two farms that have nothing to do with each other, whose
 * mean render time is returned. Where one is longer than the other, it had the machine to itself at the
 * end. What they leave behind stands in picture and beside it. */
double farm_run_side_by_side(const char *config, const char *picture, const char *options);

/* Two of the processors that this process may run on: in a container, or bound, it may be to others than the
 * first ones. false: there is no second one. */
bool two_processors(unsigned two[2]);

/*
 * Two ranks, each bound to one of two_processors(); rank 1 shares it with three processes that use all
 * they get: a renderer of a quarter of the speed.
 */
void farm_run_slow(struct farm_run *run, const char *config, const char *picture,
                   const char *options);

/* CPU seconds of rendering, and of what goes with it, of all ranks. */
double all_cpu(const struct farm_run *run);

/* The same of the rank that needs most. */
double most_cpu(const struct farm_run *run);

void farm_run_free(struct farm_run *run);

#endif
