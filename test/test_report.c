/* The figures of a run that the report works out, and the report as JSON. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "master/text_file.h"
#include "test/report_fixture.h"
#include "test/unit.h"

static void test_balance(void **state)
{
    struct renderer_stats renderers[3];
    struct report report = sample_report(renderers, 3);
    struct balance balance = report_balance(&report);
    assert_true(fabs(balance.efficiency - 9.03 / 12) < 1e-9);
    assert_true(fabs(balance.imbalance - 3.02 / 3.01) < 1e-9);
    assert_true(fabs(balance.tail_s - 0.02) < 1e-9);
    assert_true(fabs(balance.cpu_share - 9 / 9.03) < 1e-9 && balance.cpu_imbalance == 1);
    renderers[1].cpu_s = 1.5;
    balance = report_balance(&report);
    assert_true(fabs(balance.cpu_share - 7.5 / 9.03) < 1e-9);
    assert_true(fabs(balance.cpu_imbalance - 1.2) < 1e-9);
    renderers[1].cpu_s = 9; /* clocks differ: never more than all */
    assert_true(report_balance(&report).cpu_share == 1);
    renderers[2] = (struct renderer_stats){.silent = 1}; /* nobody knows when it stopped */
    assert_true(report_balance(&report).tail_s < 0.02);
    report.renderer_count = 0;
    report.time.render = 0;
    balance = report_balance(&report);
    assert_true(balance.efficiency == 0 && balance.imbalance == 1 && balance.tail_s == 0);
    assert_true(balance.cpu_share == 1 && balance.cpu_imbalance == 1);
}

static void test_json(void **state)
{
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    char *text = report_json(&report);
    assert_has(text, "\"farm\": {\n    \"version\": \"1.2.3\",\n    \"processes\": 2,\n");
    assert_has(text, "\"kernel\": \"avx2\",\n    \"schedule\": \"dynamic\",\n    \"tile\": 32,\n   "
                     " \"tiles\": 300\n  },");
    assert_has(text, "\"triangles\": 3,\n    \"duplicates\": 4,\n    \"lights\": 2,");
    assert_has(text, "\"bvh_bytes\": 678,\n    \"bytes_per_triangle\": 4341,\n    \"used\": [\"");
    assert_has(text, "\"load_s\": 0.125000,\n    \"resume_s\": 0.015625,\n");
    assert_has(text, "\"room_s\": 0.007812,\n");
    assert_has(text,
               "\"render_s\": 4.000000,\n    \"probe_s\": 0.031250,\n    \"write_s\": 0.312500\n");
    assert_has(text,
               "\"primary\": 2000000,\n    \"shadow\": 4000000,\n    \"reflection\": 600000,");
    assert_has(text, "{\"rank\": 1, \"host\": \"node\", \"tiles\": 75, \"pixels\": 518400, "
                     "\"busy_s\": 3.010000, \"cpu_s\": 3.000000, \"wait_s\": 0.500000, "
                     "\"send_s\": 0.125000, \"finish_s\": 3.510000, \"intersect_s\": 2.000000, "
                     "\"shade_s\": 1.000000, \"bytes\": 6220800}\n  ],");
    assert_has(text, "\"repeated_tiles\": 3,\n    \"wasted_s\": 0.062500\n");
    assert_has(text, "\"error\": [],");
    assert_has(text, "\"truncation\": 0.001,\n    \"rays\": 10\n");
    assert_has(text, "\"arithmetic\": null,");
    assert_has(text, "\"quantisation\": {\n    \"rmse\": 0,\n    \"max\": 0,\n");
    assert_has(text, "\"nonfinite\": 0,\n    \"first\": null,\n    \"exact_fallbacks\": 14,\n"
                     "    \"unmatched_media\": 0,\n    \"open_media\": 0\n  },");
    assert_has(text, "\"seconds_saved\": 0.000000,\n    \"seconds_repeated\": 0.000000\n  },\n");
    free(text);
    report.triangles = 0;
    assert_json_has(&report, "\"bytes_per_triangle\": null,\n");
}

/* Statistics of rank i, in which all numbers are different. */
static struct renderer_stats distinct_stats(uint32_t i)
{
    return (struct renderer_stats){
        .rank = i,
        .tiles = 11 + i,
        .silent = i == 1,
        .pixels = 1301 + 7 * i,
        .busy_s = 3.1 + i / 4.0,
        .cpu_s = 2.7 + i / 8.0,
        .wait_s = 0.31 + i / 16.0,
        .send_s = 0.017 + i / 32.0,
        .finish_s = 3.7 + i / 64.0,
        .bytes = 62207 + 13 * i,
        .counts = {.rays = {1000003 + i, 700001 + 3 * i, 50021 + 5 * i, 313 + 7 * i},
                   .exact_fallbacks = 7 + 10 * i,
                   .intersect_s = 1.9 + i / 4.0,
                   .shade_s = 0.83 + i / 8.0,
                   .bound_rays = 41 + 3 * i,
                   .truncation = 0.001 + i / 1024.0,
                   .unmatched_media = 2 + i,
                   .open_media = 9 + 4 * i},
        .host = "node",
    };
}

