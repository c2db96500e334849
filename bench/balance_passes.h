/* The passes of an adaptive run in the simulated farm: master/passes.c without clock and time limit. What tiles bring
 * and how long they take is recorded (bench/balance_record.h); plans are made anew, as pixels come in. */
#ifndef FARM_BENCH_BALANCE_PASSES_H
#define FARM_BENCH_BALANCE_PASSES_H

#include <stdbool.h>

#include "bench/balance_record.h"
#include "master/queue.h"

struct sim_passes;

/* The queue is new. Ended by sim_passes_end(), after which the queue can only be destroyed. The record must outlive
 * both. */
struct sim_passes *sim_passes_begin(const struct record *record, struct queue *queue);
void sim_passes_end(struct sim_passes *passes);

const struct record *sim_passes_record(const struct sim_passes *passes);

/* How many pixels the result of a tile has that is handed out now. */
uint32_t sim_passes_pixels(const struct sim_passes *passes, const struct tile *tile);

/* A tile counts that has taken so many seconds. */
void sim_passes_put(struct sim_passes *passes, const struct tile *tile, double seconds);

/* All tiles are in: plans the next pass. Returns whether there is one; *plan_s: one thread's seconds for the plan. */
bool sim_passes_plan(struct sim_passes *passes, double *plan_s);

/* Adds the tiles of the planned pass to the queue. */
void sim_passes_add(struct sim_passes *passes);

#endif
