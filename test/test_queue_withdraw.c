/* Withdrawing work from the queue, and ending the pre-pass of probes early. */
#include <string.h>

#include "test/queue_fixture.h"
#include "test/random.h"
#include "test/unit.h"

static const struct queue_config withdrawing = {.schedule = SCHEDULE_DYNAMIC,
                                                .width = 256,
                                                .height = 192,
                                                .renderers = 3,
                                                .tile_edge = 16,
                                                .probe_edge = 8};

/* One of these renderers, chosen at random, asks for a lot and finishes or drops some of the tiles that it holds. */
static void take_turn(struct queue *queue, uint32_t renderers, uint64_t *seed, double now,
                      unsigned char *seen)
{
    struct tile lot[LOT_TILES];
    uint32_t renderer = random_below(seed, renderers), ids[2 * LOT_TILES], held = 0;
    queue_next(queue, renderer, now, lot);
    const struct holdings *holdings = &queue->holdings;
    for (uint32_t i = holdings->holders[renderer].first; i != HOLD_NONE;
         i = holdings->holds[i].next)
        ids[held++] = holdings->holds[i].id;
    for (uint32_t i = 0; i < held && random_below(seed, 4) > 0; i++) {
        struct tile tile = queue_tile_of(queue, ids[i]);
        if (queue_is_recalled(queue, renderer, ids[i]) && random_below(seed, 2)) {
            queue_drop(queue, renderer, ids[i], now, 0);
            continue;
        }
        if (tile.pass == TILE_PROBE) answer_probe(queue, &tile, seed);
        if (queue_finish(queue, renderer, ids[i], now, 1e-3) == ANSWER_COUNTS)
            mark(seen, &withdrawing, &tile);
        hear_fates(queue, seen, &withdrawing);
    }
}

/* Takes turns until the queue is complete; withdraws work after so many of them. */
static void withdraw_after(struct queue *queue, uint32_t turns, uint64_t *seed, double *now,
                           unsigned char *seen)
{
    for (uint32_t turn = 0; !queue_complete(queue); turn++) {
        take_turn(queue, 3, seed, *now += 1e-3, seen);
        assert_true(turn < 100000);
        if (turn != turns) continue;
        queue_withdraw(queue);
        for (uint32_t i = 0; i < 3; i++) /* all but the first tile may be dropped */
            assert_true(queue->holdings.holders[i].open <= 1);
        check_sums(queue);
    }
    check_sums(queue);
}

/* Withdrawing takes out tiles that were never handed out; those that are out come back, from their holders or from
 * others. After that the queue takes new work. */
static void test_withdraw(void **state)
{
    static unsigned char seen[256 * 192];
    uint64_t seed = 1;
    for (int round = 0; round < 40; round++) {
        struct queue *queue = queue_create(&withdrawing);
        double now = 0;
        memset(seen, 0, sizeof seen);
        withdraw_after(queue, random_below(&seed, 150), &seed, &now, seen);
        uint64_t finished = queue_count(queue).pixels_finished;
        uint32_t marked = 0;
        for (uint32_t i = 0; i < 256 * 192; i++)
            marked += seen[i];
        assert_int_equal(marked, finished);
        assert_true(finished < 256 * 192 && queue_count(queue).share_finished == 1);
        struct tile tile = {.w = 128, .h = 128, .step = 1, .pass = 1};
        memset(seen, 0, sizeof seen);
        queue_add(queue, &tile, queue_work(queue, &tile), 1);
        withdraw_after(queue, UINT32_MAX, &seed, &now, seen);
        assert_int_equal(queue_count(queue).pixels_finished, finished + 128 * 128);
        for (uint32_t i = 0; i < 256 * 192; i++)
            assert_int_equal(seen[i], i % 256 < 128 && i / 256 < 128);
        queue_destroy(queue);
    }
}

/* Pieces of a piece that its holder has dropped are not withdrawn: without them the tile that all of them are parts of
 * would never be finished. */
static void test_pieces_of_a_piece_stay(void **state)
{
    struct queue *queue = queue_create(&four);
    struct tile lot[LOT_TILES], tile;
    assert_true(queue_next(queue, 0, 0, lot) > 0);
    uint32_t count, whole = lot[0].id;
    assert_true(pieces_make(queue, whole, 2, 0));
    uint32_t piece = queue->items[whole].first_piece;
    while (!queue_find_held(queue, 1, piece, &tile)) {
        count = queue_next(queue, 1, 0, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++)
            if (lot[i].id != piece) queue_finish(queue, 1, lot[i].id, 0, 1e-4);
    }
    assert_true(pieces_make(queue, piece, 4, 0));
    queue_tell(queue, holdings_find(&queue->holdings, 1, piece), false);
    queue_drop(queue, 1, piece, 0, 0);
    queue_withdraw(queue);
    assert_int_equal(queue->items[piece].pieces, 4);
    while ((count = queue_next(queue, 2, 0, lot)) > 0)
        finish_lot(queue, 2, lot, count, 0);
    assert_true(queue->items[whole].finished);
    queue_destroy(queue);
}

