/* Tiles that are handed out a second time: what late renderers have not begun, and what idle renderers take over when
 * nothing waits. */
#include <math.h>

#include "test/queue_fixture.h"
#include "test/queue_late_fixture.h"
#include "test/unit.h"

/* Renderer 0 holds two lots, the others have finished all the rest. One that asks then gets up to half of the tiles
 * that 0 has not begun, the last ones, and 0 is told of each of them. */
static void test_idle_take_unbegun(void **state)
{
    struct queue_config config = {.width = 160, .height = 80, .renderers = 4, .tile_edge = 8};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], stolen[LOT_TILES];
    assert_true(queue_next(queue, 1, 0, lot) > 0);
    assert_true(queue_finish(queue, 1, lot[0].id, 1e-3, 1e-3));
    uint32_t had = queue_next(queue, 0, 1e-3, lot), first = lot[0].id;
    had += queue_next(queue, 0, 1e-3, lot);
    assert_true(had >= 5);
    struct tile tile;
    struct recall recall;
    uint32_t others, next = 0;
    do { /* 1 still holds what is left of its first lot */
        others = queue_next(queue, 2, 2e-3, lot);
        for (uint32_t i = 0; i < others; i++)
            assert_true(queue_finish(queue, 2, lot[i].id, 2e-3, 1e-6));
    } while (others > 0 && queue_count(queue).repeated == 0);
    while (queue_unfinished(queue, &next, &tile))
        if (queue_find_held(queue, 1, tile.id, &tile)) queue_finish(queue, 1, tile.id, 2e-3, 1e-6);
    while (queue_next_recall(queue, &recall)) {
    }
    uint32_t open = queue->holdings.holders[0].open;
    uint32_t count = queue_next(queue, 3, 2e-3, stolen), told = 0;
    assert_true(open >= 4);
    assert_int_equal(count, open / 2);
    for (uint32_t i = 0; i < count; i++) {
        assert_true(stolen[i].id != first);
        assert_true(queue_is_recalled(queue, 0, stolen[i].id));
    }
    for (; queue_next_recall(queue, &recall); told++)
        assert_true(recall.renderer == 0 && !recall.finished);
    assert_int_equal(told, count);
    queue_destroy(queue);
}

/* An idle renderer does not get a tile that its holder is about to finish. It is to ask again when that tile is
 * overdue, well before the holder counts as late. */
static void test_idle_ask_again(void **state)
{
    struct queue *queue = queue_create(&four);
    struct tile lot[LOT_TILES], last;
    uint32_t count = queue_next(queue, 0, 0, lot);
    last = lot[0];
    for (int i = 0; i < 100; i++)
        queue_served(queue, 1e-4, 0); /* answers are expensive for the master, so short lots are */
    for (uint32_t i = 1; i < count; i++)
        assert_true(queue_finish(queue, 0, lot[i].id, 1e-3, 1e-4));
    while (queue_count(queue).finished < queue_count(queue).tiles - 1) {
        count = queue_next(queue, 1, 1e-3, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++)
            assert_true(queue_finish(queue, 1, lot[i].id, 1e-3, 1e-4));
    }
    assert_true(queue_tile_count(queue, 0) == 1 && queue_tile_count(queue, 1) == 0);
    assert_int_equal(queue_next(queue, 2, 1e-3, lot), 0);
    double wake = queue_wake(queue);
    assert_true(wake > 1e-3 && wake < pace_next_late(&queue->pace));
    queue_look(queue, wake);
    assert_true(queue_wake(queue) > wake);
    assert_true(queue_next(queue, 2, wake, lot) > 0);
    assert_true(queue_is_recalled(queue, 0, last.id));
    queue_destroy(queue);
}

/* A queue without waiting tiles, in which renderer 0 has taken a second for three pixels. */
static struct queue *begin_row(uint32_t renderers)
{
    const struct queue_config config = {
        .width = 3, .height = 1, .renderers = renderers, .tile_edge = 3};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    assert_int_equal(queue_next(queue, 0, 0, lot), 1);
    assert_true(queue_finish(queue, 0, lot[0].id, 1, 1));
    return queue;
}

/* The renderer gets a new tile of so many pixels, a third of a second each; returns its id. */
static uint32_t give_row(struct queue *queue, uint32_t renderer, uint32_t pixels, double now)
{
    const struct tile row = {.w = pixels, .h = 1, .step = 1, .pass = 1};
    struct tile lot[LOT_TILES];
    queue_add(queue, &row, pixels, 1);
    assert_true(queue_next(queue, renderer, now, lot) == 1 && lot[0].id == queue->item_count - 1);
    return lot[0].id;
}

