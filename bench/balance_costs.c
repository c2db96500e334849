#include "bench/balance_costs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/balance_trace.h"
#include "common/clock.h"
#include "common/message.h"
#include "master/load.h"
#include "worker/bvh.h"
#include "worker/render.h"

static uint32_t columns(uint32_t size, unsigned level)
{
    return (size + (1u << level) - 1) >> level;
}

static size_t tiles_of(const struct tile_costs *map, unsigned level)
{
    return (size_t)columns(map->width, level) * columns(map->height, level);
}

static struct tile tile_at(const struct tile_costs *map, unsigned level, size_t i)
{
    uint32_t edge = 1u << level, across = columns(map->width, level);
    uint32_t x = (uint32_t)(i % across) * edge, y = (uint32_t)(i / across) * edge;
    return (struct tile){.x = x,
                         .y = y,
                         .w = map->width - x < edge ? map->width - x : edge,
                         .h = map->height - y < edge ? map->height - y : edge,
                         .step = 1};
}

/* ---- measuring ---- */

struct cost_target {
    struct tile_costs *map;
    struct renderer *renderer;
};

/* What reading the clock twice takes: the least of many. */
static double clock_cost(void)
{
    double least = 1;
    for (int i = 0; i < 10000; i++) {
        double start = clock_thread_cpu(), cost = clock_thread_cpu() - start;
        least = fmin(least, cost);
    }
    return least;
}

