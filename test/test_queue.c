/* The work queue: every pixel exactly once, whoever asks in whatever order. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "master/queue.h"

/* A small generator of our own, so that a failure repeats. */
static uint32_t random_below(uint64_t *state, uint32_t bound)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)((*state >> 33) % bound);
}

static void mark(unsigned char *seen, const struct queue_config *config, const struct tile *tile)
{
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        assert_true(x < config->width && y < config->height);
        assert_int_equal(seen[(size_t)y * config->width + x]++, 0);
    }
}

struct held {
    uint32_t renderer, id;
};

/* Renderers chosen at random ask for tiles and finish tiles, until nothing moves any more. */
static void drive(const struct queue_config *config, uint64_t seed)
{
    struct queue *queue = queue_create(config);
    assert_non_null(queue);
    size_t pixels = (size_t)config->width * config->height;
    unsigned char *seen = calloc(pixels, 1);
    struct held *held = calloc(2 * (size_t)config->renderers, sizeof *held);
    uint32_t count = 0;
    while (queue_tiles_finished(queue) < queue_tiles(queue)) {
        struct tile tile;
        uint32_t renderer = random_below(&seed, config->renderers);
        if (queue_next(queue, renderer, &tile)) {
            assert_true(tile_pixels(&tile) <= queue_largest_tile(queue));
            mark(seen, config, &tile);
            held[count++] = (struct held){renderer, tile.id};
        } else if (count > 0) {
            uint32_t i = random_below(&seed, count);
            struct held back = held[i];
            held[i] = held[--count];
            assert_true(queue_held(queue, back.renderer, back.id, &tile));
            queue_finish(queue, back.renderer, back.id);
            assert_false(queue_held(queue, back.renderer, back.id, &tile));
        }
    }
    for (size_t i = 0; i < pixels; i++)
        assert_int_equal(seen[i], 1);
    assert_int_equal(queue_pixels_finished(queue), pixels);
    free(held);
    free(seen);
    queue_destroy(queue);
}

static void test_every_pixel_once(void **state)
{
    (void)state;
    const uint32_t sizes[][2] = {{1, 1}, {7, 5}, {64, 48}, {97, 61}, {640, 3}, {1, 300}};
    const uint32_t renderers[] = {1, 2, 3, 5, 44, 400};
    const uint32_t edges[] = {1, 8, 24, 64};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        for (size_t r = 0; r < sizeof renderers / sizeof *renderers; r++) {
            struct queue_config config = {
                .width = sizes[s][0], .height = sizes[s][1], .renderers = renderers[r]};
            config.tile_edge = edges[(s + r) % 4];
            for (int schedule = SCHEDULE_DYNAMIC; schedule <= SCHEDULE_CYCLIC; schedule++) {
                config.schedule = (enum schedule)schedule;
                drive(&config, 1 + s * 100 + r);
            }
        }
    }
}

/* Rows that one renderer gets, all its tiles together. */
static uint32_t rows_of(struct queue *queue, uint32_t renderer, uint32_t *first)
{
    uint32_t rows = 0;
    struct tile tile;
    while (queue_next(queue, renderer, &tile)) {
        if (rows == 0) *first = tile.y;
        assert_int_equal(tile.y, *first + rows);
        rows += tile.h;
        queue_finish(queue, renderer, tile.id);
    }
    return rows;
}

/* The paper: rows that do not divide evenly go to the first processors, one each. */
static void test_strips_are_the_papers(void **state)
{
    (void)state;
    struct queue_config config = {
        .schedule = SCHEDULE_STRIPS, .width = 640, .height = 480, .renderers = 44};
    struct queue *queue = queue_create(&config);
    uint32_t next = 0;
    for (uint32_t r = 0; r < 44; r++) {
        uint32_t first = 0;
        /* 480 = 44 * 10 + 40 */
        assert_int_equal(rows_of(queue, r, &first), r < 40 ? 11 : 10);
        assert_int_equal(first, next);
        next += r < 40 ? 11 : 10;
    }
    queue_destroy(queue);
}

static void test_cyclic_deals_pixels(void **state)
{
    (void)state;
    struct queue_config config = {
        .schedule = SCHEDULE_CYCLIC, .width = 333, .height = 200, .renderers = 7};
    struct queue *queue = queue_create(&config);
    for (uint32_t r = 0; r < 7; r++) {
        struct tile tile;
        while (queue_next(queue, r, &tile)) {
            for (uint32_t k = 0; k < tile_pixels(&tile); k++) {
                uint32_t x, y;
                tile_pixel(&tile, k, &x, &y);
                assert_int_equal((y * 333 + x) % 7, r);
            }
            queue_finish(queue, r, tile.id);
        }
    }
    assert_int_equal(queue_pixels_finished(queue), 333 * 200);
    queue_destroy(queue);
}