/* The id of the only tile that the renderer gets when it asks, or UINT32_MAX: none. */
static uint32_t ask(struct queue *queue, uint32_t renderer, double now)
{
    struct tile lot[LOT_TILES];
    uint32_t count = queue_next(queue, renderer, now, lot);
    assert_true(count <= 1);
    return count ? lot[0].id : UINT32_MAX;
}

/* A single pixel that two renderers hold already cannot be broken up: an idle renderer does not wait for it, whether it
 * is to be done first or last, but gets a piece of another tile that is overdue. */
static void test_idle_pass_over_a_pixel(void **state)
{
    struct queue *queue = begin_row(7);
    uint32_t overdue = give_row(queue, 0, 3, 1.95), first = give_row(queue, 1, 1, 2.17),
             last = give_row(queue, 2, 1, 2.5);
    assert_int_equal(ask(queue, 3, 2.57), first);
    assert_int_equal(ask(queue, 4, 2.9), last);
    const struct pace_renderer *renderers = queue->pace.renderers;
    assert_true(renderers[3].free_at < renderers[0].free_at && renderers[0].free_at < 3);
    assert_true(renderers[4].free_at > 3 && pace_next_late(&queue->pace) > 3);
    uint32_t piece = ask(queue, 5, 3);
    assert_true(queue->items[piece].is_piece && queue->items[piece].whole == overdue);
    queue_destroy(queue);
}

/* Of two tiles idle renderers help with the one that would be done later, if the other one is as good as done. */
static void test_idle_help_the_last(void **state)
{
    struct queue *queue = begin_row(4);
    give_row(queue, 0, 1, 1.7);
    uint32_t last = give_row(queue, 1, 3, 2);
    uint32_t piece = ask(queue, 2, 2);
    assert_true(queue->items[piece].is_piece && queue->items[piece].whole == last);
    queue_destroy(queue);
}

/* A single idle renderer waits for others that will be idle soon, to help together with them: also where the tile is
 * that of a late renderer. When there are none, it gets the whole tile. */
static void test_idle_wait_for_others(void **state)
{
    for (int late = 0; late <= 1; late++) {
        struct queue *queue = begin_row(3);
        double now = late ? 4.2 : 3.6;
        uint32_t overdue = give_row(queue, 0, 3, 2), other = give_row(queue, 1, 3, 3.5);
        queue_look(queue, now);
        assert_int_equal(queue->pace.renderers[0].is_overdue, late);
        assert_int_equal(ask(queue, 2, now), UINT32_MAX);
        assert_true(queue_finish(queue, 1, other, now, 1));
        uint32_t piece = ask(queue, 2, now);
        assert_true(queue->items[piece].is_piece && queue->items[piece].whole == overdue);
        queue_destroy(queue);
    }
    struct queue *queue = begin_row(2);
    uint32_t overdue = give_row(queue, 0, 3, 2);
    assert_int_equal(ask(queue, 1, 3.1), overdue);
    queue_destroy(queue);
}

/* A tile that was passed on from a late renderer is passed on once more only when the other one is late, too. */
static void test_two_copies_are_enough(void **state)
{
    struct queue *queue = begin_row(3);
    uint32_t id = give_row(queue, 0, 3, 2), other = give_row(queue, 2, 3, 2.1);
    assert_int_equal(ask(queue, 1, 5), id);
    assert_true(queue_finish(queue, 2, other, 5.1, 1));
    assert_int_equal(ask(queue, 2, 6.3), UINT32_MAX);
    assert_true(queue->pace.renderers[1].free_at < 6.3 && queue->pace.overdue_count == 1);
    assert_int_equal(ask(queue, 2, 8), id);
    queue_destroy(queue);
}

/* What a tile is known to have taken, its pieces are predicted from: here 8 s in place of 1. */
static void test_help_with_what_is_known(void **state)
{
    struct queue *queue = begin_row(4);
    uint32_t id = give_row(queue, 0, 3, 2);
    queue_takes_long(queue, 0, id, 10, 8);
    uint32_t part = ask(queue, 1, 10);
    const struct item *piece = &queue->items[part];
    assert_true(piece->is_piece && piece->whole == id);
    assert_sum((double)piece->work, 3 * 8 * (double)area(piece) / 3, 1);
    queue_destroy(queue);
}

