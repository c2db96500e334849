#include "master/expect.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/whole.h"
#include "master/bands.h"
#include "master/contrast.h"

/* The weights of the 5 x 5 pixels around one are products of these, of both axes: a binomial. */
#define REACH 2
#define ROWS  (2 * REACH + 1) /* that a filtered value is made of */
static const double weights[ROWS] = {1, 4, 6, 4, 1};

/* Surprises are counted by blocks, squares as high as a band: how many there are in one, and which one a column
 * is in. Blocks are so large that some thousand pixels tell of such things. */
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
 * What is around a pixel counts for so many degrees of freedom of its own spread. The fewer, the more of
 * what a plan spares is what halves that agree by chance hide: with none the garden's error (640 x 480, as
 * of 64 uniform samples) is 2.3 % larger than estimated, with 4 0.7 %, with 16 it is right. For the same
 * true error the lantern (as of 64 and 256) needs as many rays with none as with 4, 2 or 3 % more with 16,
 * and 17 and 34 % more where its own spread does not count at all.
 */
#define PRIOR 4

/* What the pixel itself counts for in the ratio of errors to spreads around it, which count for 1: as if
 * its error were its spread, as at edges. With a fifth of this nothing changes that could be told. */
#define OWN_PART 0.25

/* Of a neighbour's contrast what may be missed, in terms of its square by the cube of the number of
 * samples: for 4 samples the square of a quarter of it. With none of it what no sample has met is given up:
 * the lantern's error then is 1.7 times the estimate. */
#define MISSED 4

/* A row of what is known of pixels, filtered along it, with and without the pixel in the middle. */
struct filtered {
    double *with, *without;
};

/* Means over the pixels around one, of a band in work. Of the rows around the present one, y is at y modulo
 * their number. */
struct smooth {
    double *row; /* one, and REACH zeros on either side */
    struct filtered rows[ROWS];
    double *around; /* of each pixel of the present row */
};

/* A band in work. */
struct band {
    const struct sampled *pixels;
    uint32_t width;
    struct smooth variance, spread;
    struct color_row colors[3];
    double *row_weight;         /* of each column: the sum of the weights that lie in the picture */
    struct contrasts contrasts; /* of the present row */
    double *surprise;           /* of each block of the band: what nothing has warned of */
    double *doubles;            /* all of these; owned */
    float *floats;              /* the colours; owned */
};

/* The next so many of the band's numbers. */
static double *cut(double **left, size_t count)
{
    double *first = *left;
    *left += count;
    return first;
}

/* Numbers of a struct smooth. */
static size_t smooth_size(size_t width)
{
    return (2 * (size_t)ROWS + 2) * width + 2 * (size_t)REACH;
}

