#include "master/adaptive.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/hash.h"
#include "common/message.h"
#include "master/allocation.h"
#include "master/contrast.h"

/* In one pass a pixel goes up this many levels at most: what is known of it is not enough for more. */
#define LEVELS_PER_PASS 2

/* What share of the error before it a pass aims at: so little is done in one pass, and so much. The
 * latter, so that there is an end to passes that miss a target by a hair. */
#define PASS_AIM_MIN 0.5
#define PASS_AIM_MAX 0.93

/* Seconds per effort (master/allocation.h) of passes after the first, in terms of those of the first: what
 * seven scenes had in the mean (1.1 to 1.9); pixels that are even are quick and get none later on. It
 * counts as so much of the first pass's effort beside what the later passes themselves have shown. */
#define LATER_SECONDS 1.3
#define LATER_WEIGHT  0.1

/* The weights of the 5 x 5 pixels around one are products of these, of both axes: a binomial. */
#define REACH 2
#define ROWS  (2 * (int64_t)REACH + 1) /* that a filtered value is made of */
static const double weights[2 * REACH + 1] = {1, 4, 6, 4, 1};

/*
 * What nothing around a pixel has warned of: its own variance is SURPRISE times what it was expected to
 * be. Edges, of which about 5 of the 24 pixels around one are part, hardly ever surprise. Such things are
 * counted by blocks of this many pixels.
 */
#define SURPRISE   8
#define BLOCK_EDGE 32u

/* A row of variances: filtered along it, with and without the pixel in the middle. */
struct filtered {
    double *with, *without;
};

struct adaptive {
    struct view view;
    struct canvas *canvas; /* the means */
    double target;
    unsigned passes;
    bool met;         /* the target */
    uint64_t missing; /* pixels of the pass that are to come */
    double before;    /* the sum of squared errors when the pass was planned, as told by halves */
    double promised;  /* the share of it that the plan expected to be left */
    double log_promised, log_kept; /* of these shares and what came of them: sums over passes */
    double first_s, later_s;       /* seconds that pass 0 has taken, and those after it */
    double efforts[LEVEL_MAX + 2]; /* of a pixel with one ray per sample, from level 1 up to each */
    uint32_t last;                 /* level of max_samples */
    float *difference;             /* 3 per pixel: A - B */
    float *rays;                   /* of each pixel, per sample: what it costs */
    uint8_t *level;                /* of each pixel */
    uint8_t *next;                 /* which the pass brings it to */
    float *error;     /* expected squared error of each pixel, when the pass was planned */
    double *surprise; /* of each block: the variance that nothing has warned of, per pixel */
    double *variance; /* one row and REACH zeros on either side */
    struct filtered rows[ROWS]; /* of row y at y mod ROWS */
};

static size_t pixel_count(const struct adaptive *adaptive)
{
    return (size_t)adaptive->canvas->width * adaptive->canvas->height;
}

static double samples_of(const struct adaptive *adaptive, uint32_t level)
{
    return level_samples(&adaptive->view, level);
}

/* n^3/2 */
static double power(double samples)
{
    return samples * sqrt(samples);
}

static size_t blocks_along(uint32_t size)
{
    return (size + BLOCK_EDGE - 1) / BLOCK_EDGE;
}

static size_t block_count(const struct canvas *canvas)
{
    return blocks_along(canvas->width) * blocks_along(canvas->height);
}

static double *surprise_at(const struct adaptive *adaptive, uint32_t x, uint32_t y)
{
    size_t columns = blocks_along(adaptive->canvas->width);
    return &adaptive->surprise[y / BLOCK_EDGE * columns + x / BLOCK_EDGE];
}

