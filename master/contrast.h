/* What pixels' colours differ from their neighbours' by, row by row. */
#ifndef FARM_MASTER_CONTRAST_H
#define FARM_MASTER_CONTRAST_H

#include <stdint.h>

#include "master/canvas.h"

/* A row of a canvas, a plane for each component: pixel x at [x + 1]. What lies outside of the picture, as
 * the first and the last one do, is NaN. */
struct color_row {
    float *plane[3]; /* width + 2 floats each; the caller's */
};

/* Takes row y of the canvas, which may lie outside. */
void color_row_take(const struct color_row *row, const struct canvas *canvas, int64_t y);

/*
 * Of each pixel of the row in the middle to its at most 8 neighbours, squares of differences between colours
 * as means of the components: largest and across are C^2 and P of master/adaptive.h, width numbers each.
 * Neighbours that are not finite do not count, nor do any beside a pixel that is not; 0 where none does.
 */
void contrast_of_row(const struct color_row rows[3], uint32_t width, double *largest,
                     double *across);

#endif
