/* The dynamic schedule: what a renderer that asks gets, and which renderers report tiles that take long. */

#include "test/queue_fixture.h"
#include "test/queue_halves_fixture.h"
#include "test/queue_late_fixture.h"
#include "test/unit.h"

/* A lot begins with expensive tiles and goes on with cheap ones, but never with so many that none are left for the end
 * of the run. The column of tiles behind the middle is neither, as costs are smoothed. */
static void test_cheap_go_with_dear(void **state)
{
    struct queue_config config = {
        .width = 640, .height = 320, .renderers = 4, .tile_edge = 16, .probe_edge = 8};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    settle_halves(queue, 640);
    assert_true(queue->settled);
    double now = 2e-3;
    uint32_t with_both = 0, lots = 0;
    while (queue->waiting_work > 0.1 * queue->pace.total) {
        uint32_t count = queue_next(queue, 0, now, lot), cheap = 0;
        for (uint32_t i = 0; i < count; i++) {
            cheap += lot[i].x >= 336;
            assert_true(cheap == 0 || lot[i].x >= 320);
            now += lot[i].x < 320 ? 1e-4 : 1e-6;
            queue_finish(queue, 0, lot[i].id, now, lot[i].x < 320 ? 1e-4 : 1e-6);
        }
        if (count > 0) assert_true(lot[0].x < 320);
        with_both += cheap > 0 && cheap < count;
        lots += count > 0;
    }
    assert_true(lots > 0 && 2 * with_both > lots);
    assert_true(queue->waiting_pixels > 640 * 320 / 10);
    queue_destroy(queue);
}

/* Tiles of later passes go out in the order of their priorities: cheap ones wait for their turn. */
static void test_later_passes_keep_their_order(void **state)
{
    struct queue_config config = {.width = 64, .height = 64, .renderers = 4, .tile_edge = 16};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], tile = {.w = 2, .h = 2, .step = 1, .pass = 1};
    for (uint32_t count; (count = queue_next(queue, 0, 0, lot)) > 0;)
        finish_part(queue, 0, lot, 0, count);
    for (uint32_t i = 0; i < 1024; i++) { /* the first half is cheap, and least urgent */
        tile.x = i % 32 * 2, tile.y = i / 32 * 2;
        queue_add(queue, &tile, i < 512 ? 1 : 100, i);
    }
    uint32_t next = 1024, lots = 0;
    for (uint32_t count; (count = queue_next(queue, 0, 1e-3, lot)) > 0; lots++) {
        for (uint32_t i = 0; i < count; i++)
            assert_int_equal(lot[i].y / 2 * 32 + lot[i].x / 2, --next);
        finish_part(queue, 0, lot, 0, count);
    }
    assert_true(next == 0 && lots > 20);
    queue_destroy(queue);
}

/* The master's own renderer leaves the last tiles to the others when these tiles take less time than the master will
 * need for the others' last answers, unless all of the others are late. */
static void test_own_renderer_leaves_the_end(void **state)
{
    for (int own = 0; own <= 1; own++) {
        struct queue_config config = many;
        config.master_renders = own;
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES];
        for (uint32_t i = 0; i < 4; i++)
            finish_part(queue, i, lot, 0, queue_next(queue, i, 0, lot));
        assert_true(queue_next(queue, 1, 1e-3, lot) > 0);
        serve_for(queue, 1e-6);
        assert_true(queue_next(queue, 0, 1e-3, lot) > 0);
        finish_part(queue, 0, lot, 0, queue_tile_count(queue, 0));
        serve_for(queue, 1);
        assert_true(queue->waiting.count > 0);
        assert_int_equal(queue_next(queue, 0, 1e-3, lot) == 0, own);
        assert_true(queue_next(queue, 2, 1e-3, lot) > 0);
        queue_look(queue, 1e6);
        assert_int_equal(queue->pace.holders, 0);
        if (own) assert_true(queue_next(queue, 0, 1e6, lot) > 0);
        queue_destroy(queue);
    }
}

/* A renderer that reports a tile that takes long counts as late, and others get what it has not begun. But early in the
 * run it keeps all of it. */
static void test_takes_long(void **state)
{
    for (int early = 0; early <= 1; early++) {
        struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
        struct queue *queue = begin_late(lots, 0);
        uint32_t first = lots[1][0].id;
        double rest = pace_even_end(&queue->pace, 2e-3, queue->waiting_work);
        float report_s[LOT_TILES];
        assert_int_equal(queue_report_times(queue, 1, lots[1], 1, report_s), 1);
        double report_after = (double)report_s[0], seconds = early ? rest / 4 : rest;
        double predicted = pace_seconds(&queue->pace, 1, (double)queue->items[first].work);
        assert_true(report_after > predicted &&
                    report_after < 4 * predicted + pace_least(&queue->pace, 1));
        assert_true(report_after < rest / 4);
        queue_takes_long(queue, 1, first, 2e-3, seconds);
        assert_int_equal(queue->pace.renderers[1].is_overdue, !early);
        if (!early) /* since when it should have been done */
            assert_sum(queue->pace.renderers[1].free_at, 2e-3 - seconds + predicted, seconds);
        uint32_t count = queue_next(queue, 2, 2e-3, tiles);
        assert_true(count >= 3);
        for (uint32_t i = 0; i < 3; i++)
            assert_int_equal(tiles[i].id == lots[1][3 - i].id, !early);
        assert_int_equal(queue_is_recalled(queue, 1, lots[1][1].id), !early);
        assert_false(queue_is_recalled(queue, 1, first));
        /* The tile is known to take at least so long, which counts for its pieces and its neighbours. */
        assert_true((double)queue->items[first].seconds >= seconds * 0.999);
        queue_finish(queue, 1, first, 3e-3, 1);
        assert_false(queue->pace.renderers[1].is_overdue);
        queue_destroy(queue);
    }
}

