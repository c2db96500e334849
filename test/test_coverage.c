/* Tests of the coverage: which pixels are finished, in whatever tiles they came. */
#include <string.h>

#include "master/coverage.h"
#include "test/unit.h"

#define WIDTH  53
#define HEIGHT 31

static struct tile rectangle(uint32_t x, uint32_t y, uint32_t w, uint32_t h)
{
    return (struct tile){.x = x, .y = y, .w = w, .h = h, .step = 1};
}

/* Checks every pixel: exactly those of the tiles that were added must be finished. */
static void check_pixels(const struct coverage *coverage, bool expected[HEIGHT][WIDTH])
{
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            struct tile pixel = rectangle(x, y, 1, 1);
            assert_int_equal(coverage_count(coverage, &pixel), expected[y][x]);
            assert_int_equal(coverage_has(coverage, x, y), expected[y][x]);
        }
}

static void add(struct coverage *coverage, const struct tile *tile, bool expected[HEIGHT][WIDTH])
{
    coverage_add(coverage, tile);
    for (uint32_t i = tile->phase; i < tile->w * tile->h; i += tile->step)
        expected[tile->y + i / tile->w][tile->x + i % tile->w] = true;
    check_pixels(coverage, expected);
}

static void test_tiles_of_all_kinds(void **state)
{
    static bool expected[HEIGHT][WIDTH];
    struct coverage coverage;
    coverage_init(&coverage, WIDTH, HEIGHT);
    check_pixels(&coverage, expected);
    const struct tile tiles[] = {
        rectangle(0, 0, 8, 8),
        rectangle(WIDTH - 3, HEIGHT - 2, 3, 2),
        rectangle(4, 4, 8, 8),
        {.x = 0, .y = 20, .w = WIDTH, .h = 3, .phase = 2, .step = 5},
        {.x = 10, .y = 12, .w = 7, .h = 5, .phase = 34, .step = 100},
    };
    for (size_t i = 0; i < sizeof tiles / sizeof *tiles; i++)
        add(&coverage, &tiles[i], expected);
    coverage_free(&coverage);
}

/* Tiles are covered by tiles of another size if no pixel is missing. */
static void test_other_cuts(void **state)
{
    struct coverage coverage;
    coverage_init(&coverage, 64, 64);
    for (uint32_t y = 0; y < 64; y += 8)
        for (uint32_t x = 0; x < 64; x += 8) {
            struct tile small = rectangle(x, y, 8, 8), whole = rectangle(0, 0, 64, 64);
            struct tile large = rectangle(x / 32 * 32, y / 32 * 32, 32, 32);
            assert_true(coverage_count(&coverage, &whole) < tile_pixels(&whole));
            coverage_add(&coverage, &small);
            assert_int_equal(coverage_count(&coverage, &large) == tile_pixels(&large),
                             x % 32 == 24 && y % 32 == 24);
        }
    struct tile whole = rectangle(0, 0, 64, 64);
    assert_int_equal(coverage_count(&coverage, &whole), tile_pixels(&whole));
    coverage_free(&coverage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tiles_of_all_kinds),
        cmocka_unit_test(test_other_cuts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