/* A renderer that still has something to do takes over nothing. */
static void test_busy_do_not_help(void **state)
{
    struct queue *queue = begin_row(4);
    give_row(queue, 0, 3, 2);
    give_row(queue, 1, 3, 2.9);
    assert_int_equal(ask(queue, 1, 3.1), UINT32_MAX);
    assert_int_equal(queue->waiting.count, 0); /* nor does it break anything up */
    assert_true(ask(queue, 2, 3.1) != UINT32_MAX);
    queue_destroy(queue);
}

/* An idle renderer also takes over from a renderer that has only just got its tiles. */
static void test_idle_take_what_was_just_given(void **state)
{
    const struct queue_config config = {.width = 6, .height = 3, .renderers = 4, .tile_edge = 3};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], more[LOT_TILES];
    assert_int_equal(queue_next(queue, 0, 0, lot), 1);
    assert_true(queue_finish(queue, 0, lot[0].id, 1, 1));
    assert_int_equal(queue_next(queue, 0, 1, lot), 1);
    assert_int_equal(queue->waiting.count, 0);
    assert_true(queue_next(queue, 1, 1, more) > 0);
    assert_true(queue_is_recalled(queue, 0, lot[0].id));
    queue_destroy(queue);
}

/* Of two renderers that hold the same tile, the one that has not finished it is told when the other one has. */
static void test_finished_copy_is_told(void **state)
{
    for (int original = 0; original < 2; original++) {
        struct queue_config config = {.width = 160, .height = 80, .renderers = 4, .tile_edge = 8};
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES], stolen[LOT_TILES];
        uint32_t others = queue_next(queue, 1, 0, lot);
        assert_true(others > 0 && queue_finish(queue, 1, lot[0].id, 1e-3, 1e-3));
        for (uint32_t i = 1; i < others; i++)
            assert_true(queue_finish(queue, 1, lot[i].id, 1e-3, 1e-3));
        assert_true(queue_next(queue, 0, 1e-3, lot) >= 4);
        do {
            others = queue_next(queue, 1, 1e-3, stolen);
            for (uint32_t i = 0; i < others && queue_count(queue).repeated == 0; i++)
                assert_true(queue_finish(queue, 1, stolen[i].id, 1e-3, 1e-4));
        } while (others > 0 && queue_count(queue).repeated == 0);
        assert_true(others > 0);
        uint32_t winner = original ? 0 : 1, id = stolen[0].id;
        assert_int_equal(told_finished(queue, 1 - winner, id), 0);
        assert_true(queue_finish(queue, winner, id, 2e-3, 1e-4));
        assert_int_equal(told_finished(queue, 1 - winner, id), 1);
        queue_drop(queue, 1 - winner, id, 3e-3, 1e-4);
        assert_false(queue_is_recalled(queue, 1 - winner, id));
        queue_destroy(queue);
    }
}

/* Of three renderers that hold the same tile, the first one finishes it: both others are told, and count as idle, not
 * as late, when they have dropped it. */
static void test_all_copies_are_told(void **state)
{
    struct queue *queue = begin_row(4);
    uint32_t id = give_row(queue, 0, 1, 2), told = 0;
    assert_int_equal(ask(queue, 1, 2.4), id);
    assert_true(queue_has_recalls(queue));
    assert_int_equal(ask(queue, 2, 4), id); /* 1 is late, too */
    struct recall recall;
    while (queue_next_recall(queue, &recall))
        assert_false(recall.finished);
    assert_false(queue_has_recalls(queue));
    assert_int_equal(queue_finish(queue, 0, id, 4.1, 1), ANSWER_COUNTS);
    for (; queue_next_recall(queue, &recall); told += 1u << recall.renderer)
        assert_true(recall.finished && recall.id == id);
    assert_int_equal(told, 1u << 1 | 1u << 2);
    queue_drop(queue, 1, id, 4.2, 0);
    assert_true(queue->pace.overdue_count == 0 && queue->pace.holders == 1);
    queue_drop(queue, 2, id, 4.2, 0);
    assert_int_equal(queue->pace.holders, 0);
    queue_destroy(queue);
}

