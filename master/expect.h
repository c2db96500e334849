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

/* What nothing around a pixel has warned of: what its halves tell is so many times what is expected by what is around
 * it. Edges, of which about 5 of the 24 pixels around one are part, hardly ever surprise. */
#define SURPRISE 8

/* Sets the expected squared error of every pixel: finite, as squares of floats are well inside of what doubles
 * hold; and the root of what is expected of it by what is around it alone, whatever its own samples have met. */
void expect_errors(const struct sampled *pixels, struct crew *crew, double *error, float *warned);

#endif
