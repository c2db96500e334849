#include "master/legend.h"

#include <assert.h>
#include <stdbool.h>
#include <stdio.h>

#include "common/scene.h"
#include "common/whole.h"

/* The ten digits side by side, each three dots wide and followed by a gap of one dot. */
enum { DIGIT_WIDTH = 4, DIGIT_HEIGHT = 5 };
/* clang-format off */
static const char *const digits[DIGIT_HEIGHT] = {
    "### .#. ### ### #.# ### ### ### ### ### ",
    "#.# ##. ..# ..# #.# #.. #.. ..# #.# #.# ",
    "#.# .#. ### .## ### ### ### ..# ### ### ",
    "#.# .#. #.. ..# ..# ..# #.# ..# #.# ..# ",
    "### ### ### ### ..# ### ### ..# ### ### ",
};
/* clang-format on */

/* An entry, in dots: a square of the rank's colour, as high as a digit; a gap; the number; a gap. */
enum { GAP = 2, SQUARE = DIGIT_HEIGHT, ROW_HEIGHT = DIGIT_HEIGHT + 3 };

/* A dot is two pixels wide and high in a picture of 640 x 480, and more in larger ones. */
#define DOTS_ACROSS 320

/* Grey levels that no rank has; black are pixels that are not rendered. */
static const float paper = 0.15f, ink = 0.95f;

struct layout {
    uint32_t dot;   /* edge of a dot, pixels */
    uint32_t entry; /* width of an entry, dots */
    uint32_t columns, rows;
};

static struct layout lay_out(uint32_t width, const struct legend_entry *entries, uint32_t count)
{
    uint32_t largest = 0, places = 1;
    for (uint32_t i = 0; i < count; i++)
        if (entries[i].number > largest) largest = entries[i].number;
    for (; largest > 9; largest /= 10)
        places++;
    struct layout layout = {.dot = width / DOTS_ACROSS > 1 ? width / DOTS_ACROSS : 1,
                            .entry = SQUARE + GAP + places * DIGIT_WIDTH + GAP};
    uint32_t dots = width / layout.dot;
    layout.columns = dots > GAP ? (dots - GAP) / layout.entry : 0;
    if (layout.columns > 0) layout.rows = divide_up(count, layout.columns);
    return layout;
}

uint32_t legend_height(uint32_t width, uint32_t height, const struct legend_entry *entries,
                       uint32_t count)
{
    struct layout layout = lay_out(width, entries, count);
    uint64_t rows = (uint64_t)layout.rows * ROW_HEIGHT * layout.dot;
    bool room = rows <= height && (uint64_t)width * height <= PICTURE_MAX_PIXELS / 2;
    return room ? (uint32_t)rows : 0;
}

static void put(struct canvas *canvas, uint32_t x, uint32_t y, const float rgb[3])
{
    float *pixel = canvas_at(canvas, x, y);
    for (int c = 0; c < 3; c++)
        pixel[c] = rgb[c];
}

/* Fills a rectangle of w x h dots whose corner is at[0], at[1] dots from that of the legend. */
static void fill(struct canvas *canvas, uint32_t top, uint32_t dot, const uint32_t at[2],
                 uint32_t w, uint32_t h, const float rgb[3])
{
    for (uint32_t y = 0; y < h * dot; y++)
        for (uint32_t x = 0; x < w * dot; x++)
            put(canvas, at[0] * dot + x, top + at[1] * dot + y, rgb);
}

static void put_number(struct canvas *canvas, uint32_t top, uint32_t dot, const uint32_t at[2],
                       uint32_t number)
{
    const float white[3] = {ink, ink, ink};
    char text[11];
    int places = snprintf(text, sizeof text, "%u", number);
    for (int i = 0; i < places; i++) {
        const uint32_t first = (uint32_t)(text[i] - '0') * DIGIT_WIDTH;
        for (uint32_t k = 0; k < DIGIT_WIDTH * DIGIT_HEIGHT; k++) {
            uint32_t x = k % DIGIT_WIDTH, y = k / DIGIT_WIDTH;
            if (digits[y][first + x] != '#') continue;
            fill(canvas, top, dot, (uint32_t[2]){at[0] + (uint32_t)i * DIGIT_WIDTH + x, at[1] + y},
                 1, 1, white);
        }
    }
}

void legend_draw(struct canvas *canvas, uint32_t top, const struct legend_entry *entries,
                 uint32_t count)
{
    const float grey[3] = {paper, paper, paper};
    struct layout layout = lay_out(canvas->width, entries, count);
    assert(layout.columns > 0); /* or there is no legend */
    for (uint32_t y = top; y < canvas->height; y++)
        for (uint32_t x = 0; x < canvas->width; x++)
            put(canvas, x, y, grey);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t at[2] = {GAP + i % layout.columns * layout.entry,
                          GAP + i / layout.columns * ROW_HEIGHT};
        uint32_t number[2] = {at[0] + SQUARE + GAP, at[1]};
        fill(canvas, top, layout.dot, at, SQUARE, SQUARE, entries[i].rgb);
        put_number(canvas, top, layout.dot, number, entries[i].number);
    }
}
