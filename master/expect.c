#include "master/expect.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "common/whole.h"
#include "master/bands.h"
#include "master/contrast.h"

/* The neighbourhood of a pixel is 5 x 5 pixels, weighted with products of these binomial weights for the two axes. */
#define REACH 2
#define ROWS  (2 * REACH + 1) /* of the neighbourhood */
static const double weights[ROWS] = {1, 4, 6, 4, 1};

/* Surprises are summed over blocks, squares as high as a band: a thousand pixels show how frequent surprises are.
 * Without them 18 scenes (200 x 150, four targets) take 3 % fewer rays for the same true error, but where needles and
 * hairs are most of the error, estimates are off too far (test_adaptive_errors.c).
 * block_count(): blocks of a band; block_of(): the block that a column is in. */
#define BLOCK_EDGE BAND_ROWS

static uint32_t block_count(const struct canvas *canvas)
{
    return divide_up(canvas->width, BLOCK_EDGE);
}

static uint32_t block_of(uint32_t x)
{
    return x / BLOCK_EDGE;
}

/*
 * The weight of the neighbourhood, as a number of degrees of freedom of the pixel's own spread. The smaller it is, the
 * more of the samples that a plan saves are saved where halves agree by chance: with 0 the garden's error (640 x 480,
 * as of 64 uniform samples) is 2.3 % larger than estimated, with 4 it is 0.7 % larger, with 16 the estimate is right.
 * For the same true error the lantern (as of 64 and 256 samples) needs as many rays with 0 as with 4, 2 or 3 % more
 * with 16, and 17 and 34 % more where its own spread does not count at all.
 */
#define PRIOR 4

/* The weight of the pixel itself in the ratio of errors to spreads; its neighbourhood has weight 1. The pixel's own
 * error is taken to be equal to its spread, as at edges. A fifth of this weight made no difference that could be
 * measured. */
#define OWN_PART 0.25

/* What a pixel may have missed of a neighbour's contrast: this times the squared contrast, divided by the cube of the
 * number of samples. With 4 samples it is the square of a quarter of the contrast. With 0 in place of 4 what no sample
 * has hit is given up: the lantern's error is then 1.7 times the estimate. */
#define MISSED 4

/* A row of values, REACH zeros on either side of them; and filtered along the row, with and without the pixel in the
 * middle. */
struct smooth_row {
    double *values, *with, *without;
};

/* Weighted means over the neighbourhoods of pixels, row by row through a band. The rows are a ring buffer: row y is at
 * index y modulo ROWS. */
struct smooth {
    struct smooth_row rows[ROWS];
    double *around; /* per pixel of the present row: the mean over its neighbourhood */
};

/* What a thread needs while it works on a band. */
struct band {
    const struct statistics *pixels;
    uint32_t width;
    struct smooth variance, spread;
    struct color_row colors[3];
    double *row_weight;         /* per column: sum of the weights that lie within the picture */
    struct contrasts contrasts; /* of the present row */
    double *surprise;           /* per block of the band: sum of v over its surprises */
    double *doubles;            /* memory of all doubles above; owned */
};

/* Takes `count` doubles of what is left of the band's memory. */
static double *cut(double **left, size_t count)
{
    double *first = *left;
    *left += count;
    return first;
}

/* How many doubles a struct smooth has. */
static size_t smooth_size(size_t width)
{
    return ROWS * (3 * width + 2 * (size_t)REACH) + width;
}

static void smooth_init(struct smooth *smooth, size_t width, double **left)
{
    for (unsigned i = 0; i < ROWS; i++)
        smooth->rows[i] = (struct smooth_row){cut(left, width + 2 * (size_t)REACH),
                                              cut(left, width), cut(left, width)};
    smooth->around = cut(left, width);
}

/* Sum of the weights that lie within the picture, along one axis. */
static double weight_inside(uint32_t at, uint32_t size)
{
    double sum = 0;
    for (int k = -REACH; k <= REACH; k++) {
        int64_t there = (int64_t)at + k;
        if (there >= 0 && there < size) sum += weights[k + REACH];
    }
    return sum;
}

