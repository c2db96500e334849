/* Tests of the colours of ranks. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "master/rank_colors.h"
#include "test/unit.h"

struct cielab {
    double lightness, a, b;
};

static double linear(float encoded)
{
    double value = (double)encoded;
    return value <= 0.04045 ? value / 12.92 : pow((value + 0.055) / 1.055, 2.4);
}

static double cielab_f(double t)
{
    return t > 216.0 / 24389 ? cbrt(t) : (24389.0 / 27 * t + 16) / 116;
}

/* CIE 15:2004, with the white of sRGB. */
static struct cielab cielab(const float rgb[3])
{
    double r = linear(rgb[0]), g = linear(rgb[1]), b = linear(rgb[2]);
    double x = cielab_f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505);
    double y = cielab_f(0.2126 * r + 0.7152 * g + 0.0722 * b);
    double z = cielab_f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089);
    return (struct cielab){116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

static double distance(const float one[3], const float other[3])
{
    struct cielab a = cielab(one), b = cielab(other);
    return hypot(a.lightness - b.lightness, hypot(a.a - b.a, a.b - b.b));
}

/* The least distance between any two colours of so many ranks; reach: whose numbers differ by this at most. */
static double least_distance(uint32_t count, uint32_t reach)
{
    float(*rgb)[3] = malloc(count * sizeof *rgb);
    double least = HUGE_VAL;
    assert_non_null(rgb);
    rank_colors(count, rgb);
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t k = i + 1; k < count && k <= i + reach; k++)
            least = fmin(least, distance(rgb[i], rgb[k]));
    free(rgb);
    return least;
}

/* Of colours in CIELAB a distance of 2.3 is just noticeable. */
static void test_far_apart(void **state)
{
    double neighbours = least_distance(44, 1), many = least_distance(256, 256);
    print_message(
        "least distances: %.1f of 8, %.1f of 20, %.1f of 44, %.1f of 256; %.1f of neighbours\n",
        least_distance(8, 8), least_distance(20, 20), least_distance(44, 44), many, neighbours);
    assert_true(least_distance(8, 8) > 50 && least_distance(20, 20) > 30);
    assert_true(least_distance(44, 44) > 20 && many > 7 && neighbours > 30);
}

/* No colour is like black, the ground or the ink of the legend, or any other grey. */
static void test_unlike_all_else(void **state)
{
    float rgb[256][3];
    rank_colors(256, rgb);
    for (int i = 0; i < 256; i++) {
        struct cielab color = cielab(rgb[i]);
        assert_true(hypot(color.a, color.b) > 15 && color.lightness > 25);
    }
}

/* A rank has the same colour however many there are. */
static void test_first_stay(void **state)
{
    float few[8][3], many[100][3];
    rank_colors(8, few);
    rank_colors(100, many);
    assert_memory_equal(few, many, sizeof few);
}

/* There are fewer colours than that; all are colours, and they begin anew after the last one. */
static void test_more_ranks_than_colors(void **state)
{
    enum { RANKS = 20000 };
    float(*rgb)[3] = malloc(RANKS * sizeof *rgb);
    uint32_t again = 0;
    assert_non_null(rgb);
    rank_colors(RANKS, rgb);
    for (uint32_t i = 0; i < RANKS; i++) {
        for (int c = 0; c < 3; c++)
            assert_true(rgb[i][c] >= 0 && rgb[i][c] <= 1);
        if (again == 0 && i > 0 && memcmp(rgb[i], rgb[0], sizeof *rgb) == 0) again = i;
    }
    assert_int_equal(again, 3335);
    assert_memory_equal(rgb[1], rgb[again + 1], sizeof *rgb);
    free(rgb);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_far_apart),
        cmocka_unit_test(test_unlike_all_else),
        cmocka_unit_test(test_first_stay),
        cmocka_unit_test(test_more_ranks_than_colors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
