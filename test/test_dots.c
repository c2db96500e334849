/* Tests of the dots that legends are drawn in. */
#include <stdbool.h>
#include <string.h>

#include "master/dots.h"
#include "test/unit.h"

/* Of the canvas; with one more row of memory below it, and a colour that nothing is drawn in. */
enum { WIDTH = 20, HEIGHT = 6 };

static const float untouched = -1;

static struct canvas blank(void)
{
    struct canvas canvas;
    canvas_init(&canvas, WIDTH, HEIGHT + 1);
    for (size_t i = 0; i < 3 * canvas_pixels(&canvas); i++)
        canvas.rgb[i] = untouched;
    canvas.height = HEIGHT;
    return canvas;
}

static bool is_touched(const struct canvas *canvas, uint32_t x, uint32_t y)
{
    return canvas->rgb[3 * ((size_t)y * WIDTH + x)] != untouched;
}

/* What lies to the right of the canvas or below it is drawn nowhere, also not at the start of the next row. */
static void test_outside(void **state)
{
    struct canvas canvas = blank();
    const struct dots dots = {&canvas, 0, 1};
    dots_fill(&dots, (uint32_t[2]){WIDTH - 2, HEIGHT - 2}, 5, 5, dots_ink);
    dots_fill(&dots, (uint32_t[2]){WIDTH, 0}, 1, HEIGHT, dots_ink);
    dots_fill(&dots, (uint32_t[2]){0, HEIGHT}, WIDTH, 1, dots_ink);
    for (uint32_t y = 0; y <= HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            assert_int_equal(is_touched(&canvas, x, y),
                             x >= WIDTH - 2 && y >= HEIGHT - 2 && y < HEIGHT);
    canvas_free(&canvas);
}

/* In wide pictures a dot is several pixels wide and high: what is drawn begins and ends with a dot. */
static void test_large_dots(void **state)
{
    struct canvas canvas = blank();
    const struct dots dots = {&canvas, 1, 2};
    dots_fill(&dots, (uint32_t[2]){3, 1}, 4, 1, dots_ink);
    for (uint32_t y = 0; y <= HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            assert_int_equal(is_touched(&canvas, x, y), x >= 6 && x < 14 && y >= 3 && y < 5);
    canvas_free(&canvas);
}

/* A column is left free between two characters, and the width of a text counts it. */
static void test_gaps(void **state)
{
    struct canvas canvas = blank();
    dots_text(&(struct dots){&canvas, 0, 1}, (uint32_t[2]){0, 0}, "0m0.");
    for (uint32_t x = 0; x < WIDTH; x++) {
        bool any = false;
        for (uint32_t y = 0; y < HEIGHT; y++)
            any |= is_touched(&canvas, x, y);
        assert_int_equal(any, x != 3 && x != 9 && x != 13 && x < 15);
    }
    assert_int_equal(dots_text_width("0m0."), 16);
    canvas_free(&canvas);
}

/* The ground is told apart from text, and from pixels that are not rendered, which are black. */
static void test_ground(void **state)
{
    struct canvas canvas = blank();
    const struct dots dots = {&canvas, 2, 1};
    dots_clear(&dots);
    for (uint32_t y = 0; y <= HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            assert_int_equal(is_touched(&canvas, x, y), y >= dots.top && y < HEIGHT);
    for (int c = 0; c < 3; c++) {
        float ground = canvas_at(&canvas, 0, dots.top)[c];
        assert_true(ground > 0.1f && ground < dots_ink[c] - 0.5f);
    }
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_outside),
        cmocka_unit_test(test_large_dots),
        cmocka_unit_test(test_gaps),
        cmocka_unit_test(test_ground),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
