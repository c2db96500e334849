/* The work queue under all schedules: every pixel is rendered exactly once, whichever renderers ask and answer, in
 * whatever order. */
#include <stdlib.h>

#include "test/queue_fixture.h"
#include "test/random.h"
#include "test/unit.h"

struct held {
    uint32_t renderer, id;
};

/*
 * Renderers chosen at random ask for lots and finish tiles, in times that are unrelated to predictions, until the queue
 * is complete. Renderer 0 often delays its answers; tiles that others have taken over are sometimes dropped. A pixel
 * may be rendered several times, but counts once: by the first answer for its tile, or by a piece when all pieces of
 * its tile are back.
 */
static void drive(const struct queue_config *config, uint64_t seed)
{
    struct queue *queue = queue_create(config);
    assert_non_null(queue);
    size_t pixels = (size_t)config->width * config->height, most = 200 * (size_t)config->renderers;
    unsigned char *seen = calloc(pixels, 1);
    struct held *held = calloc(most, sizeof *held);
    struct tile lot[LOT_TILES], tile;
    uint32_t count = 0;
    double now = 0;
    while (!queue_complete(queue)) {
        uint32_t renderer = random_below(&seed, config->renderers);
        now += 1e-3 * random_below(&seed, 100);
        if (!queue->is_static && random_below(&seed, 64) == 0) check_sums(queue);
        uint32_t tiles = queue_next(queue, renderer, now, lot), sum = 0;
        for (uint32_t i = 0; i < tiles; i++) {
            assert_true(count < most);
            held[count++] = (struct held){renderer, lot[i].id};
            sum += tile_pixels(&lot[i]);
        }
        assert_true(sum <= queue_largest_lot(queue));
        if (tiles > 0 || count == 0) continue;
        uint32_t i = random_below(&seed, count);
        struct held back = held[i];
        if (back.renderer == 0 && random_below(&seed, 10) > 0) continue;
        held[i] = held[--count];
        if (queue_is_recalled(queue, back.renderer, back.id) && random_below(&seed, 2)) {
            queue_drop(queue, back.renderer, back.id, now, 0);
            continue;
        }
        assert_true(queue_find_held(queue, back.renderer, back.id, &tile));
        if (tile.pass == TILE_PROBE) answer_probe(queue, &tile, &seed);
        enum answer answer = queue_finish(queue, back.renderer, back.id, now, 1e-3);
        if (answer == ANSWER_COUNTS) mark(seen, config, &tile);
        hear_fates(queue, seen, config);
        assert_false(queue_find_held(queue, back.renderer, back.id, &tile));
    }
    for (size_t i = 0; i < pixels; i++)
        assert_int_equal(seen[i], 1);
    if (!queue->is_static) check_sums(queue);
    struct queue_count counted = queue_count(queue);
    assert_int_equal(counted.pixels_finished, pixels);
    assert_true(counted.share_finished > 0.999 && counted.share_finished <= 1);
    uint32_t next = 0;
    assert_false(queue_unfinished(queue, &next, &tile));
    free(held);
    free(seen);
    queue_destroy(queue);
}

static void test_every_pixel_once(void **state)
{
    const uint32_t sizes[][2] = {{1, 1}, {7, 5}, {64, 48}, {97, 61}, {640, 3}, {1, 300}};
    const uint32_t renderers[] = {1, 2, 3, 5, 44, 400};
    const uint32_t edges[] = {1, 8, 24, 64};
    const uint32_t probe_edges[] = {0, 2, 8, 16};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        for (size_t r = 0; r < sizeof renderers / sizeof *renderers; r++) {
            struct queue_config config = {
                .width = sizes[s][0], .height = sizes[s][1], .renderers = renderers[r]};
            config.tile_edge = edges[(s + r) % 4];
            config.probe_edge = probe_edges[(s + 2 * r) % 4];
            for (int schedule = 0; schedule < SCHEDULES; schedule++) {
                config.schedule = (enum schedule)schedule;
                for (uint64_t seed = 1 + s * 100 + r; seed < 20000; seed += 1000)
                    drive(&config, seed);
            }
        }
    }
}

/* However cheap pixels are, no lot has more of them than its message has room for. */
static void test_large_lots(void **state)
{
    const struct queue_config config = {
        .width = 2048, .height = 1024, .renderers = 1, .tile_edge = 64};
    for (uint64_t seed = 1; seed < 4; seed++)
        drive(&config, seed);
}

/* Once the queue is stopped nobody gets any tiles; those that are out may still come back. */
static void test_stop(void **state)
{
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        struct queue_config config = {.schedule = (enum schedule)schedule,
                                      .width = 100,
                                      .height = 100,
                                      .renderers = 2,
                                      .tile_edge = 10};
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES], more[LOT_TILES], tile;
        uint32_t count = queue_next(queue, 0, 0, lot);
        assert_true(count > 0);
        queue_stop(queue);
        assert_int_equal(queue_next(queue, 0, 0, more), 0);
        assert_int_equal(queue_next(queue, 1, 0, more), 0);
        assert_true(queue_over(queue, 1));
        assert_false(queue_over(queue, 0));
        assert_true(queue_find_held(queue, 0, lot[0].id, &tile));
        queue_finish(queue, 0, lot[0].id, 0, 0);
        assert_int_equal(queue_count(queue).finished, 1);
        assert_false(queue_complete(queue));
        queue_destroy(queue);
    }
}

static void test_answers_are_checked(void **state)
{
    struct queue_config config = {.width = 100, .height = 100, .renderers = 2, .tile_edge = 10};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], tile;
    assert_true(queue_next(queue, 0, 0, lot) > 0);
    assert_true(queue_find_held(queue, 0, lot[0].id, &tile));
    assert_false(queue_find_held(queue, 1, lot[0].id, &tile));
    assert_false(queue_find_held(queue, 0, lot[0].id + 1, &tile));
    assert_false(queue_find_held(queue, 0, UINT32_MAX, &tile));
    queue_destroy(queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_pixel_once),
        cmocka_unit_test(test_large_lots),
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_answers_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
