/* Tests of lattices of pixels, and of filling pixels that are not rendered. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/fill.h"
#include "test/lattice_of.h"
#include "test/random.h"
#include "test/unit.h"

/* ---- lattices ---- */

/* Every square of 16 x 16 pixels, at any position, contains the same number of pixels of a lattice. */
static void test_lattices_are_even(void **state)
{
    for (uint32_t lattice = 0; lattice <= LATTICE_COARSEST; lattice++)
        for (uint32_t left = 0; left < 16; left++)
            for (uint32_t top = 0; top < 16; top++) {
                uint32_t count = 0;
                for (uint32_t i = 0; i < 256; i++)
                    count += lattice_of(left + i % 16, top + i / 16) >= lattice;
                assert_int_equal(count, 256 >> lattice);
            }
}

static void test_coarsest(void **state)
{
    for (uint32_t y = 0; y < 64; y++)
        for (uint32_t x = 0; x < 64; x++) {
            bool on = x % LATTICE_SPACING == 0 && y % LATTICE_SPACING == 0;
            assert_int_equal(lattice_of(x, y) == LATTICE_COARSEST, on);
        }
}

/* Iterating over rows and pixels yields exactly the pixels of the lattice. */
static void test_walk(void **state)
{
    for (uint32_t lattice = 0; lattice <= LATTICE_COARSEST; lattice++) {
        bool seen[48][48] = {{false}};
        for (uint32_t y = 0; y < 48; y += lattice_row_step(lattice))
            for (uint32_t x = lattice_first(lattice, y); x < 48; x += lattice_step(lattice))
                seen[y][x] = true;
        for (uint32_t y = 0; y < 48; y++)
            for (uint32_t x = 0; x < 48; x++)
                assert_int_equal(seen[y][x], lattice_of(x, y) >= lattice);
    }
}

/* The same for the pixels that do not belong to the next coarser lattice. */
static void test_walk_between(void **state)
{
    for (uint32_t lattice = 0; lattice < LATTICE_COARSEST; lattice++) {
        bool seen[48][48] = {{false}};
        uint32_t row_step = lattice_step(lattice), step = lattice_between_step(lattice);
        for (uint32_t y = lattice_between_first_row(lattice); y < 48; y += row_step)
            for (uint32_t x = lattice_between_first(lattice, y); x < 48; x += step)
                seen[y][x] = true;
        for (uint32_t y = 0; y < 48; y++)
            for (uint32_t x = 0; x < 48; x++)
                assert_int_equal(seen[y][x], lattice_of(x, y) == lattice);
    }
}

/* ---- filling ---- */

enum { SLOPE = 131 };

/* Fills without a preview. */
static void fill_alone(struct canvas *canvas, const uint8_t *known)
{
    struct preview none = {0};
    fill_unknown(canvas, known, &none);
}

static float *color_at(const struct canvas *canvas, uint32_t x, uint32_t y)
{
    return canvas->rgb + 3 * ((size_t)y * canvas->width + x);
}

/* If the pixels of a lattice and some others are known, a linear gradient is restored, except at the borders, where
 * pixels have fewer neighbours. */
static void test_slopes_are_restored(void **state)
{
    const uint32_t width = 83, height = 61, edge = 2 * LATTICE_SPACING;
    for (uint32_t lattice = 0; lattice <= LATTICE_COARSEST; lattice++) {
        struct canvas canvas;
        uint64_t seed = lattice + 1;
        uint8_t *known = allocate_zeroed((size_t)width * height, 1);
        canvas_init(&canvas, width, height);
        for (uint32_t i = 0; i < width * height; i++) {
            uint32_t x = i % width, y = i / width;
            known[i] = lattice_of(x, y) >= lattice || random_below(&seed, 50) == 0;
            for (int c = 0; c < 3; c++)
                canvas.rgb[3 * i + (uint32_t)c] = known[i] ? (float)(x + 2 * y) + (float)c : -1;
        }
        fill_alone(&canvas, known);
        for (uint32_t y = 0; y < height; y++)
            for (uint32_t x = 0; x < width; x++)
                for (int c = 0; c < 3; c++) {
                    float is = color_at(&canvas, x, y)[c], was = (float)(x + 2 * y) + (float)c;
                    bool inside = x >= edge && x + edge < width && y >= edge && y + edge < height;
                    if (known[y * width + x]) assert_true(is == was);
                    if (inside) assert_true(fabsf(is - was) < 1e-3F);
                    assert_true(is >= 0 && is <= (float)(width + 2 * height + 2));
                }
        free(known);
        canvas_free(&canvas);
    }
}

