/* The schedules that hand out one tile at a time: who gets which tile, how far the run has come, and who takes over
 * from a renderer that gives no sign of life. */
#include <math.h>

#include "common/clock.h"
#include "test/queue_fixture.h"
#include "test/unit.h"

/* The next tile of the renderer, under a schedule that hands out one at a time; false: it gets none. */
static bool next_tile(struct queue *queue, uint32_t renderer, struct tile *tile)
{
    struct tile lot[LOT_TILES];
    uint32_t count = queue_next(queue, renderer, 0, lot);
    assert_true(count <= 1);
    if (count == 1) *tile = lot[0];
    return count == 1;
}

/* The renderer finishes its whole share, a block of rows; returns how many these are, *first: the topmost one. */
static uint32_t rows_of(struct queue *queue, uint32_t renderer, uint32_t *first)
{
    uint32_t rows = 0;
    struct tile tile;
    while (next_tile(queue, renderer, &tile)) {
        if (rows == 0) *first = tile.y;
        assert_int_equal(tile.y, *first + rows);
        rows += tile.h;
        queue_finish(queue, renderer, tile.id, 0, 0);
    }
    assert_int_equal(queue_tile_count(queue, renderer), 0);
    return rows;
}

/* As in the paper of Yamamori and others (README.md), rows that do not divide evenly go to the first processors, one
 * each. */
