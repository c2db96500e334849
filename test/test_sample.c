#include "test/sample_fixture.h"
#include "test/scene_fixture.h"

static const struct view many = {.width = 64, .height = 48, .min_samples = 2, .max_samples = 65536};

/* The first 2^m samples of each half: one in each of the 2^m rectangles of every shape. */
static void test_one_in_each_rectangle(void **state)
{
    for (uint32_t half = 0; half < 2; half++) {
        for (uint32_t m = 0; m <= 10; m++) {
            for (uint32_t wide = 0; wide <= m; wide++) {
                bool taken[1024] = {false};
                for (uint32_t i = 0; i < 1u << m; i++) {
                    double at[2];
                    sample_position(&many, 5 + m, 7 + wide, 2 * i + half, at);
                    assert_true(at[0] >= 0 && at[0] < 1 && at[1] >= 0 && at[1] < 1);
                    uint32_t column = (uint32_t)(at[0] * (1u << wide));
                    uint32_t row = (uint32_t)(at[1] * (1u << (m - wide)));
                    uint32_t cell = column << (m - wide) | row;
                    assert_false(taken[cell]);
                    taken[cell] = true;
                }
            }
        }
    }
}

static void test_single_sample_is_central(void **state)
{
    struct view one = many;
    one.min_samples = one.max_samples = 1;
    double at[2];
    sample_position(&one, 3, 4, 0, at);
    assert_true(at[0] == 0.5 && at[1] == 0.5);
}

/*
 * Over many pixels: positions are uniformly distributed, and samples that must be independent are. Of N values in [0,
 * 1) that are independent, mean (a - 1/2)(b - 1/2) is 0 with a standard deviation of 1 / (12 sqrt N), the mean of a is
 * 1/2 with 1 / sqrt(12 N); five of them are allowed.
 */
static void test_halves_and_pixels_are_independent(void **state)
{
    enum { EDGE = 300, COUNT = EDGE * EDGE };
    const double few = 5 / (12 * sqrt(COUNT));
    for (uint32_t sample = 0; sample < 6; sample += 2) {
        double mean = 0, axes = 0, halves = 0, right = 0, below = 0;
        for (uint32_t k = 0; k < COUNT; k++) {
            uint32_t x = k % EDGE, y = k / EDGE;
            double a[2], b[2], c[2], d[2];
            sample_position(&many, x, y, sample, a);
            sample_position(&many, x, y, sample + 1, b);
            sample_position(&many, x + 1, y, sample, c);
            sample_position(&many, x, y + 1, sample, d);
            mean += a[0] + a[1] - 1;
            axes += (a[0] - 0.5) * (a[1] - 0.5);
            halves += (a[0] - 0.5) * (b[0] - 0.5);
            right += (a[0] - 0.5) * (c[0] - 0.5);
            below += (a[1] - 0.5) * (d[1] - 0.5);
        }
        assert_near(mean / COUNT, 0, 5 / sqrt(6.0 * COUNT));
        assert_near(axes / COUNT, 0, few);
        assert_near(halves / COUNT, 0, few);
        assert_near(right / COUNT, 0, few);
        assert_near(below / COUNT, 0, few);
    }
}

/* Whether a sample lies below a line through its pixel. */
static double below_line(const struct view *view, uint32_t pixel, uint32_t sample)
{
    double at[2], slope = 0.1 + 0.8 * (pixel % 97) / 97.0, height = 0.1 + 0.7 * (pixel % 89) / 89.0;
    sample_position(view, pixel % 512, pixel / 512, sample, at);
    return at[1] < height + slope * (at[0] - 0.5);
}

/* The area of the pixel below that line. */
static double area_below(uint32_t pixel)
{
    double slope = 0.1 + 0.8 * (pixel % 97) / 97.0, height = 0.1 + 0.7 * (pixel % 89) / 89.0;
    double sum = 0;
    for (int i = 0; i < 2000; i++)
        sum += fmin(1, fmax(0, height + slope * ((i + 0.5) / 2000 - 0.5))) / 2000;
    return sum;
}

/* At an edge the error goes down as n^-3/4, and the halves estimate it correctly. */
static void test_error_at_edges(void **state)
{
    enum { PIXELS = 4000 };
    double before = 0;
    for (uint32_t samples = 16; samples <= 256; samples *= 16) {
        double error = 0, told = 0;
        for (uint32_t pixel = 0; pixel < PIXELS; pixel++) {
            double sum[2] = {0, 0}, mean;
            for (uint32_t i = 0; i < samples; i++)
                sum[i & 1] += below_line(&many, pixel, i);
            mean = (sum[0] + sum[1]) / samples;
            error += pow(mean - area_below(pixel), 2) / PIXELS;
            told += pow((sum[0] - sum[1]) / samples, 2) / PIXELS;
        }
        assert_true(told > 0.9 * error && told < 1.1 * error);
        if (before > 0) assert_near(log(before / error) / log(16), 1.5, 0.1);
        before = error;
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_in_each_rectangle),
        cmocka_unit_test(test_single_sample_is_central),
        cmocka_unit_test(test_halves_and_pixels_are_independent),
        cmocka_unit_test(test_error_at_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
