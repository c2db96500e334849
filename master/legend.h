/* The strip below the picture of ranks: which colour is which rank. */
#ifndef FARM_MASTER_LEGEND_H
#define FARM_MASTER_LEGEND_H

#include <stdint.h>

#include "master/canvas.h"

/* An entry of the strip. */
struct legend_entry {
    uint32_t number;
    float rgb[3];
};

/*
 * Rows of pixels that the strip takes below a picture of this size; 0 where it has no room: below a
 * picture that is narrower than one entry or less high than the strip, or has more than half of
 * PICTURE_MAX_PIXELS (with the strip, it still fits into any kind of file).
 */
uint32_t legend_height(uint32_t width, uint32_t height, const struct legend_entry *entries,
                       uint32_t count);

/* Draws the strip from the row `top` down; the canvas has legend_height() rows there. */
void legend_draw(struct canvas *canvas, uint32_t top, const struct legend_entry *entries,
                 uint32_t count);

#endif