static void test_strips_are_the_papers(void **state)
{
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

/* Pixel i goes to renderer i mod P, and nobody gets a tile without pixels. */
static void deal_pixels(uint32_t width, uint32_t height, uint32_t renderers)
{
    struct queue_config config = {
        .schedule = SCHEDULE_CYCLIC, .width = width, .height = height, .renderers = renderers};
    struct queue *queue = queue_create(&config);
    for (uint32_t r = 0; r < renderers; r++) {
        struct tile tile;
        while (next_tile(queue, r, &tile)) {
            assert_true(tile_pixels(&tile) > 0);
            for (uint32_t k = 0; k < tile_pixels(&tile); k++) {
                uint32_t x, y;
                tile_pixel(&tile, k, &x, &y);
                assert_int_equal((y * width + x) % renderers, r);
            }
            queue_finish(queue, r, tile.id, 0, 0);
        }
    }
    assert_int_equal(queue_count(queue).pixels_finished, width * height);
    queue_destroy(queue);
}

static void test_cyclic_deals_pixels(void **state)
{
    deal_pixels(333, 200, 7);
    deal_pixels(3, 1, 4);
}

/* As in Tachyon, row y goes to processor y mod P. */
static void test_cyclic_rows_deals_rows(void **state)
{
    struct queue_config config = {
        .schedule = SCHEDULE_CYCLIC_ROWS, .width = 333, .height = 200, .renderers = 7};
    struct queue *queue = queue_create(&config);
    for (uint32_t r = 0; r < 7; r++) {
        struct tile tile;
        for (uint32_t y = r; next_tile(queue, r, &tile); y += 7) {
            assert_true(tile.x == 0 && tile.w == 333 && tile.y == y && tile.h == 1);
            queue_finish(queue, r, tile.id, 0, 0);
        }
    }
    assert_true(queue_complete(queue));
    queue_destroy(queue);
}

/* A renderer holds one tile in work and one in reserve, but gets no reserve that another renderer could start at
 * once. */
static void test_reserve(void **state)
{
    struct queue_config config = {
        .schedule = SCHEDULE_TILES, .width = 80, .height = 10, .renderers = 2, .tile_edge = 10};
    struct queue *queue = queue_create(&config);
    struct tile tile;
    assert_int_equal(queue_count(queue).tiles, 8);
    assert_true(next_tile(queue, 0, &tile));
    assert_true(next_tile(queue, 0, &tile));
    assert_false(next_tile(queue, 0, &tile));
    assert_int_equal(queue_tile_count(queue, 0), 2);
    assert_true(queue_is_full(queue, 0) && !queue_is_full(queue, 1));
    assert_true(next_tile(queue, 1, &tile));
    for (uint32_t id = 0; id < 2; id++)
        queue_finish(queue, 0, id, 0, 0);
    assert_true(next_tile(queue, 0, &tile));
    assert_true(next_tile(queue, 0, &tile));
    assert_true(next_tile(queue, 1, &tile));
    queue_finish(queue, 1, 2, 0, 0);
    assert_int_equal(tile.id, 5);
    /* Two tiles wait, two renderers: renderer 1 still holds one and gets no second. */
    assert_false(next_tile(queue, 1, &tile));
    queue_finish(queue, 1, 5, 0, 0);
    assert_true(next_tile(queue, 1, &tile));
    queue_destroy(queue);
}

/* ---- progress ---- */

static uint32_t above_last_row(void *state, const struct tile *tile)
{
    return tile->y < 50 ? tile_pixels(tile) : 0;
}

/* The progress is that of the share that is least finished, also where an earlier run has finished the others: else the
 * bar would start nearly full and stand still. */
static void test_progress_of_resumed_shares(void **state)
{
    struct queue_config config = {
        .schedule = SCHEDULE_STRIPS, .width = 60, .height = 60, .renderers = 3, .tile_edge = 10};
    struct queue *queue = queue_create(&config);
    queue_skip(queue, above_last_row, NULL); /* all but half of the last share */
    struct queue_count count = queue_count(queue);
    assert_int_equal(count.pixels_finished, 50 * 60);
    assert_true(count.share_finished == 0.5 && count.share_skipped == 0.5);
    queue_destroy(queue);
}

/* The renderer gets its next tile and finishes it at `now`, having taken so many seconds; false: it gets none. */
static bool do_next(struct queue *queue, uint32_t renderer, double now, double seconds)
{
    struct tile tile;
    if (!next_tile(queue, renderer, &tile)) return false;
    queue_finish(queue, renderer, tile.id, now, seconds);
    return true;
}

/* The progress is that of the share of which most is left, as the run ends with that one. */
static void test_progress_of_shares(void **state)
{
    for (int schedule = SCHEDULE_STRIPS; schedule < SCHEDULES; schedule++) {
        struct queue_config config = {.schedule = (enum schedule)schedule,
                                      .width = 60,
                                      .height = 60,
                                      .renderers = 3,
                                      .tile_edge = 2};
        struct queue *queue = queue_create(&config);
        double tile_s = schedule == SCHEDULE_CYCLIC ? 1.0 / 3 : 1; /* of 30 or 10 in a share */
        while (do_next(queue, 0, 10, tile_s) && do_next(queue, 2, 10, tile_s))
            ;
        struct queue_count count = queue_count(queue);
        assert_int_equal(count.pixels_finished, 2 * 60 * 60 / 3);
        assert_true(fabs(count.share_finished - 0.5) < 1e-9); /* as long as the others took */
        assert_true(do_next(queue, 1, 20, 2 * 10 * tile_s));
        count = queue_count(queue);
        assert_true(count.share_finished > 0.2 && count.share_finished < 0.5);
        while (do_next(queue, 1, 40, tile_s))
            ;
        assert_true(queue_count(queue).share_finished == 1);
        queue_destroy(queue);
    }
}

/* With more renderers than rows or pixels, some shares are empty: they do not count. */
static void test_progress_of_empty_shares(void **state)
{
    for (int schedule = SCHEDULE_STRIPS; schedule < SCHEDULES; schedule++) {
        struct queue_config config = {
            .schedule = (enum schedule)schedule, .width = 2, .height = 2, .renderers = 9};
        struct queue *queue = queue_create(&config);
        assert_true(do_next(queue, 0, 10, 5));
        struct queue_count count = queue_count(queue);
        assert_true(count.share_finished > 0 && count.share_finished < 1);
        queue_destroy(queue);
    }
}

/* ---- renderers that give no sign of life ---- */

/* Renderers 0 and 2 do all that they get, in turn, until neither gets anything. */
static void work_on(struct queue *queue, unsigned char *seen, const struct queue_config *config)
{
    bool moved = true;
    while (moved) {
        moved = false;
        for (uint32_t renderer = 0; renderer < 3; renderer += 2) {
            struct tile tile;
            if (!next_tile(queue, renderer, &tile)) continue;
            moved = true;
            if (queue_finish(queue, renderer, tile.id, 0, 0)) mark(seen, config, &tile);
        }
    }
}

/* The tiles and the share of a renderer that gives no sign of life go to others; if it answers after all, its answers
 * are in vain. */
static void test_silent(void **state)
{
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        if (schedule == SCHEDULE_DYNAMIC) continue; /* it recognises late renderers by itself */
        struct queue_config config = {.schedule = (enum schedule)schedule,
                                      .width = 60,
                                      .height = 50,
                                      .renderers = 3,
                                      .tile_edge = 4};
        struct queue *queue = queue_create(&config);
        unsigned char seen[60 * 50] = {0};
        struct tile first = {0}, second = {0}, tile;
        assert_true(next_tile(queue, 1, &first) && next_tile(queue, 1, &second));
        work_on(queue, seen, &config);
        assert_false(queue_complete(queue) || queue_over(queue, 0));
        uint64_t news = queue_news(queue);
        queue_set_silent(queue, 1, true);
        assert_true(queue_news(queue) != news);
        work_on(queue, seen, &config);
        assert_true(queue_complete(queue) && queue_over(queue, 0));
        for (size_t i = 0; i < sizeof seen; i++)
            assert_int_equal(seen[i], 1);
        assert_int_equal(queue_count(queue).repeated, 2);
        assert_false(queue_has_recalls(queue)); /* messages to it would pile up */
        queue_set_silent(queue, 1, false);
        assert_false(queue_finish(queue, 1, first.id, 0, 0));
        assert_true(queue_is_recalled(queue, 1, second.id));
        queue_drop(queue, 1, second.id, 0, 0);
        assert_false(queue_find_held(queue, 1, second.id, &tile));
        queue_destroy(queue);
    }
}

