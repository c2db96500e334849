/*
 * Fuzzes messages: damages good ones. What the validators of common/protocol.h still accept must be safe to use as the
 * receiver uses it.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/protocol.h"
#include "test/fuzz/fuzz.h"

#define WIDTH  640
#define HEIGHT 480
#define BUILD  "0.1.0"

static const struct tile good_tile = {.id = 3, .x = 32, .y = 64, .w = 32, .h = 16, .step = 1};

/* A damaged copy of a good message, of the exact size; the caller frees it. */
static void *damaged(const uint8_t *data, size_t size, const void *good, size_t *bytes)
{
    void *whole = allocate(*bytes, 1);
    memcpy(whole, good, *bytes);
    *bytes = fuzz_damage(data, size, whole, *bytes);
    void *message = allocate(*bytes, 1);
    memcpy(message, whole, *bytes);
    free(whole);
    return message;
}

static void check_tile(const uint8_t *data, size_t size)
{
    size_t bytes = sizeof good_tile;
    struct tile *tile = damaged(data, size, &good_tile, &bytes);
    if (bytes == sizeof *tile && tile_message_valid(tile, WIDTH, HEIGHT)) {
        uint32_t pixels = tile_pixels(tile), x, y;
        PROMISE(pixels >= 1 && pixels <= TILE_MAX_PIXELS);
        for (uint32_t k = 0; k < pixels; k += pixels / 7 + 1) {
            tile_pixel(tile, k, &x, &y);
            PROMISE(x < WIDTH && y < HEIGHT);
        }
        tile_pixel(tile, pixels - 1, &x, &y);
        PROMISE(x < WIDTH && y < HEIGHT);
    }
    free(tile);
}

static void check_result(const uint8_t *data, size_t size)
{
    size_t pixels = tile_pixels(&good_tile);
    size_t bytes = result_bytes(&good_tile, (uint32_t)pixels, false);
    struct result_header *good = allocate_zeroed(bytes, 1);
    good->tile_id = good_tile.id;
    good->pixels = (uint32_t)pixels;
    struct result_header *header = damaged(data, size, good, &bytes);
    if (result_message_valid(header, bytes, &good_tile, false)) {
        float last;
        memcpy(&last, (const char *)(header + 1) + (3 * pixels - 1) * sizeof last, sizeof last);
        PROMISE(header->pixels == pixels && isfinite(header->start_s) && isfinite(header->busy_s) &&
                isfinite(header->cpu_s));
    }
    free(good);
    free(header);
}

/* The same for a tile of which only some pixels got samples. */
static void check_pass(const uint8_t *data, size_t size)
{
    struct tile tile = good_tile;
    tile.pass = 2;
    uint32_t pixels = tile_pixels(&tile) / 3;
    size_t bytes = result_bytes(&tile, pixels, true);
    struct result_header *good = allocate_zeroed(bytes, 1);
    good->tile_id = tile.id;
    good->pixels = pixels;
    struct result_header *header = damaged(data, size, good, &bytes);
    if (result_message_valid(header, bytes, &tile, true) && header->pixels > 0) {
        float last;
        size_t at = (REFINED_FLOATS * (size_t)header->pixels - 1) * sizeof last;
        memcpy(&last, (const char *)(header + 1) + at, sizeof last);
        PROMISE(header->pixels <= tile_pixels(&tile));
    }
    free(good);
    free(header);
}

static void check_refinements(const uint8_t *data, size_t size)
{
    const struct view view = {.min_samples = 4, .max_samples = 4096};
    struct refinement good[32];
    for (uint8_t i = 0; i < 32; i++)
        good[i] = (struct refinement){i % 8, i % 8 + 2};
    size_t bytes = sizeof good;
    struct refinement *refinements = damaged(data, size, good, &bytes);
    uint32_t count = (uint32_t)(bytes / sizeof *refinements);
    if (refinements_valid(refinements, count, level_last(&view)))
        for (uint32_t i = 0; i < count; i++)
            PROMISE(level_samples(&view, refinements[i].from) <=
                        level_samples(&view, refinements[i].to) &&
                    level_samples(&view, refinements[i].to) <= view.max_samples);
    free(refinements);
}

