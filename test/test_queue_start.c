/* The initial state of the queue: how large tiles are, which tiles there are, and which of them an earlier run has
 * finished. */

#include "test/queue_fixture.h"
#include "test/unit.h"

/* The configured tile edge, or the automatic one; a band has no more rows than a renderer's share. */
static void test_tile_edge(void **state)
{
    static const struct {
        struct queue_config config;
        uint32_t edge;
    } cases[] = {
        {{.schedule = SCHEDULE_DYNAMIC, .tile_edge = 16}, 16},
        {{.schedule = SCHEDULE_TILES, .tile_edge = 64}, 64},
        {{.schedule = SCHEDULE_STRIPS, .tile_edge = 7}, 7},
        {{.schedule = SCHEDULE_STRIPS, .tile_edge = 30}, 25},
        {{.schedule = SCHEDULE_CYCLIC, .tile_edge = 30}, 30},
        {{.schedule = SCHEDULE_CYCLIC, .tile_edge = 300}, 100},
        {{.schedule = SCHEDULE_CYCLIC_ROWS}, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct queue_config config = cases[i].config;
        config.width = config.height = 100, config.renderers = 4;
        struct queue *queue = queue_create(&config);
        assert_int_equal(queue_tile_edge(queue), cases[i].edge);
        queue_destroy(queue);
    }
}

/* Even a small share is cut into several bands, so that its progress shows, but no band is less than a row. */
static void test_bands_show_progress(void **state)
{
    for (int schedule = SCHEDULE_STRIPS; schedule <= SCHEDULE_CYCLIC; schedule++) {
        struct queue_config config = {.schedule = (enum schedule)schedule, .renderers = 6};
        config.width = 320, config.height = 240;
        struct queue *queue = queue_create(&config);
        assert_in_range(queue_count(queue).tiles, 6 * 16, 6 * 20);
        queue_destroy(queue);
        config.renderers = 240;
        queue = queue_create(&config);
        assert_in_range(queue_count(queue).tiles, 240, 2 * 240);
        queue_destroy(queue);
    }
}

/* A band for very many renderers has no more rows than a tile may have, else no renderer would take it. */
static void test_bands_fit_into_tiles(void **state)
{
    struct queue_config config = {
        .schedule = SCHEDULE_CYCLIC, .width = 16384, .height = 16384, .renderers = 1000};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    assert_int_equal(queue_tile_edge(queue), TILE_MAX_PIXELS / 16384);
    assert_int_equal(queue_next(queue, 999, 0, lot), 1);
    assert_true(tile_message_valid(&lot[0], 16384, 16384));
    queue_destroy(queue);
}

static void test_too_many_tiles(void **state)
{
    struct queue_config config = {.width = 16384, .height = 16384, .renderers = 1, .tile_edge = 1};
    assert_null(queue_create(&config));
}

static void test_auto_edge(void **state)
{
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 640, 480, 1, 1), 32);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 640, 480, 1, 44), 8);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 1920, 1080, 1, 2), 64);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 1, 1, 1, 100), 8);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 65535, 65535, 1, 44), 64);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 1, 2), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 1, 12), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 1, 44), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 3, 1000), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 4, 44), 8);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 4, 12), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 4, 13), 8);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 640, 480, 256, 12), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_DYNAMIC, 1920, 1440, 16, 44), 16);
    assert_int_equal(queue_auto_edge(SCHEDULE_TILES, 640, 480, 16, 1), 32);
}

static void test_auto_probe_edge(void **state)
{
    assert_int_equal(queue_auto_probe_edge(640, 480, 1), 24);
    assert_int_equal(queue_auto_probe_edge(640, 480, 16), 6);
    assert_int_equal(queue_auto_probe_edge(640, 480, 4096), 4);
    assert_int_equal(queue_auto_probe_edge(191, 192, 1), 0);
    assert_int_equal(queue_auto_probe_edge(192, 192, 1), 24);
    assert_int_equal(queue_auto_probe_edge(1, 1, 65535), 0);
}

/* An earlier run has finished three of four pixels, in squares of 16 that do not match the queue's tiles. */
static bool was_finished(uint32_t x, uint32_t y)
{
    return x / 16 % 2 || y / 16 % 2;
}

