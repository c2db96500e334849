/* Tests the expected errors of pixels, which are computed in bands, against the rule of master/adaptive.h for each
 * pixel. */
#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/expect.h"
#include "test/random.h"
#include "test/unit.h"

struct picture {
    struct canvas canvas;
    float *difference, *spread;
    uint8_t *level;
    struct levels levels;
};

static const float *color_at(const struct picture *picture, int64_t x, int64_t y)
{
    return picture->canvas.rgb + 3 * (y * picture->canvas.width + x);
}

static bool is_inside(const struct picture *picture, int64_t x, int64_t y)
{
    return x >= 0 && y >= 0 && x < picture->canvas.width && y < picture->canvas.height;
}

static double own_variance(const struct picture *picture, int64_t x, int64_t y)
{
    int64_t i = y * picture->canvas.width + x;
    return own_error(picture->difference + 3 * i) * picture->levels.power[picture->level[i]];
}

static double own_spread(const struct picture *picture, int64_t x, int64_t y)
{
    int64_t i = y * picture->canvas.width + x;
    double samples = picture->levels.samples[picture->level[i]];
    if (samples == 2 || !isfinite(picture->spread[i])) return own_variance(picture, x, y);
    return samples / (samples - 2) * pow((double)picture->spread[i], 2);
}

typedef double pixel_function(const struct picture *picture, int64_t x, int64_t y);

static double around(const struct picture *picture, pixel_function *f, int64_t x, int64_t y)
{
    const double weights[5] = {1, 4, 6, 4, 1};
    double sum = 0, all = 0;
    for (int64_t v = -2; v <= 2; v++) {
        for (int64_t u = -2; u <= 2; u++) {
            if ((u == 0 && v == 0) || !is_inside(picture, x + u, y + v)) continue;
            double weight = weights[u + 2] * weights[v + 2];
            sum += weight * f(picture, x + u, y + v);
            all += weight;
        }
    }
    return all > 0 ? sum / all : 0;
}

/* v */
static double variance(const struct picture *picture, int64_t x, int64_t y)
{
    double halves = around(picture, own_variance, x, y), ratio = 0;
    double own = own_spread(picture, x, y), others = around(picture, own_spread, x, y);
    double samples = picture->levels.samples[picture->level[y * picture->canvas.width + x]];
    if (own > 0) ratio = fmin((halves + own / 4) / (others + own / 4), sqrt(samples));
    return (4 * halves + (samples - 2) * ratio * own) / (samples + 2);
}

static double product(const float *m, const float *a, const float *b)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += ((double)a[c] - (double)m[c]) * ((double)b[c] - (double)m[c]);
    return sum;
}

/* C^2 and P */
static void contrast(const struct picture *picture, int64_t x, int64_t y, double *largest,
                     double *across)
{
    const float *here = color_at(picture, x, y), *near[8], *far = NULL;
    unsigned count = 0;
    for (int64_t v = y - 1; v <= y + 1; v++)
        for (int64_t u = x - 1; u <= x + 1; u++)
            if ((u != x || v != y) && is_inside(picture, u, v))
                near[count++] = color_at(picture, u, v);
    for (unsigned k = 0; k < count; k++)
        if (!far || product(here, near[k], near[k]) > product(here, far, far)) far = near[k];
    *largest = far ? product(here, far, far) / 3 : 0;
    *across = 0;
    for (unsigned k = 0; k < count; k++)
        *across = fmax(*across, -product(here, far, near[k]) / 3);
}

/* e without surprises; *surprise: the pixel's contribution to the surprises of its square of 32 x 32 */
static double expected(const struct picture *picture, int64_t x, int64_t y, double *surprise)
{
    double largest, across, halves = around(picture, own_variance, x, y);
    uint8_t level = picture->level[y * picture->canvas.width + x];
    double samples = picture->levels.samples[level], own = own_variance(picture, x, y);
    contrast(picture, x, y, &largest, &across);
    *surprise = own > 8 * (halves + across) ? own : 0;
    return variance(picture, x, y) / picture->levels.power[level] +
           4 * (largest + across) / pow(samples, 3);
}