static void check_stats(const uint8_t *data, size_t size)
{
    struct renderer_stats good = {.rank = 1, .tiles = 5, .host = "node"};
    struct render_counts sum = {.truncation = 0};
    size_t bytes = sizeof good;
    struct renderer_stats *stats = damaged(data, size, &good, &bytes);
    if (stats_message_valid(stats, bytes, 1)) {
        PROMISE(strlen(stats->host) < sizeof stats->host);
        render_counts_add(&sum, &stats->counts);
        PROMISE(sum.truncation >= 0 &&
                render_counts_rays(&sum) == render_counts_rays(&stats->counts));
    }
    free(stats);
}

static void check_ready(const uint8_t *data, size_t size)
{
    struct ready good = {.rank = 1, .host = "node"};
    size_t bytes = sizeof good;
    struct ready *ready = damaged(data, size, &good, &bytes);
    if (ready_message_valid(ready, bytes, 1)) PROMISE(strlen(ready->host) < sizeof ready->host);
    free(ready);
}

static void check_start(const uint8_t *data, size_t size)
{
    struct start good = {.elapsed_s = 0.5, .patience = 60};
    size_t bytes = sizeof good;
    struct start *start = damaged(data, size, &good, &bytes);
    if (start_message_valid(start, bytes)) PROMISE(start->elapsed_s >= 0 && start->patience >= 0);
    free(start);
}

static void check_welcome(const uint8_t *data, size_t size)
{
    struct welcome good = {.magic = WELCOME_MAGIC, .build = BUILD, .scene_bytes = 1};
    size_t bytes = sizeof good;
    struct welcome *welcome = damaged(data, size, &good, &bytes);
    /* A broadcast has a fixed size, so the receiver gets no shorter one. */
    if (bytes == sizeof good && welcome_valid(welcome, BUILD))
        PROMISE(strcmp(welcome->build, BUILD) == 0);
    free(welcome);
}

static void check_lot(const uint8_t *data, size_t size)
{
    struct lot_header good = {.answer_s = 0.5, .reports = 3};
    size_t bytes = sizeof good;
    struct lot_header *lot = damaged(data, size, &good, &bytes);
    /* The receiver has checked the length before. */
    if (bytes == sizeof good && lot_header_valid(lot))
        PROMISE(lot->answer_s >= 0 && lot->reports <= LOT_TILES);
    free(lot);
}

static void check_drop(const uint8_t *data, size_t size)
{
    struct drop good[2] = {{.tile_id = 3, .finished = 1}, {.tile_id = 4}};
    size_t bytes = sizeof good;
    struct drop *drops = damaged(data, size, good, &bytes);
    if (drop_message_valid(drops, bytes)) {
        size_t count = bytes / sizeof *drops;
        PROMISE(count >= 1 && count <= DROP_TILES && bytes % sizeof *drops == 0);
        for (size_t i = 0; i < count; i++)
            PROMISE(drops[i].finished <= 1);
    }
    free(drops);
}

static void check_dropped(const uint8_t *data, size_t size)
{
    struct result_header good = {.tile_id = 3, .pixels = RESULT_DROPPED, .busy_s = 0.5};
    size_t bytes = sizeof good;
    struct result_header *header = damaged(data, size, &good, &bytes);
    /* The receiver has checked the length before. */
    if (bytes == sizeof good && dropped_valid(header))
        PROMISE(isfinite(header->start_s) && isfinite(header->busy_s) && header->busy_s >= 0 &&
                isfinite(header->cpu_s));
    free(header);
}

static void check_tells(const uint8_t *data, size_t size)
{
    float good[4] = {0.5f, 1, 2, HUGE_VALF};
    size_t bytes = sizeof good;
    float *report_s = damaged(data, size, good, &bytes);
    uint32_t count = (uint32_t)(bytes / sizeof *report_s);
    if (lot_report_valid(report_s, count))
        for (uint32_t i = 0; i < count; i++)
            PROMISE(report_s[i] >= 0);
    free(report_s);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static void (*const checks[])(const uint8_t *data, size_t size) = {
        check_tile, check_result,      check_stats, check_welcome, check_ready,   check_start,
        check_pass, check_refinements, check_lot,   check_drop,    check_dropped, check_tells};
    if (size) checks[data[0] % (sizeof checks / sizeof *checks)](data + 1, size - 1);
    return 0;
}
