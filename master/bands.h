/* Divides a picture into bands of rows, each processed by one thread. Sums over a picture are added up band by
 * band, in their order, and so do not depend on the number of threads. */
#ifndef FARM_MASTER_BANDS_H
#define FARM_MASTER_BANDS_H

#include <stddef.h>
#include <stdint.h>

#include "common/whole.h"
#include "master/canvas.h"

/* So few that a picture of 480 rows still makes 15 bands, for as many threads. So many that what a filter reads beside
 * a band (master/expect.c: two rows above and below) is an eighth of it, and that a square block of it has a thousand
 * pixels, which show how frequent surprises are (expect.c). */
#define BAND_ROWS 32u

/* The last band may have fewer rows. */
static inline uint32_t band_count(const struct canvas *canvas)
{
    return divide_up(canvas->height, BAND_ROWS);
}

/* The first row of a band; the band ends at that of the next one. */
static inline uint32_t band_begin(const struct canvas *canvas, uint32_t band)
{
    return band < band_count(canvas) ? band * BAND_ROWS : canvas->height;
}

/* The first pixel of that row. */
static inline size_t band_first_pixel(const struct canvas *canvas, uint32_t band)
{
    return (size_t)band_begin(canvas, band) * canvas->width;
}

#endif