/* The squared error predicted from the neighbourhood alone: D, and what the range of the neighbours' colours allows. */
static double warning(const struct picture *picture, int64_t x, int64_t y)
{
    uint8_t level = picture->level[y * picture->canvas.width + x];
    double ranges = 0;
    for (int c = 0; c < 3; c++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (int64_t v = y - 1; v <= y + 1; v++)
            for (int64_t u = x - 1; u <= x + 1; u++) {
                if ((u == x && v == y) || !is_inside(picture, u, v)) continue;
                low = fmin(low, (double)color_at(picture, u, v)[c]);
                high = fmax(high, (double)color_at(picture, u, v)[c]);
            }
        if (high > low) ranges += (high - low) * (high - low) / 12;
    }
    return (around(picture, own_variance, x, y) + ranges) / picture->levels.power[level];
}

static void check_square(const struct picture *picture, const double *error,
                         const float *predicted_rms, int64_t left, int64_t top)
{
    int64_t right = left + 32, bottom = top + 32;
    double surprise = 0, pixels = 0, part;
    for (int64_t y = top; y < bottom; y++)
        for (int64_t x = left; x < right; x++)
            if (is_inside(picture, x, y))
                (void)expected(picture, x, y, &part), surprise += part, pixels++;
    for (int64_t y = top; y < bottom; y++) {
        for (int64_t x = left; x < right; x++) {
            if (!is_inside(picture, x, y)) continue;
            int64_t i = y * picture->canvas.width + x;
            double e = expected(picture, x, y, &part);
            e += surprise / pixels / picture->levels.power[picture->level[i]];
            assert_true(fabs(error[i] - e) <= 1e-12 * e);
            e = sqrt(warning(picture, x, y));
            assert_true(fabs((double)predicted_rms[i] - e) <= 1e-6 * e);
        }
    }
}

/* A mostly even picture with specks that no neighbour hints at, and pixels whose halves are not finite. */
static void fill(struct picture *picture)
{
    uint64_t state = 1;
    size_t pixels = (size_t)picture->canvas.width * picture->canvas.height;
    for (size_t i = 0; i < pixels; i++) {
        double speck =
            random_between(&state, 0, 1) < 0.02 ? pow(10, random_between(&state, -2, 1)) : 0.01;
        picture->level[i] = (uint8_t)(1 + 3 * random_between(&state, 0, 1));
        picture->spread[i] =
            random_between(&state, 0, 1) < 0.5 ? 0 : (float)(speck * random_between(&state, 0, 1));
        if (random_between(&state, 0, 1) < 0.005) picture->spread[i] = HUGE_VALF;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            picture->canvas.rgb[c] =
                (float)(random_between(&state, 0, 1) < 0.05 ? random_between(&state, 0, 1) : 0.5);
            picture->difference[c] = random_between(&state, 0, 1) < 0.005
                                         ? NAN
                                         : (float)(speck * random_between(&state, 0, 1));
        }
    }
}

static void check_size(uint32_t width, uint32_t height, uint32_t min_samples)
{
    struct view view = {.min_samples = min_samples, .max_samples = 4096};
    struct picture picture;
    size_t pixels = (size_t)width * height;
    canvas_init(&picture.canvas, width, height);
    picture.difference = allocate(pixels, 3 * sizeof(float));
    picture.spread = allocate(pixels, sizeof(float));
    picture.level = allocate(pixels, 1);
    levels_init(&picture.levels, &view);
    fill(&picture);
    double *error = allocate(pixels, sizeof *error);
    struct statistics statistics = {.canvas = &picture.canvas,
                                    .levels = picture.levels,
                                    .difference = picture.difference,
                                    .spread = picture.spread,
                                    .level = picture.level};
    struct thread_pool *pool = thread_pool_create(2);
    float *predicted_rms = allocate(pixels, sizeof *predicted_rms);
    expect_errors(&statistics, pool, error, predicted_rms);
    thread_pool_destroy(pool);
    for (uint32_t y = 0; y < height; y += 32)
        for (uint32_t x = 0; x < width; x += 32)
            check_square(&picture, error, predicted_rms, x, y);
    free(predicted_rms);
    free(error);
    free(picture.level);
    free(picture.spread);
    free(picture.difference);
    canvas_free(&picture.canvas);
}

/* Pictures smaller than the filter, of one band, and of one band plus a row and a column. */
static void test_sizes(void **state)
{
    for (uint32_t edge = 1; edge <= 5; edge++) {
        check_size(edge, 70, 4);
        check_size(70, edge, 4);
        check_size(edge, edge, 4);
    }
    check_size(64, 32, 4);
    check_size(65, 33, 4);
    check_size(31, 97, 4);
    check_size(31, 97, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sizes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
