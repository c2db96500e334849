/* Tests of the legend that shows which colour is which rank. */
#include <stdlib.h>
#include <string.h>

#include "master/legend.h"
#include "test/unit.h"

#define ENTRIES 44

/* Entries of different colours, none of which is grey. */
static void make_entries(struct legend_entry entries[ENTRIES], uint32_t first)
{
    for (uint32_t i = 0; i < ENTRIES; i++)
        entries[i] = (struct legend_entry){first + i, {1, (float)i / ENTRIES, 0}};
}

/* A picture whose values are -1, with its legend. */
static struct canvas drawn(uint32_t width, uint32_t height, const struct legend_entry *entries,
                           uint32_t count)
{
    struct canvas canvas;
    canvas_init(&canvas, width, height + legend_height(width, height, entries, count));
    for (size_t i = 0; i < (size_t)3 * width * canvas.height; i++)
        canvas.rgb[i] = -1;
    legend_draw(&canvas, height, entries, count);
    return canvas;
}

static unsigned pixels_of(const struct canvas *canvas, const float rgb[3])
{
    unsigned count = 0;
    for (size_t i = 0; i < (size_t)canvas->width * canvas->height; i++)
        count += memcmp(canvas->rgb + 3 * i, rgb, 3 * sizeof *rgb) == 0;
    return count;
}

/* Every entry has its square, nothing is drawn outside of the legend, and the picture is unchanged. */
static void test_every_entry_is_there(void **state)
{
    static const uint32_t widths[] = {30, 319, 320, 640, 1920};
    struct legend_entry entries[ENTRIES];
    make_entries(entries, 0);
    for (size_t i = 0; i < sizeof widths / sizeof *widths; i++) {
        uint32_t width = widths[i], height = 400, dot = width < 320 ? 1 : width / 320;
        struct canvas canvas = drawn(width, height, entries, ENTRIES);
        const float untouched[3] = {-1, -1, -1};
        assert_true(canvas.height > height);
        assert_int_equal(pixels_of(&canvas, untouched), width * height);
        for (uint32_t k = 0; k < ENTRIES; k++)
            assert_int_equal(pixels_of(&canvas, entries[k].rgb), 25 * dot * dot);
        canvas_free(&canvas);
    }
}

/* The number of dots in a legend with one number. */
static unsigned dots_of(uint32_t number)
{
    const struct legend_entry entry = {number, {1, 0, 0}};
    struct canvas canvas = drawn(100, 8, &entry, 1);
    unsigned dots = 0;
    for (size_t i = 0; i < (size_t)canvas.width * canvas.height; i++)
        dots += canvas.rgb[3 * i + 2] > 0.5f;
    canvas_free(&canvas);
    return dots;
}

static void test_numbers(void **state)
{
    static const unsigned dots[] = {12, 8, 11, 10, 9, 11, 12, 7, 13, 12};
    for (uint32_t digit = 0; digit < 10; digit++)
        assert_int_equal(dots_of(digit), dots[digit]);
    assert_int_equal(dots_of(4294967295u), 9 + 11 + 12 + 9 + 12 + 12 + 7 + 11 + 12 + 11);
}

/* All numbers have room for the longest one, wherever it stands. */
static void test_room_for_the_longest_number(void **state)
{
    struct legend_entry entries[] = {{9, {1, 0, 0}}, {8, {1, 0, 0}}, {7, {1, 0, 0}}};
    uint32_t width = 2 + 3 * (5 + 2 + 4 + 2); /* dots: three entries of a digit beside each other */
    assert_int_equal(legend_height(width, 1000, entries, 3), 8);
    entries[0].number = 10;
    assert_int_equal(legend_height(width, 1000, entries, 3), 2 * 8);
}

static void test_room(void **state)
{
    struct legend_entry entries[ENTRIES];
    make_entries(entries, 0);
    assert_int_equal(legend_height(1, 1000, entries, ENTRIES), 0);
    assert_int_equal(legend_height(18, 1000, entries, ENTRIES), 0);
    assert_int_equal(legend_height(19, 1000, entries, ENTRIES), 44 * 8);
    assert_int_equal(legend_height(19, 44 * 8 - 1, entries, ENTRIES), 0);
    assert_int_equal(legend_height(640, 480, entries, ENTRIES), 48);
    assert_int_equal(legend_height(640, 480, entries, 6), 16);
    assert_int_equal(legend_height(65535, 4096, entries, 6), 0);
    make_entries(entries, 1000);
    assert_int_equal(legend_height(19, 1000, entries, ENTRIES), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_entry_is_there),
        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_room_for_the_longest_number),
        cmocka_unit_test(test_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
