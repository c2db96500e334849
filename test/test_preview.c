/* Tests of the preview, which has the colours of the pre-pass. */
#include <math.h>
#include <stdlib.h>

#include "master/preview.h"
#include "test/unit.h"

enum { WIDTH = 41, HEIGHT = 30, EDGE = 10 };

/* A probe tile of some blocks of a row, as from cost_probe(); the last, narrow column has no probe. */
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

/* The red component of the block that contains this pixel; NaN: its colour is unknown. */
static float red_at(const struct preview *preview, uint32_t x, uint32_t y)
{
    uint32_t block = y / preview->edge * preview->columns + x / preview->edge;
    return preview->rgb[3 * (size_t)block];
}

static void test_nearest_block(void **state)
{
    struct preview preview = {0};
    const float left[] = {1, 1, 1}, right[] = {2, 2, 2, 3, 3, 3};
    struct tile a = probe(0, 1, 0), b = probe(2, 2, 1);
    preview_put(&preview, WIDTH, HEIGHT, &a, left);
    preview_put(&preview, WIDTH, HEIGHT, &b, right);
    assert_true(red_at(&preview, 5, 5) == 1 && red_at(&preview, 25, 15) == 2);
    assert_true(isnan(red_at(&preview, 15, 5)));
    preview_complete(&preview);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            assert_true(red_at(&preview, x, y) > 0);
    assert_true(red_at(&preview, 5, 5) == 1 && red_at(&preview, 25, 15) == 2);
    assert_true(red_at(&preview, 39, 19) == 3 && red_at(&preview, 40, 29) == 3);
    assert_true(red_at(&preview, 5, 25) == 1 && red_at(&preview, 20, 29) == 2);
    preview_free(&preview);
}

/* From one known block to all sides, and not from the end of a row to the next one. */
static void test_all_sides(void **state)
{
    enum { COLUMNS = 4, ROWS = 3 };
    for (uint32_t known = 0; known < COLUMNS * ROWS; known++)
        for (uint32_t other = 0; other < COLUMNS * ROWS; other++) {
            struct preview preview = {0};
            const uint32_t at[2][2] = {{known % COLUMNS, known / COLUMNS},
                                       {other % COLUMNS, other / COLUMNS}};
            for (int i = 0; i < 2; i++) {
                struct tile tile = probe(at[i][0], 1, at[i][1]);
                float red = (float)(1 + i);
                preview_put(&preview, COLUMNS * EDGE, ROWS * EDGE, &tile, (float[]){red, 0, 0});
            }
            preview_complete(&preview);
            for (int block = 0; block < COLUMNS * ROWS; block++) {
                int away[2];
                for (int i = 0; i < 2; i++)
                    away[i] =
                        abs(block % COLUMNS - (int)at[i][0]) + abs(block / COLUMNS - (int)at[i][1]);
                float red = preview.rgb[3 * block];
                assert_true((red == 1 && away[0] <= away[1]) || (red == 2 && away[1] <= away[0]));
            }
            preview_free(&preview);
        }
}

/* Probes that come later replace the colours that were filled in for them. */
static void test_completed_before_all_are_back(void **state)
{
    struct preview preview = {0};
    const float left[] = {1, 1, 1}, right[] = {2, 2, 2, 3, 3, 3};
    struct tile a = probe(0, 1, 0), b = probe(2, 2, 1);
    preview_put(&preview, WIDTH, HEIGHT, &a, left);
    preview_complete(&preview);
    assert_true(red_at(&preview, 25, 15) == 1);
    preview_put(&preview, WIDTH, HEIGHT, &b, right);
    assert_true(red_at(&preview, 25, 15) == 2 && red_at(&preview, 5, 25) == 1);
    preview_free(&preview);
}

/* Between the middles of four blocks the colour changes evenly, beyond the outermost ones no more. */
static void test_between_middles(void **state)
{
    struct preview preview = {0};
    const float upper[] = {0, 0, 0, 1, 1, 1}, lower[] = {2, 2, 2, 3, 3, 3};
    struct tile a = probe(0, 2, 0), b = probe(0, 2, 1);
    preview_put(&preview, 2 * EDGE, 2 * EDGE, &a, upper);
    float color[3];
    preview_put(&preview, 2 * EDGE, 2 * EDGE, &b, lower);
    for (uint32_t y = 0; y < 2 * EDGE; y++)
        for (uint32_t x = 0; x < 2 * EDGE; x++) {
            float u = fminf(fmaxf((float)x - 5, 0), EDGE) / EDGE;
            float v = fminf(fmaxf((float)y - 5, 0), EDGE) / EDGE;
            preview_between(&preview, x, y, color);
            for (int c = 0; c < 3; c++)
                assert_true(fabsf(color[c] - (u + 2 * v)) < 1e-6F);
        }
    preview_free(&preview);
}

/* Without any probe no colour is known. */
static void test_nothing_known(void **state)
{
    struct preview preview = {0};
    preview_complete(&preview);
    float color[3] = {1, 2, 3};
    preview_between(&preview, 40, 29, color);
    assert_true(color[0] == 1 && color[1] == 2 && color[2] == 3);
    preview_free(&preview);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nearest_block),
        cmocka_unit_test(test_all_sides),
        cmocka_unit_test(test_completed_before_all_are_back),
        cmocka_unit_test(test_between_middles),
        cmocka_unit_test(test_nothing_known),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