/* A renderer has two lots at most. */
static void test_two_lots(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    uint32_t counts[4];
    struct queue *queue = begin_many(lots, counts);
    assert_false(queue_is_full(queue, 0));
    assert_true(queue_next(queue, 0, 0, tiles) > 0 && queue_is_full(queue, 0));
    assert_int_equal(queue_next(queue, 0, 0, tiles), 0);
    finish_part(queue, 0, lots[0], 0, counts[0]);
    assert_true(queue_next(queue, 0, 1e-3, tiles) > 0);
    queue_destroy(queue);
}

/* At the end of a run, what waits goes to those that have nothing: a renderer gets no lot that it could begin only when
 * all others are done. */
static void test_no_reserve_at_the_end(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    uint32_t counts[4];
    struct queue *queue = begin_many(lots, counts);
    finish_part(queue, 0, lots[0], 0, counts[0]);
    while (queue->waiting.count > 8)
        finish_part(queue, 0, tiles, 0, queue_next(queue, 0, 1e-3, tiles));
    assert_int_equal(queue_next(queue, 1, 1e-3, tiles), 0);
    assert_true(queue_next(queue, 0, 1e-3, tiles) > 0);
    queue_destroy(queue);
}

/* When a renderer has become late, those that asked before and got nothing are to ask again. */
static void test_late_is_news(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 0);
    for (int late = 0; late <= 1; late++) {
        uint64_t news = queue_news(queue);
        assert_true(queue_next(queue, 2 + (uint32_t)late, late ? 0.5 : 2e-3, tiles) > 0);
        assert_int_equal(queue->pace.overdue_count > 0, late);
        assert_int_equal(queue_news(queue) != news, late);
    }
    queue_destroy(queue);
}

/* Answers may be left unread for a while when all renderers have work or have been given up for late, but not while one
 * has none. */
static void test_calm(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 1);
    const double now = 0.5;
    queue_look(queue, now);
    assert_int_equal(queue->pace.overdue_count, 2);
    assert_true(queue_next(queue, 2, now, tiles) > 0);
    assert_true(queue_calm(queue, now) == 0);
    assert_true(queue_next(queue, 3, now, tiles) > 0);
    assert_true(queue_calm(queue, now) > 0);
    queue_stop(queue);
    assert_true(queue_calm(queue, now) == 0);
    queue_destroy(queue);
}

/* Under the dynamic schedule renderers are to report tiles that take long, but no probe tiles; under fixed shares they
 * report none. */
static void test_who_tells(void **state)
{
    struct queue_config config = four;
    struct tile tiles[LOT_TILES];
    float report_s[LOT_TILES];
    for (int i = 0; i < 3; i++) {
        config.probe_edge = i == 1 ? 8 : 0;
        config.schedule = i == 2 ? SCHEDULE_STRIPS : SCHEDULE_DYNAMIC;
        struct queue *queue = queue_create(&config);
        assert_true(queue_next(queue, 0, 0, tiles) > 0);
        assert_int_equal(queue_report_times(queue, 0, tiles, 1, report_s), i == 0);
        assert_false(queue_lot_seconds(queue, 0, tiles, 1) > 0);
        queue_destroy(queue);
    }
}

/* A renderer that has become late while it holds nothing but probes gets tiles again once it has answered them. */
static void test_late_with_probes(void **state)
{
    struct queue *queue = queue_create(&with_probes);
    struct tile tiles[LOT_TILES], probes[LOT_TILES];
    uint32_t count = 0;
    for (uint32_t lots = 0; lots < 3; lots++)
        finish_lot(queue, 0, tiles, queue_next(queue, 0, 0, tiles), 1e-3);
    count = queue_next(queue, 0, 1e-3, tiles);
    assert_true(count > 0 && tiles[0].pass != TILE_PROBE);
    uint32_t probe_count = queue_next(queue, 0, 1e-3, probes);
    assert_true(probe_count > 0 && probes[0].pass == TILE_PROBE);
    finish_lot(queue, 0, tiles, count, 2e-3);
    queue_look(queue, 100);
    assert_true(queue->pace.renderers[0].is_overdue);
    finish_lot(queue, 0, probes, probe_count - 1, 100);
    assert_true(queue->pace.renderers[0].is_overdue && queue_tile_count(queue, 0) == 1);
    finish_lot(queue, 0, probes + probe_count - 1, 1, 100);
    assert_false(queue->settled || queue->pace.renderers[0].is_overdue);
    assert_int_equal(queue->pace.holders, 0);
    assert_true(queue_next(queue, 0, 100, tiles) > 0);
    queue_destroy(queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cheap_go_with_dear),
        cmocka_unit_test(test_later_passes_keep_their_order),
        cmocka_unit_test(test_own_renderer_leaves_the_end),
        cmocka_unit_test(test_takes_long),
        cmocka_unit_test(test_two_lots),
        cmocka_unit_test(test_no_reserve_at_the_end),
        cmocka_unit_test(test_late_is_news),
        cmocka_unit_test(test_calm),
        cmocka_unit_test(test_who_tells),
        cmocka_unit_test(test_late_with_probes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