struct adaptive *adaptive_create(const struct view *view, struct canvas *canvas, double target)
{
    struct adaptive *adaptive = allocate_zeroed(1, sizeof *adaptive);
    adaptive->view = *view;
    adaptive->canvas = canvas;
    adaptive->target = target;
    adaptive->last = level_last(view);
    for (uint32_t level = 1; level <= LEVEL_MAX; level++)
        adaptive->efforts[level + 1] =
            adaptive->efforts[level] + pow(samples_of(adaptive, level), EFFORT_POWER);
    assert(view->min_samples % 2 == 0 && view->max_samples % 2 == 0);
    size_t pixels = pixel_count(adaptive);
    adaptive->difference = allocate_zeroed(pixels, 3 * sizeof *adaptive->difference);
    adaptive->rays = allocate_zeroed(pixels, sizeof *adaptive->rays);
    adaptive->level = allocate_zeroed(pixels, 1);
    adaptive->next = allocate(pixels, 1);
    adaptive->error = allocate_zeroed(pixels, sizeof *adaptive->error);
    memset(adaptive->next, 1, pixels);
    adaptive->passes = 1;
    adaptive->missing = pixels;
    size_t width = canvas->width;
    adaptive->surprise = allocate_zeroed(block_count(canvas), sizeof *adaptive->surprise);
    adaptive->variance = allocate_zeroed(width + 2 * (size_t)REACH, sizeof *adaptive->variance);
    for (int i = 0; i <= 2 * REACH; i++) {
        adaptive->rows[i].with = allocate_zeroed(width, sizeof(double));
        adaptive->rows[i].without = allocate_zeroed(width, sizeof(double));
    }
    return adaptive;
}

void adaptive_destroy(struct adaptive *adaptive)
{
    if (!adaptive) return;
    for (int i = 0; i <= 2 * REACH; i++) {
        free(adaptive->rows[i].with);
        free(adaptive->rows[i].without);
    }
    free(adaptive->variance);
    free(adaptive->surprise);
    free(adaptive->error);
    free(adaptive->next);
    free(adaptive->level);
    free(adaptive->rays);
    free(adaptive->difference);
    free(adaptive);
}

/* ---- what the pixels tell ---- */

/* The squared error of a pixel as its own halves tell it; 0 where they are not finite. */
static double own_error(const struct adaptive *adaptive, size_t pixel)
{
    const float *difference = adaptive->difference + 3 * pixel;
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += (double)difference[c] * (double)difference[c];
    return sum < HUGE_VAL ? sum / 12 : 0;
}

struct error_sum adaptive_errors(const struct adaptive *adaptive, uint64_t *pixels,
                                 uint64_t *samples)
{
    struct error_sum sum = {0, 0};
    size_t count = pixel_count(adaptive);
    *pixels = *samples = 0;
    for (size_t i = 0; i < count; i++) {
        if (adaptive->level[i] == 0) continue;
        double square = own_error(adaptive, i);
        sum.squares += square;
        sum.fourths += square * square;
        *pixels += 1;
        *samples += level_samples(&adaptive->view, adaptive->level[i]);
    }
    return sum;
}

/* Row y of the variances, filtered; rows outside of the picture are 0. */
static void filter_row(struct adaptive *adaptive, int64_t y)
{
    struct filtered *row = &adaptive->rows[(y + ROWS) % ROWS];
    uint32_t width = adaptive->canvas->width;
    double *variance = adaptive->variance + REACH;
    bool inside = y >= 0 && y < adaptive->canvas->height;
    for (uint32_t x = 0; x < width; x++) {
        size_t i = (size_t)(inside ? y : 0) * width + x;
        double samples = samples_of(adaptive, adaptive->level[i]);
        variance[x] = inside ? own_error(adaptive, i) * power(samples) : 0;
    }
    for (uint32_t x = 0; x < width; x++) {
        const double *at = adaptive->variance + x;
        row->without[x] = weights[0] * (at[0] + at[4]) + weights[1] * (at[1] + at[3]);
        row->with[x] = row->without[x] + weights[2] * at[2];
    }
}

/* The sum of the weights that lie in the picture, along one axis. */
static double weight_inside(uint32_t at, uint32_t size)
{
    double sum = 0;
    for (int k = -REACH; k <= REACH; k++) {
        int64_t there = (int64_t)at + k;
        if (there >= 0 && there < size) sum += weights[k + REACH];
    }
    return sum;
}

/* v of the pixel; rows y - REACH .. y + REACH are filtered. */
static double variance_around(const struct adaptive *adaptive, uint32_t x, uint32_t y,
                              double row_weight, double column_weight)
{
    double sum = 0;
    for (uint32_t k = 0; k <= 2 * REACH; k++) {
        /* Row y + k - REACH, of any sign, modulo 2 REACH + 1. */
        const struct filtered *row = &adaptive->rows[(y + k + REACH + 1) % (2 * REACH + 1)];
        sum += weights[k] * (k == REACH ? row->without[x] : row->with[x]);
    }
    double weight = row_weight * column_weight - weights[REACH] * weights[REACH];
    return weight > 0 ? sum / weight : 0;
}

