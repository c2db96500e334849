/* What a pass does in a tile: what each of its pixels gets, and what comes in of them. */
#include <assert.h>

#include "common/hash.h"
#include "master/adaptive_state.h"

/* Iterates over a tile's pixels in the tile's order, without a division for each. */
struct walk {
    size_t pixel; /* index of the present pixel in the canvas */
    /* Column and width in the tile; columns of a step beyond whole rows. */
    uint32_t column, width, step;
    size_t on, back; /* distances in the canvas: of a step, and from a row's end to the next row */
};

static struct walk walk_begin(const struct adaptive *adaptive, const struct tile *tile)
{
    const struct canvas *canvas = adaptive->statistics.canvas;
    size_t row = canvas->width;
    uint32_t column = tile->phase % tile->w, step = tile->step % tile->w;
    assert(tile->x + tile->w <= row && tile->y + tile->h <= canvas->height);
    return (struct walk){.pixel = (tile->y + tile->phase / tile->w) * row + tile->x + column,
                         .column = column,
                         .width = tile->w,
                         .step = step,
                         .on = tile->step / tile->w * row + step,
                         .back = row - tile->w};
}

static void walk_on(struct walk *walk)
{
    walk->pixel += walk->on;
    walk->column += walk->step;
    if (walk->column < walk->width) return;
    walk->column -= walk->width;
    walk->pixel += walk->back;
}

/* ---- what is to be done ---- */

/* Whether the pass is still to bring samples to the pixel. */
static bool is_pending(const struct adaptive *adaptive, size_t pixel)
{
    return adaptive->pass.next[pixel] > adaptive->statistics.level[pixel];
}

/* In pass 0, results contain all pixels of a tile, also where only some are still to come. */
static bool has_all_pixels(const struct adaptive *adaptive)
{
    return adaptive->pass.count == 1;
}

uint32_t adaptive_pixels(const struct adaptive *adaptive, const struct tile *tile)
{
    uint32_t pixels = tile_pixels(tile), in = 0;
    if (has_all_pixels(adaptive)) return pixels;
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk))
        in += is_pending(adaptive, walk.pixel);
    return in;
}

struct adaptive_work adaptive_work(const struct adaptive *adaptive, const struct tile *tile)
{
    const struct levels *levels = &adaptive->statistics.levels;
    struct adaptive_work work = {0};
    uint32_t pixels = tile_pixels(tile);
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk)) {
        size_t i = walk.pixel;
        if (!is_pending(adaptive, i)) continue;
        uint32_t before = adaptive->statistics.level[i], after = adaptive->pass.next[i];
        work.samples += levels->samples[after] - levels->samples[before];
        work.removed += pixel_errors_with_hidden(&adaptive->errors, i) *
                        (1 - levels_left(levels, before, after));
    }
    return work;
}

double adaptive_work_seconds(const struct adaptive *adaptive, const struct tile *tile)
{
    return pass_cost_of(adaptive->cost, tile);
}

void adaptive_refinements(const struct adaptive *adaptive, const struct tile *tile,
                          struct refinement *refinements)
{
    uint32_t pixels = tile_pixels(tile);
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk))
        refinements[k] = (struct refinement){adaptive->statistics.level[walk.pixel],
                                             adaptive->pass.next[walk.pixel]};
}

/* Pixels whose levels are hashed in one call, as calls cost more than bytes. */
#define HASHED_PIXELS 256u

uint64_t adaptive_plan_hash(const struct adaptive *adaptive, const struct tile *tile)
{
    uint64_t hash = adaptive->pass.count;
    uint8_t levels[2 * HASHED_PIXELS];
    uint32_t pixels = tile_pixels(tile), count = 0;
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk)) {
        levels[count++] = adaptive->statistics.level[walk.pixel];
        levels[count++] = adaptive->pass.next[walk.pixel];
        if (count < sizeof levels && k + 1 < pixels) continue;
        hash = hash64(levels, count, hash);
        count = 0;
    }
    return hash;
}

/* ---- what comes in ---- */

