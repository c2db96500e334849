#include "master/legend.h"

#include <assert.h>
#include <stdio.h>

#include "common/whole.h"
#include "master/dots.h"

/* An entry, in dots: a square of the rank's colour, as high as a digit; a gap; the number; a gap. */
enum { GAP = 2, SQUARE = GLYPH_HEIGHT, ROW_HEIGHT = GLYPH_HEIGHT + 3 };

struct layout {
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
    struct layout layout = {.entry = SQUARE + GAP + places * DIGIT_WIDTH + GAP};
    uint32_t dots = width / dots_edge(width);
    layout.columns = dots > GAP ? (dots - GAP) / layout.entry : 0;
    if (layout.columns > 0) layout.rows = divide_up(count, layout.columns);
    return layout;
}

uint32_t legend_height(uint32_t width, uint32_t height, const struct legend_entry *entries,
                       uint32_t count)
{
    return dots_height(width, height, lay_out(width, entries, count).rows * ROW_HEIGHT);
}

void legend_draw(struct canvas *canvas, uint32_t top, const struct legend_entry *entries,
                 uint32_t count)
{
    struct dots dots = {canvas, top, dots_edge(canvas->width)};
    struct layout layout = lay_out(canvas->width, entries, count);
    assert(layout.columns > 0); /* or there is no legend */
    dots_clear(&dots);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t at[2] = {GAP + i % layout.columns * layout.entry,
                          GAP + i / layout.columns * ROW_HEIGHT};
        char number[11];
        snprintf(number, sizeof number, "%u", entries[i].number);
        dots_fill(&dots, at, SQUARE, SQUARE, entries[i].rgb);
        dots_text(&dots, (uint32_t[2]){at[0] + SQUARE + GAP, at[1]}, number);
    }
}
