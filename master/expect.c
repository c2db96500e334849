#include "master/expect.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/contrast.h"

/* The weights of the 5 x 5 pixels around one are products of these, of both axes: a binomial. */
#define REACH 2
#define ROWS  (2 * REACH + 1) /* that a filtered value is made of */
static const double weights[ROWS] = {1, 4, 6, 4, 1};

/*
 * What nothing around a pixel has warned of: its own variance is SURPRISE times what it was expected to
 * be. Edges, of which about 5 of the 24 pixels around one are part, hardly ever surprise. Such things are
 * counted by squares of this edge, in pixels: large enough that some thousand pixels tell of one.
 */
#define SURPRISE   8
#define BLOCK_EDGE BAND_ROWS

uint32_t band_count(const struct canvas *canvas)
{
    return (canvas->height + BAND_ROWS - 1) / BAND_ROWS;
}

uint32_t band_begin(const struct canvas *canvas, uint32_t band)
{
    return band < band_count(canvas) ? band * BAND_ROWS : canvas->height;
}

void levels_init(struct levels *levels, const struct view *view)
{
    for (uint32_t level = 0; level <= LEVEL_MAX; level++) {
        double samples = level_samples(view, level);
        levels->samples[level] = samples;
        levels->power[level] = samples * sqrt(samples);
    }
}

double own_error(const float *difference)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += (double)difference[c] * (double)difference[c];
    return sum < HUGE_VAL ? sum / 12 : 0;
}

/* Variances of a row, filtered along it, with and without the pixel in the middle. */
struct filtered {
    double *with, *without;
};

/* A band in work. Of the rows around the present one, y is at y modulo their number. */
struct band {
    const struct sampled *pixels;
    uint32_t width;
    double *variance; /* one row, and REACH zeros on either side */
    struct filtered rows[ROWS];
    struct color_row colors[3];
    double *row_weight; /* of each column: the sum of the weights that lie in the picture */
    double *around, *largest, *across; /* of each pixel of the present row */
    double *
        surprise; /* of each block of the band: the variance that nothing has warned of, per pixel */
    double *doubles; /* all of these; owned */
    float *floats;   /* the colours; owned */
};

