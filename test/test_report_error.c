/* What the table of the report says about the sampling error, and about what a lower one would take. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "test/report_fixture.h"
#include "test/unit.h"

/* The last row of a run's error log. */
static const struct error_row last_row = {2.4, 16, {0.000098, 0.000087, 0.00011}, (double)NAN, 1};

/* The report of a run with two renderers whose error log has that row alone. */
static struct renderer_stats renderers[2];
static struct error_row row;
static struct error_log errors;
static struct report report;

static void begin(void)
{
    report = sample_report(renderers, 2);
    row = last_row;
    errors = (struct error_log){&row, 1};
    report.errors = &errors;
}

/* A lower error is beyond max_samples. */
static void test_table_beyond(void **state)
{
    begin();
    report.forecast =
        (struct error_forecast){.rmse = 0.000098, .goal = 0.000049123, .beyond = true};
    report.max_samples = 64;
    report.ended = ENDED_BY_TARGET;
    report.target = 0.0001;
    assert_table_lacks(&report, 80, "not known");
    assert_table_has(&report, 80,
                     "\nan RMSE of 0.000049 is beyond sampling.max_samples = 64\n"
                     "sampling.target_error = 0.0001 is met\n");
    report.forecast.max_samples = 256;
    assert_table_has(&report, 80,
                     "\nan RMSE of 0.000049 is beyond sampling.max_samples = 64, 256 would "
                     "be enough\n");
    assert_json_has(&report, "\"beyond_rmse\": 4.9123e-05,\n    \"enough_samples\": 256\n");
    assert_json_has(&report, "\"forecast\": null");
    report.forecast.goal = report.target = 0.000012345;
    assert_table_has(&report, 80,
                     "\nan RMSE of 0.000012345 is beyond sampling.max_samples = 64, 256");
}

/* Where all pixels have the same number of samples, it may be beyond what any run can have. */
static void test_table_beyond_all(void **state)
{
    begin();
    report.forecast = (struct error_forecast){
        .rmse = 0.000098, .goal = 0.000049123, .samples = 70000, .beyond = true};
    report.max_samples = 50000;
    assert_table_has(
        &report, 80,
        "\nan RMSE of 0.000049 would take more than the 65536 samples that a run can have\n");
    assert_json_has(&report, "\"beyond_rmse\": 4.9123e-05\n");
    assert_json_has(&report, "\"forecast\": null");
}

/* Nothing is known of what a lower error would take; and what has ended the run. */
static void test_table_ended(void **state)
{
    begin();
    report.forecast = (struct error_forecast){.known = false};
    report.ended = ENDED_BY_TARGET;
    report.target = 0.0001;
    assert_table_has(&report, 80,
                     "\nwhat a smaller error would take is not known\n"
                     "sampling.target_error = 0.0001 is met\n");
    report.ended = ENDED_BY_TIME;
    assert_table_has(&report, 80,
                     "\nstopped by sampling.time_limit, "
                     "sampling.target_error = 0.0001 is not met\n");
    report.target = 0.00005;
    assert_table_has(&report, 80, "sampling.target_error = 0.00005 is not met\n");
    report.target = 0;
    assert_table_has(&report, 80, "\nstopped by sampling.time_limit\n");
    report.ended = ENDED_WITHOUT_ERROR;
    assert_table_has(&report, 80, "\nstopped as samples show no error\n");
}

/* The samples per pixel of an adaptive run, and what is missing of its last pass. */
static void test_table_cut_off(void **state)
{
    begin();
    report.ended = ENDED_BY_TIME;
    assert_table_lacks(&report, 80, "samples per pixel"); /* sampling was uniform */
    report.passes = 3;
    report.missing_share = 0.4;
    assert_table_has(&report, 80,
                     "\n16.0 samples per pixel\n"
                     "stopped by sampling.time_limit, pass 3 was cut off:\n"
                     "  40.0 % of its pixels got none of its samples\n");
    report.missing_share = 0.0001; /* never shown as 0 */
    assert_table_has(&report, 130,
                     ", pass 3 was cut off: 0.1 % of its pixels got none of its samples\n");
    report.missing_share = 1;
    assert_table_has(&report, 80, ", pass 3 was planned, but nothing of it was done\n");
    report.unsampled = 1;
    assert_table_lacks(&report, 80, "pass 3");
}

