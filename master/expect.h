/* What the error of each pixel is expected to be: e of the rule in master/adaptive.h. */
#ifndef FARM_MASTER_EXPECT_H
#define FARM_MASTER_EXPECT_H

#include <stdint.h>

#include "common/crew.h"
#include "common/refinement.h"
#include "master/canvas.h"

/* Pixels are looked at in bands of so many rows, each by one thread: sums over a picture are sums of those
 * of bands, in their order, and so the same for any number of threads. */
#define BAND_ROWS 32u

uint32_t band_count(const struct canvas *canvas);
/* Its first row; that of the band behind it is where it ends. */
uint32_t band_begin(const struct canvas *canvas, uint32_t band);

/* Of each level: its samples n, and n^3/2. */
struct levels {
    double samples[LEVEL_MAX + 1], power[LEVEL_MAX + 1];
};
void levels_init(struct levels *levels, const struct view *view);

/* What is known of a picture's pixels, all of which have samples. */
struct sampled {
    const struct canvas *canvas;
    const float *difference; /* 3 per pixel: A - B */
    const float *spread;     /* of each pixel, as struct pixel_floats has it */
    const uint8_t *level;    /* of each pixel */
    const struct levels *levels;
};

/* The squared error of a pixel as its own halves tell it, 3 floats; 0 where they are not finite. */
double own_error(const float *difference);

/* Surprises are counted by blocks, squares as high as a band: how many there are in one, and which one a column
 * is in. */
#define BLOCK_EDGE BAND_ROWS
uint32_t block_count(const struct canvas *canvas);
static inline uint32_t block_of(uint32_t x)
{
    return x / BLOCK_EDGE;
}

/* Of a block, by level: the squared error that a pixel of it has, in the mean, by things that its samples have all
 * missed. */
struct hidden {
    double error[LEVEL_MAX + 1];
};

/* Sets the expected squared error of every pixel: finite, as squares of floats are well inside of what doubles
 * hold; and what is hidden in each block, block_count() of them for each band. */
void expect_errors(const struct sampled *pixels, struct crew *crew, double *error,
                   struct hidden *hidden);

#endif
