#include "master/heat_scale.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>

#include "master/dots.h"

/* In dots: the bar, under it the ticks, under these the labels. */
enum {
    GAP = 2,
    BAR_HEIGHT = 5,
    TICK_TOP = GAP + BAR_HEIGHT,
    LABEL_TOP = TICK_TOP + 2,
    HEIGHT = LABEL_TOP + GLYPH_HEIGHT + 1
};

/* Room for a label at each end, of which the longest is like "999ms" or "86400s". */
#define LABEL_MOST  24
#define WIDTH_LEAST (2 * (LABEL_MOST + GAP) + GAP)

uint32_t heat_scale_height(uint32_t width, uint32_t height)
{
    return width / dots_edge(width) >= WIDTH_LEAST ? dots_height(width, height, HEIGHT) : 0;
}

struct label {
    char text[24];
    uint32_t left, end; /* dots */
};

/* A time with two digits or, where it has three before the point, these. */
static void write_time(double seconds, struct label *label)
{
    static const char *const units[] = {"ns", "us", "ms", "s"};
    double value = seconds * 1e9;
    size_t unit = 0;
    for (; unit + 1 < sizeof units / sizeof *units && value >= 999.5; unit++)
        value /= 1000;
    snprintf(label->text, sizeof label->text, value < 9.95 ? "%.2g%s" : "%.0f%s", value,
             units[unit]);
}

struct scale {
    struct dots dots;
    struct heat_range range;
    uint32_t bar; /* width of the bar, dots */
};

/* Where on the bar this time is, dots from its left end. */
static uint32_t place_of(const struct scale *scale, double seconds)
{
    const struct heat_range *range = &scale->range;
    double share = log(seconds / range->lowest) / log(range->highest / range->lowest);
    return (uint32_t)lround(share * (scale->bar - 1));
}

/* The label of a time, in the middle below its place, but not beyond the ends of the bar. */
static struct label label_of(const struct scale *scale, double seconds)
{
    struct label label = {.left = 0};
    write_time(seconds, &label);
    uint32_t width = dots_text_width(label.text) - 1; /* without the gap behind it */
    uint32_t middle = place_of(scale, seconds);
    uint32_t left = middle > width / 2 ? middle - width / 2 : 0;
    if (left + width > scale->bar) left = scale->bar - width;
    label.left = GAP + left;
    label.end = label.left + width;
    return label;
}

static void draw_label(const struct scale *scale, double seconds, const struct label *label)
{
    uint32_t tick[2] = {GAP + place_of(scale, seconds), TICK_TOP};
    dots_fill(&scale->dots, tick, 1, 1, dots_ink);
    dots_text(&scale->dots, (uint32_t[2]){label->left, LABEL_TOP}, label->text);
}

static void draw_bar(const struct scale *scale)
{
    for (uint32_t x = 0; x < scale->bar; x++) {
        float rgb[3];
        timeline_heat_color(x / (scale->bar - 1.0), rgb);
        dots_fill(&scale->dots, (uint32_t[2]){GAP + x, GAP}, 1, BAR_HEIGHT, rgb);
    }
}

/* Labels of 1, 2 and 5 times powers of ten between those of the ends, from left to right, where there is room. */
static void draw_round_labels(const struct scale *scale, uint32_t from, uint32_t to)
{
    static const double steps[] = {1, 2, 5};
    int decade = (int)floor(log10(scale->range.lowest)), last = (int)log10(scale->range.highest);
    for (int i = 0; i < 3 * (last - decade + 1); i++) {
        int power = decade + i / 3;
        double seconds = steps[i % 3] * pow(10, power);
        if (seconds <= scale->range.lowest || seconds >= scale->range.highest) continue;
        struct label label = label_of(scale, seconds);
        if (label.left < from + 2 * GAP || label.end + 2 * GAP > to) continue;
        draw_label(scale, seconds, &label);
        from = label.end;
    }
}

void heat_scale_draw(struct canvas *canvas, uint32_t top, struct heat_range range)
{
    uint32_t edge = dots_edge(canvas->width);
    struct scale scale = {{canvas, top, edge}, range, canvas->width / edge - 2 * GAP};
    dots_clear(&scale.dots);
    if (!(range.lowest > 0)) return;
    struct label lowest = label_of(&scale, range.lowest);
    struct label highest = label_of(&scale, range.highest);
    draw_bar(&scale);
    draw_label(&scale, range.lowest, &lowest);
    draw_label(&scale, range.highest, &highest);
    draw_round_labels(&scale, lowest.end, highest.left);
}