static void band_init(struct band *band, const struct statistics *pixels)
{
    size_t width = pixels->canvas->width, blocks = block_count(pixels->canvas);
    *band = (struct band){.pixels = pixels, .width = (uint32_t)width};
    band->doubles = allocate_zeroed(2 * smooth_size(width) + 4 * width + blocks + 9 * (width + 2),
                                    sizeof *band->doubles);
    double *left = band->doubles;
    smooth_init(&band->variance, width, &left);
    smooth_init(&band->spread, width, &left);
    band->row_weight = cut(&left, width);
    band->contrasts = (struct contrasts){cut(&left, width), cut(&left, width), cut(&left, width)};
    band->surprise = cut(&left, blocks);
    for (unsigned i = 0; i < 9; i++)
        band->colors[i / 3].plane[i % 3] = cut(&left, width + 2);
    for (uint32_t x = 0; x < width; x++)
        band->row_weight[x] = weight_inside(x, (uint32_t)width);
}

static void band_free(struct band *band)
{
    free(band->doubles);
}

/* v of a pixel as estimated from its own halves. */
static double own_variance(const struct statistics *pixels, size_t i)
{
    return own_error(pixels->difference + 3 * i) * pixels->levels.power[pixels->level[i]];
}

/* S of a pixel. Where it is unknown, with two samples or not finite, it is replaced by v estimated from its halves. */
static double own_spread(const struct statistics *pixels, size_t i)
{
    double samples = pixels->levels.samples[pixels->level[i]], spread = (double)pixels->spread[i];
    bool known = samples > 2 && spread >= 0 && spread < HUGE_VAL;
    return known ? spread * spread * samples / (samples - 2) : own_variance(pixels, i);
}

/* The place of row y, which may be REACH rows outside the picture. */
static const struct smooth_row *smooth_row(const struct smooth *smooth, int64_t y)
{
    return &smooth->rows[(y + ROWS) % ROWS];
}

static void filter_row(const struct smooth_row *row, uint32_t width)
{
    for (uint32_t x = 0; x < width; x++) {
        const double *at = row->values + x;
        row->without[x] = weights[0] * (at[0] + at[4]) + weights[1] * (at[1] + at[3]);
        row->with[x] = row->without[x] + weights[2] * at[2];
    }
}

/* Takes row y and filters it; rows outside the picture are 0. */
static void take_row(const struct band *band, int64_t y)
{
    bool inside = y >= 0 && y < band->pixels->canvas->height;
    size_t first = inside ? (size_t)y * band->width : 0;
    const struct smooth_row *variance = smooth_row(&band->variance, y);
    const struct smooth_row *spread = smooth_row(&band->spread, y);
    for (uint32_t x = 0; x < band->width; x++) {
        variance->values[REACH + x] = inside ? own_variance(band->pixels, first + x) : 0;
        spread->values[REACH + x] = inside ? own_spread(band->pixels, first + x) : 0;
    }
    filter_row(variance, band->width);
    filter_row(spread, band->width);
}

/* Computes the means of row y; all rows within REACH of it must have been filtered. */
static void find_around(const struct band *band, const struct smooth *smooth, uint32_t y)
{
    double column_weight = weight_inside(y, band->pixels->canvas->height);
    const double *part[ROWS];
    for (int k = 0; k < ROWS; k++) {
        const struct smooth_row *row = smooth_row(smooth, (int64_t)y + k - REACH);
        part[k] = k == REACH ? row->without : row->with;
    }
    for (uint32_t x = 0; x < band->width; x++) {
        double sum = 0;
        for (int k = 0; k < ROWS; k++)
            sum += weights[k] * part[k][x];
        double weight = band->row_weight[x] * column_weight - weights[REACH] * weights[REACH];
        smooth->around[x] = weight > 0 ? sum / weight : 0;
    }
}