static uint32_t finished_pixels(void *state, const struct tile *tile)
{
    uint32_t count = 0;
    for (uint32_t k = 0; k < tile_pixels(tile); k++) {
        uint32_t x, y;
        tile_pixel(tile, k, &x, &y);
        count += was_finished(x, y);
    }
    return count;
}

static uint32_t all_finished(void *state, const struct tile *tile)
{
    return tile_pixels(tile);
}

static void test_skip(void **state)
{
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        const struct queue_config config = {.schedule = (enum schedule)schedule,
                                            .width = 50,
                                            .height = 40,
                                            .renderers = 3,
                                            .tile_edge = 7,
                                            .probe_edge = 10};
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES];
        unsigned char seen[50 * 40] = {0};
        uint64_t seed = 1;
        uint32_t last = 0;
        bool splits = schedule == SCHEDULE_DYNAMIC || schedule == SCHEDULE_TILES;
        queue_skip(queue, finished_pixels, NULL);
        if (splits) assert_true(queue_count(queue).share_skipped > 0.5);
        if (!splits)
            assert_true(queue_count(queue).share_skipped == queue_count(queue).share_finished);
        while (!queue_complete(queue)) {
            uint32_t renderer = last++ % 3;
            uint32_t count = queue_next(queue, renderer, last, lot);
            for (uint32_t i = 0; i < count; i++) {
                if (lot[i].pass == TILE_PROBE) answer_probe(queue, &lot[i], &seed);
                if (queue_finish(queue, renderer, lot[i].id, last, 1e-3))
                    mark(seen, &config, &lot[i]);
            }
            assert_true(last < 100000);
            if (splits) check_sums(queue);
        }
        assert_int_equal(queue_count(queue).pixels_finished, 50 * 40);
        uint32_t again = 0;
        for (uint32_t i = 0; i < 50 * 40; i++) {
            assert_true(seen[i] || was_finished(i % 50, i / 50));
            again += seen[i] && was_finished(i % 50, i / 50);
        }
        if (splits) assert_true(again < 50 * 40 / 8);
        queue_destroy(queue);
        queue = queue_create(&config);
        queue_skip(queue, all_finished, NULL);
        assert_true(queue_complete(queue) && queue_over(queue, 0));
        assert_int_equal(queue_next(queue, 0, 0, lot), 0);
        queue_destroy(queue);
    }
}

static uint32_t upper_half(void *state, const struct tile *tile)
{
    return tile->y < 24 ? tile_pixels(tile) : 0;
}

/* The end is foretold from what is left to this run: what an earlier one has finished takes no time. */
static void test_end_of_what_is_left(void **state)
{
    struct queue_config config = {.width = 64, .height = 48, .renderers = 1, .tile_edge = 8};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    double now = 0, pixels = 0;
    queue_skip(queue, upper_half, NULL);
    assert_int_equal(queue_count(queue).tiles, 8 * 6); /* none had to be split */
    while (pixels < 12 * 64) {
        uint32_t count = queue_next(queue, 0, now, lot);
        for (uint32_t i = 0; i < count; i++) {
            double seconds = tile_pixels(&lot[i]) / 64.0;
            queue_finish(queue, 0, lot[i].id, now += seconds, seconds);
            pixels += tile_pixels(&lot[i]);
        }
    }
    assert_true(pixels < 24 * 64 && fabs(queue_ends(queue, now) - 24) < 1e-6);
    queue_destroy(queue);
}

/* Where an earlier run has finished pass 0, tiles of later passes are predicted from probes all the same. */
static void test_passes_behind_a_finished_one(void **state)
{
    struct queue_config config = {.schedule = SCHEDULE_DYNAMIC,
                                  .width = 64,
                                  .height = 64,
                                  .renderers = 2,
                                  .tile_edge = 16,
                                  .probe_edge = 8};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], tile = {.w = 64, .h = 64, .step = 1, .pass = 1};
    uint32_t probes = 0, count;
    uint64_t seed = 1;
    queue_skip(queue, all_finished, NULL);
    assert_int_equal(queue_next(queue, 0, 0, lot), 0);
    for (tile.w = tile.h = 16; tile.x < 64; tile.x += 16)
        queue_add(queue, &tile, queue_work(queue, &tile), 1);
    check_sums(queue);
    for (uint32_t who = 0; !queue->settled; who = 1 - who) {
        count = queue_next(queue, who, 0, lot);
        for (uint32_t i = 0; i < count; i++, probes++) {
            assert_int_equal(lot[i].pass, TILE_PROBE);
            answer_probe(queue, &lot[i], &seed);
            queue_finish(queue, who, lot[i].id, 0, 1e-3);
        }
        assert_true(count > 0);
    }
    assert_true(probes > 0);
    queue_destroy(queue);
}

