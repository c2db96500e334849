/*
 * Bands of a picture. Pixels are looked at in bands of so many rows, each by one thread: sums over a picture are sums
 * of those of bands, in their order, and so the same for any number of threads.
 */
#ifndef FARM_MASTER_BANDS_H
#define FARM_MASTER_BANDS_H

#include <stddef.h>
#include <stdint.h>

#include "master/canvas.h"

#define BAND_ROWS 32u

uint32_t band_count(const struct canvas *canvas);

/* Its first row; that of the band behind it is where it ends. */
uint32_t band_begin(const struct canvas *canvas, uint32_t band);

/* The first pixel of that row. */
size_t band_first_pixel(const struct canvas *canvas, uint32_t band);

#endif
