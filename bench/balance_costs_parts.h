/* What the files that measure costs, model them and report them share; all others use balance_costs.h. */
#ifndef FARM_BENCH_BALANCE_COSTS_PARTS_H
#define FARM_BENCH_BALANCE_COSTS_PARTS_H

#include <stddef.h>

#include "bench/balance_costs.h"
#include "master/share.h"

/* The number of tiles of a level across so many pixels; the number of all tiles of a level; one of them, in rows
 * from the top. */
uint32_t level_columns(uint32_t size, unsigned level);
size_t level_tiles(const struct tile_costs *map, unsigned level);
struct tile level_tile(const struct tile_costs *map, unsigned level, size_t i);

/* The schedule of each APART_ number. */
extern const enum schedule apart_schedules[APART_SCHEDULES];

/* The sum of the seconds that cost() returns for each tile of a renderer's share, in their order. */
double share_sum(const struct queue_config *config, uint32_t renderer,
                 double (*cost)(const void *, const struct tile *), const void *context);

#endif
