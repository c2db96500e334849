#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/message.h"
#include "common/scene.h"
#include "master/json.h"
#include "master/report.h"
#include "master/text_file.h"
#include "test/text.h"

enum { RANKS = 100 };

/* A run on count renderers in which rank i was busy for 3 + i / 100 of 4 seconds. */
static struct report sample_report(struct renderer_stats *renderers, int count)
{
    for (int i = 0; i < count; i++) {
        renderers[i] = (struct renderer_stats){
            .rank = (uint32_t)i,
            .tiles = 75,
            .pixels = 518400,
            .busy_s = 3 + i / 100.0,
            .cpu_s = 3,
            .wait_s = 0.5,
            .send_s = 0.125,
            .finish_s = 3.5 + i / 100.0,
            .bytes = 6220800,
            .counts = {.rays = {1000000, 2000000, 300000, 0},
                       .exact_fallbacks = 7,
                       .intersect_s = 2,
                       .shade_s = 1,
                       .bound_rays = 5,
                       .truncation = 0.001},
            .host = "node",
        };
    }
    struct report report = {
        .version = "1.2.3",
        .config = "lantern.ini",
        .image_file = "lantern.png",
        .image_width = 1920,
        .image_height = 1080,
        .processes = count,
        .cores = (uint32_t)count + 3,
        .processors = (uint32_t)count,
        .kernel = PROCESSOR_AVX2,
        .schedule = SCHEDULE_DYNAMIC,
        .tile_edge = 32,
        .tiles = 300,
        .primitives = 5,
        .triangles = 3,
        .duplicates = 4,
        .lights = 2,
        .scene_bytes = 12345,
        .bvh_bytes = 678,
        .guessed_rmse = (double)NAN,
        .features = FEATURE_TRIANGLES | FEATURE_LIGHTS,
        .time = {.total = 5,
                 .init = 0.25,
                 .load = 0.125,
                 .broadcast = 0.0625,
                 .build = 0.25,
                 .render = 4,
                 .write = 0.3125,
                 .probe = 0.03125,
                 .resume = 0.015625,
                 .room = 0.0078125},
        .renderers = renderers,
        .renderer_count = count,
        .master_cpu_s = 0.01,
        .master_messages = 600,
        .repeated_tiles = 3,
        .wasted_s = 0.0625,
    };
    report.picture = report_counts(&report);
    return report;
}

static void test_balance(void **state)
{
    (void)state;
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
    (void)state;
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
    assert_has(text, "\"seconds_saved\": 0.000000,\n    \"seconds_repeated\": 0.000000\n  }\n}\n");
    free(text);
    report.triangles = 0;
    text = report_json(&report);
    assert_has(text, "\"bytes_per_triangle\": null,\n");
    free(text);
}

/* Of rank i, every number another one. */
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