static void expect_row(struct adaptive *adaptive, uint32_t y)
{
    const struct canvas *canvas = adaptive->canvas;
    double column_weight = weight_inside(y, canvas->height);
    for (uint32_t x = 0; x < canvas->width; x++) {
        size_t i = (size_t)y * canvas->width + x;
        double samples = samples_of(adaptive, adaptive->level[i]);
        double row_weight = weight_inside(x, canvas->width);
        double around = variance_around(adaptive, x, y, row_weight, column_weight);
        struct contrast contrast = contrast_of(canvas, x, y);
        double missed = (contrast.largest + contrast.across) / (samples * samples);
        double own = own_error(adaptive, i) * power(samples);
        if (own > SURPRISE * (around + contrast.across))
            *surprise_at(adaptive, x, y) += own / (BLOCK_EDGE * BLOCK_EDGE);
        adaptive->error[i] = (float)((around + contrast.across) / power(samples) + missed);
    }
}

/* What surprises there may still be. */
static void expect_surprises(struct adaptive *adaptive)
{
    const struct canvas *canvas = adaptive->canvas;
    for (uint32_t y = 0; y < canvas->height; y++) {
        for (uint32_t x = 0; x < canvas->width; x++) {
            size_t i = (size_t)y * canvas->width + x;
            double samples = samples_of(adaptive, adaptive->level[i]);
            adaptive->error[i] += (float)(*surprise_at(adaptive, x, y) / power(samples));
        }
    }
}

/* e of every pixel */
static void expect_errors(struct adaptive *adaptive)
{
    memset(adaptive->surprise, 0, block_count(adaptive->canvas) * sizeof *adaptive->surprise);
    for (int64_t y = -REACH; y < REACH; y++)
        filter_row(adaptive, y);
    for (uint32_t y = 0; y < adaptive->canvas->height; y++) {
        filter_row(adaptive, (int64_t)y + REACH);
        expect_row(adaptive, y);
    }
    expect_surprises(adaptive);
}

/* ---- what they cost ---- */

/* Rays of all of the pixel's samples. */
static double cost_of(const struct adaptive *adaptive, size_t pixel)
{
    return (double)adaptive->rays[pixel] * samples_of(adaptive, adaptive->level[pixel]);
}

/* Of as many samples once more. */
static double effort_of(const struct adaptive *adaptive, size_t pixel)
{
    uint32_t level = adaptive->level[pixel];
    return (double)adaptive->rays[pixel] *
           (adaptive->efforts[level + 1] - adaptive->efforts[level]);
}

static double gain_of(const struct adaptive *adaptive, size_t pixel)
{
    return (double)adaptive->error[pixel] / cost_of(adaptive, pixel);
}

/* All pixels, and what their halves tell; where these tell nothing (told: of all of them), what is
 * expected, as contrasts may still hide something. */
static struct allocation *allocate_all(const struct adaptive *adaptive, double told)
{
    struct allocation *allocation = allocation_create();
    size_t pixels = pixel_count(adaptive);
    for (size_t i = 0; i < pixels; i++) {
        double error = (double)adaptive->error[i];
        if (error < HUGE_VAL)
            allocation_add(allocation, gain_of(adaptive, i),
                           told > 0 ? own_error(adaptive, i) : error, effort_of(adaptive, i),
                           adaptive->last - adaptive->level[i]);
    }
    return allocation;
}

/* ---- the plan ---- */

/* What the last pass has kept of its promise. */
static void learn(struct adaptive *adaptive, double squares)
{
    if (!(adaptive->promised > 0 && adaptive->promised < 1 && squares > 0)) return;
    adaptive->log_promised += log(adaptive->promised);
    adaptive->log_kept += log(squares / adaptive->before);
    adaptive->promised = 0;
}

