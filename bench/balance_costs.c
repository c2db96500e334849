#include "bench/balance_costs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/balance_costs_parts.h"
#include "bench/balance_record.h"
#include "bench/balance_trace.h"
#include "common/message.h"
#include "common/whole.h"
#include "master/queue.h"

/* ---- tiles that are measured ---- */

uint32_t level_columns(uint32_t size, unsigned level)
{
    return divide_up(size, 1u << level);
}

size_t level_tiles(const struct tile_costs *map, unsigned level)
{
    return (size_t)level_columns(map->width, level) * level_columns(map->height, level);
}

struct tile level_tile(const struct tile_costs *map, unsigned level, size_t i)
{
    uint32_t edge = 1u << level, across = level_columns(map->width, level);
    uint32_t x = (uint32_t)(i % across) * edge, y = (uint32_t)(i / across) * edge;
    return (struct tile){.x = x,
                         .y = y,
                         .w = smaller(edge, map->width - x),
                         .h = smaller(edge, map->height - y),
                         .step = 1};
}

/* ---- what follows from the measurements ---- */

static double sum_level(const struct tile_costs *map, unsigned level)
{
    double sum = 0;
    for (size_t i = 0; i < level_tiles(map, level); i++)
        sum += (double)map->levels[level][i];
    return sum;
}

static double least_of(const float *costs, size_t count)
{
    double least = (double)costs[0];
    for (size_t i = 1; i < count; i++)
        least = fmin(least, (double)costs[i]);
    return least;
}

/* Distributes the cost of an 8 x 8 tile among its pixels, in proportion to their costs alone. */
static void share_among_pixels(struct tile_costs *map, size_t block)
{
    struct tile tile = level_tile(map, COST_BASE, block);
    const float *single = map->levels[0];
    double sum = 0, cost = fmax(0, (double)map->levels[COST_BASE][block] - map->fixed);
    for (uint32_t k = 0; k < tile_pixels(&tile); k++) {
        uint32_t x, y;
        tile_pixel(&tile, k, &x, &y);
        sum += (double)single[(size_t)y * map->width + x];
    }
    for (uint32_t k = 0; k < tile_pixels(&tile); k++) {
        uint32_t x, y;
        tile_pixel(&tile, k, &x, &y);
        size_t at = (size_t)y * map->width + x;
        map->base[at] = sum > 0 ? cost * (double)single[at] / sum : cost / tile_pixels(&tile);
    }
}

void costs_integrate(struct tile_costs *map)
{
    size_t row = (size_t)map->width + 1;
    map->sums = allocate_zeroed(row * (map->height + 1), sizeof *map->sums);
    for (uint32_t y = 0; y < map->height; y++)
        for (uint32_t x = 0; x < map->width; x++)
            map->sums[(y + 1) * row + x + 1] =
                map->base[(size_t)y * map->width + x] + map->sums[y * row + x + 1] +
                map->sums[(y + 1) * row + x] - map->sums[y * row + x];
}

void costs_derive(struct tile_costs *map)
{
    /* The cost of the cheapest single pixel is nearly all fixed cost. */
    map->fixed = least_of(map->levels[0], level_tiles(map, 0));
    for (unsigned level = 0; level < COST_LEVELS; level++)
        map->totals[level] = sum_level(map, level);
    double base = map->totals[COST_BASE] - (double)level_tiles(map, COST_BASE) * map->fixed;
    for (unsigned level = 0; level < COST_LEVELS; level++)
        map->spread[level] =
            (map->totals[level] - (double)level_tiles(map, level) * map->fixed) / base;
    map->base = allocate((size_t)map->width * map->height, sizeof *map->base);
    for (size_t block = 0; block < level_tiles(map, COST_BASE); block++)
        share_among_pixels(map, block);
    costs_integrate(map);
}

void costs_free(struct tile_costs *map)
{
    for (unsigned level = 0; level < COST_LEVELS; level++)
        free(map->levels[level]);
    free(map->base);
    free(map->sums);
    *map = (struct tile_costs){0};
}

