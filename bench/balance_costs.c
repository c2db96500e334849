#include "bench/balance_costs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench/balance_trace.h"
#include "bench/median.h"
#include "common/clock.h"
#include "common/message.h"
#include "master/load.h"
#include "master/queue.h"
#include "master/share.h"
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
    float *rgb; /* room for the whole picture, more than any tile needs */
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

/* What a round measures: rounds measurements of each tile, at all levels, and of shares. */
struct rounds {
    unsigned count, round;
    float *all[COST_LEVELS];
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

static const enum schedule apart_schedules[APART_SCHEDULES] = {
    [APART_CYCLIC] = SCHEDULE_CYCLIC,
    [APART_CYCLIC_ROWS] = SCHEDULE_CYCLIC_ROWS,
};

#define SHARES (APART_SCHEDULES * (APART_MOST + 1))

/* Of each number of renderers every round takes another one's share, evenly over all of them: shares of all would
 * take more than ten times as long, and rays are as far apart in each. */
static uint32_t renderer_of_round(uint32_t renderers, unsigned round, unsigned rounds)
{
    return (uint32_t)((2 * (uint64_t)round + 1) * renderers / (2 * (uint64_t)rounds));
}

/* What the tiles of a renderer's share cost in all, in its order, each as the function tells. */
static double sum_share(const struct share_config *config, uint32_t renderer,
                        double (*cost)(const void *, const struct tile *), const void *context)
{
    struct shares shares;
    struct tile tile;
    double sum = 0;
    shares_init(&shares, config, QUEUE_MAX_TILES);
    while (share_next(&shares, renderer, &tile))
        sum += cost(context, &tile);
    shares_free(&shares);
    return sum;
}

static double seconds_of(const void *context, const struct tile *tile)
{
    const struct cost_target *target = context;
    double start = clock_thread_cpu();
    render_tile(target, tile);
    return clock_thread_cpu() - start;
}

/* Shares in between blocks: what else the machine does weighs on them as on the tiles that they are compared with. */
static void measure_shares(const struct cost_target *target, struct rounds *rounds, size_t block)
{
    for (size_t i = block; i < SHARES; i += tiles_of(target->map, COST_LEVELS - 1)) {
        struct share_config config = {.schedule = apart_schedules[i % APART_SCHEDULES],
                                      .width = target->map->width,
                                      .height = target->map->height,
                                      .renderers = (uint32_t)(i / APART_SCHEDULES)};
        if (!(rounds->renderers >> config.renderers & 1)) continue;
        uint32_t renderer = renderer_of_round(config.renderers, rounds->round, rounds->count);
        rounds->shares[i * rounds->count + rounds->round] =
            sum_share(&config, renderer, seconds_of, target);
    }
}

static void measure_levels(const struct cost_target *target, struct rounds *rounds)
{
    struct tile_costs *map = target->map;
    for (unsigned level = 0; level < COST_LEVELS; level++)
        rounds->all[level] = allocate(tiles_of(map, level) * rounds->count, sizeof(float));
    for (; rounds->round < rounds->count; rounds->round++)
        for (size_t block = 0; block < tiles_of(map, COST_LEVELS - 1); block++) {
            measure_block(target, rounds, block);
            measure_shares(target, rounds, block);
        }
    for (unsigned level = 0; level < COST_LEVELS; level++) {
        map->levels[level] = allocate(tiles_of(map, level), sizeof(float));
        keep_medians(map->levels[level], rounds->all[level], tiles_of(map, level), rounds->count);
        free(rounds->all[level]);
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
    stage->bvh = aligned_alloc(BVH_ALIGNMENT, bytes);
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

/* Each share that was measured against what the model says of the very same one. */
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
        map->apart[i % APART_SCHEDULES][renderers] = median_of(ratios, rounds->count);
    }
    free(ratios);
}

void costs_measure(struct tile_costs *map, const char *config, uint32_t width, uint32_t height,
                   uint32_t samples, unsigned rounds, uint64_t renderers)
{
    struct cost_stage stage;
    struct rounds all = {
        .count = rounds, .clock = clock_cost(), .renderers = renderers & APART_ALL};
    all.shares = allocate_zeroed((size_t)SHARES * rounds, sizeof *all.shares);
    open_stage(&stage, config, width, height, samples);
    *map = (struct tile_costs){.width = width, .height = height, .samples = samples};
    float *rgb = allocate(3 * (size_t)width * height, sizeof *rgb);
    measure_levels(&(struct cost_target){map, stage.renderer, rgb}, &all);
    free(rgb);
    close_stage(&stage);
    costs_derive(map);
    compare_shares(map, &all);
    free(all.shares);
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
    good = good && fwrite(map->apart, sizeof map->apart, 1, file) == 1;
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
    if (fread(map->apart, sizeof map->apart, 1, file) != 1) fatal("%s is damaged: remove it", path);
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

/* As if its pixels lay together. */
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
    return (view->apart > 0 ? view->apart : 1) * cost_together(view, tile);
}

static double cost_in_view(const void *context, const struct tile *tile)
{
    return costs_of(context, tile);
}

double costs_of_share(const struct picture_costs *view, enum schedule schedule, uint32_t renderers,
                      uint32_t renderer)
{
    struct share_config config = {.schedule = schedule,
                                  .width = costs_width(view),
                                  .height = costs_height(view),
                                  .renderers = renderers};
    return sum_share(&config, renderer, cost_in_view, view);
}

double costs_apart(const struct tile_costs *map, enum schedule schedule, uint32_t renderers)
{
    for (unsigned i = 0; i < APART_SCHEDULES; i++) {
        if (apart_schedules[i] != schedule || renderers < 2) continue;
        if (renderers > APART_MOST || !(map->apart[i][renderers] > 0))
            fatal("shares of %u renderers were not measured", renderers);
        return map->apart[i][renderers];
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
