#include "master/canvas.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

void canvas_init(struct canvas *canvas, uint32_t width, uint32_t height)
{
    canvas->width = width;
    canvas->height = height;
    canvas->rgb = allocate_zeroed((size_t)width * height, 3 * sizeof(float));
}

void canvas_free(struct canvas *canvas)
{
    free(canvas->rgb);
    *canvas = (struct canvas){0};
}

static float *canvas_pixel(struct canvas *canvas, uint32_t x, uint32_t y)
{
    return canvas->rgb + 3 * ((size_t)y * canvas->width + x);
}

static void put_rows(struct canvas *canvas, const struct tile *tile, const float *rgb)
{
    size_t row = (size_t)tile->w * 3;
    for (uint32_t y = 0; y < tile->h; y++)
        memcpy(canvas_pixel(canvas, tile->x, tile->y + y), rgb + y * row, row * sizeof *rgb);
}

static void put_pixels(struct canvas *canvas, const struct tile *tile, const float *rgb)
{
    uint32_t pixels = tile_pixels(tile);
    for (uint32_t k = 0; k < pixels; k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        memcpy(canvas_pixel(canvas, x, y), rgb + 3 * (size_t)k, 3 * sizeof *rgb);
    }
}

void canvas_put(struct canvas *canvas, const struct tile *tile, const float *rgb)
{
    assert(tile->x <= canvas->width && tile->w <= canvas->width - tile->x);
    assert(tile->y <= canvas->height && tile->h <= canvas->height - tile->y);
    if (tile->step == 1 && tile->phase == 0)
        put_rows(canvas, tile, rgb);
    else
        put_pixels(canvas, tile, rgb);
}
