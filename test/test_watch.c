#include "test/scratch.h"

#include <math.h>

#include "master/text_file.h"
#include "master/watch.h"

enum { EDGE = 10, PIXELS = EDGE * EDGE };

static struct canvas canvas, reference;

static struct watch begun(uint64_t pixels, const char *csv)
{
    canvas_init(&canvas, EDGE, EDGE);
    canvas_init(&reference, EDGE, EDGE);
    struct watch watch = {.canvas = &canvas, .reference = &reference, .samples = 4, .begin = 100};
    assert_true(watch_start(&watch, csv));
    struct result_header header = {.cpu_s = 10,
                                   .counts = {.sampling = {1, 0.01}, .halfway = {3, 0.09}}};
    watch_add(&watch, pixels, &header);
    return watch;
}

static void ended(struct watch *watch)
{
    watch_free(watch);
    canvas_free(&canvas);
    canvas_free(&reference);
}

/* After the only pass the last row is that of the pass, and CPU seconds are scaled to the seconds that
 * rendering took. */
static void test_end(void **state)
{
    struct watch watch = begun(PIXELS, NULL);
    struct error_forecast forecast;
    watch_look(&watch, 101); /* a look between */
    assert_true(watch_end(&watch, 103, 5, &forecast));
    const struct error_row *last = &watch.log.rows[watch.log.count - 1];
    const struct error_breakdown all = {.sum = {1, 0.01}};
    struct error_estimate told = error_estimate(&all, PIXELS, ERROR_LOOK_PASS, 1);
    assert_true(last->estimate.low == told.low && last->estimate.high == told.high);
    assert_true(last->samples == 4 && last->sampled_share == 1 && last->true_rmse == 0);
    assert_true(forecast.known && forecast.seconds == 5);
    ended(&watch);
}

/* The interval is wider where the numbers of samples in the halves differ. */
static void test_odd_samples(void **state)
{
    struct watch watch = begun(PIXELS, NULL);
    watch_look(&watch, 101);
    watch.samples = 5;
    watch_look(&watch, 102);
    const struct error_row *even = &watch.log.rows[0], *odd = &watch.log.rows[1];
    assert_true(odd->estimate.rmse == even->estimate.rmse);
    assert_true(odd->estimate.high > 1.2 * even->estimate.high);
    assert_true(odd->estimate.low < even->estimate.low / 1.2);
    ended(&watch);
}

/* With half of the picture there is no true error, and half of the samples per pixel; the row is written at once. */
static void test_half(void **state)
{
    struct watch watch = begun(PIXELS / 2, "rows.csv");
    watch_look(&watch, 101);
    assert_true(isnan(watch.log.rows[0].true_rmse));
    assert_true(watch.log.rows[0].samples == 2 && watch.log.rows[0].sampled_share == 0.5);
    struct text_file text;
    assert_true(text_file_read("rows.csv", 1 << 12, &text));
    assert_non_null(strstr(text.text, "\n1,2,"));
    text_file_free(&text);
    ended(&watch);
}

/* Single samples tell nothing about the error: there is no row that would call it 0. */
static void test_single_samples(void **state)
{
    struct watch watch = begun(PIXELS, NULL);
    struct error_forecast forecast;
    watch.samples = 1;
    watch_look(&watch, 101);
    assert_true(watch_end(&watch, 103, 5, &forecast));
    assert_int_equal(watch.log.count, 0);
    assert_false(forecast.known);
    ended(&watch);
}

/* No seconds are foretold for more samples than a run may have. */
static void test_most_samples(void **state)
{
    for (uint32_t samples = SAMPLES_MAX / 4; samples <= SAMPLES_MAX; samples *= 4) {
        struct watch watch = begun(PIXELS, NULL);
        struct error_forecast forecast;
        watch.samples = samples;
        assert_true(watch_end(&watch, 103, 5, &forecast));
        assert_true(forecast.known == (samples < SAMPLES_MAX) && forecast.beyond != forecast.known);
        double rmse = watch.log.rows[watch.log.count - 1].estimate.rmse;
        assert_true(forecast.goal == (forecast.known ? forecast_goal(rmse) : rmse / 2));
        ended(&watch);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_end),          cmocka_unit_test(test_odd_samples),
        cmocka_unit_test(test_half),         cmocka_unit_test(test_single_samples),
        cmocka_unit_test(test_most_samples),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