static void find_contrasts(struct band *band, uint32_t y)
{
    struct color_row rows[3];
    for (uint32_t k = 0; k < 3; k++)
        rows[k] = band->colors[(y + k + 2) % 3]; /* row y + k - 1 */
    color_row_take(&rows[2], band->pixels->canvas, (int64_t)y + 1);
    contrast_of_row(rows, band->width, &band->contrasts);
}

/* v of the rule, with n = samples. */
static double variance_of(double around, double spread_around, double spread, double samples)
{
    double own = OWN_PART * spread, ratio = 0;
    if (spread > 0) ratio = fmin((around + own) / (spread_around + own), sqrt(samples));
    return (PRIOR * around + (samples - 2) * ratio * spread) / (PRIOR + samples - 2);
}

static void expect_row(struct band *band, uint32_t y, double *error, float *predicted_rms)
{
    const struct statistics *pixels = band->pixels;
    find_around(band, &band->variance, y);
    find_around(band, &band->spread, y);
    find_contrasts(band, y);
    const double *own_variances = smooth_row(&band->variance, y)->values + REACH;
    const double *own_spreads = smooth_row(&band->spread, y)->values + REACH;
    for (uint32_t x = 0; x < band->width; x++) {
        size_t i = (size_t)y * band->width + x;
        double samples = pixels->levels.samples[pixels->level[i]];
        double power = pixels->levels.power[pixels->level[i]];
        double around = band->variance.around[x], edge_variance = band->contrasts.edge_variance[x];
        double missed = MISSED / (samples * samples * samples);
        double own = own_variances[x], spread = own_spreads[x];
        double spread_around = band->spread.around[x];
        if (own > SURPRISE * (around + edge_variance)) band->surprise[block_of(x)] += own;
        error[i] = variance_of(around, spread_around, spread, samples) / power +
                   missed * (band->contrasts.largest[x] + edge_variance);
        /* Of 4 samples at an edge between two neighbours' colours, the halves' error is at most 8 times the second
         * term. */
        predicted_rms[i] = (float)sqrt((around + band->contrasts.range_variance[x]) / power);
    }
}

/* Divides each block's sum by its number of pixels; the block at the right edge may be narrower. */
static void spread_blocks(const struct band *band, uint32_t rows)
{
    for (uint32_t x = 0; x < band->width; x += BLOCK_EDGE) {
        uint32_t block_pixels = rows * smaller(BLOCK_EDGE, band->width - x);
        band->surprise[block_of(x)] /= block_pixels;
    }
}

/* Adds the error of surprises that may still be there: each pixel gets the mean of its block. */
static void expect_surprises(const struct band *band, uint32_t y, double *error)
{
    const struct statistics *pixels = band->pixels;
    for (uint32_t x = 0; x < band->width; x++) {
        size_t i = (size_t)y * band->width + x;
        error[i] += band->surprise[block_of(x)] / pixels->levels.power[pixels->level[i]];
    }
}

struct expectation {
    const struct statistics *pixels;
    double *error;
    float *predicted_rms;
};

static void expect_band(void *context, uint32_t number)
{
    const struct expectation *it = context;
    const struct canvas *canvas = it->pixels->canvas;
    uint32_t begin = band_begin(canvas, number), end = band_begin(canvas, number + 1);
    struct band band;
    band_init(&band, it->pixels);
    for (int64_t y = (int64_t)begin - REACH; y < (int64_t)begin + REACH; y++)
        take_row(&band, y);
    color_row_take(&band.colors[(begin + 2) % 3], canvas, (int64_t)begin - 1);
    color_row_take(&band.colors[begin % 3], canvas, begin);
    for (uint32_t y = begin; y < end; y++) {
        take_row(&band, (int64_t)y + REACH);
        expect_row(&band, y, it->error, it->predicted_rms);
    }
    spread_blocks(&band, end - begin);
    for (uint32_t y = begin; y < end; y++)
        expect_surprises(&band, y, it->error);
    band_free(&band);
}

void expect_errors(const struct statistics *pixels, struct thread_pool *pool, double *error,
                   float *predicted_rms)
{
    struct expectation it = {pixels, error, predicted_rms};
    thread_pool_for(pool, band_count(pixels->canvas), expect_band, &it);
}
