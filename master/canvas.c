#include "master/canvas.h"

#include <assert.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/prefetch.h"
#include "common/whole.h"

void canvas_init(struct canvas *canvas, uint32_t width, uint32_t height)
{
    canvas->width = width;
    canvas->height = height;
    /* Each row of a tile is on another page. The pages are mapped here, before the first tile comes, and are
     * huge pages where the system grants them: otherwise each costs the master a page fault while the renderers
     * wait. */
    canvas->rgb = allocate_prefaulted((size_t)width * height, 3 * sizeof *canvas->rgb);
}

void canvas_free(struct canvas *canvas)
{
    free(canvas->rgb);
    *canvas = (struct canvas){0};
}

static bool is_rectangle(const struct tile *tile)
{
    return tile->step == 1 && tile->phase == 0;
}

/* Where the tile's k-th pixel lies. */
static float *pixel_at(const struct canvas *canvas, const struct tile *tile, uint32_t k)
{
    uint32_t x, y;
    tile_pixel(tile, k, &x, &y);
    return canvas_at(canvas, x, y);
}

static void assert_inside(const struct canvas *canvas, const struct tile *tile)
{
    assert(tile->x <= canvas->width && tile->w <= canvas->width - tile->x);
    assert(tile->y <= canvas->height && tile->h <= canvas->height - tile->y);
    (void)canvas, (void)tile;
}

static size_t row_bytes(const struct tile *tile)
{
    return 3 * (size_t)tile->w * sizeof(float);
}

/* The number of rows that are asked for before they are stored; 0: rows are so long that the hardware prefetcher does
 * it. */
static uint32_t rows_ahead(const struct tile *tile)
{
    return (uint32_t)(CANVAS_AHEAD / row_bytes(tile));
}

static void expect_row(const struct canvas *canvas, const struct tile *tile, uint32_t row)
{
    if (row < tile->h) prefetch_block(canvas_at(canvas, tile->x, tile->y + row), row_bytes(tile));
}

void canvas_expect(const struct canvas *canvas, const struct tile *tile)
{
    uint32_t rows = is_rectangle(tile) ? smaller(rows_ahead(tile), tile->h) : 0;
    for (uint32_t row = 0; row < rows; row++)
        expect_row(canvas, tile, row);
}

/* Copies a rectangle, without a division to find each row. */
static void put_rows(struct canvas *canvas, const struct tile *tile, const float *rgb)
{
    float *there = canvas_at(canvas, tile->x, tile->y);
    uint32_t ahead = rows_ahead(tile);
    for (uint32_t row = 0; row < tile->h; row++) {
        if (ahead > 0) expect_row(canvas, tile, row + ahead);
        memcpy(there, rgb, row_bytes(tile));
        there += 3 * (size_t)canvas->width;
        rgb += 3 * (size_t)tile->w;
    }
}

void canvas_put(struct canvas *canvas, const struct tile *tile, const float *rgb)
{
    uint32_t pixels = tile_pixels(tile);
    assert_inside(canvas, tile);
    if (is_rectangle(tile)) {
        put_rows(canvas, tile, rgb);
        return;
    }
    for (uint32_t k = 0; k < pixels; k++)
        memcpy(pixel_at(canvas, tile, k), rgb + 3 * (size_t)k, 3 * sizeof *rgb);
}

void canvas_get(const struct canvas *canvas, const struct tile *tile, float *rgb)
{
    /* Pixels that are contiguous, in the tile and in the picture. */
    uint32_t stretch = is_rectangle(tile) ? tile->w : 1, pixels = tile_pixels(tile);
    assert_inside(canvas, tile);
    for (uint32_t k = 0; k < pixels; k += stretch)
        memcpy(rgb + 3 * (size_t)k, pixel_at(canvas, tile, k), 3 * (size_t)stretch * sizeof *rgb);
}