/* What the plan that was just made expects to be left, of pixels' errors as their halves tell them. */
static void promise(struct adaptive *adaptive, double squares)
{
    double left = 0;
    size_t pixels = pixel_count(adaptive);
    for (size_t i = 0; i < pixels; i++) {
        double before = samples_of(adaptive, adaptive->level[i]);
        double after = samples_of(adaptive, adaptive->next[i]);
        left += own_error(adaptive, i) * power(before / after);
    }
    adaptive->promised = squares > 0 ? left / squares : 0;
    adaptive->before = squares;
}

/* Every pixel's next level; returns whether any goes up. */
static bool assign_levels(struct adaptive *adaptive, double limit)
{
    assert(adaptive->missing == 0);
    size_t pixels = pixel_count(adaptive);
    for (size_t i = 0; i < pixels; i++) {
        unsigned most = adaptive->last - adaptive->level[i];
        if (most > LEVELS_PER_PASS) most = LEVELS_PER_PASS;
        unsigned up = allocation_doublings(gain_of(adaptive, i), limit, most);
        adaptive->next[i] = (uint8_t)(adaptive->level[i] + up);
        adaptive->missing += up > 0;
    }
    return adaptive->missing > 0;
}

bool adaptive_plan(struct adaptive *adaptive)
{
    uint64_t pixels, samples;
    struct error_sum told = adaptive_errors(adaptive, &pixels, &samples);
    struct error_estimate estimate = error_estimate(&told, pixels, adaptive->passes);
    learn(adaptive, told.squares);
    adaptive->met = adaptive->target > 0 && estimate.high <= adaptive->target;
    if (adaptive->met) return false;
    expect_errors(adaptive);
    struct allocation *allocation = allocate_all(adaptive, told.squares);
    double share = fmax(PASS_AIM_MIN, adaptive->target / estimate.high);
    if (share > PASS_AIM_MAX) share = PASS_AIM_MAX;
    double limit = allocation_limit(allocation, share * share * allocation_told(allocation));
    allocation_destroy(allocation);
    if (!assign_levels(adaptive, limit)) return false;
    promise(adaptive, told.squares);
    adaptive->passes++;
    return true;
}

bool adaptive_is_met(const struct adaptive *adaptive)
{
    return adaptive->met;
}

double adaptive_seconds(const struct adaptive *adaptive)
{
    return adaptive->first_s + adaptive->later_s;
}

/* Of a pass to come: all pixels have samples. */
static double seconds_per_effort(const struct adaptive *adaptive)
{
    double first = 0, later = 0;
    size_t pixels = pixel_count(adaptive);
    for (size_t i = 0; i < pixels; i++) {
        first += (double)adaptive->rays[i] * pow(samples_of(adaptive, 1), EFFORT_POWER);
        later += (double)adaptive->rays[i] * adaptive->efforts[adaptive->level[i]];
    }
    return (adaptive->later_s + LATER_WEIGHT * LATER_SECONDS * adaptive->first_s) /
           (later + LATER_WEIGHT * first);
}

double adaptive_foresee(struct adaptive *adaptive, double rmse, double power)
{
    uint64_t pixels, samples;
    struct error_sum told = adaptive_errors(adaptive, &pixels, &samples);
    if (pixels < pixel_count(adaptive) || !(told.squares > 0)) return HUGE_VAL;
    /* A pass that promised to leave a share s left s^exponent: 0.94 to 1.11 after the first whole
     * pass of four scenes, 0.92 to 1.08 after more; one of a few pixels tells hardly anything.
     * So: as if one whole pass had kept its promise before them. */
    double whole = 2 * log(PASS_AIM_MIN);
    double exponent = (adaptive->log_kept + whole) / (adaptive->log_promised + whole);
    if (adaptive->passes == 1) exponent = power / FORECAST_EDGE; /* promises are for edges */
    if (!(exponent > 0)) return HUGE_VAL;
    double share = pow(rmse * rmse * (double)pixels / told.squares, 1 / exponent);
    if (share >= 1) return 0;
    expect_errors(adaptive);
    struct allocation *allocation = allocate_all(adaptive, told.squares);
    double limit = allocation_limit(allocation, share * allocation_told(allocation));
    double effort = limit > 0 ? allocation_under(allocation, limit).effort : HUGE_VAL;
    allocation_destroy(allocation);
    return effort * seconds_per_effort(adaptive);
}

