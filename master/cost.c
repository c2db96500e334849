#include "master/cost.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "common/extremes.h"
#include "common/message.h"
#include "common/protocol.h"
#include "common/whole.h"

/*
 * The share of the cheapest probe that is subtracted from all probes. A probe of a single pixel has a fixed cost that a
 * sample among many does not have. The cheapest probes of a picture (the sky) are little else: measured on lantern and
 * garden, such a sample costs in a tile about a quarter of its probe, on the scale on which samples elsewhere cost what
 * their probes take beyond the fixed part.
 */
#define FIXED_SHARE 0.75

/* The number of blocks along a side of `pixels` pixels whose middle, at edge / 2, lies within the picture. */
static uint32_t blocks_across(uint32_t pixels, uint32_t edge)
{
    uint32_t middle = edge / 2;
    return pixels > middle ? divide_up(pixels - middle, edge) : 0;
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
    map->probes = divide_up(map->columns, blocks) * map->rows;
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

/* The middles of the blocks in a row of blocks: every edge-th pixel of one row of the picture. */
struct tile cost_probe(const struct cost_map *map, uint32_t i)
{
    uint32_t edge = map->edge, across = divide_up(map->columns, map->probe_blocks);
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

bool cost_put(struct cost_map *map, const struct tile *probe, const float *seconds)
{
    assert(probe->pass == TILE_PROBE);
    uint32_t pixels = tile_pixels(probe);
    size_t first = (size_t)(probe->y / map->edge) * map->columns + probe->x / map->edge;
    for (uint32_t k = 0; k < pixels; k++) {
        float took = seconds[k];
        if (!(took >= 0 && took <= (float)SECONDS_MOST)) return false;
        if (map->seconds[first + k] < 0) map->blocks_known++;
        map->seconds[first + k] = took;
    }
    return true;
}

/* ---- smoothing ---- */

/* Sets i - 1, i and i + 1; those not among 0 .. count - 1 are replaced by i. */
static void neighbours(uint32_t i, uint32_t count, uint32_t at[3])
{
    at[0] = i > 0 ? i - 1 : 0;
    at[1] = i;
    at[2] = i + 1 < count ? i + 1 : i;
}

/* Smooths with binomial weights over the known ones of 3 x 3 blocks: 4 for the middle, 2 for sides, 1 for corners. */
static void smooth_block(struct cost_map *map, uint32_t column, uint32_t row, float fixed,
                         float unknown)
{
    double sum = 0, weights = 0, peak = 0;
    uint32_t columns[3], rows[3];
    neighbours(column, map->columns, columns);
    neighbours(row, map->rows, rows);
    for (int dy = 0; dy < 3; dy++) {
        const float *line = map->seconds + (size_t)rows[dy] * map->columns;
        for (int dx = 0; dx < 3; dx++) {
            float seconds = line[columns[dx]];
            double weight = (1 + (dx == 1)) * (1 + (dy == 1));
            double more = (double)(seconds - fixed);
            if (seconds < 0) continue;
            sum += more * weight;
            weights += weight;
            peak = larger_number(peak, more);
        }
    }
    size_t i = (size_t)row * map->columns + column;
    map->mean[i] = weights > 0 ? (float)(sum / weights) : unknown;
    map->peak[i] = weights > 0 ? (float)peak : unknown;
}

/* At least this is taken: probes of 0 s, by a clock that stood still, would predict nothing. */
#define LEAST_SECONDS 1e-9f

void cost_settle(struct cost_map *map)
{
    size_t count = (size_t)map->columns * map->rows;
    double sum = 0, cheapest = HUGE_VAL;
    for (size_t i = 0; i < count; i++) {
        if (map->seconds[i] < 0) continue;
        double seconds = larger_number((double)map->seconds[i], (double)LEAST_SECONDS);
        map->seconds[i] = (float)seconds;
        cheapest = smaller_number(cheapest, seconds);
        sum += seconds;
    }
    assert(map->blocks_known > 0);
    float fixed = (float)FIXED_SHARE * (float)cheapest;
    float unknown = (float)(sum / map->blocks_known) - fixed;
    for (uint32_t row = 0; row < map->rows; row++)
        for (uint32_t column = 0; column < map->columns; column++)
            smooth_block(map, column, row, fixed, unknown);
}

/* ---- prediction ---- */

/* The smoothed work at u blocks from the left and v from the top: interpolated bilinearly between the middles of four
 * blocks, constant beyond the outermost middles. */
static double mean_at(const struct cost_map *map, double u, double v)
{
    uint32_t right = (uint32_t)(u + 0.5), below = (uint32_t)(v + 0.5);
    double fx = u - 0.5 - (right - 1.0), fy = v - 0.5 - (below - 1.0);
    uint32_t left = right > 0 ? right - 1 : 0, above = below > 0 ? below - 1 : 0;
    uint32_t last = map->columns - 1, bottom = map->rows - 1;
    const float *high = map->mean + (size_t)smaller(above, bottom) * map->columns;
    const float *low = map->mean + (size_t)smaller(below, bottom) * map->columns;
    left = smaller(left, last), right = smaller(right, last);
    double a = (double)high[left], b = (double)high[right];
    double c = (double)low[left], d = (double)low[right];
    return (a + (b - a) * fx) * (1 - fy) + (c + (d - c) * fx) * fy;
}

static double peak_at(const struct cost_map *map, double u, double v)
{
    size_t row = smaller((uint32_t)v, map->rows - 1);
    return (double)map->peak[row * map->columns + smaller((uint32_t)u, map->columns - 1)];
}

/* Number of parts of a side that are evaluated: one for every block, 16 at most. */
static uint32_t parts_of(uint32_t pixels, uint32_t edge)
{
    return pixels <= edge ? 1 : smaller(divide_up(pixels, edge), 16);
}

/* Distance of the middle of a side's i-th part from its beginning. */
static double middle_of(uint32_t i, uint32_t pixels, uint32_t parts)
{
    return parts == 1 ? 0.5 * pixels : (i + 0.5) * pixels / parts;
}

struct cost cost_predict(const struct cost_map *map, uint32_t x, uint32_t y, uint32_t w, uint32_t h)
{
    double pixels = (double)w * h;
    if (map->edge == 0) return (struct cost){pixels, pixels};
    uint32_t across = parts_of(w, map->edge), down = parts_of(h, map->edge);
    double sum = 0, peak = 0;
    for (uint32_t j = 0; j < down; j++) {
        double v = (y + middle_of(j, h, down)) / map->edge;
        for (uint32_t i = 0; i < across; i++) {
            double u = (x + middle_of(i, w, across)) / map->edge;
            sum += mean_at(map, u, v);
            peak = larger_number(peak, peak_at(map, u, v));
        }
    }
    double work = pixels * sum;
    if (across * down > 1) work /= across * down;
    return (struct cost){work, pixels * peak};
}
