/* The legend below the picture of ranks: which colour is which rank. */
#ifndef FARM_MASTER_LEGEND_H
#define FARM_MASTER_LEGEND_H

#include <stdint.h>

#include "master/canvas.h"

struct legend_entry {
    uint32_t number;
    float rgb[3];
};

/* Rows of pixels that the legend takes below a picture of this size. 0: there is no room for it (dots_height()),
 * or the picture is narrower than one entry. */
uint32_t legend_height(uint32_t width, uint32_t height, const struct legend_entry *entries,
                       uint32_t count);

/* Draws the legend from the row `top` down; the canvas has legend_height() rows there. */
void legend_draw(struct canvas *canvas, uint32_t top, const struct legend_entry *entries,
                 uint32_t count);

#endif
