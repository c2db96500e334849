#include "master/dots.h"

#include <assert.h>
#include <stdbool.h>
#include <string.h>

#include "common/scene.h"

struct glyph {
    char character;
    const char *rows[GLYPH_HEIGHT];
};

/* clang-format off */
static const struct glyph glyphs[] = {
    {'0', {"###", "#.#", "#.#", "#.#", "###"}},
    {'1', {".#.", "##.", ".#.", ".#.", "###"}},
    {'2', {"###", "..#", "###", "#..", "###"}},
    {'3', {"###", "..#", ".##", "..#", "###"}},
    {'4', {"#.#", "#.#", "###", "..#", "..#"}},
    {'5', {"###", "#..", "###", "..#", "###"}},
    {'6', {"###", "#..", "###", "#.#", "###"}},
    {'7', {"###", "..#", "..#", "..#", "..#"}},
    {'8', {"###", "#.#", "###", "#.#", "###"}},
    {'9', {"###", "#.#", "###", "..#", "###"}},
    {'.', {".", ".", ".", ".", "#"}},
    {'-', {"...", "...", "###", "...", "..."}},
    {'e', {"...", ".##", "###", "#..", ".##"}},
    {'m', {".....", ".....", "####.", "#.#.#", "#.#.#"}},
    {'n', {"...", "...", "##.", "#.#", "#.#"}},
    {'s', {"...", ".##", "##.", "..#", "##."}},
    {'u', {"...", "...", "#.#", "#.#", ".##"}},
};
/* clang-format on */

/* A dot is two pixels wide and high in a picture of 640 x 480, and more in larger ones. */
#define DOTS_ACROSS 320

/* Grey levels that no rank and no heat has; black are pixels that are not rendered. */
static const float ground[3] = {0.15f, 0.15f, 0.15f};
const float dots_ink[3] = {0.95f, 0.95f, 0.95f};

static const struct glyph *glyph_of(char character)
{
    const struct glyph *glyph = glyphs, *end = glyphs + sizeof glyphs / sizeof *glyphs;
    while (glyph < end && glyph->character != character)
        glyph++;
    assert(glyph < end);
    return glyph;
}

static uint32_t glyph_width(const struct glyph *glyph)
{
    return (uint32_t)strlen(*glyph->rows);
}

uint32_t dots_edge(uint32_t width)
{
    return width / DOTS_ACROSS > 1 ? width / DOTS_ACROSS : 1;
}

uint32_t dots_height(uint32_t width, uint32_t height, uint32_t rows)
{
    uint64_t pixels = (uint64_t)rows * dots_edge(width);
    bool room = pixels <= height && (uint64_t)width * height <= PICTURE_MAX_PIXELS / 2;
    return room ? (uint32_t)pixels : 0;
}

static void put(struct canvas *canvas, uint32_t x, uint32_t y, const float rgb[3])
{
    if (x >= canvas->width || y >= canvas->height) return;
    float *pixel = canvas_at(canvas, x, y);
    for (int c = 0; c < 3; c++)
        pixel[c] = rgb[c];
}

void dots_clear(const struct dots *dots)
{
    for (uint32_t y = dots->top; y < dots->canvas->height; y++)
        for (uint32_t x = 0; x < dots->canvas->width; x++)
            put(dots->canvas, x, y, ground);
}

void dots_fill(const struct dots *dots, const uint32_t at[2], uint32_t w, uint32_t h,
               const float rgb[3])
{
    for (uint32_t y = 0; y < h * dots->edge; y++)
        for (uint32_t x = 0; x < w * dots->edge; x++)
            put(dots->canvas, at[0] * dots->edge + x, dots->top + at[1] * dots->edge + y, rgb);
}

static void draw_glyph(const struct dots *dots, const uint32_t at[2], const struct glyph *glyph)
{
    for (uint32_t y = 0; y < GLYPH_HEIGHT; y++)
        for (uint32_t x = 0; x < glyph_width(glyph); x++)
            if (glyph->rows[y][x] == '#')
                dots_fill(dots, (uint32_t[2]){at[0] + x, at[1] + y}, 1, 1, dots_ink);
}

void dots_text(const struct dots *dots, const uint32_t at[2], const char *text)
{
    uint32_t place[2] = {at[0], at[1]};
    for (; *text; text++) {
        const struct glyph *glyph = glyph_of(*text);
        draw_glyph(dots, place, glyph);
        place[0] += glyph_width(glyph) + 1;
    }
}

uint32_t dots_text_width(const char *text)
{
    uint32_t width = 0;
    for (; *text; text++)
        width += glyph_width(glyph_of(*text)) + 1;
    return width;
}