static int ascending(const void *a, const void *b)
{
    const float *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

/* rounds measurements of every tile at `rounds` places in a row become their median. */
static void keep_medians(float *out, float *all, size_t tiles, unsigned rounds)
{
    for (size_t i = 0; i < tiles; i++) {
        qsort(all + i * rounds, rounds, sizeof *all, ascending);
        out[i] = all[i * rounds + rounds / 2];
    }
}

/* What a round measures: rounds measurements of each tile, at all levels. */
struct rounds {
    unsigned count, round;
    float *all[COST_LEVELS];
    double clock; /* seconds that reading it takes */
};

static void render_tile(const struct cost_target *target, const struct tile *tile)
{
    static float rgb[3 << (2 * (COST_LEVELS - 1))];
    struct render_counts counts;
    renderer_tile(target->renderer, tile, rgb, &counts);
}

static void measure_tile(const struct cost_target *target, struct rounds *rounds, unsigned level,
                         size_t i)
{
    struct tile tile = tile_at(target->map, level, i);
    double start = clock_thread_cpu();
    render_tile(target, &tile);
    double seconds = fmax(0, clock_thread_cpu() - start - rounds->clock);
    rounds->all[level][i * rounds->count + rounds->round] = (float)seconds;
}

/* A block of the largest tiles, at all levels in turn: so what else the machine does meanwhile weighs
 * on all of them alike, and so do the caches, which know the block by then. */
static void measure_block(const struct cost_target *target, struct rounds *rounds, size_t block)
{
    struct tile area = tile_at(target->map, COST_LEVELS - 1, block);
    render_tile(target, &area);
    for (unsigned level = COST_LEVELS; level-- > 0;) {
        uint32_t across = columns(target->map->width, level), edge = 1u << level;
        for (uint32_t y = area.y; y < area.y + area.h; y += edge)
            for (uint32_t x = area.x; x < area.x + area.w; x += edge)
                measure_tile(target, rounds, level, (size_t)(y >> level) * across + (x >> level));
    }
}

static void measure_levels(const struct cost_target *target, unsigned count)
{
    struct tile_costs *map = target->map;
    struct rounds rounds = {.count = count, .clock = clock_cost()};
    for (unsigned level = 0; level < COST_LEVELS; level++)
        rounds.all[level] = allocate(tiles_of(map, level) * count, sizeof(float));
    for (; rounds.round < count; rounds.round++)
        for (size_t block = 0; block < tiles_of(map, COST_LEVELS - 1); block++)
            measure_block(target, &rounds, block);
    for (unsigned level = 0; level < COST_LEVELS; level++) {
        map->levels[level] = allocate(tiles_of(map, level), sizeof(float));
        keep_medians(map->levels[level], rounds.all[level], tiles_of(map, level), count);
        free(rounds.all[level]);
    }
}

/* ---- what follows from the measurements ---- */

static double sum_level(const struct tile_costs *map, unsigned level)
{
    double sum = 0;
    for (size_t i = 0; i < tiles_of(map, level); i++)
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

/* The share of a pixel in what its 8 x 8 tile costs, by what it costs alone. */
static void share_among_pixels(struct tile_costs *map, size_t block)
{
    struct tile tile = tile_at(map, COST_BASE, block);
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
    /* The cheapest single pixel is nearly nothing but a tile's own cost. */
    map->fixed = least_of(map->levels[0], tiles_of(map, 0));
    for (unsigned level = 0; level < COST_LEVELS; level++)
        map->totals[level] = sum_level(map, level);
    double base = map->totals[COST_BASE] - (double)tiles_of(map, COST_BASE) * map->fixed;
    for (unsigned level = 0; level < COST_LEVELS; level++)
        map->spread[level] =
            (map->totals[level] - (double)tiles_of(map, level) * map->fixed) / base;
    map->base = allocate((size_t)map->width * map->height, sizeof *map->base);
    for (size_t block = 0; block < tiles_of(map, COST_BASE); block++)
        share_among_pixels(map, block);
    costs_integrate(map);
}

/* The scene at this size, uniformly sampled whatever it asks for; the caller frees it. */
static struct scene *load_scene(const char *config, uint32_t width, uint32_t height,
                                uint32_t samples)
{
    char *overrides[] = {format_text("image.width=%u", width),
                         format_text("image.height=%u", height),
                         format_text("sampling.samples=%u", samples),
                         copy_text("sampling.target_error=0"), copy_text("sampling.time_limit=0")};
    const int count = sizeof overrides / sizeof *overrides;
    struct job job;
    if (!load_job(config, overrides, count, REACH_FOLDER, &job)) fatal("cannot load %s", config);
    for (int i = 0; i < count; i++)
        free(overrides[i]);
    struct view view = settings_view(&job.settings);
    struct scene *scene = builder_finish(job.builder, &view);
    job_free(&job);
    return scene;
}

/* What bvh_build() asks for, a multiple of which aligned_alloc() wants. */
#define BVH_ALIGNMENT 64

/* A renderer of the scene as it is to be measured, and what it needs. */
struct cost_stage {
    struct scene *scene;
    void *bvh;
    struct renderer *renderer;
};

static void open_stage(struct cost_stage *stage, const char *config, uint32_t width,
                       uint32_t height, uint32_t samples)
{
    stage->scene = load_scene(config, width, height, samples);
    size_t bytes = bvh_bytes_bound(stage->scene);
    stage->bvh = aligned_alloc(BVH_ALIGNMENT, (bytes / BVH_ALIGNMENT + 1) * BVH_ALIGNMENT);
    if (!stage->bvh) fatal("out of memory");
    bvh_build(stage->scene, stage->bvh, 1);
    stage->renderer = renderer_create(stage->scene, stage->bvh);
}

static void close_stage(struct cost_stage *stage)
{
    renderer_destroy(stage->renderer);
    free(stage->bvh);
    free(stage->scene);
}

void costs_measure(struct tile_costs *map, const char *config, uint32_t width, uint32_t height,
                   uint32_t samples, unsigned rounds)
{
    struct cost_stage stage;
    open_stage(&stage, config, width, height, samples);
    *map = (struct tile_costs){.width = width, .height = height, .samples = samples};
    measure_levels(&(struct cost_target){map, stage.renderer}, rounds);
    close_stage(&stage);
    costs_derive(map);
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
        size_t tiles = tiles_of(map, level);
        good = fwrite(map->levels[level], sizeof(float), tiles, file) == tiles;
    }
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
        size_t tiles = tiles_of(map, level);
        map->levels[level] = allocate(tiles, sizeof(float));
        if (fread(map->levels[level], sizeof(float), tiles, file) != tiles)
            fatal("%s is damaged: remove it", path);
    }
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

/* Seconds per map pixel become seconds of the picture: as many samples, as many pixels. */
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

/* Linear in the logarithm of the samples between the sizes that were measured. */
double costs_spread(const struct tile_costs *map, double samples)
{
    double level = log2(samples / map->samples) / 2;
    if (level <= 0) return map->spread[0];
    if (level >= COST_LEVELS - 1) return map->spread[COST_LEVELS - 1];
    unsigned below = (unsigned)level;
    double part = level - below;
    return (1 - part) * map->spread[below] + part * map->spread[below + 1];
}

/* The measurement of just this tile; negative when there is none. */
static double measured(const struct tile_costs *map, const struct tile *tile)
{
    uint32_t larger = tile->w > tile->h ? tile->w : tile->h;
    unsigned level = 0;
    while (level < COST_LEVELS && (1u << level) < larger)
        level++;
    if (level == COST_LEVELS || tile->step != 1 || tile->phase != 0) return -1;
    if (tile->x % (1u << level) || tile->y % (1u << level)) return -1;
    size_t i = (size_t)(tile->y >> level) * columns(map->width, level) + (tile->x >> level);
    struct tile own = tile_at(map, level, i);
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

double costs_of(const struct picture_costs *view, const struct tile *tile)
{
    const struct tile_costs *map = view->map;
    double seen = view->run ? run_costs_of(view->run, tile) : -1;
    if (seen >= 0) return seen;
    if (tile->pass == TILE_PROBE) return cost_of_probes(view, tile);
    if (!view->run && view->scale == 1 && view->samples == map->samples && view->top == 0) {
        double cost = measured(map, tile);
        if (cost >= 0) return cost;
    }
    double base = tile->step == 1 ? base_of_rectangle(view, tile) : base_of_pixels(view, tile);
    double samples = (double)tile_pixels(tile) * view->samples;
    return map->fixed + costs_spread(map, samples) * base * growth(view);
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
