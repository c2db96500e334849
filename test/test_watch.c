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

/* Rows between passes come ever more seldom, and no more often than a twentieth of the time allows. */
static void test_next_row(void **state)
{
    (void)state;
    assert_true(watch_next_row(2, 0) == 2.5);
    assert_true(watch_next_row(2, 0.0125) == 2.5);
    assert_true(fabs(watch_next_row(2, 0.25) - 7) < 1e-9);
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

/* Ends a run of which only its number of samples matters; its error is 0.12, the round number below half of it 0.05. */
static struct error_forecast forecast_from(uint32_t samples)
{
    struct watch watch = begun(PIXELS, NULL);
    struct error_forecast forecast;
    struct result_header more = {.counts = {.sampling = {0.44, 0.01}, .halfway = {1.32, 0.09}}};
    watch_add(&watch, 0, &more);
    watch.samples = samples;
    assert_true(watch_end(&watch, 103, 5, &forecast));
    ended(&watch);
    return forecast;
}

/* No seconds are foretold for more samples than a run may have. Where the round number needs more, half of the error
 * may not. */
static void test_most_samples(void **state)
{
    struct error_forecast few = forecast_from(16384), more = forecast_from(28000),
                          most = forecast_from(SAMPLES_MAX);
    assert_true(few.known && !few.beyond && few.goal == 0.05);
    assert_true(more.known && !more.beyond && more.samples <= SAMPLES_MAX);
    assert_true(!most.known && most.beyond);
    assert_float_equal(more.goal, 0.06, 1e-9);
    assert_float_equal(most.goal, 0.06, 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_end),
        cmocka_unit_test(test_next_row),
        cmocka_unit_test(test_odd_samples),
        cmocka_unit_test(test_half),
        cmocka_unit_test(test_single_samples),
        cmocka_unit_test(test_most_samples),
    };
    return cmocka_run_group_tests(tests, scratch_open, scratch_close);
}
