#include "master/pass_cost.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/whole.h"

/*
 * What rays take is averaged over blocks of BLOCK_EDGE x BLOCK_EDGE pixels, about the tiles of pass 0, which are timed
 * as a whole. What a pass asks for is summed over cells of CELL_EDGE x CELL_EDGE, near the smallest tiles. In adaptive
 * runs of eight scenes on 8 to 128 processors, simulated as bench/balance_adaptive.c does but with samples that are
 * stored in no time, 91.8 % of their time goes into tiles that count; with cells of 2, 8 and 16 pixels it is 91.9, 91.2
 * and 90.7 %, with blocks of 32 pixels 91.2 %.
 */
#define BLOCK_EDGE  16u
#define CELL_EDGE   4u
#define BLOCK_CELLS (BLOCK_EDGE / CELL_EDGE)

struct pass_cost {
    uint32_t width, height; /* pixels */
    uint32_t blocks_across, blocks_down;
    double *seconds; /* per block: of all samples so far */
    double *rays;    /* per block: of all samples that it had when a pass was predicted last */
    uint32_t cells_across, cells_down;
    /* (cells_across + 1) x (cells_down + 1): predicted seconds of all cells above and to the left of a corner. */
    double *sums;
};

size_t pass_cost_pixel_bytes(void)
{
    const struct pass_cost *c = NULL;
    const size_t cells = (size_t)BLOCK_CELLS * BLOCK_CELLS,
                 pixels = (size_t)BLOCK_EDGE * BLOCK_EDGE;
    size_t bytes = sizeof *c->seconds + sizeof *c->rays + cells * sizeof *c->sums;
    return round_up_to(bytes, pixels) / pixels;
}

static size_t block_count(const struct pass_cost *cost)
{
    return (size_t)cost->blocks_across * cost->blocks_down;
}

/* A row of sums. */
static size_t row_length(const struct pass_cost *cost)
{
    return (size_t)cost->cells_across + 1;
}

struct pass_cost *pass_cost_create(uint32_t width, uint32_t height)
{
    struct pass_cost *cost = allocate_zeroed(1, sizeof *cost);
    *cost = (struct pass_cost){.width = width,
                               .height = height,
                               .blocks_across = divide_up(width, BLOCK_EDGE),
                               .blocks_down = divide_up(height, BLOCK_EDGE),
                               .cells_across = divide_up(width, CELL_EDGE),
                               .cells_down = divide_up(height, CELL_EDGE)};
    cost->seconds = allocate_zeroed(block_count(cost), sizeof *cost->seconds);
    cost->rays = allocate_zeroed(block_count(cost), sizeof *cost->rays);
    cost->sums = allocate_zeroed(row_length(cost) * (cost->cells_down + 1), sizeof *cost->sums);
    return cost;
}

void pass_cost_destroy(struct pass_cost *cost)
{
    if (!cost) return;
    free(cost->sums);
    free(cost->rays);
    free(cost->seconds);
    free(cost);
}

/* ---- what is predicted ---- */

/* A coordinate in pixels, as a cell and the part of it that lies before. */
struct in_cells {
    uint32_t cell;
    double part;
};

/* size: of the picture in this direction. The last cell may be narrower than the others. */
static struct in_cells in_cells(uint32_t pixels, uint32_t size)
{
    uint32_t cell = smaller(pixels, size - 1) / CELL_EDGE, begin = cell * CELL_EDGE;
    return (struct in_cells){cell, (double)(pixels - begin) / smaller(CELL_EDGE, size - begin)};
}

/* The seconds above and to the left of a point, which is in pixels; linear within a cell. */
static double seconds_before(const struct pass_cost *cost, uint32_t x, uint32_t y)
{
    struct in_cells h = in_cells(x, cost->width), v = in_cells(y, cost->height);
    const double *above = cost->sums + v.cell * row_length(cost) + h.cell;
    const double *below = above + row_length(cost);
    return (1 - v.part) * ((1 - h.part) * above[0] + h.part * above[1]) +
           v.part * ((1 - h.part) * below[0] + h.part * below[1]);
}

double pass_cost_of(const struct pass_cost *cost, const struct tile *tile)
{
    uint32_t right = tile->x + tile->w, bottom = tile->y + tile->h;
    double seconds = seconds_before(cost, right, bottom) - seconds_before(cost, tile->x, bottom) -
                     seconds_before(cost, right, tile->y) + seconds_before(cost, tile->x, tile->y);
    return fmax(seconds, 0); /* rounding may make it less */
}

/* ---- what is known ---- */