/* ---- files ---- */

struct file_header {
    uint32_t width, height, samples;
};

void costs_save(const struct tile_costs *map, const char *path)
{
    FILE *file = fopen(path, "wb");
    struct file_header header = {map->width, map->height, map->samples};
    bool good = file && fwrite(&header, sizeof header, 1, file) == 1;
    for (unsigned level = 0; good && level < COST_LEVELS; level++) {
        size_t tiles = level_tiles(map, level);
        good = fwrite(map->levels[level], sizeof(float), tiles, file) == tiles;
    }
    good = good && fwrite(map->apart_ratio, sizeof map->apart_ratio, 1, file) == 1;
    if (!good || fclose(file) != 0) fatal("cannot write %s", path);
}

bool costs_read(struct tile_costs *map, const char *path)
{
    FILE *file = fopen(path, "rb");
    struct file_header header;
    if (!file) return false;
    if (fread(&header, sizeof header, 1, file) != 1) fatal("%s is damaged: remove it", path);
    *map = (struct tile_costs){
        .width = header.width, .height = header.height, .samples = header.samples};
    for (unsigned level = 0; level < COST_LEVELS; level++) {
        size_t tiles = level_tiles(map, level);
        map->levels[level] = allocate(tiles, sizeof(float));
        if (fread(map->levels[level], sizeof(float), tiles, file) != tiles)
            fatal("%s is damaged: remove it", path);
    }
    if (fread(map->apart_ratio, sizeof map->apart_ratio, 1, file) != 1)
        fatal("%s is damaged: remove it", path);
    fclose(file);
    costs_derive(map);
    return true;
}

/* ---- the cost of a tile ---- */

/* The integral of base from the top left corner to this point of the map, linear within pixels. */
static double integral(const struct tile_costs *map, double x, double y)
{
    uint32_t left = (uint32_t)x, top = (uint32_t)y;
    if (left >= map->width) left = map->width - 1;
    if (top >= map->height) top = map->height - 1;
    size_t row = (size_t)map->width + 1;
    const double *at = map->sums + top * row + left;
    double u = x - left, v = y - top;
    return (1 - v) * ((1 - u) * at[0] + u * at[1]) + v * ((1 - u) * at[row] + u * at[row + 1]);
}

/* The factor from seconds of the map to seconds of the picture: more samples, and more pixels per map pixel. */
static double growth(const struct picture_costs *view)
{
    return (double)view->scale * view->scale * view->samples / view->map->samples;
}

static double base_of_rectangle(const struct picture_costs *view, const struct tile *tile)
{
    const struct tile_costs *map = view->map;
    double scale = 1.0 / view->scale, left = tile->x * scale, top = view->top + tile->y * scale;
    double right = (tile->x + tile->w) * scale, bottom = view->top + (tile->y + tile->h) * scale;
    return integral(map, right, bottom) - integral(map, left, bottom) - integral(map, right, top) +
           integral(map, left, top);
}

static double base_of_pixels(const struct picture_costs *view, const struct tile *tile)
{
    double sum = 0, pixel = 1.0 / view->scale / view->scale;
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        sum +=
            view->map
                ->base[(size_t)(view->top + y / view->scale) * view->map->width + x / view->scale];
    }
    return sum * pixel;
}

/* Interpolates between the sizes that were measured, linearly in the logarithm of the number of samples. */
double costs_spread(const struct tile_costs *map, double samples)
{
    double level = log2(samples / map->samples) / 2;
    if (level <= 0) return map->spread[0];
    if (level >= COST_LEVELS - 1) return map->spread[COST_LEVELS - 1];
    unsigned below = (unsigned)level;
    double part = level - below;
    return (1 - part) * map->spread[below] + part * map->spread[below + 1];
}