/* How many samples a result has of the pixel. */
static double samples_of(const struct adaptive *adaptive, size_t pixel)
{
    const double *samples = adaptive->statistics.levels.samples;
    uint32_t from = has_all_pixels(adaptive) ? 0 : adaptive->statistics.level[pixel];
    return samples[adaptive->pass.next[pixel]] - samples[from];
}

void adaptive_spread(const struct adaptive *adaptive, const struct tile *tile, double seconds,
                     float *costs)
{
    uint32_t pixels = tile_pixels(tile);
    double samples = 0;
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk))
        samples += samples_of(adaptive, walk.pixel);
    if (!(samples > 0)) return;
    walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk))
        costs[walk.pixel] += (float)(seconds * samples_of(adaptive, walk.pixel) / samples);
}

/* Takes in what the pass brings to a pixel. A pixel without samples has no state before to be looked at: reading it
 * would take as long as storing the first samples. */
static void put_pixel(struct adaptive *adaptive, size_t pixel, const struct new_samples *more)
{
    uint32_t from = adaptive->statistics.level[pixel], to = adaptive->pass.next[pixel];
    struct pixel_statistics before;
    if (from > 0) before = statistics_of_pixel(&adaptive->statistics, pixel);
    double rays = statistics_put(&adaptive->statistics, pixel, to, more);
    pixel_errors_settle(&adaptive->errors, pixel, from > 0 ? &before : NULL);
    effort_add(&adaptive->effort, from, to, rays);
    adaptive->pass.missing--;
}

static void advance(struct new_samples *at, size_t pixels)
{
    at->mean += 3 * pixels;
    at->difference += 3 * pixels;
    at->spread += pixels;
    at->rays += pixels;
}

/* Whether pass 0 is under way, and all pixels of the tile, which is a rectangle, are still to come. */
static bool is_new(const struct adaptive *adaptive, const struct tile *tile)
{
    size_t row = adaptive->statistics.canvas->width;
    if (!has_all_pixels(adaptive) || tile->step > 1 || tile->phase > 0) return false;
    for (uint32_t y = tile->y; y < tile->y + tile->h; y++)
        for (uint32_t x = tile->x; x < tile->x + tile->w; x++)
            if (!is_pending(adaptive, y * row + x)) return false;
    return true;
}

/* Takes in such a tile, row by row: that is most of what the master has to store. */
static void put_new(struct adaptive *adaptive, const struct tile *tile, struct new_samples at)
{
    size_t row = adaptive->statistics.canvas->width;
    double rays = 0;
    for (uint32_t y = tile->y; y < tile->y + tile->h; y++, advance(&at, tile->w))
        rays += statistics_put_first(&adaptive->statistics, y * row + tile->x, tile->w, 1, &at);
    pixel_errors_settle(&adaptive->errors, tile->y * row + tile->x, NULL);
    effort_add(&adaptive->effort, 0, 1, rays);
    adaptive->pass.missing -= tile_pixels(tile);
}

/* Takes in a tile pixel by pixel. */
static void put_pending(struct adaptive *adaptive, const struct tile *tile, struct new_samples at)
{
    bool all = has_all_pixels(adaptive);
    uint32_t pixels = tile_pixels(tile);
    struct walk walk = walk_begin(adaptive, tile);
    for (uint32_t k = 0; k < pixels; k++, walk_on(&walk)) {
        bool more = is_pending(adaptive, walk.pixel);
        if (more) put_pixel(adaptive, walk.pixel, &at);
        if (more || all) advance(&at, 1);
    }
}

void adaptive_put(struct adaptive *adaptive, const struct tile *tile, const float *part,
                  double seconds)
{
    size_t in = adaptive_pixels(adaptive, tile);
    struct new_samples at = {.mean = part, .difference = part + 3 * in};
    at.spread = at.difference + 3 * in;
    at.rays = at.spread + in;
    struct effort *effort = &adaptive->effort;
    (adaptive->pass.is_first ? &effort->on_first : &effort->on_later)->seconds += seconds;
    pass_cost_took(adaptive->cost, tile, seconds);
    if (is_new(adaptive, tile))
        put_new(adaptive, tile, at);
    else
        put_pending(adaptive, tile, at);
}
