/* Tests of the scale below the heat map. */
#include <stdlib.h>
#include <string.h>

#include "master/dots.h"
#include "master/heat_scale.h"
#include "test/unit.h"

enum {
    WIDTH = 320,
    HEIGHT = 100,
    BAR_LEFT = 2,
    BAR_ROW = HEIGHT + 4,
    TICK_ROW = HEIGHT + 7,
    LABEL_TOP = 9
};

/* A picture of this width whose values are -1, with its scale. */
static struct canvas drawn(uint32_t width, struct heat_range range)
{
    struct canvas canvas;
    canvas_init(&canvas, width, HEIGHT + heat_scale_height(width, HEIGHT));
    for (size_t i = 0; i < 3 * canvas_pixels(&canvas); i++)
        canvas.rgb[i] = -1;
    heat_scale_draw(&canvas, HEIGHT, range);
    return canvas;
}

static bool is_ink(const struct canvas *canvas, uint32_t x, uint32_t y)
{
    return memcmp(canvas_at(canvas, x, y), dots_ink, sizeof dots_ink) == 0;
}

/* Whether the label is what stands there: the same dots as of its text alone. */
static void assert_label(const struct canvas *canvas, uint32_t left, const char *text)
{
    struct canvas alone;
    canvas_init(&alone, WIDTH, GLYPH_HEIGHT);
    dots_text(&(struct dots){&alone, 0, 1}, (uint32_t[2]){left, 0}, text);
    for (uint32_t y = 0; y < GLYPH_HEIGHT; y++)
        for (uint32_t x = left; x < left + dots_text_width(text); x++)
            assert_int_equal(is_ink(canvas, x, HEIGHT + LABEL_TOP + y), is_ink(&alone, x, y));
    canvas_free(&alone);
}

static void test_picture_is_unchanged(void **state)
{
    static const uint32_t widths[] = {54, 319, 320, 640, 1921};
    for (size_t i = 0; i < sizeof widths / sizeof *widths; i++) {
        struct canvas canvas = drawn(widths[i], (struct heat_range){1e-6, 1e-3});
        uint32_t untouched = 0;
        for (size_t k = 0; k < canvas_pixels(&canvas); k++)
            untouched += canvas.rgb[3 * k] < 0;
        assert_true(canvas.height > HEIGHT);
        assert_int_equal(untouched, widths[i] * HEIGHT);
        canvas_free(&canvas);
    }
}

static void test_bar_is_from_black_to_white(void **state)
{
    struct canvas canvas = drawn(WIDTH, (struct heat_range){1e-6, 1e-3});
    for (uint32_t x = 0; x < WIDTH - 2 * BAR_LEFT; x++) {
        float rgb[3];
        timeline_heat_color(x / (WIDTH - 2 * BAR_LEFT - 1.0), rgb);
        assert_memory_equal(canvas_at(&canvas, BAR_LEFT + x, BAR_ROW), rgb, sizeof rgb);
    }
    canvas_free(&canvas);
}

static uint32_t ticks_of(const struct canvas *canvas)
{
    uint32_t ticks = 0;
    for (uint32_t x = 0; x < canvas->width; x++)
        ticks += is_ink(canvas, x, TICK_ROW);
    return ticks;
}

/* 1 us to 1 ms over 316 dots: 105 for each power of ten. */
static void test_ticks_and_labels(void **state)
{
    struct canvas canvas = drawn(WIDTH, (struct heat_range){1e-6, 1e-3});
    static const uint32_t ticks[] = {2, 34, 75, 107, 139, 180, 212, 244, 285, 317};
    assert_int_equal(ticks_of(&canvas), sizeof ticks / sizeof *ticks);
    for (size_t i = 0; i < sizeof ticks / sizeof *ticks; i++)
        assert_true(is_ink(&canvas, ticks[i], TICK_ROW));
    assert_label(&canvas, BAR_LEFT, "1us");
    assert_label(&canvas, 107 - (dots_text_width("10us") - 1) / 2, "10us");
    assert_label(&canvas, WIDTH - BAR_LEFT + 1 - dots_text_width("1ms"), "1ms");
    canvas_free(&canvas);
}