/* Tiles that a late renderer has not begun are passed on whole, even while another renderer is overdue for longer. */
static void test_unbegun_is_not_broken_up(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 1);
    queue_look(queue, 0.02);
    queue_look(queue, 1000);
    double now = 1000;
    for (uint32_t ask = 0; ask < 4; ask++) {
        uint32_t asker = 2 + ask % 2, count = queue_next(queue, asker, now, tiles);
        for (uint32_t i = 1; i < 4; i++)
            assert_int_equal(queue->items[lots[1][i].id].pieces, 0);
        for (uint32_t i = 0; i < count; i++)
            assert_true(queue_finish(queue, asker, tiles[i].id, now += 1e-4, 1e-3));
    }
    queue_destroy(queue);
}

/* All tiles that an overdue renderer has not begun go into one lot, together with tiles that wait. */
static void test_late_in_one_lot(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 0);
    queue_look(queue, 0.5);
    assert_true(queue->waiting.count > 0);
    assert_true(queue_next(queue, 2, 0.5, tiles) > 3);
    for (uint32_t i = 0; i < 3; i++)
        assert_int_equal(tiles[i].id, lots[1][3 - i].id); /* the last first */
    assert_false(queue_is_recalled(queue, 1, lots[1][0].id));
    assert_int_equal(queue_count(queue).repeated, 3);
    assert_true(queue_tile_count(queue, 2) > 3);
    queue_destroy(queue);
}

/* Of tiles that late renderers have not begun, a renderer gets no more than one lot, but one tile at least. */
static void test_late_within_a_lot(void **state)
{
    static const struct {
        double tiles; /* limit of the lot */
        uint32_t count;
    } cases[] = {{0.5, 1}, {1.5, 1}, {2.5, 2}, {3.5, 3}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
        struct queue *queue = begin_late(lots, 0);
        queue_look(queue, 0.5);
        struct draft draft = {.renderer = 2, .tiles = tiles};
        double work = (double)queue->items[lots[1][3].id].work;
        repeat_late(queue, &draft, (struct pace_lot){cases[i].tiles * work, HUGE_VAL});
        assert_int_equal(draft.count, cases[i].count);
        queue_destroy(queue);
    }
}

/* Renderer 0 gets all 72 tiles of 32 x 32 pixels. An idle one would take over half of them, which are more pixels than
 * its message has room for. */
static void test_unbegun_within_a_lot(void **state)
{
    const struct queue_config config = {
        .width = 256, .height = 288, .renderers = 2, .tile_edge = 32};
    struct queue *queue = queue_create(&config);
    struct tile tiles[LOT_TILES];
    while (queue->waiting.count > 0) {
        uint32_t id = heap_top(&queue->waiting);
        queue_unset_waiting(queue, id);
        queue_give(queue, 0, id, (double)queue->items[id].work);
    }
    holdings_end_lot(&queue->holdings, 0);
    assert_int_equal(queue_tile_count(queue, 0), 72);
    assert_int_equal(queue_next(queue, 1, 0, tiles), queue_largest_lot(queue) / (32 * 32));
    queue_destroy(queue);
}

/* Tiles are taken over from the renderer that has most by now, not from the one that got most. */
static void test_unbegun_of_the_richest(void **state)
{
    const struct queue_config config = {.width = 64, .height = 64, .renderers = 3, .tile_edge = 16};
    struct queue *queue = queue_create(&config);
    struct tile tiles[LOT_TILES];
    for (uint32_t id = 0; id < 16; id++) {
        queue_unset_waiting(queue, id);
        queue_give(queue, id >= 10, id, (double)queue->items[id].work);
    }
    holdings_end_lot(&queue->holdings, 0);
    holdings_end_lot(&queue->holdings, 1);
    for (uint32_t id = 0; id < 8; id++)
        assert_true(queue_finish(queue, 0, id, 1e-3, 1e-4));
    assert_int_equal(queue_next(queue, 2, 1e-3, tiles), 3);
    assert_true(queue_is_recalled(queue, 1, tiles[0].id));
    queue_destroy(queue);
}

/* A late renderer that asks, as it has room for another lot, gets nothing: it may have stopped since, and messages to
 * it would pile up. */
static void test_late_gets_nothing(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 0);
    queue_look(queue, 0.5);
    assert_true(queue->pace.renderers[1].is_overdue && queue->waiting.count > 0);
    assert_false(queue_is_full(queue, 1));
    assert_int_equal(queue_next(queue, 1, 0.5, tiles), 0);
    queue_destroy(queue);
}