/* Every number is under its own name: in this report none is like another, or twice as large. */
static void test_json_whole(void **state)
{
    struct renderer_stats renderers[] = {distinct_stats(0), distinct_stats(1), distinct_stats(2)};
    struct error_row rows[] = {
        {0.51, 4, {0.021, 0.019, 0.023}, 0.037, 0.6}, /* above the interval, though not by much */
        {1.53, 9.5, {0.0081, 0.0071, 0.0093}, 0.0083, 0.9},
        {2.57, 16.25, {0.0043, 0.0037, 0.0047}, 0.0029, 1}, /* below it */
        {3.59, 32.75, {0.0022, 0.0015, 0.0026}, (double)NAN, 1}};
    struct error_log log = {rows, 4};
    struct report report = sample_report(renderers, 0);
    report.processes = 4;
    report.renderer_count = 3;
    report.cores = 7;
    report.processors = 2;
    report.primitives = 137;
    report.triangles = 59;
    report.time.build = 0.27;
    report.time.probe = 0.033;
    report.errors = &log;
    report.forecast =
        (struct error_forecast){true, false, 0.0022, 3.59, 0.001, 0.55, 0.06, 65, 0, 0};
    report.min_samples = 6;
    report.max_samples = 260;
    report.unsampled = 19;
    report.guessed_rmse = 0.0133;
    report.passes = 8;
    report.missing_share = 0.375;
    report.plan_s = 0.0123;
    report.ended = ENDED_BY_TIME;
    report.has_reference = true;
    report.truth = (struct truth){0.0029, 0.71, 0.053};
    report.quantisation = (struct quantisation){0.00113, 0.0071, 29, 0.00037};
    report.master_cpu_s = 0.0103;
    report.master_messages = 601;
    report.service_s = 0.000000631;
    report.answer_wait_s = 0.000517;
    report.answer_wait_most_s = 0.0089;
    report.repeated_tiles = 38;
    report.wasted_s = 0.067;
    report.heat = (struct heat_range){0.00000021, 0.0000047};
    report.resumed = (struct resumed){.tiles = 15,
                                      .pixels = 977,
                                      .records = 18,
                                      .seconds = 1.37,
                                      .cpu_s = 1.21,
                                      .repeated_s = 0.41};
    report.picture = report_counts(&report);
    char *text = report_json(&report);
    struct text_file expected;
    assert_true(text_file_read("test/data/report.json", 1 << 16, &expected));
    if (strcmp(text, expected.text) != 0) {
        fprintf(stderr, "other than test/data/report.json:\n%s", text); /* print_error() cuts */
        fail();
    }
    text_file_free(&expected);
    free(text);
}

/* Of the samples that are not finite, the first one in the picture is named, not that of the lowest rank; NaN is
 * written as null. */
static void test_bad_samples(void **state)
{
    struct renderer_stats renderers[3];
    struct report report = sample_report(renderers, 3);
    assert_null(report_bad_samples(&report));
    const struct bad_sample late = {.x = 1, .y = 7};
    const struct bad_sample early = {.x = 6,
                                     .y = 2,
                                     .sample = 3,
                                     .depth = 4,
                                     .origin = {(double)NAN, 0.5, 1},
                                     .direction = {0, 0, -1}};
    render_counts_bad(&renderers[0].counts, &late);
    render_counts_bad(&renderers[2].counts, &early);
    render_counts_bad(&renderers[2].counts, &late);
    report.picture = report_counts(&report);
    assert_json_has(
        &report,
        "\"nonfinite\": 3,\n    \"first\": {\"rank\": 2, \"pixel\": [6, 2], \"sample\": 3, "
        "\"depth\": 4, \"ray\": {\"origin\": [null, 0.5, 1], "
        "\"direction\": [0, 0, -1]}},\n");
    char *text = report_bad_samples(&report);
    assert_has(text, "3 samples are not finite, or too bright for floats; the first is sample 3 of "
                     "pixel 6 2, rank 2, ");
    free(text);
}

/* A tile that two renderers have rendered counts as work of both, but once for the picture. */
static void test_twice(void **state)
{
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    const struct bad_sample bad = {.x = 3, .y = 1};
    struct render_counts tile = {.rays = {16}, .exact_fallbacks = 5};
    render_counts_bad(&tile, &bad);
    for (int i = 0; i < 2; i++)
        render_counts_add(&renderers[i].counts, &tile);
    render_counts_add(&report.picture, &tile);
    assert_int_equal(report_picture_counts(&report).nonfinite, 1);
    assert_int_equal(report_counts(&report).nonfinite, 2);
    assert_json_has(&report, "\"nonfinite\": 1,\n");
    assert_json_has(&report, "\"primary\": 2000032,\n");
}