/* Pictures of all sizes: every pixel is filled even if only the one in the corner is known. */
static void test_all_sizes(void **state)
{
    for (uint32_t width = 1; width <= 20; width++)
        for (uint32_t height = 1; height <= 20; height++) {
            struct canvas canvas;
            struct preview preview = {0};
            const struct tile probe = {.w = 1, .h = 1, .step = 64, .pass = TILE_PROBE};
            const float two[3] = {2, 2, 2};
            uint8_t known[400] = {0};
            canvas_init(&canvas, width, height);
            preview_put(&preview, width, height, &probe, two);
            fill_unknown(&canvas, known, &preview);
            for (uint32_t i = 0; i < 3 * width * height; i++)
                assert_true(canvas.rgb[i] == 2);
            preview_free(&preview);
            canvas_free(&canvas);
        }
}

/* Known pixels keep their colours whatever the preview has. Without a preview, unknown pixels stay black. */
static void test_known_stays(void **state)
{
    for (int with = 0; with < 2; with++) {
        struct canvas canvas;
        struct preview preview = {0};
        const struct tile probe = {.w = 1, .h = 1, .step = 64, .pass = TILE_PROBE};
        const float gray[3] = {1, 1, 1};
        uint8_t known[32 * 32] = {0};
        canvas_init(&canvas, 32, 32);
        memset(known + 16 * 32, 1, 16 * 32);
        for (uint32_t i = 16 * 32; i < 32 * 32; i++)
            canvas.rgb[3 * i] = 5;
        if (with) preview_put(&preview, 32, 32, &probe, gray);
        fill_unknown(&canvas, known, &preview);
        for (uint32_t y = 0; y < 32; y++)
            for (uint32_t x = 0; x < 32; x++) {
                float red = color_at(&canvas, x, y)[0];
                if (y >= 16) assert_true(red == 5);
                if (y == 0) assert_true(red == (float)with);
                if (y < 16) assert_true(red >= (float)with && red < 5);
            }
        preview_free(&preview);
        canvas_free(&canvas);
    }
}

/* Blocks of the preview that are as small as the gaps are used. */
static void test_small_blocks(void **state)
{
    struct canvas canvas;
    struct preview preview = {0};
    uint8_t known[64 * 64] = {0};
    canvas_init(&canvas, 64, 64);
    for (uint32_t row = 0; row < 16; row++) {
        const struct tile probe = {
            .y = 4 * row + 2, .w = 64, .h = 1, .phase = 2, .step = 4, .pass = TILE_PROBE};
        float rgb[3 * 16];
        for (uint32_t i = 0; i < 16; i++)
            rgb[3 * i] = rgb[3 * i + 1] = rgb[3 * i + 2] = (float)((row + i) % 2);
        preview_put(&preview, 64, 64, &probe, rgb);
    }
    for (uint32_t i = 0; i < 64 * 64; i++)
        known[i] = lattice_of(i % 64, i / 64) == LATTICE_COARSEST;
    fill_unknown(&canvas, known, &preview);
    for (uint32_t y = 2; y < 64; y += 4)
        for (uint32_t x = 2; x < 64; x += 4)
            assert_true(color_at(&canvas, x, y)[0] == (float)((x / 4 + y / 4) % 2));
    preview_free(&preview);
    canvas_free(&canvas);
}

/* Probes of a slope, in the middles of blocks as cost_probe() has them. */
static void put_slope(struct preview *preview, uint32_t edge)
{
    for (uint32_t top = 0; top + edge / 2 < SLOPE; top += edge)
        for (uint32_t left = 0; left + edge / 2 < SLOPE; left += edge) {
            uint32_t x = left + edge / 2, y = top + edge / 2;
            const struct tile probe = {.x = left,
                                       .y = y,
                                       .w = SLOPE - left < edge ? SLOPE - left : edge,
                                       .h = 1,
                                       .phase = edge / 2,
                                       .step = edge,
                                       .pass = TILE_PROBE};
            const float value = (float)(x + 2 * y), rgb[3] = {value, value, value};
            preview_put(preview, SLOPE, SLOPE, &probe, rgb);
        }
}

/* What only probes have been taken of is where it belongs, however large their blocks are: a slope is what it
 * was, but at the borders. */