/* The next so many of the band's numbers. */
static double *cut(double **left, size_t count)
{
    double *first = *left;
    *left += count;
    return first;
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
    size_t width = pixels->canvas->width, blocks = (width + BLOCK_EDGE - 1) / BLOCK_EDGE;
    *band = (struct band){.pixels = pixels, .width = (uint32_t)width};
    size_t doubles = (2 * (size_t)ROWS + 5) * width + 2 * (size_t)REACH + blocks;
    band->doubles = allocate_zeroed(doubles, sizeof *band->doubles);
    band->floats = allocate_zeroed(9 * (width + 2), sizeof *band->floats);
    double *left = band->doubles;
    for (unsigned i = 0; i < ROWS; i++)
        band->rows[i] = (struct filtered){cut(&left, width), cut(&left, width)};
    band->variance = cut(&left, width + 2 * (size_t)REACH);
    band->row_weight = cut(&left, width);
    band->around = cut(&left, width);
    band->largest = cut(&left, width);
    band->across = cut(&left, width);
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

static struct filtered *filtered_at(struct band *band, int64_t y)
{
    return &band->rows[(y + ROWS) % ROWS];
}

/* Row y of the variances, filtered; rows outside of the picture are 0. */
static void filter_row(struct band *band, int64_t y)
{
    const struct sampled *pixels = band->pixels;
    struct filtered *row = filtered_at(band, y);
    double *variance = band->variance + REACH;
    bool inside = y >= 0 && y < pixels->canvas->height;
    size_t first = inside ? (size_t)y * band->width : 0;
    for (uint32_t x = 0; x < band->width; x++)
        variance[x] = inside ? own_error(pixels->difference + 3 * (first + x)) *
                                   pixels->levels->power[pixels->level[first + x]]
                             : 0;
    for (uint32_t x = 0; x < band->width; x++) {
        const double *at = band->variance + x;
        row->without[x] = weights[0] * (at[0] + at[4]) + weights[1] * (at[1] + at[3]);
        row->with[x] = row->without[x] + weights[2] * at[2];
    }
}

/* v of each pixel of the row; those within REACH of it are filtered. */
static void find_variances(struct band *band, uint32_t y)
{
    double column_weight = weight_inside(y, band->pixels->canvas->height);
    const double *part[ROWS];
    for (int k = 0; k < ROWS; k++) {
        const struct filtered *row = filtered_at(band, (int64_t)y + k - REACH);
        part[k] = k == REACH ? row->without : row->with;
    }
    for (uint32_t x = 0; x < band->width; x++) {
        double sum = 0;
        for (int k = 0; k < ROWS; k++)
            sum += weights[k] * part[k][x];
        double weight = band->row_weight[x] * column_weight - weights[REACH] * weights[REACH];
        band->around[x] = weight > 0 ? sum / weight : 0;
    }
}

static void find_contrasts(struct band *band, uint32_t y)
{
    struct color_row rows[3];
    for (uint32_t k = 0; k < 3; k++)
        rows[k] = band->colors[(y + k + 2) % 3]; /* row y + k - 1 */
    color_row_take(&rows[2], band->pixels->canvas, (int64_t)y + 1);
    contrast_of_row(rows, band->width, band->largest, band->across);
}

static void expect_row(struct band *band, uint32_t y, double *error)
{
    const struct sampled *pixels = band->pixels;
    find_variances(band, y);
    find_contrasts(band, y);
    for (uint32_t x = 0; x < band->width; x++) {
        size_t i = (size_t)y * band->width + x;
        double samples = pixels->levels->samples[pixels->level[i]];
        double power = pixels->levels->power[pixels->level[i]];
        double around = band->around[x], across = band->across[x];
        double missed = (band->largest[x] + across) / (samples * samples);
        double own = own_error(pixels->difference + 3 * i) * power;
        if (own > SURPRISE * (around + across))
            band->surprise[x / BLOCK_EDGE] += own / (BLOCK_EDGE * BLOCK_EDGE);
        error[i] = (around + across) / power + missed;
    }
}

/* What surprises there may still be. */
static void expect_surprises(const struct band *band, uint32_t y, double *error)
{
    const struct sampled *pixels = band->pixels;
    for (uint32_t x = 0; x < band->width; x++) {
        size_t i = (size_t)y * band->width + x;
        double power = pixels->levels->power[pixels->level[i]];
        error[i] += band->surprise[x / BLOCK_EDGE] / power;
    }
}

struct expectation {
    const struct sampled *pixels;
    double *error;
};

static void expect_band(void *context, uint32_t number)
{
    const struct expectation *it = context;
    const struct canvas *canvas = it->pixels->canvas;
    uint32_t begin = band_begin(canvas, number), end = band_begin(canvas, number + 1);
    struct band band;
    band_init(&band, it->pixels);
    for (int64_t y = (int64_t)begin - REACH; y < (int64_t)begin + REACH; y++)
        filter_row(&band, y);
    color_row_take(&band.colors[(begin + 2) % 3], canvas, (int64_t)begin - 1);
    color_row_take(&band.colors[begin % 3], canvas, begin);
    for (uint32_t y = begin; y < end; y++) {
        filter_row(&band, (int64_t)y + REACH);
        expect_row(&band, y, it->error);
    }
    for (uint32_t y = begin; y < end; y++)
        expect_surprises(&band, y, it->error);
    band_free(&band);
}

void expect_errors(const struct sampled *pixels, struct crew *crew, double *error)
{
    struct expectation it = {pixels, error};
    crew_share(crew, band_count(pixels->canvas), expect_band, &it);
}
