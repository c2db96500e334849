/* The store of adaptive sampling: for each pixel the mean, the halves' difference, the spread and the cost of its
 * samples, updated as samples come in. */
#ifndef FARM_MASTER_STATISTICS_H
#define FARM_MASTER_STATISTICS_H

#include <stddef.h>
#include <stdint.h>

#include "common/refinement.h"
#include "master/canvas.h"

/* For each level: its number of samples n, and n^3/2. */
struct levels {
    double samples[LEVEL_MAX + 1], power[LEVEL_MAX + 1];
    uint32_t last; /* the lowest level that has max_samples */
};

void levels_init(struct levels *levels, const struct view *view);

/* Adds levels, each with twice as many samples, up to this maximum. */
void levels_extend(struct levels *levels, uint32_t max_samples);

/* The share of a squared error that remains when a pixel goes from one level to another one. */
static inline double levels_left(const struct levels *levels, uint32_t from, uint32_t to)
{
    return levels->power[from] / levels->power[to];
}

/* A pixel's squared error (mean of the components), estimated from its halves; 0 where they are not finite. difference:
 * 3 floats, A - B. */
double own_error(const float *difference);

/* A copy of what is known of one pixel, whose level is above 0. */
struct pixel_statistics {
    float mean[3], difference[3], spread;
    uint8_t level;
};

/* Further samples of a pixel: pointers into the arrays of struct pixel_floats, in which the following pixels' come
 * next. */
struct new_samples {
    const float *mean, *difference, *spread, *rays;
};

/* To be written by the functions below alone. Arrays are owned, except for the canvas. */
struct statistics {
    struct canvas *canvas; /* the means; the caller's own */
    struct levels levels;
    uint64_t unsampled; /* pixels without samples */
    float *difference;  /* 3 per pixel: A - B */
    float *spread;      /* of each pixel, as struct pixel_floats has it */
    float *rays;        /* of each pixel, rays per sample: its cost */
    uint8_t *level;     /* of each pixel */
};

/* Bytes of memory kept for each pixel beside the canvas. */
size_t statistics_pixel_bytes(void);

/* Begins without any samples. The canvas, which has the size of the view's region, must outlive the statistics. Freed
 * by statistics_free(), which leaves the canvas. */
void statistics_init(struct statistics *statistics, const struct view *view, struct canvas *canvas);
void statistics_free(struct statistics *statistics);

/* Copies the pixel's present state. */
struct pixel_statistics statistics_of_pixel(const struct statistics *statistics, size_t pixel);

/* Adds the samples that bring a pixel to a level above its own. Returns the rays that each of them took, at least 1. */
double statistics_put(struct statistics *statistics, size_t pixel, uint32_t level,
                      const struct new_samples *more);

/* The same for `count` consecutive pixels, none of which has samples. Returns the sum of their rays per sample. */
double statistics_put_first(struct statistics *statistics, size_t pixel, size_t count,
                            uint32_t level, const struct new_samples *more);

static inline double statistics_samples(const struct statistics *statistics, size_t pixel)
{
    return statistics->levels.samples[statistics->level[pixel]];
}

/* Rays per sample of a pixel that has samples. */
static inline double statistics_rays(const struct statistics *statistics, size_t pixel)
{
    return (double)statistics->rays[pixel];
}

/* How many levels the pixel can still go up. */
static inline uint32_t statistics_levels_above(const struct statistics *statistics, size_t pixel)
{
    return statistics->levels.last - statistics->level[pixel];
}

#endif
