/* The schedules that are compared, in the real farm and in virtual time. */
#ifndef FARM_BENCH_BALANCE_SCHEDULES_H
#define FARM_BENCH_BALANCE_SCHEDULES_H

#include "bench/balance.h"

enum { STRIPS, CYCLIC_PIXELS, CYCLIC_ROWS, PLAIN_TILES, FULL, SCHEDULES_COMPARED };

struct bench_schedule {
    const char *name;    /* a word */
    const char *options; /* of the farm */
    bool is_static;
};

extern const struct bench_schedule bench_schedules[SCHEDULES_COMPARED];

/* Simulates the schedule on a machine, the picture being that of costs. */
void schedule_simulate(unsigned schedule, const struct machine *machine,
                       const struct picture_costs *costs, struct sim_outcome *outcome);

/* `processors` ranks with a core each, rank 0 included, with what messages cost between two of one machine: all on that
 * one; or each on its own, so that none has a tray or a bell. */
struct machine one_machine(uint32_t processors);
struct machine apart_machines(uint32_t processors);

/* A scene at the paper's size. */
struct picture_costs scene_costs(const struct bench_scene *scene, uint32_t samples);

/* Seconds of the full schedule on one processor: what speed-ups compare with. */
double serial_seconds(const struct picture_costs *costs);

#endif