static void smooth_init(struct smooth *smooth, size_t width, double **left)
{
    for (unsigned i = 0; i < ROWS; i++)
        smooth->rows[i] = (struct filtered){cut(left, width), cut(left, width)};
    smooth->row = cut(left, width + 2 * (size_t)REACH);
    smooth->around = cut(left, width);
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

static void band_init(struct band *band, const struct sampled *pixels)
{
    size_t width = pixels->canvas->width, blocks = block_count(pixels->canvas);
    *band = (struct band){.pixels = pixels, .width = (uint32_t)width};
    band->doubles =
        allocate_zeroed(2 * smooth_size(width) + 4 * width + blocks, sizeof *band->doubles);
    band->floats = allocate_zeroed(9 * (width + 2), sizeof *band->floats);
    double *left = band->doubles;
    smooth_init(&band->variance, width, &left);
    smooth_init(&band->spread, width, &left);
    band->row_weight = cut(&left, width);
    band->contrasts = (struct contrasts){cut(&left, width), cut(&left, width), cut(&left, width)};
    band->surprise = cut(&left, blocks);
    for (unsigned i = 0; i < 9; i++)
        band->colors[i / 3].plane[i % 3] = band->floats + i * (width + 2);
    for (uint32_t x = 0; x < width; x++)
        band->row_weight[x] = weight_inside(x, (uint32_t)width);
}

static void band_free(struct band *band)
{
    free(band->doubles);
    free(band->floats);
}

/* What its halves tell of a pixel: v of one by itself. */
static double own_variance(const struct sampled *pixels, size_t i)
{
    return own_error(pixels->difference + 3 * i) * pixels->levels->power[pixels->level[i]];
}

/* S of a pixel; where nothing is known of it, of two samples or what is not finite, what its halves tell. */
static double own_spread(const struct sampled *pixels, size_t i)
{
    double samples = pixels->levels->samples[pixels->level[i]], spread = (double)pixels->spread[i];
    bool known = samples > 2 && spread >= 0 && spread < HUGE_VAL;
    return known ? spread * spread * samples / (samples - 2) : own_variance(pixels, i);
}

static void filter_row(const struct smooth *smooth, int64_t y, uint32_t width)
{
    const struct filtered *row = &smooth->rows[(y + ROWS) % ROWS];
    for (uint32_t x = 0; x < width; x++) {
        const double *at = smooth->row + x;
        row->without[x] = weights[0] * (at[0] + at[4]) + weights[1] * (at[1] + at[3]);
        row->with[x] = row->without[x] + weights[2] * at[2];
    }
}

/* Row y of what is known, filtered; rows outside of the picture are 0. */
static void take_row(struct band *band, int64_t y)
{
    bool inside = y >= 0 && y < band->pixels->canvas->height;
    size_t first = inside ? (size_t)y * band->width : 0;
    for (uint32_t x = 0; x < band->width; x++) {
        band->variance.row[REACH + x] = inside ? own_variance(band->pixels, first + x) : 0;
        band->spread.row[REACH + x] = inside ? own_spread(band->pixels, first + x) : 0;
    }
    filter_row(&band->variance, y, band->width);
    filter_row(&band->spread, y, band->width);
}

/* The means of row y; rows within REACH of it are filtered. */
static void find_around(const struct band *band, const struct smooth *smooth, uint32_t y)
{
    double column_weight = weight_inside(y, band->pixels->canvas->height);
    const double *part[ROWS];
    for (int k = 0; k < ROWS; k++) {
        const struct filtered *row = &smooth->rows[((int64_t)y + k - REACH + ROWS) % ROWS];
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

/* v */
static double variance_of(double around, double spread_around, double spread, double samples)
{
    double own = OWN_PART * spread, ratio = 0;
    if (spread > 0) ratio = fmin((around + own) / (spread_around + own), sqrt(samples));
    return (PRIOR * around + (samples - 2) * ratio * spread) / (PRIOR + samples - 2);
}

static void expect_row(struct band *band, uint32_t y, double *error, float *warned)
{
    const struct sampled *pixels = band->pixels;
    find_around(band, &band->variance, y);
    find_around(band, &band->spread, y);
    find_contrasts(band, y);
    for (uint32_t x = 0; x < band->width; x++) {
        size_t i = (size_t)y * band->width + x;
        double samples = pixels->levels->samples[pixels->level[i]];
        double power = pixels->levels->power[pixels->level[i]];
        double around = band->variance.around[x], across = band->contrasts.across[x];
        double missed = MISSED / (samples * samples * samples);
        double own = own_variance(pixels, i);
        double spread = own_spread(pixels, i), spread_around = band->spread.around[x];
        if (own > SURPRISE * (around + across)) band->surprise[block_of(x)] += own;
        error[i] = variance_of(around, spread_around, spread, samples) / power +
                   missed * (band->contrasts.largest[x] + across);
        /* At an edge between two neighbours' colours halves of 4 samples tell 8 times the second part at most. */
        warned[i] = (float)sqrt((around + band->contrasts.around[x]) / power);
    }
}

/* What there is in a block, for each of its pixels; those at the right edge are narrower. */
static void spread_blocks(const struct band *band, uint32_t rows)
{
    for (uint32_t x = 0; x < band->width; x += BLOCK_EDGE) {
        uint32_t block_pixels = rows * smaller(BLOCK_EDGE, band->width - x);
        band->surprise[block_of(x)] /= block_pixels;
    }
}

/* What surprises there may still be. */
static void expect_surprises(const struct band *band, uint32_t y, double *error)
{
    const struct sampled *pixels = band->pixels;
    for (uint32_t x = 0; x < band->width; x++) {
        size_t i = (size_t)y * band->width + x;
        error[i] += band->surprise[block_of(x)] / pixels->levels->power[pixels->level[i]];
    }
}

struct expectation {
    const struct sampled *pixels;
    double *error;
    float *warned;
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
        expect_row(&band, y, it->error, it->warned);
    }
    spread_blocks(&band, end - begin);
    for (uint32_t y = begin; y < end; y++)
        expect_surprises(&band, y, it->error);
    band_free(&band);
}

void expect_errors(const struct sampled *pixels, struct crew *crew, double *error, float *warned)
{
    struct expectation it = {pixels, error, warned};
    crew_share(crew, band_count(pixels->canvas), expect_band, &it);
}
