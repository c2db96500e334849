#include "master/statistics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

static void set_level(struct levels *levels, uint32_t level, double samples)
{
    levels->samples[level] = samples;
    levels->power[level] = samples * sqrt(samples);
}

void levels_init(struct levels *levels, const struct view *view)
{
    for (uint32_t level = 0; level <= LEVEL_MAX; level++)
        set_level(levels, level, level_samples(view, level));
    levels->last = level_last(view);
}

void levels_extend(struct levels *levels, uint32_t max_samples)
{
    double samples = levels->samples[levels->last];
    while (samples < max_samples && levels->last < LEVEL_MAX) {
        samples = fmin(2 * samples, max_samples);
        set_level(levels, ++levels->last, samples);
    }
    for (uint32_t level = levels->last + 1; level <= LEVEL_MAX; level++)
        set_level(levels, level, samples);
}

double own_error(const float *difference)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += (double)difference[c] * (double)difference[c];
    return sum < HUGE_VAL ? sum / 12 : 0;
}

size_t statistics_pixel_bytes(void)
{
    const struct statistics *s = NULL;
    return 3 * sizeof *s->difference + sizeof *s->spread + sizeof *s->rays + sizeof *s->level;
}

void statistics_init(struct statistics *statistics, const struct view *view, struct canvas *canvas)
{
    size_t pixels = canvas_pixels(canvas);
    *statistics = (struct statistics){.canvas = canvas, .unsampled = pixels};
    levels_init(&statistics->levels, view);
    /* Allocated in the same way as the canvas, for the same reason. */
    statistics->difference = allocate_prefaulted(pixels, 3 * sizeof *statistics->difference);
    statistics->spread = allocate_prefaulted(pixels, sizeof *statistics->spread);
    statistics->rays = allocate_prefaulted(pixels, sizeof *statistics->rays);
    statistics->level = allocate_prefaulted(pixels, sizeof *statistics->level);
}

void statistics_free(struct statistics *statistics)
{
    free(statistics->difference);
    free(statistics->spread);
    free(statistics->rays);
    free(statistics->level);
}

struct pixel_statistics statistics_of_pixel(const struct statistics *statistics, size_t pixel)
{
    struct pixel_statistics copy = {.level = statistics->level[pixel],
                                    .spread = statistics->spread[pixel]};
    memcpy(copy.mean, &statistics->canvas->rgb[3 * pixel], sizeof copy.mean);
    memcpy(copy.difference, &statistics->difference[3 * pixel], sizeof copy.difference);
    return copy;
}

/* The mean of `samples` samples and `count` more. */
static float combined(float mean, double samples, float more, double count)
{
    return (float)((samples * (double)mean + count * (double)more) / (samples + count));
}

static double squared_distance(float a, float b)
{
    return ((double)a - (double)b) * ((double)a - (double)b);
}

/* The spread of all samples of the pixel: of those it has and those that have come in. It is combined by means of the
 * halves' means, mean + difference / 2 and mean - difference / 2 (T. Chan, G. Golub & R. LeVeque, Updating formulae and
 * a pairwise algorithm for computing sample variances, 1979). */
static float combined_spread(const struct statistics *statistics, size_t pixel, double samples,
                             const struct new_samples *more, double count)
{
    double apart = 0, all = samples + count;
    for (size_t c = 0; c < 3; c++)
        apart += squared_distance(statistics->canvas->rgb[3 * pixel + c], more->mean[c]) +
                 squared_distance(statistics->difference[3 * pixel + c], more->difference[c]) / 4;
    double within = samples * squared_distance(statistics->spread[pixel], 0) +
                    count * squared_distance(*more->spread, 0);
    return (float)sqrt(within / all + samples * count / (all * all) * apart / 3);
}

/* Rays per sample, made valid: a sample takes at least one ray. */
static double rays_of(float rays)
{
    return rays >= 1 && rays < HUGE_VALF ? (double)rays : 1;
}

double statistics_put_first(struct statistics *statistics, size_t pixel, size_t count,
                            uint32_t level, const struct new_samples *more)
{
    double rays = 0;
    memcpy(&statistics->canvas->rgb[3 * pixel], more->mean, 3 * count * sizeof *more->mean);
    memcpy(&statistics->difference[3 * pixel], more->difference,
           3 * count * sizeof *more->difference);
    memcpy(&statistics->spread[pixel], more->spread, count * sizeof *more->spread);
    memset(&statistics->level[pixel], (int)level, count);
    for (size_t i = 0; i < count; i++) {
        double of_pixel = rays_of(more->rays[i]);
        statistics->rays[pixel + i] = (float)of_pixel;
        rays += of_pixel;
    }
    statistics->unsampled -= count;
    return rays;
}

/* Combines the pixel's samples with `count` more. */
static void put_more(struct statistics *statistics, size_t pixel, double count,
                     const struct new_samples *more, float rays)
{
    double before = statistics_samples(statistics, pixel);
    statistics->spread[pixel] = combined_spread(statistics, pixel, before, more, count);
    for (size_t c = 0; c < 3; c++) {
        float *mean = &statistics->canvas->rgb[3 * pixel + c],
              *difference = &statistics->difference[3 * pixel + c];
        *mean = combined(*mean, before, more->mean[c], count);
        *difference = combined(*difference, before, more->difference[c], count);
    }
    statistics->rays[pixel] = combined(statistics->rays[pixel], before, rays, count);
}

double statistics_put(struct statistics *statistics, size_t pixel, uint32_t level,
                      const struct new_samples *more)
{
    if (statistics->level[pixel] == 0)
        return statistics_put_first(statistics, pixel, 1, level, more);
    double rays = rays_of(*more->rays);
    double count = statistics->levels.samples[level] - statistics_samples(statistics, pixel);
    put_more(statistics, pixel, count, more, (float)rays);
    statistics->level[pixel] = (uint8_t)level;
    return rays;
}