/* What an earlier run has counted belongs to the picture, not to this run's work. */
static void test_resumed(void **state)
{
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    const struct bad_sample early = {.x = 3, .y = 1}, late = {.x = 1, .y = 7};
    report.resumed.tiles = 5;
    report.resumed.pixels = 80;
    report.resumed.records = 7;
    report.resumed.seconds = 1.5;
    report.resumed.repeated_s = 0.25;
    report.resumed.counts.truncation = 2;
    report.resumed.counts.rays[RAY_PRIMARY] = 1;
    render_counts_bad(&report.resumed.counts, &early);
    render_counts_bad(&renderers[1].counts, &late);
    report.picture = report_counts(&report);
    assert_int_equal(report_picture_counts(&report).rays[RAY_PRIMARY],
                     report_counts(&report).rays[RAY_PRIMARY] + 1);
    assert_int_equal(report_picture_counts(&report).nonfinite, 2);
    assert_json_has(&report,
                    "\"nonfinite\": 2,\n    \"first\": {\"rank\": null, \"pixel\": [3, 1], ");
    assert_json_has(&report, "\"truncation\": 2,\n");
    assert_json_has(&report,
                    "\"resumed\": {\n    \"tiles\": 5,\n    \"pixels\": 80,\n    \"records\": 7,\n"
                    "    \"seconds_saved\": 1.500000,\n    \"seconds_repeated\": 0.250000\n  },\n");
    char *text = report_bad_samples(&report);
    assert_has(text, "2 samples are not finite, or too bright for floats; the first is sample 0 of "
                     "pixel 3 1, an earlier run");
    free(text);
}

/* Each feature is named once: used, or left out. */
static void test_json_features(void **state)
{
    struct renderer_stats renderers[1];
    struct report report = sample_report(renderers, 1);
    char *text = report_json(&report), *left_out = strstr(text, "\"left_out\"");
    assert_non_null(left_out);
    for (unsigned i = 0; i < FEATURE_COUNT; i++) {
        char *name = format_text("\"%s\"", scene_feature_name(i));
        char *place = strstr(strstr(text, "\"used\""), name);
        assert_non_null(place);
        assert_int_equal(place < left_out, report.features >> i & 1);
        free(name);
    }
    free(text);
}

/* Numbers are numbers, all else is what a user would write; nothing that has no say is there. */
static void test_json_settings(void **state)
{
    struct renderer_stats renderers[1];
    struct report report = sample_report(renderers, 1);
    char *text = report_json(&report);
    assert_has(text, "\"settings\": {\n    \"image\": {\"width\": 1920, \"height\": 1080},\n");
    assert_has(text, "\"up\": \"0 1 0\", \"fov\": 45},\n");
    assert_has(text, "\"sampling\": {\"min_samples\": 4, \"max_samples\": 64, "
                     "\"target_error\": 0.0001, \"time_limit\": 0, \"reference\": \"\"},\n");
    assert_has(text, "\"farm\": {\"schedule\": \"dynamic\", \"tile\": \"auto\", "
                     "\"master_renders\": \"no\",");
    assert_has(text, "\"output\": {\"image\": \"lantern.png\",");
    free(text);
    struct settings settings = sample_settings;
    settings.sampling.target_error = 0;
    settings.image.region[2] = settings.image.region[3] = 5;
    settings.farm.tile = 16;
    report.settings = &settings;
    text = report_json(&report);
    assert_has(text, "\"region\": \"0 0 5 5\"}");
    assert_has(text, "\"tile\": 16,");
    assert_has(text, "\"sampling\": {\"samples\": 7, ");
    free(text);
}

static void test_json_without_numbers(void **state)
{
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    renderers[1].counts.truncation = HUGE_VAL;
    report.picture = report_counts(&report);
    report.time.load = (double)NAN;
    report.renderers = renderers;
    char *text = report_json(&report);
    assert_has(text, "\"truncation\": null");
    assert_has(text, "\"load_s\": null");
    assert_null(strstr(text, ": nan"));
    assert_null(strstr(text, ": inf"));
    free(text);
}

/* What a run did not have is null, or is not there. */
static void test_json_without_extras(void **state)
{
    struct renderer_stats renderers[1];
    struct report report = sample_report(renderers, 1);
    report.has_reference = false;
    report.heat = (struct heat_range){0, 0};
    report.forecast = (struct error_forecast){.known = false};
    char *text = report_json(&report);
    assert_has(text, "\"reference\": null");
    assert_has(text, "\"forecast\": null");
    assert_null(strstr(text, "\"heatmap\": {"));
    free(text);
    report.forecast =
        (struct error_forecast){true, false, 0.0022, 3.59, 0.001, 0.55, 0.06, 0, 0, 0};
    text = report_json(&report);
    assert_has(text, "\"forecast\": {");
    assert_null(strstr(text, "\"samples\":"));
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_balance),
        cmocka_unit_test(test_json),
        cmocka_unit_test(test_json_whole),
        cmocka_unit_test(test_bad_samples),
        cmocka_unit_test(test_twice),
        cmocka_unit_test(test_resumed),
        cmocka_unit_test(test_json_features),
        cmocka_unit_test(test_json_settings),
        cmocka_unit_test(test_json_without_numbers),
        cmocka_unit_test(test_json_without_extras),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
