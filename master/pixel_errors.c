#include "master/pixel_errors.h"

#include <assert.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/bands.h"
#include "master/expect.h"

size_t pixel_errors_bytes(void)
{
    const struct pixel_errors *e = NULL;
    return sizeof *e->expected + sizeof *e->predicted_rms + hidden_pixel_bytes();
}

void pixel_errors_init(struct pixel_errors *errors, const struct statistics *statistics)
{
    size_t pixels = canvas_pixels(statistics->canvas);
    *errors = (struct pixel_errors){.statistics = statistics, .hidden = hidden_create(pixels)};
    errors->expected = allocate_prefaulted(pixels, sizeof *errors->expected);
    errors->predicted_rms = allocate_prefaulted(pixels, sizeof *errors->predicted_rms);
}

void pixel_errors_free(struct pixel_errors *errors)
{
    hidden_destroy(errors->hidden);
    free(errors->expected);
    free(errors->predicted_rms);
}

/* ---- what changes ---- */

void pixel_errors_settle(struct pixel_errors *errors, size_t pixel,
                         const struct pixel_statistics *before)
{
    errors->is_expected = errors->is_summed = false;
    if (!before) return;
    hidden_settle(errors->hidden, errors->statistics, pixel, before);
}

void pixel_errors_left(struct pixel_errors *errors)
{
    errors->is_summed = false;
}

/* ---- totals ---- */

struct summing {
    const struct pixel_errors *errors;
    struct error_totals *bands;
};

/* Adds a pixel that has samples. */
static void add_pixel(const struct pixel_errors *errors, size_t pixel, struct error_totals *totals)
{
    double square = pixel_errors_own(errors, pixel);
    totals->halves.squares += square;
    totals->halves.fourths += square * square;
    totals->pixels++;
    totals->samples += (uint64_t)statistics_samples(errors->statistics, pixel);
    hidden_add(errors->hidden, errors->statistics, pixel, &totals->hidden);
}

static void sum_band(void *context, uint32_t band)
{
    const struct summing *it = context;
    const struct statistics *statistics = it->errors->statistics;
    size_t end = band_first_pixel(statistics->canvas, band + 1);
    struct error_totals totals = {.pixels = 0};
    for (size_t i = band_first_pixel(statistics->canvas, band); i < end; i++)
        if (statistics->level[i] > 0) add_pixel(it->errors, i, &totals);
    it->bands[band] = totals;
}

static void add_totals(struct error_totals *all, const struct error_totals *more)
{
    error_sum_add(&all->halves, &more->halves);
    all->pixels += more->pixels;
    all->samples += more->samples;
    hidden_join(&all->hidden, &more->hidden);
}

const struct error_totals *pixel_errors_totals(struct pixel_errors *errors,
                                               struct thread_pool *pool)
{
    if (errors->is_summed) return &errors->totals;
    uint32_t bands = band_count(errors->statistics->canvas);
    struct summing it = {errors, allocate(bands, sizeof *it.bands)};
    thread_pool_for(pool, bands, sum_band, &it);
    errors->totals = (struct error_totals){.pixels = 0};
    for (uint32_t k = 0; k < bands; k++)
        add_totals(&errors->totals, &it.bands[k]);
    free(it.bands);
    errors->is_summed = true;
    return &errors->totals;
}

const struct error_totals *pixel_errors_expect(struct pixel_errors *errors,
                                               struct thread_pool *pool)
{
    const struct error_totals *totals = pixel_errors_totals(errors, pool);
    hidden_share(errors->hidden, &totals->hidden);
    if (errors->is_expected || errors->statistics->unsampled > 0) return totals;
    expect_errors(errors->statistics, pool, errors->expected, errors->predicted_rms);
    errors->is_expected = true;
    return totals;
}

double pixel_errors_halves(const struct pixel_errors *errors)
{
    assert(errors->is_summed);
    return errors->totals.halves.squares;
}

struct error_breakdown pixel_errors_breakdown(const struct pixel_errors *errors)
{
    assert(errors->is_summed);
    return hidden_errors(errors->hidden, &errors->totals.hidden, errors->totals.halves);
}

/* ---- of a pixel ---- */

double pixel_errors_own(const struct pixel_errors *errors, size_t pixel)
{
    return own_error(errors->statistics->difference + 3 * pixel);
}

double pixel_errors_hidden(const struct pixel_errors *errors, size_t pixel)
{
    return hidden_of(errors->hidden, pixel, errors->statistics->level[pixel]);
}

double pixel_errors_with_hidden(const struct pixel_errors *errors, size_t pixel)
{
    return pixel_errors_expected(errors, pixel) + pixel_errors_hidden(errors, pixel);
}

double pixel_errors_expected_sum(const struct pixel_errors *errors)
{
    size_t pixels = canvas_pixels(errors->statistics->canvas);
    double sum = 0;
    for (size_t i = 0; i < pixels; i++)
        sum += errors->expected[i];
    return sum;
}