/* A slope too steep for any sampling is not shown in the table, but is in the JSON. */
static void test_table_steep_forecast(void **state)
{
    begin();
    report.forecast =
        (struct error_forecast){true, false, 0.000098, 2, 0.00004, 351.1, 154.88, 0, 0.06, 0};
    assert_table_has(&report, 80, "\nan RMSE of 0.00004 would take about 2.41 s (2.40 to 2.47)\n");
    assert_json_has(&report, "\"slope\": -351.1,");
    report.forecast.slope = 2.1;
    assert_table_has(&report, 80, ", slope -2.10 +- ");
}

/* Where the error may as well not go down, the interval of a forecast has no upper end, and says so in words. */
static void test_table_forecast_without_an_end(void **state)
{
    begin();
    report.forecast =
        (struct error_forecast){true, false, 0.000098, 2, 0.00004, 0.5, 0.6, 64, 0.06, 0};
    assert_table_has(
        &report, 80,
        "\nan RMSE of 0.00004 would take about 12.4 s (4.92 or more), with 64 samples\n");
    assert_json_has(&report, "\"render_high_s\": null");
}

/* The sampling error, and what a lower one would take. */
static void test_table_error(void **state)
{
    begin();
    report.forecast = (struct error_forecast){true, false, 0.000098, 2, 0.00002, 0.5, 0, 64, 0, 0};
    assert_table_has(&report, 80,
                     "\nsampling error: RMSE 0.000098 (0.000087 to 0.00011) after 2.4 s\n"
                     "an RMSE of 0.00002 would take about 48.4 s (48.4 to 48.4), with 64 samples\n"
                     "  slope -0.50 +- 0.00\n");
    char *text = table_text(&report, 40);
    assert_fits(text, 40);
    assert_has(text, "\nsampling error: RMSE 0.000098\n  (0.000087 to 0.00011) after 2.4 s\n"
                     "an RMSE of 0.00002 would take\n  about 48.4 s (48.4 to 48.4)\n"
                     "  with 64 samples, slope -0.50 +- 0.00\n");
    free(text);
    report.forecast.seconds = 50;
    assert_table_has(
        &report, 80,
        "an RMSE of 0.00002 would take about 1153 s (1153 to 1153), with 64 samples\n");
    row.elapsed_s = 0.0374;
    assert_table_has(&report, 80, " after 0.037 s\n");
    row.elapsed_s = 0.201;
    assert_table_has(&report, 80, " after 0.20 s\n");
}

/* An interval does not read like a single figure. */
static void test_table_narrow_interval(void **state)
{
    begin();
    row.estimate = (struct error_estimate){0.001121, 0.001109, 0.001134};
    assert_table_has(&report, 80, "\nsampling error: RMSE 0.00112 (0.00111 to 0.00113) after");
    row.estimate = (struct error_estimate){0.00112, 0.00104, 0.00116};
    assert_table_has(&report, 80, "\nsampling error: RMSE 0.0011 (0.0010 to 0.0012) after");
    row.estimate = (struct error_estimate){0.002997, 0.0025, 0.0031};
    assert_table_has(&report, 80, "\nsampling error: RMSE 0.0030 (0.0025 to 0.0031) after");
    row.estimate = (struct error_estimate){0.002997, 0.00289, 0.00301};
    assert_table_has(&report, 80, "\nsampling error: RMSE 0.00300 (0.00289 to 0.00301) after");
    row.estimate = (struct error_estimate){0.00112, 0.00107, 0.00116};
    assert_table_has(&report, 80, "\nsampling error: RMSE 0.00112 (0.00107 to 0.00116) after");
}

/* What is said of the error is not said of samples that are not finite. */
static void test_table_not_finite(void **state)
{
    begin();
    report.target = 0.001;
    report.ended = ENDED_BY_TARGET;
    assert_table_has(&report, 80, "(0.000087 to 0.00011) after 2.4 s\n");
    assert_table_has(&report, 80, "\nsampling.target_error = 0.001 is met\n");
    report.picture.nonfinite = 1;
    assert_table_has(&report, 80, "(0.000087 to 0.00011) of what is finite,");
    assert_table_has(&report, 80, "\nsampling.target_error = 0.001 is met by what is finite\n");
}

