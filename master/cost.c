#include "master/cost.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "common/message.h"

/*
 * A probe of a pixel on its own has a fixed cost that a sample among many does not have. The
 * cheapest probes of a picture (the sky) are little else: measured on lantern and garden, what such
 * a sample costs in a tile is about a quarter of what its probe costs beyond that fixed part
 * elsewhere. So this share of the cheapest probe is taken off all.
 */
#define FIXED_SHARE 0.75

/* Blocks across so many pixels whose middle, edge / 2, lies within. */
static uint32_t blocks_across(uint32_t pixels, uint32_t edge)
{
    uint32_t middle = edge / 2;
    return pixels > middle ? (pixels - middle - 1) / edge + 1 : 0;
}

void cost_init(struct cost_map *map, uint32_t width, uint32_t height, uint32_t edge,
               uint32_t blocks)
{
    *map = (struct cost_map){.width = width, .height = height};
    if (edge == 0) return;
    map->columns = blocks_across(width, edge);
    map->rows = blocks_across(height, edge);
    if (map->columns == 0 || map->rows == 0) return;
    map->edge = edge;
    map->probe_blocks = blocks;
    map->probes = (map->columns + blocks - 1) / blocks * map->rows;
    size_t count = (size_t)map->columns * map->rows;
    map->seconds = allocate(count, sizeof *map->seconds);
    map->mean = allocate(count, sizeof *map->mean);
    map->peak = allocate(count, sizeof *map->peak);
    for (size_t i = 0; i < count; i++) {
        map->seconds[i] = -1;
        map->mean[i] = map->peak[i] = 1;
    }
}

void cost_free(struct cost_map *map)
{
    free(map->seconds);
    free(map->mean);
    free(map->peak);
    *map = (struct cost_map){0};
}

/* The middle of every block, in a row of blocks: every edge-th pixel of one row of the picture. */
struct tile cost_probe(const struct cost_map *map, uint32_t i)
{
    uint32_t edge = map->edge, across = (map->columns + map->probe_blocks - 1) / map->probe_blocks;
    uint32_t x = i % across * map->probe_blocks * edge, left = map->width - x;
    uint64_t w = (uint64_t)map->probe_blocks * edge;
    return (struct tile){.x = x,
                         .y = i / across * edge + edge / 2,
                         .w = w < left ? (uint32_t)w : left,
                         .h = 1,
                         .phase = edge / 2,
                         .step = edge,
                         .pass = TILE_PROBE};
}

void cost_put(struct cost_map *map, const struct tile *probe, const float *seconds)
{
    assert(probe->pass == TILE_PROBE);
    uint32_t pixels = tile_pixels(probe);
    size_t first = (size_t)(probe->y / map->edge) * map->columns + probe->x / map->edge;
    for (uint32_t k = 0; k < pixels; k++) {
        if (map->seconds[first + k] < 0) map->blocks_known++;
        map->seconds[first + k] = fmaxf(seconds[k], 0);
    }
}

/* ---- smoothing ---- */

/* The block at column, row, or the nearest at the picture's edge. */
static size_t block_at(const struct cost_map *map, int64_t column, int64_t row)
{
    int64_t right = (int64_t)map->columns - 1, bottom = (int64_t)map->rows - 1;
    column = column < 0 ? 0 : column > right ? right : column;
    row = row < 0 ? 0 : row > bottom ? bottom : row;
    return (size_t)row * map->columns + (size_t)column;
}

/* Binomial weights over 3 x 3 blocks: 4 for the middle, 2 for sides, 1 for corners; of those that are known.
 */
static void smooth_block(struct cost_map *map, uint32_t column, uint32_t row, float fixed,
                         float unknown)
{
    double sum = 0, weights = 0;
    float peak = 0;
    for (int dy = -1; dy <= 1; dy++) {
        for (int dx = -1; dx <= 1; dx++) {
            float seconds = map->seconds[block_at(map, (int64_t)column + dx, (int64_t)row + dy)];
            double weight = (2 - dx * dx) * (2 - dy * dy);
            if (seconds < 0) continue;
            sum += (double)(seconds - fixed) * weight;
            weights += weight;
            peak = fmaxf(peak, seconds - fixed);
        }
    }
    size_t i = (size_t)row * map->columns + column;
    map->mean[i] = weights > 0 ? (float)(sum / weights) : unknown;
    map->peak[i] = weights > 0 ? peak : unknown;
}

/* A clock that stood still would predict nothing. */
#define LEAST_SECONDS 1e-9f

void cost_settle(struct cost_map *map)
{
    size_t count = (size_t)map->columns * map->rows;
    double sum = 0;
    float cheapest = HUGE_VALF;
    for (size_t i = 0; i < count; i++) {
        if (map->seconds[i] < 0) continue;
        map->seconds[i] = fmaxf(map->seconds[i], LEAST_SECONDS);
        cheapest = fminf(cheapest, map->seconds[i]);
        sum += (double)map->seconds[i];
    }
    assert(map->blocks_known > 0);
    float fixed = (float)FIXED_SHARE * cheapest;
    float unknown = (float)(sum / map->blocks_known) - fixed;
    for (uint32_t row = 0; row < map->rows; row++)
        for (uint32_t column = 0; column < map->columns; column++)
            smooth_block(map, column, row, fixed, unknown);
}

/* ---- prediction ---- */

/* Between the middles of four blocks, linear in both directions. */
static double mean_at(const struct cost_map *map, double x, double y)
{
    double u = x / map->edge - 0.5, v = y / map->edge - 0.5;
    int64_t column = (int64_t)floor(u), row = (int64_t)floor(v);
    double fx = u - (double)column, fy = v - (double)row;
    double a = (double)map->mean[block_at(map, column, row)];
    double b = (double)map->mean[block_at(map, column + 1, row)];
    double c = (double)map->mean[block_at(map, column, row + 1)];
    double d = (double)map->mean[block_at(map, column + 1, row + 1)];
    return (a + (b - a) * fx) * (1 - fy) + (c + (d - c) * fx) * fy;
}

/* Parts of a side that are looked at: one for every block, 16 at most. */
static uint32_t parts_of(uint32_t pixels, uint32_t edge)
{
    uint32_t parts = (pixels + edge - 1) / edge;
    return parts < 16 ? parts : 16;
}

struct cost cost_predict(const struct cost_map *map, uint32_t x, uint32_t y, uint32_t w, uint32_t h)
{
    double pixels = (double)w * h;
    if (map->edge == 0) return (struct cost){pixels, pixels};
    uint32_t across = parts_of(w, map->edge), down = parts_of(h, map->edge);
    double sum = 0, peak = 0;
    for (uint32_t j = 0; j < down; j++) {
        for (uint32_t i = 0; i < across; i++) {
            double px = x + (i + 0.5) * w / across, py = y + (j + 0.5) * h / down;
            sum += mean_at(map, px, py);
            size_t block = block_at(map, (int64_t)(px / map->edge), (int64_t)(py / map->edge));
            peak = fmax(peak, (double)map->peak[block]);
        }
    }
    return (struct cost){pixels * sum / (across * down), pixels * peak};
}