bool adaptive_is_complete(const struct adaptive *adaptive)
{
    return adaptive->missing == 0;
}

double adaptive_target(const struct adaptive *adaptive)
{
    return adaptive->target;
}

unsigned adaptive_passes(const struct adaptive *adaptive)
{
    return adaptive->passes;
}

/* ---- tiles ---- */

static size_t pixel_at(const struct adaptive *adaptive, const struct tile *tile, uint32_t k)
{
    uint32_t x, y;
    tile_pixel(tile, k, &x, &y);
    assert(x < adaptive->canvas->width && y < adaptive->canvas->height);
    return (size_t)y * adaptive->canvas->width + x;
}

struct adaptive_work adaptive_work(const struct adaptive *adaptive, const struct tile *tile)
{
    struct adaptive_work work = {0};
    uint32_t pixels = tile_pixels(tile);
    for (uint32_t k = 0; k < pixels; k++) {
        size_t i = pixel_at(adaptive, tile, k);
        double before = samples_of(adaptive, adaptive->level[i]);
        double after = samples_of(adaptive, adaptive->next[i]);
        if (!(after > before)) continue;
        work.pixels++;
        work.samples += (uint64_t)(after - before);
        work.removed += (double)adaptive->error[i] * (1 - power(before / after));
    }
    /* Pass 0 takes tiles as a whole. */
    if (adaptive->passes == 1) work.pixels = pixels;
    return work;
}

void adaptive_take(const struct adaptive *adaptive, const struct tile *tile,
                   struct refinement *refinements)
{
    uint32_t pixels = tile_pixels(tile);
    for (uint32_t k = 0; k < pixels; k++) {
        size_t i = pixel_at(adaptive, tile, k);
        refinements[k] = (struct refinement){adaptive->level[i], adaptive->next[i]};
    }
}

uint64_t adaptive_plan_hash(const struct adaptive *adaptive, const struct tile *tile)
{
    uint64_t hash = adaptive->passes;
    uint32_t pixels = tile_pixels(tile);
    for (uint32_t k = 0; k < pixels; k++) {
        size_t i = pixel_at(adaptive, tile, k);
        const uint8_t levels[2] = {adaptive->level[i], adaptive->next[i]};
        hash = hash64(levels, sizeof levels, hash);
    }
    return hash;
}

/* What so many samples and so many more come to together. */
static float combined(float mean, double samples, float more, double count)
{
    if (samples == 0) return more;
    return (float)((samples * (double)mean + count * (double)more) / (samples + count));
}

/* Rays per sample as they came in: a sample is one ray at least. */
static double rays_of(float rays)
{
    return rays >= 1 && rays < HUGE_VALF ? (double)rays : 1;
}

void adaptive_put(struct adaptive *adaptive, const struct tile *tile, const float *part,
                  double seconds)
{
    *(adaptive->passes > 1 ? &adaptive->later_s : &adaptive->first_s) += seconds;
    uint32_t pixels = tile_pixels(tile), in = adaptive_work(adaptive, tile).pixels;
    const float *mean = part, *difference = mean + 3 * (size_t)in,
                *rays = difference + 3 * (size_t)in;
    for (uint32_t k = 0; k < pixels; k++) {
        size_t i = pixel_at(adaptive, tile, k);
        double before = samples_of(adaptive, adaptive->level[i]);
        double more = samples_of(adaptive, adaptive->next[i]) - before;
        if (!(more > 0)) {
            if (adaptive->passes > 1) continue;
            mean += 3, difference += 3, rays++;
            continue;
        }
        adaptive->missing--;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            adaptive->canvas->rgb[c] = combined(adaptive->canvas->rgb[c], before, *mean++, more);
            adaptive->difference[c] =
                combined(adaptive->difference[c], before, *difference++, more);
        }
        adaptive->rays[i] = combined(adaptive->rays[i], before, (float)rays_of(*rays++), more);
        adaptive->level[i] = adaptive->next[i];
    }
}

uint32_t adaptive_samples(const struct adaptive *adaptive, uint32_t x, uint32_t y)
{
    return level_samples(&adaptive->view, adaptive->level[(size_t)y * adaptive->canvas->width + x]);
}