/* Every number under its own name: none is like another, or twice as large. */
static void test_json_whole(void **state)
{
    (void)state;
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
    report.forecast = (struct error_forecast){true, false, 0.0022, 3.59, 0.001, 0.55, 0.06, 65, 0};
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
    report.resumed = (struct resumed){
        .tiles = 15, .pixels = 977, .records = 18, .seconds = 1.37, .cpu_s = 1.21, .again_s = 0.41};
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

/* The first in the picture, not on the lowest rank; what is not a number is null. */
static void test_bad_samples(void **state)
{
    (void)state;
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
    char *text = report_json(&report);
    assert_has(text,
               "\"nonfinite\": 3,\n    \"first\": {\"rank\": 2, \"pixel\": [6, 2], \"sample\": 3, "
               "\"depth\": 4, \"ray\": {\"origin\": [null, 0.5, 1], "
               "\"direction\": [0, 0, -1]}},\n");
    free(text);
    text = report_bad_samples(&report);
    assert_has(text, "3 samples are not finite; the first is sample 3 of pixel 6 2, rank 2, ");
    free(text);
}

/* A tile that two have rendered is work of both, but once in the picture. */
static void test_twice(void **state)
{
    (void)state;
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
    char *text = report_json(&report);
    assert_has(text, "\"nonfinite\": 1,\n");
    assert_has(text, "\"primary\": 2000032,\n");
    free(text);
}

/* What an earlier run has met counts for the picture, not for this run's work. */
static void test_resumed(void **state)
{
    (void)state;
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    const struct bad_sample early = {.x = 3, .y = 1}, late = {.x = 1, .y = 7};
    report.resumed.tiles = 5;
    report.resumed.pixels = 80;
    report.resumed.records = 7;
    report.resumed.seconds = 1.5;
    report.resumed.again_s = 0.25;
    report.resumed.counts.truncation = 2;
    report.resumed.counts.rays[RAY_PRIMARY] = 1;
    render_counts_bad(&report.resumed.counts, &early);
    render_counts_bad(&renderers[1].counts, &late);
    report.picture = report_counts(&report);
    assert_int_equal(report_picture_counts(&report).rays[RAY_PRIMARY],
                     report_counts(&report).rays[RAY_PRIMARY] + 1);
    assert_int_equal(report_picture_counts(&report).nonfinite, 2);
    char *text = report_json(&report);
    assert_has(text, "\"nonfinite\": 2,\n    \"first\": {\"rank\": null, \"pixel\": [3, 1], ");
    assert_has(text, "\"truncation\": 2,\n");
    assert_has(text,
               "\"resumed\": {\n    \"tiles\": 5,\n    \"pixels\": 80,\n    \"records\": 7,\n"
               "    \"seconds_saved\": 1.500000,\n    \"seconds_repeated\": 0.250000\n  }\n}\n");
    free(text);
    text = report_bad_samples(&report);
    assert_has(text,
               "2 samples are not finite; the first is sample 0 of pixel 3 1, an earlier run");
    free(text);
}

/* Each feature is named once: used, or left out. */
static void test_json_features(void **state)
{
    (void)state;
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

static void test_json_without_numbers(void **state)
{
    (void)state;
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

static void assert_json_string(const char *value, const char *expected)
{
    struct json json;
    json_begin(&json);
    json_string(&json, NULL, value);
    char *text = json_end(&json), *whole = format_text("\"%s\"\n", expected);
    assert_string_equal(text, whole);
    free(whole);
    free(text);
}

static void test_json_strings(void **state)
{
    (void)state;
    assert_json_string("", "");
    assert_json_string("a\"b\\c/\n\x7f\x01", "a\\\"b\\\\c/\\u000a\\u007f\\u0001");
    assert_json_string("\xc3\xa9 \xe2\x82\xac \xf0\x9f\x94\xa6",
                       "\xc3\xa9 \xe2\x82\xac \xf0\x9f\x94\xa6");
    assert_json_string("\xff", "\\ufffd");
    assert_json_string("a\xc3", "a\\ufffd");                     /* cut */
    assert_json_string("\xe2\x82", "\\ufffd\\ufffd");            /* cut */
    assert_json_string("\xc0\x80", "\\ufffd\\ufffd");            /* longer than need be */
    assert_json_string("\xe0\x80\x80", "\\ufffd\\ufffd\\ufffd"); /* the same */
    assert_json_string("\xed\xa0\x80", "\\ufffd\\ufffd\\ufffd"); /* a surrogate */
    assert_json_string("\xf4\x90\x80\x80", "\\ufffd\\ufffd\\ufffd\\ufffd"); /* above U+10FFFF */
}

static void test_json_numbers(void **state)
{
    (void)state;
    const double values[] = {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, 0, 123456789, -2.5};
    const char *const expected[] = {"0.1\n",
                                    "0.3333333333333333\n",
                                    "4.94065645841247e-324\n",
                                    "1.7976931348623157e+308\n",
                                    "0\n",
                                    "123456789\n",
                                    "-2.5\n"};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        struct json json;
        json_begin(&json);
        json_number(&json, NULL, values[i]);
        char *text = json_end(&json);
        assert_string_equal(text, expected[i]);
        assert_true(strtod(text, NULL) == values[i]);
        free(text);
    }
}

/* The table as text that the caller frees. */
static char *table_text(const struct report *report, int columns)
{
    char *text;
    size_t bytes;
    FILE *out = open_memstream(&text, &bytes);
    assert_non_null(out);
    report_table(out, report, columns);
    fclose(out);
    return text;
}

static void assert_fits(const char *text, size_t columns)
{
    while (*text) {
        size_t length = strcspn(text, "\n");
        if (length > columns) fail_msg("too long for %zu: %.*s", columns, (int)length, text);
        text += length + 1;
    }
}

static void test_table(void **state)
{
    (void)state;
    struct renderer_stats renderers[4];
    struct report report = sample_report(renderers, 4);
    renderers[0].pixels /= 2;
    renderers[1].pixels += renderers[0].pixels;
    renderers[2].busy_s = 1.5;
    char *text = table_text(&report, 80);
    assert_has(text, "  rendering           4.000 s   80.0 %  ###################\n");
    assert_has(text, "  writing             0.312 s    6.2 %  ##\n"
                     "  other               0.000 s    0.0 %\n"
                     "  total               5.000 s\n");
    assert_has(text, "  intersection        2.000 s   50.0 %  ############\n");
    assert_has(text, "  waiting             0.500 s   12.5 %  ###\n");
    assert_has(text,
               "     0     75   259200   12.5 %    0.500    3.000  ########################\n");
    assert_has(text, "     2     75   518400   25.0 %    0.500    1.500  ############\n");
    assert_has(text, "  mean     75   518400   25.0 %    0.500    2.635  #####################\n");
    assert_has(text, "efficiency 65.9 %, imbalance 1.150, tail 0.030 s\n");
    assert_has(text, "13.2M rays, 3.3M per second\n4.0M primary, 8.0M shadow, 1.2M reflection\n");
    assert_has(text, "picture lantern.png\n");
    assert_null(strstr(text, "NaN"));
    assert_null(strstr(text, "node"));
    assert_null(strstr(text, "CPU"));
    free(text);
    report.time.total = 8;
    text = table_text(&report, 80);
    assert_has(
        text, "  other               3.000 s   37.5 %  #########\n  total               8.000 s\n");
    /* All of them wait while a pass is planned. */
    assert_null(strstr(text, "planning"));
    free(text);
    report.plan_s = 0.3;
    text = table_text(&report, 80);
    assert_has(text, "  planning passes     0.300 s    7.5 %  ##\n"
                     "  waiting             0.200 s    5.0 %  #\n");
    free(text);
    /* No more of that than they have waited. What was read of a journal is nothing else besides. */
    report.plan_s = 9;
    report.resumed.records = 1;
    report.time.resume = 1;
    text = table_text(&report, 80);
    assert_has(text, "  planning passes     0.500 s   12.5 %  ###\n"
                     "  waiting             0.000 s    0.0 %\n");
    assert_has(text, "  reading journal     1.000 s   12.5 %  ###\n");
    assert_has(text, "  other               2.000 s   25.0 %  ######\n");
    assert_null(strstr(text, "picture memory"));
    free(text);
    report.time.room = 1;
    text = table_text(&report, 80);
    assert_has(text, "  picture memory      1.000 s   12.5 %  ###\n");
    assert_has(text, "  other               1.000 s   12.5 %  ###\n");
    report.resumed.records = 0;
    report.time.room = 0;
    free(text);
    renderers[3].cpu_s = 0;
    text = table_text(&report, 80);
    assert_has(text,
               "\nCPU time is 85 % of busy time, as cores were shared, its imbalance is 1.333\n");
    free(text);
    for (int i = 0; i < 4; i++)
        renderers[i].counts = (struct render_counts){.rays = {i == 0}};
    text = table_text(&report, 80);
    assert_has(text, "\n1 ray, ");
    free(text);
}

/* The seconds in the line of the second table that begins so; 0: there is none. */
static double seconds_of(const char *text, const char *label)
{
    char *start = format_text("\n  %s  ", label), *line = strstr(text, start);
    double seconds = line ? strtod(line + strlen(start), NULL) : 0;
    free(start);
    return seconds;
}

static double sum_of_parts(const char *text)
{
    static const char *const labels[] = {"pre-pass",       "intersection", "shading",
                                         "without a core", "waiting",      "sending, other"};
    double sum = 0;
    for (size_t i = 0; i < sizeof labels / sizeof *labels; i++)
        sum += seconds_of(text, labels[i]);
    return sum;
}

/* The pre-pass is none of what is left, nor is the time in which somebody else had the core. */
static void test_table_parts(void **state)
{
    (void)state;
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    for (int i = 0; i < 2; i++) {
        renderers[i].busy_s = renderers[i].cpu_s = 3.375;
        renderers[i].wait_s = 0.5;
    }
    report.time.probe = 0.25;
    char *text = table_text(&report, 80);
    assert_has(text, "renderers\n  pre-pass            0.250 s    6.2 %  ##\n"
                     "  intersection        2.000 s   50.0 %");
    assert_has(text,
               "  sending, other      0.250 s    6.2 %  ##\n"); /* 0.125 s in tiles given up */
    assert_null(strstr(text, "without a core"));
    free(text);
    /* 0.65 of 3.25 s of tiles, and of 3.375 s that were busy. */
    renderers[0].cpu_s = 1;
    renderers[1].cpu_s = 0.3;
    text = table_text(&report, 80);
    assert_has(text, "  pre-pass            0.050 s    1.2 %\n"
                     "  intersection        0.400 s   10.0 %  ##\n"
                     "  shading             0.200 s    5.0 %  #\n"
                     "  without a core      2.725 s   68.1 %  ################\n"
                     "  waiting             0.500 s   12.5 %  ###\n"
                     "  sending, other      0.125 s    3.1 %  #\n");
    assert_true(fabs(sum_of_parts(text) - 4) < 0.002);
    free(text);
    /* No more of it than fits beside the rest, as where a time limit cuts it off. */
    report.time.probe = 3;
    renderers[0].cpu_s = renderers[1].cpu_s = 3.375;
    text = table_text(&report, 80);
    assert_has(text, "  pre-pass            0.375 s    9.4 %");
    assert_true(fabs(sum_of_parts(text) - 4) < 0.002);
    free(text);
    report.time.probe = 0;
    text = table_text(&report, 80);
    assert_null(strstr(text, "pre-pass"));
    free(text);
}

/* More renderers than cores are no faster than these, and the CPU time of one is not uneven. */
static void test_table_cores(void **state)
{
    (void)state;
    struct renderer_stats renderers[8];
    struct report report = sample_report(renderers, 8);
    char *text = table_text(&report, 80);
    assert_null(strstr(text, " core"));
    free(text);
    report.cores = report.processors = 2;
    for (int i = 0; i < 8; i++)
        renderers[i].cpu_s = 0.75;
    text = table_text(&report, 80);
    assert_has(text,
               "\n8 renderers on 2 cores: at most 2 times as fast as one\n"
               "CPU time is 25 % of busy time, as cores were shared, its imbalance is 1.000\n");
    free(text);
    report.cores = 9;
    report.processors = 5;
    text = table_text(&report, 80);
    assert_has(text, "\n8 renderers, 5 on a core at a time: at most 5 times as fast as one\n");
    free(text);
    report.cores = report.processors = 1;
    text = table_text(&report, 80);
    assert_has(text, "\n8 renderers on 1 core: no faster than one\n");
    free(text);
    report.renderer_count = 1;
    text = table_text(&report, 80);
    assert_has(text, "\nCPU time is 25 % of busy time, as cores were shared\n");
    assert_null(strstr(text, "1 renderers"));
    free(text);
}

/* A picture that an earlier run has left as a whole says nothing of the renderers. */
static void test_table_nothing_rendered(void **state)
{
    (void)state;
    struct renderer_stats renderers[2] = {0};
    struct report report = sample_report(renderers, 0);
    report.renderer_count = 2;
    report.resumed.records = report.resumed.tiles = 300;
    report.resumed.pixels = 2073600;
    char *text = table_text(&report, 40);
    assert_fits(text, 40);
    assert_has(text, "  total               5.000 s\n\n"
                     "nothing was rendered\n  all was in the journal\n");
    assert_null(strstr(text, "efficiency"));
    assert_null(strstr(text, " rays"));
    free(text);
    renderers[1].counts.rays[RAY_PRIMARY] = 1;
    text = table_text(&report, 80);
    assert_has(text, "efficiency");
    free(text);
}

/* Of the columns, pixels go first: a share and its bar say more. */
static void test_table_narrow(void **state)
{
    (void)state;
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    char *text = table_text(&report, 50);
    assert_fits(text, 50);
    assert_has(text, "farm 1.2.3, 1920 x 1080 pixels, 2 renderers\n  dynamic schedule, 300 ");
    assert_has(text, "  rank  tiles    share   wait s   busy s\n"
                     "     0     75   50.0 %    0.500    3.000  ########\n");
    free(text);
    text = table_text(&report, 57);
    assert_has(text, "     0     75   518400   50.0 %    0.500    3.000  ######\n");
    free(text);
    text = table_text(&report, 40);
    assert_has(text, "     0     75   50.0 %    0.500    3.000\n");
    free(text);
}

/* What a PNG cannot show is told where there is any. */
static void test_table_clipped(void **state)
{
    (void)state;
    struct renderer_stats renderers[1];
    struct report report = sample_report(renderers, 1);
    char *text = table_text(&report, 80);
    assert_null(strstr(text, "clipped"));
    free(text);
    report.quantisation = (struct quantisation){.clipped = 435, .clipped_rmse = 0.00651};
    text = table_text(&report, 80);
    assert_has(text, "\nclipped: 435 pixels beyond what the file can hold, RMSE 0.0065\n");
    free(text);
    text = table_text(&report, 40);
    assert_has(text, "\n  beyond what the file can hold\n  RMSE 0.0065\n");
    free(text);
}

/* What the picture may lack is told where it lacks something. */
static void test_table_truncation(void **state)
{
    (void)state;
    struct renderer_stats renderers[1];
    static const struct {
        double most;
        const char *text; /* never less than that */
    } bounds[] = {{0.0321, "0.033"},
                  {0.032, "0.032"},
                  {0.0401358, "0.041"},
                  {0.996, "1"},
                  {0.0996, "0.1"},
                  {0.9901, "1"},
                  {0.07, "0.07"},
                  {1, "1"},
                  {1.01, "1.1"},
                  {12.1, "13"},
                  {99.5, "1e+02"},
                  {121, "1.3e+02"},
                  {0.0000100001, "0.000011"},
                  {3.21e-12, "3.3e-12"}};
    struct report report = sample_report(renderers, 1);
    for (size_t i = 0; i < sizeof bounds / sizeof *bounds; i++) {
        char line[64];
        report.picture.truncation = bounds[i].most;
        snprintf(line, sizeof line, "\ntruncation: at most %s anywhere\n", bounds[i].text);
        char *text = table_text(&report, 80);
        assert_has(text, line);
        free(text);
    }
    report.resumed.counts.truncation = HUGE_VAL;
    char *text = table_text(&report, 80);
    assert_has(text, "\ntruncation: without bound\n");
    free(text);
    report.picture.truncation = report.resumed.counts.truncation = 0;
    text = table_text(&report, 80);
    assert_null(strstr(text, "truncation"));
    free(text);
}

static void test_table_fits(void **state)
{
    (void)state;
    static struct renderer_stats renderers[RANKS];
    for (int count = 0; count <= RANKS; count = 2 * count + 1) {
        struct report report = sample_report(renderers, count);
        if (count > 1) memset(renderers[1].host, 'h', 60);
        for (int columns = 40; columns < 130; columns++) {
            char *text = table_text(&report, columns);
            assert_fits(text, (size_t)columns);
            free(text);
        }
    }
}

static void test_table_extremes(void **state)
{
    (void)state;
    struct renderer_stats renderers[1];
    struct report report = sample_report(renderers, 1);
    renderers[0].busy_s = renderers[0].wait_s = report.time.total = report.time.render = 1e7;
    renderers[0].pixels = renderers[0].counts.rays[0] = UINT64_MAX;
    renderers[0].tiles = UINT32_MAX;
    report.picture.nonfinite = 12;
    char *text = table_text(&report, 40);
    assert_fits(text, 40);
    assert_has(text, "12 samples are not finite\n");
    free(text);
    report.time = (struct run_times){0};
    report.image_file = "a\033[2J\xc2\x9b\x9bé.png";
    text = table_text(&report, 0);
    assert_fits(text, 80);
    assert_has(text, "picture a?[2J???é.png\n");
    assert_null(strstr(text, "inf "));
    assert_null(strstr(text, "nan"));
    free(text);
}

static void test_table_of_many(void **state)
{
    (void)state;
    static struct renderer_stats renderers[RANKS];
    struct report report = sample_report(renderers, RANKS);
    strcpy(renderers[7].host, "other");
    char *text = table_text(&report, 80);
    assert_has(text, "\n    99     75   518400    1.0 %    0.500    3.990");
    assert_has(text, "\n    96     75");
    assert_has(text, "\n   ...  92 more, then the idlest\n     3     75");
    assert_has(text, "\n     0     75");
    assert_null(strstr(text, "\n    95 "));
    assert_null(strstr(text, "\n     4 "));
    assert_has(text, "  mean     75   518400    1.0 %    0.500    3.495");
    assert_has(text, "  host\n");
    assert_has(text, "  node ");
    free(text);
    *renderers[7].host = '\0'; /* it has never reported: nobody knows */
    text = table_text(&report, 80);
    assert_null(strstr(text, "  host\n"));
    free(text);
}

/* Of the last row of a run. */
static const struct error_row last_row = {2.4, 16, {0.000098, 0.000087, 0.00011}, (double)NAN, 1};

/* Of a run with two renderers, here, and that row. */
static struct report report_of_row(struct renderer_stats *renderers, struct error_row *row,
                                   struct error_log *log)
{
    struct report report = sample_report(renderers, 2);
    *row = last_row;
    *log = (struct error_log){row, 1};
    report.errors = log;
    return report;
}

/* Where less is beyond what is allowed, or nothing tells what it would take. */
static void test_table_no_forecast(void **state)
{
    (void)state;
    struct renderer_stats renderers[2];
    struct error_row row;
    struct error_log log;
    struct report report = report_of_row(renderers, &row, &log);
    report.forecast = (struct error_forecast){.rmse = 0.000098, .goal = 0.000049, .beyond = true};
    report.max_samples = 64;
    report.ended = ENDED_BY_TARGET;
    report.target = 0.0001;
    char *text = table_text(&report, 80);
    assert_null(strstr(text, "not known"));
    assert_has(text, "\n0.000049 is beyond sampling.max_samples = 64\n"
                     "sampling.target_error = 0.0001 is met\n");
    free(text);
    report.forecast = (struct error_forecast){.known = false};
    text = table_text(&report, 80);
    assert_has(text,
               "\nwhat less would take is not known\nsampling.target_error = 0.0001 is met\n");
    free(text);
    report.ended = ENDED_BY_TIME;
    text = table_text(&report, 80);
    assert_has(text, "\nstopped by sampling.time_limit, "
                     "sampling.target_error = 0.0001 is not met\n");
    free(text);
    report.target = 0;
    text = table_text(&report, 80);
    assert_has(text, "\nstopped by sampling.time_limit\n");
    free(text);
    report.passes = 3;
    report.missing_share = 0.4;
    text = table_text(&report, 80);
    assert_has(text, "\nstopped by sampling.time_limit, pass 3 was cut off:\n"
                     "  40.0 % of its pixels are missing\n");
    free(text);
    report.missing_share = 0.0001; /* never none */
    text = table_text(&report, 130);
    assert_has(text, ", pass 3 was cut off: 0.1 % of its pixels are missing\n");
    free(text);
    report.unsampled = 1;
    text = table_text(&report, 80);
    assert_null(strstr(text, "cut off"));
    free(text);
}

/* A slope that no sampling has is not shown, and the report has it. */
static void test_table_steep_forecast(void **state)
{
    (void)state;
    struct renderer_stats renderers[2];
    struct error_row row;
    struct error_log log;
    struct report report = report_of_row(renderers, &row, &log);
    report.forecast =
        (struct error_forecast){true, false, 0.000098, 2, 0.00004, 351.1, 154.88, 0, 0.06};
    char *text = table_text(&report, 80), *json = report_json(&report);
    assert_has(text, "\n0.00004 would take about 2.41 s (2.4 to 2.47)\n");
    assert_has(json, "\"slope\": -351.1,");
    free(text);
    free(json);
    report.forecast.slope = 2.1;
    text = table_text(&report, 80);
    assert_has(text, ", slope -2.10 +- ");
    free(text);
}

/* In a terminal of 80 columns. */
static void assert_table_has(const struct report *report, const char *expected)
{
    char *text = table_text(report, 80);
    assert_has(text, expected);
    free(text);
}

/* An error with what less would cost. */
static void test_table_error(void **state)
{
    (void)state;
    struct renderer_stats renderers[2];
    struct error_row row;
    struct error_log log;
    struct report report = report_of_row(renderers, &row, &log);
    report.forecast = (struct error_forecast){true, false, 0.000098, 2, 0.00002, 0.5, 0, 64, 0};
    assert_table_has(&report, "\nsampling error: RMSE 0.000098 (0.000087 to 0.00011) after 2.4 s\n"
                              "0.00002 would take about 48.4 s (48.4 to 48.4), with 64 samples\n"
                              "  slope -0.50 +- 0.00\n");
    char *text = table_text(&report, 40);
    assert_fits(text, 40);
    assert_has(text, "\nsampling error: RMSE 0.000098\n  (0.000087 to 0.00011) after 2.4 s\n"
                     "0.00002 would take about 48.4 s\n  (48.4 to 48.4), with 64 samples\n");
    free(text);
    report.forecast.seconds = 50;
    assert_table_has(&report, "0.00002 would take about 1153 s (1153 to 1153), with 64 samples\n");
    row.elapsed_s = 0.0374;
    assert_table_has(&report, " after 0.037 s\n");
}

/* An earlier run's part counts as this one's. */
static void test_table_error_of_two_runs(void **state)
{
    (void)state;
    struct renderer_stats renderers[2];
    struct error_row row;
    struct error_log log;
    struct report report = report_of_row(renderers, &row, &log);
    report.forecast = (struct error_forecast){true, false, 0.000098, 12, 0.00002, 0.5, 0, 64, 0};
    row.true_rmse = 0.00009;
    report.resumed.render_s = 10;
    report.resumed.cpu_s = 20;
    assert_table_has(&report,
                     " after 2.4 s\n  and 10.0 s of an earlier run (20.0 s of CPU time, shared)\n"
                     "  RMSE 0.00009 against the reference\n0.00002 would take about 289 s (");
    row.true_rmse = 0.2;
    assert_table_has(&report, "\n  RMSE 0.2 against the reference (is it of this view?)\n");
}

/* Where only a part of the pixels has samples. */
static void test_table_error_of_a_part(void **state)
{
    (void)state;
    struct renderer_stats renderers[2];
    struct error_row row;
    struct error_log log;
    struct report report = report_of_row(renderers, &row, &log);
    row.share = 0.00095;
    assert_table_has(&report, " of the 0.095 % that has samples after 2.4 s\n");
    row.share = 0.0456;
    char *text = table_text(&report, 80);
    assert_has(text, "of the 4.5 % that has samples");
    assert_null(strstr(text, "guessed"));
    free(text);
    report.unsampled = 9544;
    assert_table_has(&report, "that of what is guessed is not known");
    report.guessed_rmse = 0.01;
    row.share = 0.36;
    row.estimate = (struct error_estimate){0.002, 0.0019, 0.0021};
    /* 0.36 * 0.002^2 + 0.64 * 0.01^2 = 0.0081^2 */
    assert_table_has(&report, "about 0.0081 of the whole picture, 0.01 of what is guessed");
    char *json = report_json(&report);
    assert_has(json, "\"guessed_rmse\": 0.01\n");
    free(json);
    /* The true error is known also where no row knows it, as pixels are without samples. */
    row.true_rmse = (double)NAN;
    report.has_reference = true;
    report.truth.rmse = 0.0123;
    assert_table_has(&report, ", 0.01 of what is guessed\n"
                              "  RMSE 0.012 of the whole picture against the reference\n");
    row.true_rmse = 0.2;
    report.has_reference = false;
    report.guessed_rmse = (double)NAN;
    report.unsampled = 0;
    row.share = 0.9996;
    assert_table_has(&report, "of the 99.9 % that has samples");
    row.elapsed_s = 0.0374;
    assert_table_has(&report, " after 0.037 s,");
}

/* One sample tells nothing about its own error. */
static void test_table_truth(void **state)
{
    (void)state;
    struct renderer_stats renderers[2];
    struct report report = sample_report(renderers, 2);
    struct error_log log = {0};
    report.errors = &log;
    report.has_reference = true;
    report.truth.rmse = 0.0231;
    char *text = table_text(&report, 80);
    assert_has(text, "\nsampling error: RMSE 0.023 against the reference\n");
    free(text);
    report.has_reference = false;
    report.max_samples = 1;
    text = table_text(&report, 80);
    assert_has(text, "\nsampling error: unknown with one sample a pixel\n");
    free(text);
    report.max_samples = 2; /* of which no pixel has come in */
    text = table_text(&report, 80);
    assert_null(strstr(text, "sampling error"));
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
        cmocka_unit_test(test_table_no_forecast),
        cmocka_unit_test(test_table_steep_forecast),
        cmocka_unit_test(test_table_error),
        cmocka_unit_test(test_table_error_of_two_runs),
        cmocka_unit_test(test_table_error_of_a_part),
        cmocka_unit_test(test_table_truth),
        cmocka_unit_test(test_json_features),
        cmocka_unit_test(test_json_without_numbers),
        cmocka_unit_test(test_json_strings),
        cmocka_unit_test(test_json_numbers),
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_table_parts),
        cmocka_unit_test(test_table_nothing_rendered),
        cmocka_unit_test(test_table_cores),
        cmocka_unit_test(test_table_narrow),
        cmocka_unit_test(test_table_clipped),
        cmocka_unit_test(test_table_truncation),
        cmocka_unit_test(test_table_fits),
        cmocka_unit_test(test_table_extremes),
        cmocka_unit_test(test_table_of_many),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
