#include "master/bands.h"

#include "common/whole.h"

uint32_t band_count(const struct canvas *canvas)
{
    return divide_up(canvas->height, BAND_ROWS);
}

uint32_t band_begin(const struct canvas *canvas, uint32_t band)
{
    return band < band_count(canvas) ? band * BAND_ROWS : canvas->height;
}

size_t band_first_pixel(const struct canvas *canvas, uint32_t band)
{
    return (size_t)band_begin(canvas, band) * canvas->width;
}
