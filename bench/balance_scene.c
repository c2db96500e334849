/* Speed-ups of a given scene, by the simulated farm. */
#include <stdio.h>

#include "bench/balance.h"
#include "bench/balance_schedules.h"

/* How long the master serves is not measured for this scene: that of the first one stands for it. */
static void put_row(const struct picture_costs *costs, double serial, uint32_t processors)
{
    struct machine machine =
        one_machine(processors, kept_serving(&bench_scenes[0], costs->samples));
    printf("| %u |", processors);
    for (unsigned k = 0; k < SCHEDULES; k++) {
        struct sim_outcome outcome;
        schedule_simulate(compared[k], &machine, costs, &outcome);
        printf(" %.1f |", serial / outcome.render_s);
        sim_outcome_free(&outcome);
    }
    putchar('\n');
    fflush(stdout);
}

void compare_schedules(const char *config, uint32_t samples)
{
    struct tile_costs map, single;
    uint64_t shown = UINT64_C(1) << PAPER_PROCESSORS;
    for (uint32_t processors = 2; processors < PAPER_PROCESSORS; processors *= 2)
        shown |= UINT64_C(1) << processors;
    costs_measure(&map, config, PAPER_WIDTH, PAPER_HEIGHT, samples, bench_rounds, shown);
    if (samples != 1) costs_measure(&single, config, PAPER_WIDTH, PAPER_HEIGHT, 1, bench_rounds, 0);
    struct picture_costs costs = {
        .map = &map, .single = samples == 1 ? &map : &single, .scale = 1, .samples = samples};
    double serial = serial_seconds(&costs);
    printf("Simulated speed-up of %s, %u x %u pixels, samples = %u, one processor: %.3f s\n\n"
           "| processors |",
           config, PAPER_WIDTH, PAPER_HEIGHT, samples, serial);
    for (unsigned k = 0; k < SCHEDULES; k++)
        printf(" %s |", schedule_names[compared[k]]);
    printf("\n|---|");
    for (unsigned k = 0; k < SCHEDULES; k++)
        printf("---|");
    putchar('\n');
    for (uint32_t processors = 2; processors < PAPER_PROCESSORS; processors *= 2)
        put_row(&costs, serial, processors);
    put_row(&costs, serial, PAPER_PROCESSORS);
    costs_free(&map);
    if (samples != 1) costs_free(&single);
}
