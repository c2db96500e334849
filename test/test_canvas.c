#include <stdlib.h>

#include "common/message.h"
#include "master/canvas.h"
#include "test/unit.h"

/* A colour that identifies its pixel. */
static void paint(float *rgb, uint32_t x, uint32_t y)
{
    rgb[0] = (float)x;
    rgb[1] = (float)y;
    rgb[2] = 1;
}

static void put(struct canvas *canvas, struct tile tile)
{
    uint32_t pixels = tile_pixels(&tile);
    float *rgb = allocate(pixels, 3 * sizeof *rgb);
    for (uint32_t k = 0; k < pixels; k++) {
        uint32_t x, y;
        tile_pixel(&tile, k, &x, &y);
        paint(rgb + (size_t)3 * k, x, y);
    }
    canvas_put(canvas, &tile, rgb);
    float *again = allocate(pixels, 3 * sizeof *rgb);
    canvas_get(canvas, &tile, again);
    assert_memory_equal(again, rgb, pixels * 3 * sizeof *rgb);
    free(again);
    free(rgb);
}

/* The number of pixels painted so far. Each must have its own colour, and the others 0. */
static unsigned count_painted(const struct canvas *canvas)
{
    unsigned painted = 0;
    for (uint32_t y = 0; y < canvas->height; y++) {
        for (uint32_t x = 0; x < canvas->width; x++) {
            const float *rgb = canvas->rgb + (size_t)3 * (y * canvas->width + x);
            float expected[3] = {0};
            if (rgb[2] > 0) paint(expected, x, y), painted++;
            assert_memory_equal(rgb, expected, sizeof expected);
        }
    }
    return painted;
}

static void test_begins_black(void **state)
{
    struct canvas canvas;
    canvas_init(&canvas, 5, 3);
    assert_int_equal(canvas.width, 5);
    assert_int_equal(canvas.height, 3);
    for (int i = 0; i < 45; i++)
        assert_true(canvas.rgb[i] == 0);
    canvas_free(&canvas);
    assert_null(canvas.rgb);
}

static void test_rectangles(void **state)
{
    struct canvas canvas;
    canvas_init(&canvas, 10, 7);
    put(&canvas, (struct tile){.x = 8, .y = 4, .w = 2, .h = 3, .step = 1});
    assert_int_equal(count_painted(&canvas), 6);
    put(&canvas, (struct tile){.x = 0, .y = 0, .w = 10, .h = 1, .step = 1});
    assert_int_equal(count_painted(&canvas), 16);
    put(&canvas, (struct tile){.x = 3, .y = 2, .w = 1, .h = 1, .step = 1});
    assert_int_equal(count_painted(&canvas), 17);
    canvas_free(&canvas);
}

static void test_cyclic_shares(void **state)
{
    struct canvas canvas;
    canvas_init(&canvas, 10, 7);
    unsigned expected = 0;
    for (uint32_t phase = 0; phase < 3; phase++) {
        struct tile tile = {.x = 1, .y = 2, .w = 9, .h = 5, .step = 3, .phase = phase};
        put(&canvas, tile);
        expected += tile_pixels(&tile);
        assert_int_equal(count_painted(&canvas), expected);
    }
    assert_int_equal(expected, 45);
    canvas_free(&canvas);
}

static void test_late_phase(void **state)
{
    struct canvas canvas;
    canvas_init(&canvas, 10, 7);
    put(&canvas, (struct tile){.w = 10, .h = 7, .step = 1, .phase = 65}); /* the last five */
    assert_int_equal(count_painted(&canvas), 5);
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_begins_black),
        cmocka_unit_test(test_rectangles),
        cmocka_unit_test(test_cyclic_shares),
        cmocka_unit_test(test_late_phase),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