/* A renderer that has answered for a tile in the meantime is not told any more that another one has it. */
static void test_answered_is_not_recalled(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 0);
    struct recall recall;
    uint32_t told = 0;
    queue_look(queue, 0.5);
    assert_true(queue_next(queue, 2, 0.5, tiles) > 3);
    assert_true(queue_is_recalled(queue, 1, lots[1][3].id));
    assert_true(queue_finish(queue, 1, lots[1][3].id, 0.5, 1e-3));
    for (; queue_next_recall(queue, &recall); told += recall.renderer == 1)
        assert_true(recall.renderer != 1 || recall.id != lots[1][3].id);
    assert_int_equal(told, 2);
    queue_destroy(queue);
}

/* Tiles of a late renderer are taken over even if another one is overdue for longer, if that one has begun all it
 * holds. */
static void test_late_behind_a_later_one(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    struct queue *queue = begin_late(lots, 1);
    queue_look(queue, 0.5);
    assert_true(queue->pace.renderers[0].is_overdue && queue->pace.renderers[1].is_overdue);
    assert_true(queue->pace.renderers[0].free_at < queue->pace.renderers[1].free_at);
    assert_true(queue_next(queue, 2, 0.5, tiles) >= 3);
    for (uint32_t i = 0; i < 3; i++)
        assert_int_equal(tiles[i].id, lots[1][3 - i].id);
    queue_destroy(queue);
}

/* A tile that was passed on from a late renderer to one that then stops is passed on again, though the late one has
 * dropped it and asked for other work since. */
static void test_stopped_behind_a_late_one(void **state)
{
    struct tile lots[4][LOT_TILES], tiles[LOT_TILES];
    uint32_t counts[4];
    struct queue *queue = begin_many(lots, counts);
    uint32_t kept = lots[0][counts[0] - 2].id, taken = lots[0][counts[0] - 1].id, most = 0;
    finish_part(queue, 0, lots[0], 0, counts[0] - 2);
    for (uint32_t i = 1; i < 4; i++)
        finish_part(queue, i, lots[i], 0, counts[i]);
    queue_look(queue, 0.1);
    assert_true(queue_next(queue, 1, 0.1, tiles) > 0);
    assert_int_equal(tiles[0].id, taken); /* and 1 stops */
    queue_look(queue, 0.2);
    assert_true(queue_finish(queue, 0, kept, 0.21, 0.2));
    uint32_t count = queue_next(queue, 0, 0.21, tiles);
    queue_drop(queue, 0, taken, 0.21, 0);
    for (uint32_t i = 0; i < count; i++)
        queue_finish(queue, 0, tiles[i].id, 0.22, 1e-3);
    for (double now = 0.3; !queue_complete(queue) && most < 100000; now += 1e-3, most++) {
        queue_look(queue, now);
        for (uint32_t renderer = 0; renderer < 4; renderer++) {
            if (renderer == 1) continue;
            count = queue_next(queue, renderer, now, tiles);
            for (uint32_t i = 0; i < count; i++)
                queue_finish(queue, renderer, tiles[i].id, now, 1e-3);
        }
    }
    assert_true(queue_complete(queue));
    queue_destroy(queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_idle_take_unbegun),
        cmocka_unit_test(test_idle_ask_again),
        cmocka_unit_test(test_idle_pass_over_a_pixel),
        cmocka_unit_test(test_idle_help_the_last),
        cmocka_unit_test(test_idle_wait_for_others),
        cmocka_unit_test(test_two_copies_are_enough),
        cmocka_unit_test(test_help_with_what_is_known),
        cmocka_unit_test(test_busy_do_not_help),
        cmocka_unit_test(test_idle_take_what_was_just_given),
        cmocka_unit_test(test_finished_copy_is_told),
        cmocka_unit_test(test_all_copies_are_told),
        cmocka_unit_test(test_unbegun_is_not_broken_up),
        cmocka_unit_test(test_late_in_one_lot),
        cmocka_unit_test(test_late_within_a_lot),
        cmocka_unit_test(test_unbegun_within_a_lot),
        cmocka_unit_test(test_unbegun_of_the_richest),
        cmocka_unit_test(test_late_gets_nothing),
        cmocka_unit_test(test_answered_is_not_recalled),
        cmocka_unit_test(test_late_behind_a_later_one),
        cmocka_unit_test(test_stopped_behind_a_late_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
