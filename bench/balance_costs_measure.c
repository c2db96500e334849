/* Measures the costs of tiles and shares, with the real renderer in this process. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/balance_costs.h"
#include "bench/balance_costs_parts.h"
#include "bench/balance_stage.h"
#include "bench/median.h"
#include "common/clock.h"
#include "common/message.h"
#include "test/renderer_fixture.h"

/* ---- measuring ---- */

struct cost_target {
    struct tile_costs *map;
    struct renderer *renderer;
    float *rgb; /* room for the whole picture, more than any tile needs */
};

/* Seconds that reading the clock twice takes: the minimum of many. */
static double clock_cost(void)
{
    double least = 1;
    for (int i = 0; i < 10000; i++) {
        double start = clock_thread_cpu(), cost = clock_thread_cpu() - start;
        least = fmin(least, cost);
    }
    return least;
}

/* The state of measuring: `count` measurements of each tile, at all levels, and of shares. */
struct rounds {
    unsigned count, round;
    double *all[COST_LEVELS];
    double clock; /* seconds that reading it takes */
    uint64_t renderers;
    double *shares; /* seconds: per share (as measure_shares() numbers them) and round */
};

static void render_tile(const struct cost_target *target, const struct tile *tile)
{
    struct render_counts counts;
    renderer_tile(target->renderer, tile, target->rgb, &counts);
}

static void measure_tile(const struct cost_target *target, struct rounds *rounds, unsigned level,
                         size_t i)
{
    struct tile tile = level_tile(target->map, level, i);
    double start = clock_thread_cpu();
    render_tile(target, &tile);
    double seconds = fmax(0, clock_thread_cpu() - start - rounds->clock);
    rounds->all[level][i * rounds->count + rounds->round] = seconds;
}

/* Measures a tile of the largest level, at all levels in turn. So disturbances by other processes affect all
 * levels alike, and so do the caches, which hold the block's data by then. */
static void measure_block(const struct cost_target *target, struct rounds *rounds, size_t block)
{
    struct tile area = level_tile(target->map, COST_LEVELS - 1, block);
    render_tile(target, &area);
    for (unsigned level = COST_LEVELS; level-- > 0;) {
        uint32_t across = level_columns(target->map->width, level), edge = 1u << level;
        for (uint32_t y = area.y; y < area.y + area.h; y += edge)
            for (uint32_t x = area.x; x < area.x + area.w; x += edge)
                measure_tile(target, rounds, level, (size_t)(y >> level) * across + (x >> level));
    }
}

#define SHARES (APART_SCHEDULES * (APART_MOST + 1))

/* The renderer whose share is measured in a round: a different one in every round, evenly spaced over all
 * renderers. To measure the shares of all would take more than ten times as long, and rays are equally distant
 * in each. */
static uint32_t renderer_of_round(uint32_t renderers, unsigned round, unsigned rounds)
{
    return (uint32_t)((2 * (uint64_t)round + 1) * renderers / (2 * (uint64_t)rounds));
}

static double seconds_of(const void *context, const struct tile *tile)
{
    const struct cost_target *target = context;
    double start = clock_thread_cpu();
    render_tile(target, tile);
    return clock_thread_cpu() - start;
}

/* Measures shares between blocks of tiles, so that disturbances affect them like the tiles with which they are
 * compared. */
static void measure_shares(const struct cost_target *target, struct rounds *rounds, size_t block)
{
    for (size_t i = block; i < SHARES; i += level_tiles(target->map, COST_LEVELS - 1)) {
        struct queue_config config = {.schedule = apart_schedules[i % APART_SCHEDULES],
                                      .width = target->map->width,
                                      .height = target->map->height,
                                      .renderers = (uint32_t)(i / APART_SCHEDULES)};
        if (!(rounds->renderers >> config.renderers & 1)) continue;
        uint32_t renderer = renderer_of_round(config.renderers, rounds->round, rounds->count);
        rounds->shares[i * rounds->count + rounds->round] =
            share_sum(&config, renderer, seconds_of, target);
    }
}

/* Says what it is at on stderr, as it may take minutes. */
static void measure_levels(const struct cost_target *target, struct rounds *rounds,
                           const char *config)
{
    struct tile_costs *map = target->map;
    for (unsigned level = 0; level < COST_LEVELS; level++)
        rounds->all[level] = allocate(level_tiles(map, level) * rounds->count, sizeof(double));
    for (; rounds->round < rounds->count; rounds->round++) {
        fprintf(stderr, "measuring the costs of %s, %u x %u, %u sample%s: round %u of %u\n", config,
                map->width, map->height, map->samples, map->samples == 1 ? "" : "s",
                rounds->round + 1, rounds->count);
        for (size_t block = 0; block < level_tiles(map, COST_LEVELS - 1); block++) {
            measure_block(target, rounds, block);
            measure_shares(target, rounds, block);
        }
    }
    for (unsigned level = 0; level < COST_LEVELS; level++) {
        map->levels[level] = allocate(level_tiles(map, level), sizeof(float));
        for (size_t i = 0; i < level_tiles(map, level); i++)
            map->levels[level][i] =
                (float)median_of(rounds->all[level] + i * rounds->count, rounds->count);
        free(rounds->all[level]);
    }
}

/* Compares each share that was measured with the model's cost of the same share. */
static void compare_shares(struct tile_costs *map, const struct rounds *rounds)
{
    struct picture_costs view = {.map = map, .scale = 1, .samples = map->samples};
    double *ratios = allocate(rounds->count, sizeof *ratios);
    for (size_t i = 0; i < SHARES; i++) {
        uint32_t renderers = (uint32_t)(i / APART_SCHEDULES);
        if (!(rounds->renderers >> renderers & 1)) continue;
        for (unsigned round = 0; round < rounds->count; round++) {
            uint32_t renderer = renderer_of_round(renderers, round, rounds->count);
            ratios[round] =
                rounds->shares[i * rounds->count + round] /
                costs_of_share(&view, apart_schedules[i % APART_SCHEDULES], renderers, renderer);
        }
        map->apart_ratio[i % APART_SCHEDULES][renderers] = median_of(ratios, rounds->count);
    }
    free(ratios);
}

void costs_measure(struct tile_costs *map, const char *config, uint32_t width, uint32_t height,
                   uint32_t samples, unsigned rounds, uint64_t renderers)
{
    struct stage stage;
    struct rounds all = {
        .count = rounds, .clock = clock_cost(), .renderers = renderers & APART_ALL};
    all.shares = allocate_zeroed((size_t)SHARES * rounds, sizeof *all.shares);
    /* Uniformly sampled, whatever the scene says. */
    char *count = format_text("sampling.samples=%u", samples);
    stage_open(&stage, config, width, height,
               (const char *[]){count, "sampling.target_error=0", "sampling.time_limit=0"}, 3);
    free(count);
    *map = (struct tile_costs){.width = width, .height = height, .samples = samples};
    float *rgb = allocate(3 * (size_t)width * height, sizeof *rgb);
    measure_levels(&(struct cost_target){map, stage.renderer, rgb}, &all, config);
    free(rgb);
    stage_close(&stage);
    costs_derive(map);
    compare_shares(map, &all);
    free(all.shares);
}
