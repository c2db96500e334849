/* The schedules that are compared, in the real farm and in the simulated one. */
#ifndef FARM_BENCH_BALANCE_SCHEDULES_H
#define FARM_BENCH_BALANCE_SCHEDULES_H

#include "bench/balance.h"
#include "master/schedule.h"

/* In the order of the tables. */
extern const enum schedule compared[SCHEDULES];

/* Simulates the schedule on a machine for the picture of `costs`. */
void schedule_simulate(enum schedule schedule, const struct machine *machine,
                       const struct picture_costs *costs, struct sim_outcome *outcome);

/*
 * Machines of `processors` ranks with a core each, rank 0 included, with the message costs of two ranks of one machine:
 * all ranks on the same machine, where the master serves `serving` times as long as without pause (kept_serving()); or
 * each on its own, so that none has a tray or a bell.
 */
struct machine one_machine(uint32_t processors, double serving);
struct machine apart_machines(uint32_t processors);

/* Makes the master serve longer by this factor. */
void scale_serving(struct message_costs *costs, double factor);

/* The costs of a scene at the paper's size. */
struct picture_costs scene_costs(const struct bench_scene *scene, uint32_t samples);

/* Seconds of the dynamic schedule on one processor: the reference for speed-ups. */
double serial_seconds(const struct picture_costs *costs);

#endif
