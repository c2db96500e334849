/* What the samples of each pixel tell, as they come in: the store of adaptive sampling. */
#ifndef FARM_MASTER_STATISTICS_H
#define FARM_MASTER_STATISTICS_H

#include <stddef.h>
#include <stdint.h>

#include "common/refinement.h"
#include "master/canvas.h"

/* Of each level: its samples n, and n^3/2. */
struct levels {
    double samples[LEVEL_MAX + 1], power[LEVEL_MAX + 1];
    uint32_t last; /* the lowest one that has max_samples */
};
void levels_init(struct levels *levels, const struct view *view);

/* The share of a squared error that is left where a pixel goes from one level to another one. */
static inline double levels_left(const struct levels *levels, uint32_t from, uint32_t to)
{
    return levels->power[from] / levels->power[to];
}

/* The squared error of a pixel as its own halves tell it, 3 floats; 0 where they are not finite. */
double own_error(const float *difference);

/* What is known of a picture's pixels, all of which have samples. */
struct sampled {
    const struct canvas *canvas;
    const float *difference; /* 3 per pixel: A - B */
    const float *spread;     /* of each pixel, as struct pixel_floats has it */
    const uint8_t *level;    /* of each pixel */
    const struct levels *levels;
};

/* What is known of a pixel at a level, above 0. */
struct known {
    float mean[3], difference[3], spread;
    uint8_t level;
};

/* More samples of a pixel, and of those behind it: struct pixel_floats. */
struct new_samples {
    const float *mean, *difference, *spread, *rays;
};

/* Written by the functions below alone. */
struct statistics {
    struct canvas *canvas; /* the means; the caller's */
    struct levels levels;
    uint64_t unsampled; /* pixels without samples */
    float *difference;  /* 3 per pixel: A - B */
    float *spread;      /* of each pixel, as struct pixel_floats has it */
    float *rays;        /* of each pixel, per sample: what it costs */
    uint8_t *level;     /* of each pixel */
};

/* Memory that is kept for each pixel beside the canvas. */
size_t statistics_pixel_bytes(void);

/* No pixel has samples yet. The canvas, of the view's region, must outlive the statistics. Freed by
 * statistics_free(), which leaves the canvas. */
void statistics_init(struct statistics *statistics, const struct view *view, struct canvas *canvas);
void statistics_free(struct statistics *statistics);

/* As they are, also when more have come in; valid as long as they are. */
struct sampled statistics_sampled(const struct statistics *statistics);
struct known statistics_known(const struct statistics *statistics, size_t pixel);

/* The pixel has got the samples that bring it to a level above its own; returns the rays that each of them took, 1 at
 * least. */
double statistics_put(struct statistics *statistics, size_t pixel, uint32_t level,
                      const struct new_samples *more);

static inline double statistics_samples(const struct statistics *statistics, size_t pixel)
{
    return statistics->levels.samples[statistics->level[pixel]];
}

/* Per sample of a pixel that has some. */
static inline double statistics_rays(const struct statistics *statistics, size_t pixel)
{
    return (double)statistics->rays[pixel];
}

/* Levels that the pixel can still go up. */
static inline uint32_t statistics_levels_above(const struct statistics *statistics, size_t pixel)
{
    return statistics->levels.last - statistics->level[pixel];
}

#endif
