#include "bench/balance_record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench/balance_stage.h"
#include "bench/median.h"
#include "common/clock.h"
#include "common/message.h"
#include "common/whole.h"
#include "master/adaptive.h"

/* Of tiles that are timed. */
#define EDGE 16u

/* What recording needs. */
struct recorder {
    struct record *record;
    struct stage stage;
    struct adaptive *adaptive;
    unsigned rounds;
    struct pixel_floats all; /* of the present pass */
    double put_s[2], put_pixels[2];
};

static size_t pixel_count(const struct view *view)
{
    return (size_t)view->region_w * view->region_h;
}

static size_t row_length(const struct record *record)
{
    return (size_t)record->view.region_w + 1;
}

/* Copies number j of one set of arrays to number i of another one. */
static void copy_pixel(const struct pixel_floats *to, size_t i, const struct pixel_floats *from,
                       size_t j)
{
    memcpy(to->mean + 3 * i, from->mean + 3 * j, 3 * sizeof(float));
    memcpy(to->difference + 3 * i, from->difference + 3 * j, 3 * sizeof(float));
    to->spread[i] = from->spread[j];
    to->rays[i] = from->rays[j];
}

/* ---- recording ---- */

static double time_task(const struct recorder *it, const struct task *task)
{
    double *seconds = allocate(it->rounds, sizeof *seconds);
    struct render_counts counts;
    for (unsigned round = 0; round < it->rounds; round++) {
        double begin = clock_thread_cpu();
        renderer_task(it->stage.renderer, task, &counts);
        seconds[round] = clock_thread_cpu() - begin;
    }
    double median = median_of(seconds, it->rounds);
    free(seconds);
    return median;
}

/* Notes a task's results, and in `sums` the rays of each of its pixels; returns those of all. */
static double note_task(const struct recorder *it, const struct task *task, double *sums)
{
    const struct view *view = &it->record->view;
    double all = 0;
    for (uint32_t k = 0, in = 0; k < tile_pixels(task->tile); k++) {
        struct refinement refinement = task->refinements[k];
        uint32_t x, y;
        if (refinement.to == refinement.from) continue;
        tile_pixel(task->tile, k, &x, &y);
        double rays = (double)task->to.rays[in] *
                      (level_samples(view, refinement.to) - level_samples(view, refinement.from));
        copy_pixel(&it->all, (size_t)y * view->region_w + x, &task->to, in++);
        sums[(y + 1) * row_length(it->record) + x + 1] = rays;
        all += rays;
    }
    return all;
}

static void put(struct recorder *it, const struct tile *tile, uint32_t pixels, const float *part,
                double seconds)
{
    unsigned later = tile->pass > 0;
    double begin = clock_thread_cpu();
    adaptive_put(it->adaptive, tile, part, seconds);
    it->put_s[later] += clock_thread_cpu() - begin;
    it->put_pixels[later] += pixels;
}

static void record_tile(struct recorder *it, const struct tile *tile, double *sums)
{
    static float part[EDGE * EDGE * REFINED_FLOATS];
    struct refinement refinements[EDGE * EDGE];
    uint32_t pixels = adaptive_pixels(it->adaptive, tile);
    if (pixels == 0) return;
    adaptive_refinements(it->adaptive, tile, refinements);
    struct task task = {
        .tile = tile, .refinements = refinements, .to = pixel_floats(part, pixels, true)};
    double seconds = time_task(it, &task), rays = note_task(it, &task, sums);
    for (uint32_t y = tile->y + 1; y <= tile->y + tile->h; y++)
        for (uint32_t x = tile->x + 1; x <= tile->x + tile->w; x++)
            sums[y * row_length(it->record) + x] *= seconds / rays;
    put(it, tile, pixels, part, seconds);
}

/* Turns seconds of pixels into sums. */
static void integrate(const struct record *record, double *sums)
{
    size_t length = row_length(record);
    for (uint32_t y = 1; y <= record->view.region_h; y++) {
        double row = 0;
        for (uint32_t x = 1; x <= record->view.region_w; x++) {
            row += sums[y * length + x];
            sums[y * length + x] = sums[(y - 1) * length + x] + row;
        }
    }
}

static void record_pass(struct recorder *it)
{
    struct record *record = it->record;
    const struct view *view = &record->view;
    struct recorded_pass *pass = &record->passes[record->count];
    if (record->count == RECORD_PASSES) fatal("a run of more than %d passes", RECORD_PASSES);
    pass->floats = allocate_zeroed(pixel_count(view), REFINED_FLOATS * sizeof *pass->floats);
    pass->sums = allocate_zeroed(row_length(record) * (view->region_h + 1), sizeof *pass->sums);
    it->all = pixel_floats(pass->floats, pixel_count(view), true);
    struct tile tile = {.step = 1, .pass = record->count++};
    for (tile.y = 0; tile.y < view->region_h; tile.y += EDGE)
        for (tile.x = 0; tile.x < view->region_w; tile.x += EDGE) {
            tile.w = smaller(EDGE, view->region_w - tile.x);
            tile.h = smaller(EDGE, view->region_h - tile.y);
            record_tile(it, &tile, pass->sums);
        }
    integrate(record, pass->sums);
}

/* Plans the next pass; returns whether there is one. */
static bool plan(struct recorder *it)
{
    double begin = clock_thread_cpu();
    bool more = adaptive_plan(it->adaptive, HUGE_VAL);
    it->record->passes[it->record->count - 1].plan_s = clock_thread_cpu() - begin;
    return more;
}

void record_make(struct record *record, const char *config, uint32_t width, uint32_t height,
                 double target, unsigned rounds)
{
    struct recorder it = {.record = record, .rounds = rounds};
    struct canvas canvas;
    uint64_t pixels, samples;
    char *goal = format_text("sampling.target_error=%.17g", target);
    stage_open(&it.stage, config, width, height, (const char *[]){goal}, 1);
    free(goal);
    *record = (struct record){.view = it.stage.scene->view, .target = target};
    canvas_init(&canvas, width, height);
    it.adaptive = adaptive_create(&record->view, &canvas, target);
    do
        record_pass(&it);
    while (plan(&it));
    (void)adaptive_errors(it.adaptive, &pixels, &samples);
    record->samples = (double)samples / (double)pixels;
    for (unsigned later = 0; later < 2; later++)
        record->put_s[later] = it.put_s[later] / fmax(it.put_pixels[later], 1);
    adaptive_destroy(it.adaptive);
    canvas_free(&canvas);
    stage_close(&it.stage);
}

void record_free(struct record *record)
{
    for (unsigned i = 0; i < record->count; i++) {
        free(record->passes[i].floats);
        free(record->passes[i].sums);
    }
    *record = (struct record){0};
}

/* ---- what is recorded ---- */

double record_seconds(const struct record *record, const struct tile *tile)
{
    const double *above = record->passes[tile->pass].sums + tile->y * row_length(record) + tile->x;
    const double *below = above + tile->h * row_length(record);
    return fmax(below[tile->w] - below[0] - above[tile->w] + above[0], 0);
}

void record_copy(const struct record *record, const struct tile *tile,
                 const struct refinement *refinements, const struct pixel_floats *to)
{
    size_t all = pixel_count(&record->view);
    struct pixel_floats from = pixel_floats(record->passes[tile->pass].floats, all, true);
    size_t in = 0;
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        if (refinements[k].to == refinements[k].from) continue;
        tile_pixel(tile, k, &x, &y);
        copy_pixel(to, in++, &from, (size_t)y * record->view.region_w + x);
    }
}
