/* Tests the contrasts of whole rows against the definition, one pixel at a time. */
#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "master/contrast.h"
#include "test/random.h"
#include "test/unit.h"

/* One of a few values, so that some neighbours differ by the same amount; some are not finite. */
static float component(uint64_t *state)
{
    double at = random_between(state, 0, 1);
    if (at < 0.01) return NAN;
    if (at < 0.02) return INFINITY;
    return (float)floor(4 * random_between(state, 0, 1));
}

struct differences {
    double by[8][3], square[8];
    unsigned count;
};

static double product(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The differences to those neighbours of pixel x, y that count. */
static struct differences differences_of(const struct canvas *canvas, int64_t x, int64_t y)
{
    struct differences all = {.count = 0};
    for (int64_t v = y - 1; v <= y + 1; v++) {
        for (int64_t u = x - 1; u <= x + 1; u++) {
            if ((u == x && v == y) || u < 0 || v < 0 || u >= canvas->width || v >= canvas->height)
                continue;
            double *by = all.by[all.count];
            for (int64_t c = 0; c < 3; c++)
                by[c] = (double)canvas->rgb[3 * (v * canvas->width + u) + c] -
                        (double)canvas->rgb[3 * (y * canvas->width + x) + c];
            all.square[all.count] = product(by, by);
            if (all.square[all.count] < HUGE_VAL) all.count++;
        }
    }
    return all;
}

/* The mean over components of a quarter of their range's square. */
static double range_variance(const struct differences *all)
{
    double sum = 0;
    for (int c = 0; c < 3 && all->count > 0; c++) {
        double low = all->by[0][c], high = low;
        for (unsigned k = 1; k < all->count; k++) {
            low = fmin(low, all->by[k][c]);
            high = fmax(high, all->by[k][c]);
        }
        sum += (high - low) * (high - low) / 4;
    }
    return sum / 3;
}

static void check_pixel(const struct canvas *canvas, uint32_t x, uint32_t y, double largest,
                        double across, double around)
{
    struct differences all = differences_of(canvas, x, y);
    unsigned far = 0;
    double opposite = 0;
    for (unsigned k = 1; k < all.count; k++)
        if (all.square[k] > all.square[far]) far = k;
    for (unsigned k = 0; k < all.count; k++)
        opposite = fmax(opposite, -product(all.by[far], all.by[k]));
    assert_true(largest == (all.count ? all.square[far] / 3 : 0));
    assert_true(across == opposite / 3);
    assert_true(around == range_variance(&all));
}

static void check_canvas(uint32_t width, uint32_t height)
{
    struct canvas canvas;
    uint64_t state = 1;
    canvas_init(&canvas, width, height);
    for (size_t i = 0; i < 3 * (size_t)width * height; i++)
        canvas.rgb[i] = component(&state);
    double *doubles = allocate(9 * ((size_t)width + 2), sizeof *doubles);
    struct contrasts contrasts = {allocate(width, sizeof(double)), allocate(width, sizeof(double)),
                                  allocate(width, sizeof(double))};
    struct color_row rows[3];
    for (unsigned i = 0; i < 9; i++)
        rows[i / 3].plane[i % 3] = doubles + i * ((size_t)width + 2);
    for (uint32_t y = 0; y < height; y++) {
        for (unsigned k = 0; k < 3; k++)
            color_row_take(&rows[k], &canvas, (int64_t)y + k - 1);
        contrast_of_row(rows, width, &contrasts);
        for (uint32_t x = 0; x < width; x++)
            check_pixel(&canvas, x, y, contrasts.largest[x], contrasts.edge_variance[x],
                        contrasts.range_variance[x]);
    }
    free(contrasts.range_variance);
    free(contrasts.edge_variance);
    free(contrasts.largest);
    free(doubles);
    canvas_free(&canvas);
}

/* Rows of less than a chunk, of whole chunks, and of whole chunks and a pixel. */
static void test_rows(void **state)
{
    check_canvas(1, 1);
    check_canvas(1, 5);
    check_canvas(3, 2);
    check_canvas(127, 4);
    check_canvas(256, 9);
    check_canvas(385, 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_rows)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