/* Nor are pieces of a tile of which one has been handed out: it would be rendered in vain. */
static void test_pieces_in_work_stay(void **state)
{
    struct queue *queue = queue_create(&four);
    struct tile lot[LOT_TILES];
    assert_true(queue_next(queue, 0, 0, lot) > 0);
    uint32_t whole = lot[0].id, count, pieces = 0;
    assert_true(pieces_make(queue, whole, 4, 0));
    while (pieces == 0) {
        count = queue_next(queue, 1, 0, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++) {
            pieces += queue->items[lot[i].id].is_piece;
            if (!queue->items[lot[i].id].is_piece) queue_finish(queue, 1, lot[i].id, 0, 1e-4);
        }
    }
    queue_withdraw(queue);
    assert_int_equal(queue->items[whole].pieces, 4);
    queue_destroy(queue);
}

/* The queue does not wait for a renderer that has stopped while it held tiles that are withdrawn. */
static void test_withdraw_from_stopped(void **state)
{
    static unsigned char seen[256 * 192];
    struct queue *queue = queue_create(&withdrawing);
    uint64_t seed = 7;
    double now = 0;
    memset(seen, 0, sizeof seen);
    while (!queue->settled || queue_tile_count(queue, 2) == 0)
        take_turn(queue, 3, &seed, now += 1e-6, seen); /* nobody is late yet */
    queue_withdraw(queue);
    queue_look(queue,
               now); /* which takes out nothing that a renderer has begun and may still finish */
    const struct holdings *holdings = &queue->holdings;
    uint32_t begun = holdings->holds[holdings->holders[2].first].id;
    assert_false(queue->items[begun].replaced);
    assert_false(queue_complete(queue) || queue->pace.renderers[2].is_overdue);
    for (int i = 0; i < 10000 && !queue_complete(queue); i++) {
        take_turn(queue, 2, &seed, now += 1e-3, seen);
        queue_look(queue, now);
    }
    assert_true(queue_complete(queue) && queue_tile_count(queue, 2) > 0);
    /* Should it go on, it is to give up the tile, begun or not. */
    uint32_t id = holdings->holds[holdings->holders[2].last].id;
    assert_true(queue->items[id].pass == 0 && queue->items[id].replaced);
    assert_int_equal(told_finished(queue, 2, id), 1);
    check_sums(queue);
    queue_destroy(queue);
}

/* The number of probe tiles that renderers hold. */
static uint32_t probes_out(const struct queue *queue)
{
    uint32_t out = 0;
    for (uint32_t i = 0; i < queue->map.probes; i++)
        out += queue->items[queue->first_probe + i].copies;
    return out;
}

/* Whenever the pre-pass is ended, no more probes are handed out, and each renderer may drop those it holds except the
 * one that it is at. The queue predicts from the first probe that is back, and every pixel is rendered once as ever. */
static void test_probes_end(void **state)
{
    static unsigned char seen[256 * 192];
    uint32_t ended_with_none = 0, ended_with_some = 0;
    uint64_t seed = 1;
    for (uint32_t round = 1; round <= 60; round++) {
        struct queue *queue = queue_create(&withdrawing);
        double now = 0;
        memset(seen, 0, sizeof seen);
        for (uint32_t turn = 0; turn < round % 6 || probes_out(queue) == 0; turn++)
            take_turn(queue, 3, &seed, now += 1e-3, seen);
        uint32_t out = probes_out(queue), given = queue->next_probe, recalls = 0;
        bool knew = queue->settled, knows = queue->map.blocks_known > 0;
        uint64_t news = queue_news(queue);
        queue_end_probes(queue, now); /* of which idle renderers are told once */
        assert_true((queue_news(queue) > news) == !knew);
        news = queue_news(queue);
        queue_end_probes(queue, now);
        assert_int_equal(queue_news(queue), news);
        assert_true(queue->settled == (knew || knows));
        for (struct recall recall; queue_next_recall(queue, &recall); recalls++)
            assert_true(!recall.finished && queue->items[recall.id].pass == TILE_PROBE);
        assert_true(knew || (out - recalls >= 1 && out - recalls <= 3));
        for (uint32_t turn = 0; !queue_complete(queue); turn++) {
            take_turn(queue, 3, &seed, now += 1e-3, seen);
            assert_true(turn < 100000 && probes_out(queue) <= out);
            assert_true(queue->settled || queue->map.blocks_known == 0);
            for (uint32_t i = given; !knew && i < queue->map.probes; i++) {
                uint64_t id = (uint64_t)i * queue->probe_stride % queue->map.probes;
                assert_int_equal(queue->items[queue->first_probe + id].copies, 0);
            }
        }
        for (uint32_t i = 0; i < 256 * 192; i++)
            assert_int_equal(seen[i], 1);
        check_sums(queue);
        ended_with_none += !knows;
        ended_with_some += knows && !knew;
        queue_destroy(queue);
    }
    assert_true(ended_with_none > 2 && ended_with_some > 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_withdraw),
        cmocka_unit_test(test_pieces_of_a_piece_stay),
        cmocka_unit_test(test_pieces_in_work_stay),
        cmocka_unit_test(test_withdraw_from_stopped),
        cmocka_unit_test(test_probes_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
