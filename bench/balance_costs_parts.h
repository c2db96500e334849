/* What measuring costs and telling them share; for all others there is balance_costs.h. */
#ifndef FARM_BENCH_BALANCE_COSTS_PARTS_H
#define FARM_BENCH_BALANCE_COSTS_PARTS_H

#include <stddef.h>

#include "bench/balance_costs.h"
#include "master/share.h"

/* Tiles of a level that lie side by side on so many pixels; all tiles of one; one of them, rows from the top. */
uint32_t level_columns(uint32_t size, unsigned level);
size_t level_tiles(const struct tile_costs *map, unsigned level);
struct tile level_tile(const struct tile_costs *map, unsigned level, size_t i);

/* Of each of these. */
extern const enum schedule apart_schedules[APART_SCHEDULES];

/* Seconds that the tiles of a renderer's share cost in all, in its order, each as the function tells. */
double share_sum(const struct share_config *config, uint32_t renderer,
                 double (*cost)(const void *, const struct tile *), const void *context);

#endif
