/* Contrast of each pixel to its 8 neighbours, row by row. */
#ifndef FARM_MASTER_CONTRAST_H
#define FARM_MASTER_CONTRAST_H

#include <stdint.h>

#include "master/canvas.h"

/* A row of a canvas, with a plane for each component: pixel x is at [x + 1]. Colours that are not finite, and what lies
 * outside the picture, such as the first and the last double, are NaN. */
struct color_row {
    double *plane[3]; /* width + 2 doubles each; the caller's */
};

/* Copies row y of the canvas, which may lie outside the picture. */
void color_row_take(const struct color_row *row, const struct canvas *canvas, int64_t y);

/* The result for each pixel of a row; arrays of the row's width, the caller's. */
struct contrasts {
    double *largest, *edge_variance; /* C^2 and P of master/adaptive.h */
    /* The largest variance that single samples can have whose colours lie between those of the neighbours, whatever the
     * pixel's own colour is. */
    double *range_variance;
};

/*
 * Compares each pixel of the middle row with its neighbours, 8 at most. Results are squared differences of colours,
 * means over the components. Neighbours that are not finite are ignored, and so are all neighbours of a pixel that is
 * not finite itself; where none is left, results are 0.
 */
void contrast_of_row(const struct color_row rows[3], uint32_t width,
                     const struct contrasts *contrasts);

#endif
