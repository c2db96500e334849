/* A report of a sample run, and its table as text. */
#ifndef FARM_TEST_REPORT_FIXTURE_H
#define FARM_TEST_REPORT_FIXTURE_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/scene.h"
#include "master/report.h"
#include "test/text.h"
#include "test/unit.h"

/* The settings of that run, which was adaptive. */
static const struct settings sample_settings = {.image = {1920, 1080, {0}},
                                                .camera = {.up = {0, 1, 0}, .fov = 45},
                                                .sampling = {.samples = 7,
                                                             .min_samples = 4,
                                                             .max_samples = 64,
                                                             .target_error = 0.0001,
                                                             .reference = ""},
                                                .farm = {.schedule = SCHEDULE_DYNAMIC},
                                                .output = {.image = "lantern.png"}};

/* A run on count renderers in which rank i was busy for 3 + i / 100 of 4 seconds. */
static inline struct report sample_report(struct renderer_stats *renderers, int count)
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
        .settings = &sample_settings,
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

/* The table as text that the caller frees. */
static inline char *table_text(const struct report *report, int columns)
{
    char *text;
    size_t bytes;
    FILE *out = open_memstream(&text, &bytes);
    assert_non_null(out);
    report_table(out, report, columns);
    fclose(out);
    return text;
}

/* In a terminal with so many columns. */
static inline void assert_table_has(const struct report *report, int columns, const char *expected)
{
    char *text = table_text(report, columns);
    assert_has(text, expected);
    free(text);
}

static inline void assert_table_lacks(const struct report *report, int columns,
                                      const char *unexpected)
{
    char *text = table_text(report, columns);
    assert_null(strstr(text, unexpected));
    free(text);
}

static inline void assert_json_has(const struct report *report, const char *expected)
{
    char *text = report_json(report);
    assert_has(text, expected);
    free(text);
}

static inline void assert_fits(const char *text, size_t columns)
{
    while (*text) {
        size_t length = strcspn(text, "\n");
        if (length > columns) fail_msg("too long for %zu: %.*s", columns, (int)length, text);
        text += length + 1;
    }
}

#endif
