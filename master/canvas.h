/* The picture while it is assembled: linear RGB floats, rows from the top. */
#ifndef FARM_MASTER_CANVAS_H
#define FARM_MASTER_CANVAS_H

#include <stddef.h>
#include <stdint.h>

#include "common/tile.h"

struct canvas {
    uint32_t width, height; /* pixels */
    float *rgb; /* 3 for each of canvas_pixels(); those that are not rendered yet are 0 */
};

static inline size_t canvas_pixels(const struct canvas *canvas)
{
    return (size_t)canvas->width * canvas->height;
}

/* The pixel's three floats. */
static inline float *canvas_at(const struct canvas *canvas, uint32_t x, uint32_t y)
{
    return canvas->rgb + 3 * ((size_t)y * canvas->width + x);
}

/* A picture with all pixels 0, whose pages are mapped: storing a tile causes no page faults. */
void canvas_init(struct canvas *canvas, uint32_t width, uint32_t height);
void canvas_free(struct canvas *canvas);

/* The most bytes that are asked for before they are stored: those of a tile of 16 x 16 pixels fit, and the first-level
 * cache has room for several times as much, unless rows are a multiple of 4096 bytes long. */
#define CANVAS_AHEAD 4096u

/* The tile, which is valid, is about to be stored: asks for the memory of its first rows. */
void canvas_expect(const struct canvas *canvas, const struct tile *tile);

/* Copies a tile's pixels (3 floats each, in the tile's order) into the picture; the tile is valid. */
void canvas_put(struct canvas *canvas, const struct tile *tile, const float *rgb);

/* Copies a tile's pixels out of the picture. */
void canvas_get(const struct canvas *canvas, const struct tile *tile, float *rgb);

#endif
