/* What stands in for tiles that are not finished. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "master/preview.h"

enum { WIDTH = 41, HEIGHT = 30, EDGE = 10 };

/* The middles of some blocks of a row, as cost_probe() has it: the last, narrow column has none. */
static struct tile probe(uint32_t column, uint32_t blocks, uint32_t row)
{
    return (struct tile){.x = column * EDGE,
                         .y = row * EDGE + EDGE / 2,
                         .w = blocks * EDGE,
                         .h = 1,
                         .phase = EDGE / 2,
                         .step = EDGE,
                         .pass = TILE_PROBE};
}

static float red_at(const struct canvas *canvas, uint32_t x, uint32_t y)
{
    return canvas->rgb[3 * ((size_t)y * canvas->width + x)];
}

static void test_nearest_block(void **state)
{
    (void)state;
    struct preview preview = {0};
    struct canvas canvas;
    const float left[] = {1, 1, 1}, right[] = {2, 2, 2, 3, 3, 3};
    const struct tile all = {.w = WIDTH, .h = HEIGHT, .step = 1};
    struct tile a = probe(0, 1, 0), b = probe(2, 2, 1);
    canvas_init(&canvas, WIDTH, HEIGHT);
    preview_put(&preview, WIDTH, HEIGHT, &a, left);
    preview_put(&preview, WIDTH, HEIGHT, &b, right);
    preview_complete(&preview);
    preview_fill(&preview, &canvas, &all, NULL);
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        assert_true(canvas.rgb[3 * i] > 0);
    assert_true(red_at(&canvas, 5, 5) == 1 && red_at(&canvas, 25, 15) == 2);
    assert_true(red_at(&canvas, 39, 19) == 3 && red_at(&canvas, 40, 29) == 3);
    assert_true(red_at(&canvas, 5, 25) == 1 && red_at(&canvas, 20, 29) == 2);
    preview_free(&preview);
    canvas_free(&canvas);
}

/* What an earlier run has left is better than any preview. */
static void test_what_is_there_stays(void **state)
{
    (void)state;
    struct preview preview = {0};
    struct canvas canvas;
    struct coverage there;
    const float gray[] = {1, 1, 1};
    const struct tile all = {.w = WIDTH, .h = HEIGHT, .step = 1};
    const struct tile found = {.x = 7, .y = 3, .w = 2, .h = 5, .step = 1};
    struct tile a = probe(0, 1, 0);
    canvas_init(&canvas, WIDTH, HEIGHT);
    coverage_init(&there, WIDTH, HEIGHT);
    coverage_add(&there, &found);
    preview_put(&preview, WIDTH, HEIGHT, &a, gray);
    preview_complete(&preview);
    preview_fill(&preview, &canvas, &all, &there);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            assert_true(red_at(&canvas, x, y) == !(x >= 7 && x < 9 && y >= 3 && y < 8));
    coverage_free(&there);
    preview_free(&preview);
    canvas_free(&canvas);
}

/* Without any probe the picture stays as it is. */
static void test_nothing_known(void **state)
{
    (void)state;
    struct preview preview = {0};
    struct canvas canvas;
    const struct tile all = {.w = WIDTH, .h = HEIGHT, .step = 1};
    canvas_init(&canvas, WIDTH, HEIGHT);
    preview_complete(&preview);
    preview_fill(&preview, &canvas, &all, NULL);
    assert_true(red_at(&canvas, 40, 29) == 0);
    preview_free(&preview);
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nearest_block),
        cmocka_unit_test(test_what_is_there_stays),
        cmocka_unit_test(test_nothing_known),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