/* One tile in work and one in reserve, but no reserve when others could start it at once. */
static void test_reserve(void **state)
{
    (void)state;
    struct queue_config config = {.width = 80, .height = 10, .renderers = 2, .tile_edge = 10};
    struct queue *queue = queue_create(&config);
    struct tile tile;
    assert_int_equal(queue_tiles(queue), 8);
    assert_true(queue_next(queue, 0, &tile));
    assert_true(queue_next(queue, 0, &tile));
    assert_false(queue_next(queue, 0, &tile));
    assert_int_equal(queue_holds(queue, 0), 2);
    assert_true(queue_next(queue, 1, &tile));
    for (uint32_t id = 0; id < 2; id++)
        queue_finish(queue, 0, id);
    assert_true(queue_next(queue, 0, &tile));
    assert_true(queue_next(queue, 0, &tile));
    assert_true(queue_next(queue, 1, &tile));
    queue_finish(queue, 1, 2);
    assert_int_equal(tile.id, 5);
    /* Two tiles wait, two renderers: renderer 1 still holds one and gets no second. */
    assert_false(queue_next(queue, 1, &tile));
    queue_finish(queue, 1, 5);
    assert_true(queue_next(queue, 1, &tile));
    queue_destroy(queue);
}

static void test_stop(void **state)
{
    (void)state;
    struct queue_config config = {.width = 100, .height = 100, .renderers = 2, .tile_edge = 10};
    struct queue *queue = queue_create(&config);
    struct tile tile;
    assert_true(queue_next(queue, 0, &tile));
    queue_stop(queue);
    assert_false(queue_next(queue, 0, &tile));
    assert_false(queue_next(queue, 1, &tile));
    assert_true(queue_held(queue, 0, tile.id, &tile));
    queue_finish(queue, 0, tile.id);
    assert_int_equal(queue_tiles_finished(queue), 1);
    queue_destroy(queue);
}

static void test_answers_are_checked(void **state)
{
    (void)state;
    struct queue_config config = {.width = 100, .height = 100, .renderers = 2, .tile_edge = 10};
    struct queue *queue = queue_create(&config);
    struct tile tile;
    assert_true(queue_next(queue, 0, &tile));
    assert_false(queue_held(queue, 1, tile.id, &tile));
    assert_false(queue_held(queue, 0, tile.id + 1, &tile));
    assert_false(queue_held(queue, 0, UINT32_MAX, &tile));
    queue_destroy(queue);
}

static void test_too_many_tiles(void **state)
{
    (void)state;
    struct queue_config config = {.width = 16384, .height = 16384, .renderers = 1, .tile_edge = 1};
    assert_null(queue_create(&config));
}

static void test_auto_edge(void **state)
{
    (void)state;
    assert_int_equal(queue_auto_edge(640, 480, 1), 32);
    assert_int_equal(queue_auto_edge(640, 480, 44), 8);
    assert_int_equal(queue_auto_edge(1920, 1080, 2), 64);
    assert_int_equal(queue_auto_edge(1, 1, 100), 8);
    assert_int_equal(queue_auto_edge(65535, 65535, 44), 64);
}

/* Two tiles of three are finished already, as hashed from where they lie. */
static bool is_finished(void *state, const struct tile *tile)
{
    unsigned char *seen = state;
    if ((tile->x / 7 + tile->y / 5 + tile->phase) % 3 == 0) return false;
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        assert_int_equal(seen[y * 50 + x]++, 0);
    }
    return true;
}

static void test_skip(void **state)
{
    (void)state;
    for (enum schedule schedule = SCHEDULE_DYNAMIC; schedule <= SCHEDULE_CYCLIC; schedule++) {
        const struct queue_config config = {
            .schedule = schedule, .width = 50, .height = 40, .renderers = 3, .tile_edge = 7};
        struct queue *queue = queue_create(&config);
        unsigned char seen[50 * 40] = {0};
        uint64_t pixels = 0;
        queue_skip(queue, is_finished, seen);
        for (int i = 0; i < 50 * 40; i++)
            pixels += seen[i];
        assert_true(pixels > 0);
        assert_int_equal(queue_pixels_finished(queue), pixels);
        for (uint32_t renderer = 0; renderer < 3; renderer++) {
            struct tile tile;
            while (queue_next(queue, renderer, &tile)) {
                mark(seen, &config, &tile);
                queue_finish(queue, renderer, tile.id);
            }
        }
        assert_int_equal(queue_tiles_finished(queue), queue_tiles(queue));
        assert_int_equal(queue_pixels_finished(queue), 50 * 40);
        for (int i = 0; i < 50 * 40; i++)
            assert_int_equal(seen[i], 1);
        queue_destroy(queue);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_pixel_once),
        cmocka_unit_test(test_strips_are_the_papers),
        cmocka_unit_test(test_cyclic_deals_pixels),
        cmocka_unit_test(test_reserve),
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_answers_are_checked),
        cmocka_unit_test(test_too_many_tiles),
        cmocka_unit_test(test_auto_edge),
        cmocka_unit_test(test_skip),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
