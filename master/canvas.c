#include "master/canvas.h"

#include <assert.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

void canvas_init(struct canvas *canvas, uint32_t width, uint32_t height)
{
    size_t bytes = (size_t)width * height * 3 * sizeof(float);
    canvas->width = width;
    canvas->height = height;
    /* A tile's rows are each on another page. Here these are there before the first tile comes, and huge where
     * the system grants that: else each costs the master a page fault while the renderers wait. */
    canvas->rgb = allocate_large(bytes);
    memset(canvas->rgb, 0, bytes);
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

/* Where the tile's k-th pixel lies, and how many from there on stand side by side in tile and
 * picture: a row of a rectangle, else a single one. */
static float *stretch_at(const struct canvas *canvas, const struct tile *tile, uint32_t k,
                         uint32_t *stretch)
{
    uint32_t x, y;
    tile_pixel(tile, k, &x, &y);
    *stretch = is_rectangle(tile) ? tile->w : 1;
    return canvas->rgb + 3 * ((size_t)y * canvas->width + x);
}

static void assert_inside(const struct canvas *canvas, const struct tile *tile)
{
    assert(tile->x <= canvas->width && tile->w <= canvas->width - tile->x);
    assert(tile->y <= canvas->height && tile->h <= canvas->height - tile->y);
    (void)canvas, (void)tile;
}

/* A rectangle: without a division to find each row. */
static void put_rows(struct canvas *canvas, const struct tile *tile, const float *rgb)
{
    float *there = canvas->rgb + 3 * ((size_t)tile->y * canvas->width + tile->x);
    for (uint32_t row = 0; row < tile->h; row++) {
        memcpy(there, rgb, 3 * (size_t)tile->w * sizeof *rgb);
        there += 3 * (size_t)canvas->width;
        rgb += 3 * (size_t)tile->w;
    }
}

void canvas_put(struct canvas *canvas, const struct tile *tile, const float *rgb)
{
    uint32_t pixels = tile_pixels(tile), stretch;
    assert_inside(canvas, tile);
    if (is_rectangle(tile)) {
        put_rows(canvas, tile, rgb);
        return;
    }
    for (uint32_t k = 0; k < pixels; k += stretch) {
        float *there = stretch_at(canvas, tile, k, &stretch);
        memcpy(there, rgb + 3 * (size_t)k, 3 * (size_t)stretch * sizeof *rgb);
    }
}

void canvas_get(const struct canvas *canvas, const struct tile *tile, float *rgb)
{
    uint32_t pixels = tile_pixels(tile), stretch;
    assert_inside(canvas, tile);
    for (uint32_t k = 0; k < pixels; k += stretch) {
        const float *there = stretch_at(canvas, tile, k, &stretch);
        memcpy(rgb + 3 * (size_t)k, there, 3 * (size_t)stretch * sizeof *rgb);
    }
}