/* What a silent renderer holds, whichever it is, goes to an idle one once. It is not handed out again when that one is
 * silent, too, but the first one has answered after all. */
static void test_silent_tiles_go_out_once(void **state)
{
    for (uint32_t silent = 0; silent < 3; silent++) {
        struct queue_config config = {
            .schedule = SCHEDULE_TILES, .width = 20, .height = 10, .renderers = 3, .tile_edge = 10};
        struct queue *queue = queue_create(&config);
        uint32_t a = (silent + 1) % 3, b = (silent + 2) % 3;
        struct tile held, first, second, tile;
        assert_true(next_tile(queue, silent, &held) && next_tile(queue, a, &first));
        queue_set_silent(queue, silent, true);
        assert_false(next_tile(queue, a, &tile)); /* not as a reserve */
        assert_true(next_tile(queue, b, &second));
        assert_int_equal(second.id, held.id);
        queue_finish(queue, a, first.id, 0, 0);
        assert_false(next_tile(queue, a, &tile));
        /* The late answer counts, so that the copy is of no use to anybody. */
        assert_int_equal(queue_finish(queue, silent, held.id, 0, 0), ANSWER_COUNTS);
        queue_set_silent(queue, b, true);
        assert_false(next_tile(queue, a, &tile));
        assert_true(queue_complete(queue));
        queue_destroy(queue);
    }
}

/* Idle renderers look for the tiles of silent ones only while there are silent ones: if each of 10^5 idle renderers
 * looked at all others, that would be 10^10 looks, some 20 s. */
static void test_nobody_is_silent(void **state)
{
    enum { RENDERERS = 100000 };
    struct queue_config config = {
        .schedule = SCHEDULE_STRIPS, .width = 1, .height = RENDERERS, .renderers = RENDERERS};
    struct queue *queue = queue_create(&config);
    struct tile tile;
    double start = clock_thread_cpu();
    const bool silent[] = {false, true, true, false, false};
    for (size_t i = 0; i < sizeof silent / sizeof *silent; i++)
        queue_set_silent(queue, 7, silent[i]);
    for (uint32_t renderer = 0; renderer < RENDERERS; renderer++) {
        assert_true(next_tile(queue, renderer, &tile));
        queue_finish(queue, renderer, tile.id, 0, 0);
        assert_false(next_tile(queue, renderer, &tile));
    }
    assert_true(queue_complete(queue));
    assert_true(clock_thread_cpu() - start < 4);
    queue_destroy(queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_strips_are_the_papers),
        cmocka_unit_test(test_cyclic_deals_pixels),
        cmocka_unit_test(test_cyclic_rows_deals_rows),
        cmocka_unit_test(test_reserve),
        cmocka_unit_test(test_progress_of_resumed_shares),
        cmocka_unit_test(test_progress_of_shares),
        cmocka_unit_test(test_progress_of_empty_shares),
        cmocka_unit_test(test_silent),
        cmocka_unit_test(test_silent_tiles_go_out_once),
        cmocka_unit_test(test_nobody_is_silent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
