/*
 * Legends below pictures are drawn in dots, squares of pixels: rectangles, and text in glyphs of five rows.
 *
 * All positions and lengths are in dots; at[0] and at[1] count from the left edge of the picture and from the
 * top of the legend. What lies outside of the canvas is not drawn.
 */
#ifndef FARM_MASTER_DOTS_H
#define FARM_MASTER_DOTS_H

#include <stdint.h>

#include "master/canvas.h"

enum { GLYPH_HEIGHT = 5, DIGIT_WIDTH = 4 }; /* of a digit with the gap behind it */

struct dots {
    struct canvas *canvas; /* not owned */
    uint32_t top;          /* first row of the legend, pixels */
    uint32_t edge;         /* of a dot, pixels: dots_edge() */
};

/* The edge of a dot in a picture of this width, pixels. */
uint32_t dots_edge(uint32_t width);

/*
 * Rows of pixels that a legend of `rows` dots takes below a picture of this size. 0: there is no room for it,
 * because the picture is less high than the legend, or has more than half of PICTURE_MAX_PIXELS (so that with
 * the legend it fits into any kind of file).
 */
uint32_t dots_height(uint32_t width, uint32_t height, uint32_t rows);

/* The colour of text. */
extern const float dots_ink[3];

/* Fills the canvas from the row `top` down with the ground of a legend. */
void dots_clear(const struct dots *dots);

/* Fills a rectangle, whose upper left corner is at `at`. */
void dots_fill(const struct dots *dots, const uint32_t at[2], uint32_t w, uint32_t h,
               const float rgb[3]);

/* Draws a number as printf() writes it, and the letters of ns, us, ms, s; at is its upper left corner. */
void dots_text(const struct dots *dots, const uint32_t at[2], const char *text);

/* The width of such a text, with the gap behind it. */
uint32_t dots_text_width(const char *text);

#endif
