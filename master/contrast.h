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

/* Of each pixel of a row, as many as it has; the caller's. */
struct contrasts {
    double *largest, *across; /* C^2 and P of master/adaptive.h */
    /* The most that the variance of a single sample can be that has a colour of neighbours, whatever the pixel's own
     * colour is. */
    double *around;
};

/*
 * Of each pixel of the row in the middle to its at most 8 neighbours, squares of differences between colours
 * as means of the components. Neighbours that are not finite do not count, nor do any beside a pixel that is not; 0
 * where none does.
 */
void contrast_of_row(const struct color_row rows[3], uint32_t width,
                     const struct contrasts *contrasts);

#endif