/* The measurement of exactly this tile; negative when there is none. */
static double measured(const struct tile_costs *map, const struct tile *tile)
{
    uint32_t edge = larger(tile->w, tile->h);
    unsigned level = 0;
    while (level < COST_LEVELS && (1u << level) < edge)
        level++;
    if (level == COST_LEVELS || tile->step != 1 || tile->phase != 0) return -1;
    if (tile->x % (1u << level) || tile->y % (1u << level)) return -1;
    size_t i = (size_t)(tile->y >> level) * level_columns(map->width, level) + (tile->x >> level);
    struct tile own = level_tile(map, level, i);
    if (own.w != tile->w || own.h != tile->h) return -1;
    return (double)map->levels[level][i];
}

double costs_of_probe(const struct picture_costs *view, uint32_t x, uint32_t y)
{
    const struct tile_costs *single = view->single;
    size_t at = (size_t)(view->top + y / view->scale) * single->width + x / view->scale;
    return (double)single->levels[0][at];
}

static double cost_of_probes(const struct picture_costs *view, const struct tile *tile)
{
    double sum = 0;
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        sum += costs_of_probe(view, x, y);
    }
    return sum;
}

/* The cost of a tile as if its pixels were adjacent. */
static double cost_together(const struct picture_costs *view, const struct tile *tile)
{
    const struct tile_costs *map = view->map;
    if (!view->run && view->scale == 1 && view->samples == map->samples && view->top == 0) {
        double cost = measured(map, tile);
        if (cost >= 0) return cost;
    }
    double base = tile->step == 1 ? base_of_rectangle(view, tile) : base_of_pixels(view, tile);
    double samples = (double)tile_pixels(tile) * view->samples;
    return map->fixed + costs_spread(map, samples) * base * growth(view);
}

double costs_of(const struct picture_costs *view, const struct tile *tile)
{
    double seen = view->run ? run_costs_of(view->run, tile) : -1;
    if (seen >= 0) return seen;
    if (tile->pass == TILE_PROBE) return cost_of_probes(view, tile);
    if (view->record) return view->map->fixed + record_seconds(view->record, tile);
    return (view->apart_ratio > 0 ? view->apart_ratio : 1) * cost_together(view, tile);
}

/* ---- the cost of a share ---- */

const enum schedule apart_schedules[APART_SCHEDULES] = {
    [APART_CYCLIC] = SCHEDULE_CYCLIC,
    [APART_CYCLIC_ROWS] = SCHEDULE_CYCLIC_ROWS,
};

double share_sum(const struct queue_config *config, uint32_t renderer,
                 double (*cost)(const void *, const struct tile *), const void *context)
{
    struct shares shares;
    struct tile tile;
    double sum = 0;
    share_init(&shares, config);
    while (share_next(&shares, renderer, &tile))
        sum += cost(context, &tile);
    share_free(&shares);
    return sum;
}

static double cost_in_view(const void *context, const struct tile *tile)
{
    return costs_of(context, tile);
}

double costs_of_share(const struct picture_costs *view, enum schedule schedule, uint32_t renderers,
                      uint32_t renderer)
{
    struct queue_config config = {.schedule = schedule,
                                  .width = costs_width(view),
                                  .height = costs_height(view),
                                  .renderers = renderers};
    return share_sum(&config, renderer, cost_in_view, view);
}

double costs_apart_ratio(const struct tile_costs *map, enum schedule schedule, uint32_t renderers)
{
    for (unsigned i = 0; i < APART_SCHEDULES; i++) {
        if (apart_schedules[i] != schedule || renderers < 2) continue;
        if (renderers > APART_MOST || !(map->apart_ratio[i][renderers] > 0))
            fatal("shares of %u renderers were not measured", renderers);
        return map->apart_ratio[i][renderers];
    }
    return 1;
}

uint32_t costs_width(const struct picture_costs *view)
{
    return view->map->width * view->scale;
}

uint32_t costs_height(const struct picture_costs *view)
{
    return (view->map->height - 2 * view->top) * view->scale;
}

double costs_total(const struct picture_costs *view)
{
    struct tile all = {.w = costs_width(view), .h = costs_height(view), .step = 1};
    return base_of_rectangle(view, &all) * growth(view);
}