/* The most probes of a probe tile of a queue with a probe every four pixels. */
static uint32_t probes_of_a_tile(uint32_t width, uint32_t height, uint32_t renderers)
{
    const struct queue_config config = {
        .width = width, .height = height, .renderers = renderers, .tile_edge = 16, .probe_edge = 4};
    struct queue *queue = queue_create(&config);
    uint32_t blocks = queue->map.probe_blocks;
    queue_destroy(queue);
    return blocks;
}

/* Few probes are in short tiles, a tile for each renderer if possible; two million are in long ones, several for each
 * renderer. */
static void test_probes_of_a_tile(void **state)
{
    assert_int_equal(probes_of_a_tile(640, 480, 44), 8);
    assert_int_equal(probes_of_a_tile(64, 48, 44), 192 / 44);
    assert_int_equal(probes_of_a_tile(64, 48, 400), 1);
    assert_int_equal(probes_of_a_tile(7680, 4320, 44), 64);
    assert_int_equal(probes_of_a_tile(7680, 4320, 10000), 1920 * 1080 / 10000 / 8);
    assert_int_equal(probes_of_a_tile(7680, 4320, 100000), 8);
}

/* Every probe tile is handed out once, however many there are; and a few that follow each other are spread over the
 * picture, so that a lot of them is as expensive as any other. */
static void test_probes_are_spread(void **state)
{
    for (uint32_t tiles = 1; tiles <= LOT_TILES; tiles++) {
        struct queue_config config = {
            .width = 64, .height = 8 * tiles, .renderers = 1, .tile_edge = 16, .probe_edge = 8};
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES];
        bool seen[LOT_TILES] = {false};
        uint32_t least = UINT32_MAX, most = 0;
        assert_int_equal(queue_next(queue, 0, 0, lot), tiles);
        for (uint32_t i = 0; i < tiles; i++) {
            uint32_t row = lot[i].id - queue->first_probe;
            assert_true(row < tiles && !seen[row]);
            seen[row] = true;
            if (i % 8 == 0) least = UINT32_MAX, most = 0;
            least = row < least ? row : least, most = row > most ? row : most;
            if (i % 8 == 7) assert_true(2 * (most - least) >= tiles);
        }
        queue_destroy(queue);
    }
}

/* Before anything is known, the first tiles that renderers get come from all over the picture. */
static void test_first_tiles_are_scattered(void **state)
{
    struct queue_config config = {.width = 256, .height = 256, .renderers = 16, .tile_edge = 16};
    struct queue *queue = queue_create(&config);
    uint32_t quarters[4] = {0};
    for (uint32_t renderer = 0; renderer < 16; renderer++) {
        struct tile lot[LOT_TILES];
        assert_true(queue_next(queue, renderer, 0, lot) > 0);
        quarters[lot[0].x / 128 + 2 * (lot[0].y / 128)]++;
    }
    for (int i = 0; i < 4; i++)
        assert_in_range(quarters[i], 2, 6);
    queue_destroy(queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tile_edge),
        cmocka_unit_test(test_bands_show_progress),
        cmocka_unit_test(test_bands_fit_into_tiles),
        cmocka_unit_test(test_too_many_tiles),
        cmocka_unit_test(test_auto_edge),
        cmocka_unit_test(test_auto_probe_edge),
        cmocka_unit_test(test_skip),
        cmocka_unit_test(test_end_of_what_is_left),
        cmocka_unit_test(test_passes_behind_a_finished_one),
        cmocka_unit_test(test_probes_of_a_tile),
        cmocka_unit_test(test_probes_are_spread),
        cmocka_unit_test(test_first_tiles_are_scattered),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