/* The part of a tile that is in the block of this column and row. */
static struct tile part_in_block(const struct tile *tile, uint32_t column, uint32_t row)
{
    uint32_t left = larger(tile->x, column * BLOCK_EDGE), top = larger(tile->y, row * BLOCK_EDGE);
    return (struct tile){
        .x = left,
        .y = top,
        .w = smaller(tile->x + tile->w, (column + 1) * BLOCK_EDGE) - left,
        .h = smaller(tile->y + tile->h, (row + 1) * BLOCK_EDGE) - top,
        .step = 1,
    };
}

/* The tile's seconds are divided among its blocks as predicted; where nothing was predicted, by their pixels. */
void pass_cost_took(struct pass_cost *cost, const struct tile *tile, double seconds)
{
    double whole = pass_cost_of(cost, tile), pixels = (double)tile->w * tile->h;
    uint32_t right = divide_up(tile->x + tile->w, BLOCK_EDGE);
    uint32_t bottom = divide_up(tile->y + tile->h, BLOCK_EDGE);
    for (uint32_t row = tile->y / BLOCK_EDGE; row < bottom; row++)
        for (uint32_t column = tile->x / BLOCK_EDGE; column < right; column++) {
            struct tile part = part_in_block(tile, column, row);
            double share = whole > 0 ? pass_cost_of(cost, &part) / whole : part.w * part.h / pixels;
            cost->seconds[(size_t)row * cost->blocks_across + column] += share * seconds;
        }
}

/* ---- predicting ---- */

struct rays_asked {
    struct pass_cost *cost;
    const struct statistics *statistics;
    const uint8_t *next;
};

/* Sums the rays of a row of pixels: what its blocks have, and what the pass asks for in its cells. */
static void add_row(const struct rays_asked *it, uint32_t y)
{
    const struct pass_cost *cost = it->cost;
    const struct statistics *statistics = it->statistics;
    const double *samples = statistics->levels.samples;
    double *have = cost->rays + (size_t)(y / BLOCK_EDGE) * cost->blocks_across;
    double *asked = cost->sums + (y / CELL_EDGE + 1) * row_length(cost) + 1;
    size_t first = (size_t)y * cost->width;
    for (uint32_t x = 0; x < cost->width; x++) {
        size_t i = first + x;
        double rays = statistics_rays(statistics, i), before = samples[statistics->level[i]];
        have[x / BLOCK_EDGE] += rays * before;
        asked[x / CELL_EDGE] += rays * (samples[it->next[i]] - before);
    }
}

/* Does so for a row of blocks. The sum at a cell's lower right corner is what is asked for in it until the sums are
 * made. */
static void add_blocks(void *context, uint32_t row)
{
    const struct rays_asked *it = context;
    const struct pass_cost *cost = it->cost;
    uint32_t top = row * BLOCK_EDGE, bottom = smaller(top + BLOCK_EDGE, cost->height);
    size_t cells = row_length(cost) * divide_up(bottom - top, CELL_EDGE);
    memset(cost->rays + (size_t)row * cost->blocks_across, 0,
           cost->blocks_across * sizeof *cost->rays);
    memset(cost->sums + (top / CELL_EDGE + 1) * row_length(cost), 0, cells * sizeof *cost->sums);
    for (uint32_t y = top; y < bottom; y++)
        add_row(it, y);
}

/* Seconds per ray in the whole picture; 0: nothing was timed. */
static double mean_seconds(const struct pass_cost *cost)
{
    double seconds = 0, rays = 0;
    for (size_t block = 0; block < block_count(cost); block++) {
        seconds += cost->seconds[block];
        rays += cost->rays[block];
    }
    return rays > 0 ? seconds / rays : 0;
}

/* Turns the rays asked for in each cell into sums of seconds. A block that seems to take no time is one that a coarse
 * clock has missed. */
static void sum_seconds(struct pass_cost *cost)
{
    double mean = mean_seconds(cost);
    size_t length = row_length(cost);
    for (uint32_t y = 0; y < cost->cells_down; y++) {
        size_t first = (size_t)(y / BLOCK_CELLS) * cost->blocks_across;
        double *above = cost->sums + y * length, *sums = above + length, row = 0;
        for (uint32_t x = 0; x < cost->cells_across; x++) {
            size_t block = first + x / BLOCK_CELLS;
            double own = cost->seconds[block] / cost->rays[block];
            row += sums[x + 1] * (own > 0 ? own : mean);
            sums[x + 1] = above[x + 1] + row;
        }
    }
}

void pass_cost_predict(struct pass_cost *cost, const struct statistics *statistics,
                       const uint8_t *next, struct thread_pool *pool)
{
    struct rays_asked it = {cost, statistics, next};
    thread_pool_for(pool, cost->blocks_down, add_blocks, &it);
    sum_seconds(cost);
}