static void test_preview_is_in_place(void **state)
{
    for (uint32_t edge = 4; edge <= 22; edge += 2) {
        struct canvas canvas;
        struct preview preview = {0};
        uint8_t known[SLOPE * SLOPE] = {0};
        uint32_t border = 2 * LATTICE_SPACING + edge;
        canvas_init(&canvas, SLOPE, SLOPE);
        put_slope(&preview, edge);
        fill_unknown(&canvas, known, &preview);
        for (uint32_t y = border; y + border < SLOPE; y++)
            for (uint32_t x = border; x + border < SLOPE; x++)
                assert_true(fabsf(color_at(&canvas, x, y)[1] - (float)(x + 2 * y)) < 1e-3F);
        preview_free(&preview);
        canvas_free(&canvas);
    }
}

/* ---- what that is off by ---- */

enum { SQUARE = 96 };

/* The estimated error of a square of which the pixels of a lattice and the upper rows are known. Pixels that are on no
 * lattice coarser than `raised` differ from the others by `by`. */
static double told_error(uint32_t lattice, uint32_t upper, uint32_t raised, float by)
{
    struct canvas canvas;
    struct preview none = {0};
    uint8_t known[SQUARE * SQUARE];
    canvas_init(&canvas, SQUARE, SQUARE);
    for (uint32_t i = 0; i < SQUARE * SQUARE; i++) {
        uint32_t x = i % SQUARE, y = i / SQUARE;
        known[i] = y < upper || lattice_of(x, y) >= lattice;
        canvas.rgb[3 * i] = lattice_of(x, y) <= raised ? by : 0;
    }
    double error = fill_error(&canvas, known, &none);
    canvas_free(&canvas);
    return error;
}

/* The error is estimated with the finest complete lattice, by the differences of its own pixels from the coarser ones,
 * in one of three components. */
static void test_error_by_finest(void **state)
{
    for (uint32_t lattice = 1; lattice < LATTICE_COARSEST; lattice++) {
        assert_true(told_error(lattice, 0, LATTICE_COARSEST, 0.5F) == 0);
        double share = told_error(lattice, 0, lattice, 0.5F) / (0.25 / 3);
        assert_true(fabs(told_error(lattice, 0, lattice, 1) / (share / 3) - 1) < 1e-6);
        assert_true(share > 0.36 && share < 0.58); /* as it was measured */
        assert_true(told_error(lattice, 0, lattice - 1, 0.5F) == 0);
    }
}

/* If only the coarsest lattice is complete, or there are single pixels, the error is unknown. */
static void test_error_not_known(void **state)
{
    assert_true(isnan(told_error(LATTICE_COARSEST, 0, 0, 1)));
    assert_true(isnan(told_error(LATTICE_COARSEST + 1, 8, 0, 1)));
}

/* Pictures of all sizes give a finite error or NaN. */
static void test_error_of_all_sizes(void **state)
{
    for (uint32_t width = 1; width <= 20; width++)
        for (uint32_t height = 1; height <= 20; height++) {
            struct canvas canvas;
            struct preview none = {0};
            uint8_t known[400];
            canvas_init(&canvas, width, height);
            for (uint32_t i = 0; i < width * height; i++)
                known[i] = lattice_of(i % width, i / width) >= 2;
            double error = fill_error(&canvas, known, &none);
            assert_true(width > 2 || height > 2 ? error == 0 : isnan(error) || error == 0);
            canvas_free(&canvas);
        }
}

/* Areas in which all pixels are known do not count, however uneven they are. */
static void test_error_where_guessed(void **state)
{
    struct canvas canvas;
    struct preview none = {0};
    uint8_t known[SQUARE * SQUARE];
    uint64_t seed = 1;
    canvas_init(&canvas, SQUARE, SQUARE);
    for (uint32_t i = 0; i < SQUARE * SQUARE; i++) {
        uint32_t x = i % SQUARE, y = i / SQUARE;
        known[i] = y < SQUARE / 2 || lattice_of(x, y) >= 2;
        for (int c = 0; c < 3 && y < SQUARE / 2 - 4; c++)
            canvas.rgb[3 * i + (uint32_t)c] = (float)random_below(&seed, 100);
    }
    assert_true(fill_error(&canvas, known, &none) == 0);
    known[0] = 0;
    assert_true(isnan(fill_error(&canvas, known, &none)));
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lattices_are_even),
        cmocka_unit_test(test_coarsest),
        cmocka_unit_test(test_walk),
        cmocka_unit_test(test_walk_between),
        cmocka_unit_test(test_slopes_are_restored),
        cmocka_unit_test(test_all_sizes),
        cmocka_unit_test(test_known_stays),
        cmocka_unit_test(test_small_blocks),
        cmocka_unit_test(test_preview_is_in_place),
        cmocka_unit_test(test_error_by_finest),
        cmocka_unit_test(test_error_not_known),
        cmocka_unit_test(test_error_of_all_sizes),
        cmocka_unit_test(test_error_where_guessed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
