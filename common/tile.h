/*
 * A tile: the unit of work that is handed out.
 *
 * The pixels of a tile are numbered k = 0 .. tile_pixels() - 1 in the order in which they are sent. With step
 * 1 they are all pixels of the rectangle, row by row from the top. With a larger step they are every step-th
 * pixel of the rectangle in that order, beginning with number `phase`: a renderer's share of a band of rows
 * under the cyclic schedule, or the probes of a row.
 */
#ifndef FARM_COMMON_TILE_H
#define FARM_COMMON_TILE_H

#include <assert.h>
#include <stdint.h>

struct tile {
    uint32_t id;    /* assigned by the queue */
    uint32_t x, y;  /* top left pixel, in the rendered region */
    uint32_t w, h;  /* pixels, at least 1 x 1 */
    uint32_t phase; /* 0 .. w * h - 1 */
    uint32_t step;  /* at least 1 */
    uint32_t pass;  /* pass of adaptive sampling, else 0; or TILE_PROBE */
};

/* The pass of a probe: one sample of each pixel, which measures its cost and is not for the picture. */
#define TILE_PROBE UINT32_MAX

_Static_assert(sizeof(struct tile) == 32, "struct tile goes over the wire as it is");

/* The largest tile, in pixels of its rectangle; bounds the sizes of messages and buffers. */
#define TILE_MAX_PIXELS (1u << 20)

/* How many pixels the tile has. w * h and step must be TILE_MAX_PIXELS at most: larger ones may overflow. */
static inline uint32_t tile_pixels(const struct tile *tile)
{
    assert(tile->w >= 1 && tile->step >= 1);
    return (tile->w * tile->h - tile->phase + tile->step - 1) / tile->step;
}

/* Position of the tile's k-th pixel in the rendered region. */
static inline void tile_pixel(const struct tile *tile, uint32_t k, uint32_t *x, uint32_t *y)
{
    uint32_t i = tile->phase + k * tile->step;
    *x = tile->x + i % tile->w;
    *y = tile->y + i / tile->w;
}

#endif