/* Seconds of an earlier run count like those of this one. */
static void test_table_error_of_two_runs(void **state)
{
    begin();
    report.forecast = (struct error_forecast){true, false, 0.000098, 12, 0.00002, 0.5, 0, 64, 0, 0};
    row.true_rmse = 0.00009;
    report.resumed.render_s = 10;
    report.resumed.cpu_s = 20;
    assert_table_has(
        &report, 80,
        " after 2.4 s\n  and 10.0 s of an earlier run (20.0 s of CPU time, divided by 2 cores)\n"
        "  RMSE 0.000090 against the reference\nan RMSE of 0.00002 would take about 289 s (");
    row.true_rmse = 0.2;
    assert_table_has(&report, 80, "\n  RMSE 0.20 against the reference (is it of this view?)\n");
}

/* Where only a part of the pixels has samples. */
static void test_table_error_of_a_part(void **state)
{
    begin();
    row.sampled_share = 0.00095;
    assert_table_has(&report, 80,
                     " of the 0.095 % of the pixels\n"
                     "  that have samples, after 2.4 s\n");
    row.sampled_share = 0.0456;
    assert_table_has(&report, 80, "of the 4.5 % of the pixels\n  that have samples, after");
    assert_table_lacks(&report, 80, "guessed");
    report.unsampled = 9544;
    assert_table_has(&report, 80,
                     "that have samples, after 2.4 s, the error of the guessed ones is not known");
    report.guessed_rmse = 0.01;
    row.sampled_share = 0.36;
    row.estimate = (struct error_estimate){0.002, 0.0019, 0.0021};
    /* 0.36 * 0.002^2 + 0.64 * 0.01^2 = 0.0081^2 */
    assert_table_has(&report, 80, "about 0.0081 of the whole picture, 0.010 of what is guessed");
    assert_json_has(&report, "\"guessed_rmse\": 0.01\n");
    /* The true error is known also where no row knows it, as pixels are without samples. */
    row.true_rmse = (double)NAN;
    report.has_reference = true;
    report.truth.rmse = 0.0123;
    assert_table_has(&report, 80,
                     ", 0.010 of what is guessed\n"
                     "  RMSE 0.012 of the whole picture against the reference\n");
    row.true_rmse = 0.2;
    report.has_reference = false;
    report.guessed_rmse = (double)NAN;
    report.unsampled = 0;
    row.sampled_share = 0.9996;
    assert_table_has(&report, 80, "of the 99.9 % of the pixels");
    row.elapsed_s = 0.0374;
    assert_table_has(&report, 80, " after 0.037 s,");
}

/* Without an estimate: the error against a reference, or that it is unknown with one sample a pixel. */
static void test_table_truth(void **state)
{
    begin();
    errors = (struct error_log){0};
    report.has_reference = true;
    report.truth.rmse = 0.0231;
    assert_table_has(&report, 80, "\nsampling error: RMSE 0.023 against the reference\n");
    report.has_reference = false;
    report.max_samples = 1;
    assert_table_has(&report, 80, "\nsampling error: unknown with one sample per pixel\n");
    report.max_samples = 2; /* of which no pixel has come in */
    assert_table_lacks(&report, 80, "sampling error");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table_beyond),
        cmocka_unit_test(test_table_beyond_all),
        cmocka_unit_test(test_table_ended),
        cmocka_unit_test(test_table_cut_off),
        cmocka_unit_test(test_table_steep_forecast),
        cmocka_unit_test(test_table_forecast_without_an_end),
        cmocka_unit_test(test_table_error),
        cmocka_unit_test(test_table_narrow_interval),
        cmocka_unit_test(test_table_not_finite),
        cmocka_unit_test(test_table_error_of_two_runs),
        cmocka_unit_test(test_table_error_of_a_part),
        cmocka_unit_test(test_table_truth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
