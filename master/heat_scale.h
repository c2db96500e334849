/* The scale below the heat map: which colour is how much CPU time per pixel. */
#ifndef FARM_MASTER_HEAT_SCALE_H
#define FARM_MASTER_HEAT_SCALE_H

#include <stdint.h>

#include "master/canvas.h"
#include "master/timeline.h"

/* Rows of pixels that the scale takes below a picture of this size; 0: there is no room for it (dots_height()),
 * or the picture is too narrow for two labels. */
uint32_t heat_scale_height(uint32_t width, uint32_t height);

/*
 * Draws the scale from the row `top` down; the canvas has heat_scale_height() rows there. A bar has the colours
 * from black to white; below it stand the least and the largest value, and as many of 1, 2 and 5 times powers of
 * ten as there is room for. Of an empty range (0, 0) only the ground is drawn.
 */
void heat_scale_draw(struct canvas *canvas, uint32_t top, struct heat_range range);

#endif