/* 20 ms to 20 s: neither end is a power of ten, and some labels are of whole seconds. */
static void test_ticks_of_seconds(void **state)
{
    struct canvas canvas = drawn(WIDTH, (struct heat_range){0.02, 20});
    static const uint32_t ticks[] = {2, 44, 75, 107, 149, 180, 212, 254, 285, 317};
    assert_int_equal(ticks_of(&canvas), sizeof ticks / sizeof *ticks);
    for (size_t i = 0; i < sizeof ticks / sizeof *ticks; i++)
        assert_true(is_ink(&canvas, ticks[i], TICK_ROW));
    assert_label(&canvas, ticks[1] - (dots_text_width("50ms") - 1) / 2, "50ms");
    assert_label(&canvas, ticks[8] - (dots_text_width("10s") - 1) / 2, "10s");
    canvas_free(&canvas);
}

static void test_digits_and_units(void **state)
{
    static const struct {
        double lowest;
        const char *text;
    } cases[] = {{3e-15, "3e-06ns"},  {3.14e-10, "0.31ns"}, {9.949e-9, "9.9ns"}, {9.951e-9, "10ns"},
                 {9.994e-7, "999ns"}, {9.996e-7, "1us"},    {0.9995, "1s"},      {0.00047, "470us"},
                 {0.25, "250ms"},     {86400, "86400s"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct canvas canvas =
            drawn(WIDTH, (struct heat_range){cases[i].lowest, 1e3 * cases[i].lowest});
        assert_label(&canvas, BAR_LEFT, cases[i].text);
        canvas_free(&canvas);
    }
}

/* Of the narrowest scale only the ends are labelled, of a wider one as many more as there is room for. */
static void test_narrow(void **state)
{
    struct canvas canvas = drawn(54, (struct heat_range){1e-6, 1e-3});
    assert_label(&canvas, BAR_LEFT, "1us");
    assert_label(&canvas, 54 - BAR_LEFT + 1 - dots_text_width("1ms"), "1ms");
    assert_int_equal(ticks_of(&canvas), 2);
    canvas_free(&canvas);
    canvas = drawn(80, (struct heat_range){1e-6, 1e-3});
    assert_label(&canvas, 80 - BAR_LEFT + 1 - dots_text_width("1ms"), "1ms");
    assert_int_equal(ticks_of(&canvas), 3);
    canvas_free(&canvas);
}

/* However long a label is, and of a range that is none, nothing is drawn elsewhere. */
static void test_extremes(void **state)
{
    struct canvas canvas = drawn(54, (struct heat_range){1e290, 1e293});
    canvas_free(&canvas);
    canvas = drawn(WIDTH, (struct heat_range){0, 0});
    for (uint32_t x = 0; x < WIDTH; x++)
        for (uint32_t y = HEIGHT; y < canvas.height; y++)
            assert_false(is_ink(&canvas, x, y));
    canvas_free(&canvas);
}

static void test_room(void **state)
{
    assert_int_equal(heat_scale_height(53, 1000), 0);
    assert_int_equal(heat_scale_height(54, 1000), 15);
    assert_int_equal(heat_scale_height(54, 14), 0);
    assert_int_equal(heat_scale_height(640, 480), 30);
    assert_int_equal(heat_scale_height(65535, 4096), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_picture_is_unchanged),
        cmocka_unit_test(test_bar_is_from_black_to_white),
        cmocka_unit_test(test_ticks_and_labels),
        cmocka_unit_test(test_ticks_of_seconds),
        cmocka_unit_test(test_digits_and_units),
        cmocka_unit_test(test_narrow),
        cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
