/* Tiles that are broken into pieces while a renderer holds them as a whole: either all pieces count, or the whole. */
#include <math.h>

#include "test/queue_fixture.h"
#include "test/unit.h"

/* All tiles are finished except *last, which renderer 0 has begun, so soon that it is not overdue before; returns how
 * many pieces of it renderer 1 got in its last lot. */
static uint32_t leave_last(struct queue *queue, struct tile *last, struct tile *lot, double *now)
{
    uint32_t count = queue_next(queue, 0, *now, lot);
    *last = lot[0];
    for (uint32_t i = 1; i < count; i++)
        assert_true(queue_finish(queue, 0, lot[i].id, *now, 1e-4));
    while ((count = queue_next(queue, 1, *now, lot)) > 0 && !queue_count(queue).repeated)
        for (uint32_t i = 0; i < count; i++, *now += 1e-6)
            assert_true(queue_finish(queue, 1, lot[i].id, *now, 1e-4));
    assert_int_equal(queue_count(queue).finished, queue_count(queue).tiles - 1);
    return count;
}

/* The same, and the last tile is long overdue. Returns the number of its pieces that renderer 1 has got or, if it has
 * none, renderer 2 gets. */
static uint32_t break_last(struct queue *queue, struct tile *last, struct tile pieces[LOT_TILES])
{
    double now = 1e-3;
    uint32_t count = leave_last(queue, last, pieces, &now);
    now += 100; /* overdue by far */
    queue_look(queue, now);
    return count > 0 ? count : queue_next(queue, 2, now, pieces);
}

/* The renderer finishes the tile; returns whether its answer counts at once. */
static bool finish_and_mark(struct queue *queue, uint32_t renderer, const struct tile *tile,
                            unsigned char seen[64 * 48])
{
    enum answer answer = queue_finish(queue, renderer, tile->id, 0, 1e-4);
    if (answer == ANSWER_COUNTS) mark(seen, &four, tile);
    hear_fates(queue, seen, &four);
    return answer == ANSWER_COUNTS;
}

/* The pieces of a tile count when the last of them is back; an answer for the whole tile is then in vain. */
static void test_pieces_replace(void **state)
{
    struct queue *queue = queue_create(&four);
    struct tile last, lot[LOT_TILES];
    unsigned char seen[64 * 48] = {0};
    uint32_t count = break_last(queue, &last, lot),
             renderer = queue_tile_count(queue, 2) > 0 ? 2 : 1;
    uint32_t kept = 0, counted = 0, tiles = queue_count(queue).tiles;
    assert_true(count > 0 && tile_pixels(&lot[0]) < tile_pixels(&last));
    do {
        for (uint32_t i = 0; i < count; i++, kept++) {
            assert_true(counted == 0 && !queue_complete(queue));
            assert_int_equal(queue_finish(queue, renderer, lot[i].id, 101, 1e-4), ANSWER_KEPT);
            counted = hear_fates(queue, seen, &four); /* no pixel twice */
        }
        count = queue_next(queue, renderer, 101, lot);
    } while (count > 0);
    assert_true(queue_complete(queue) && counted == kept);
    assert_int_equal(queue_count(queue).tiles, tiles - 1 + kept);
    assert_int_equal(queue_count(queue).pixels_finished, 64 * 48);
    assert_true(queue_count(queue).share_finished == 1);
    for (uint32_t k = 0; k < tile_pixels(&last); k++) {
        uint32_t x, y;
        tile_pixel(&last, k, &x, &y);
        assert_int_equal(seen[y * 64 + x], 1);
    }
    double wasted = queue_count(queue).wasted_s;
    assert_int_equal(queue_finish(queue, 0, last.id, 102, 1), ANSWER_IN_VAIN);
    assert_true(queue_count(queue).wasted_s == wasted + 1);
    assert_int_equal(queue_count(queue).pixels_finished, 64 * 48);
    queue_destroy(queue);
}

/* A tile is broken into as many pieces as idle renderers can use, but into no more than the master can take in while
 * they are rendered: a tile of 100 s into 2, where an answer takes the master 25 s. */
static void test_pieces_are_worth_an_answer(void **state)
{
    for (int dear = 0; dear <= 1; dear++) {
        struct queue *queue = queue_create(&four);
        struct tile last, lot[LOT_TILES];
        double now = 1e-3;
        serve_for(queue, 1e-2); /* so that it is no use yet to break up anything */
        assert_int_equal(leave_last(queue, &last, lot, &now), 0);
        now += 100;
        queue_look(queue, now);
        serve_for(queue, dear ? 25 : 1e-6);
        assert_true(queue_next(queue, 2, now, lot) > 0);
        assert_int_equal(queue->items[last.id].pieces, dear ? 2 : 8);
        queue_destroy(queue);
    }
}

/* A whole tile that comes back before any of its pieces counts, and all pieces are in vain. */
static void test_whole_before_pieces(void **state)
{
    struct queue *queue = queue_create(&four);
    struct tile last, lot[LOT_TILES], tile;
    uint32_t next = 0, count = break_last(queue, &last, lot), tiles = queue_count(queue).tiles;
    uint32_t renderer = queue_tile_count(queue, 2) > 0 ? 2 : 1;
    assert_true(count > 0 && tile_pixels(&lot[0]) < tile_pixels(&last));
    /* Pieces are not split like other tiles: their whole expects back as many as it was broken into. */
    for (uint32_t i = 0; i < count; i++) {
        assert_true(queue->items[lot[i].id].is_piece);
        assert_false(split_is_possible(queue, lot[i].id));
    }
    assert_true(queue_finish(queue, 0, last.id, 101, 1));
    assert_true(queue_complete(queue));
    assert_int_equal(queue_count(queue).tiles, tiles);
    assert_int_equal(queue_count(queue).pixels_finished, 64 * 48);
    assert_false(queue_unfinished(queue, &next, &tile));
    for (uint32_t i = 0; i < count; i++)
        assert_false(queue_finish(queue, renderer, lot[i].id, 102, 1e-4));
    assert_int_equal(queue_next(queue, 3, 103, lot), 0);
    queue_destroy(queue);
}

/* A whole tile that comes back before the last of its pieces counts, and the pieces that are back do not. */
static void test_whole_before_last_piece(void **state)
{
    struct queue *queue = queue_create(&four);
    struct tile last, lot[LOT_TILES];
    unsigned char seen[64 * 48] = {0};
    uint32_t count = break_last(queue, &last, lot),
             renderer = queue_tile_count(queue, 2) > 0 ? 2 : 1;
    uint32_t pieces = queue->items[last.id].pieces, tiles = queue_count(queue).tiles, kept = 0;
    assert_true(pieces > 2);
    for (; kept + 1 < pieces; count = queue_next(queue, renderer, 101, lot))
        for (uint32_t i = 0; i < count && kept + 1 < pieces; i++, kept++)
            assert_int_equal(queue_finish(queue, renderer, lot[i].id, 101, 1e-4), ANSWER_KEPT);
    double wasted = queue_count(queue).wasted_s;
    assert_int_equal(queue_finish(queue, 0, last.id, 102, 1), ANSWER_COUNTS);
    assert_int_equal(hear_fates(queue, seen, &four), 0);
    assert_true(fabs(queue_count(queue).wasted_s - wasted - kept * 1e-4) < 1e-9);
    assert_true(queue_complete(queue));
    assert_int_equal(queue_count(queue).tiles, tiles);
    assert_int_equal(queue_count(queue).pixels_finished, 64 * 48);
    queue_destroy(queue);
}

/* A piece may be broken up in turn; then either its own pieces come back in its place, or it does. */
static void test_pieces_of_a_piece(void **state)
{
    for (int by_parts = 0; by_parts < 2; by_parts++) {
        struct queue *queue = queue_create(&four);
        struct tile lot[LOT_TILES], tile;
        unsigned char seen[64 * 48] = {0};
        uint32_t count = queue_next(queue, 0, 0, lot), whole = lot[0].id;
        uint64_t news = queue_news(queue);
        assert_true(pieces_make(queue, whole, 2, 0));
        assert_true(queue_news(queue) != news); /* so that those who have got nothing ask again */
        uint32_t piece = queue->items[whole].first_piece;
        for (uint32_t i = 1; i < count; i++)
            assert_true(finish_and_mark(queue, 0, &lot[i], seen));
        for (bool held = false; (count = queue_next(queue, 1, 0, lot)) > 0;) {
            for (uint32_t i = 0; i < count; i++)
                if (lot[i].id != piece) finish_and_mark(queue, 1, &lot[i], seen);
            if (held || !queue_find_held(queue, 1, piece, &tile)) continue;
            held = true;
            assert_true(pieces_make(queue, piece, 4, 0));
            if (!by_parts) assert_false(finish_and_mark(queue, 1, &tile, seen));
        }
        assert_true(queue_complete(queue) && queue->items[whole].finished);
        for (uint32_t i = 0; i < 64 * 48; i++)
            assert_int_equal(seen[i], 1);
        assert_int_equal(queue_finish(queue, 0, whole, 0, 1), ANSWER_IN_VAIN);
        if (by_parts) assert_int_equal(queue_finish(queue, 1, piece, 0, 1), ANSWER_IN_VAIN);
        queue_destroy(queue);
    }
}

/* Pieces of a tile that has taken longer than it was thought to take at worst are predicted from that time, their worst
 * cases, too. */
static void test_pieces_of_what_takes_long(void **state)
{
    struct queue *queue = queue_create(&four);
    struct tile lot[LOT_TILES];
    assert_true(queue_next(queue, 0, 0, lot) > 0);
    const double known = 100 * (double)queue->items[lot[0].id].worst;
    assert_true(pieces_make(queue, lot[0].id, 4, known));
    const struct item *whole = &queue->items[lot[0].id];
    for (uint32_t i = 0; i < whole->pieces; i++) {
        const struct item *piece = &queue->items[whole->first_piece + i];
        assert_sum((double)piece->work, known * (double)area(piece) / (double)area(whole), known);
        assert_true(piece->worst >= piece->work);
    }
    queue_destroy(queue);
}

/* There are never more tiles than QUEUE_MAX_TILES: one that would make more is not broken up. */
static void test_pieces_within_the_limit(void **state)
{
    struct queue *queue = queue_create(&four);
    struct tile lot[LOT_TILES];
    assert_true(queue_next(queue, 0, 0, lot) > 0);
    uint32_t items = queue->item_count;
    queue->item_count = QUEUE_MAX_TILES - 3;
    assert_false(pieces_make(queue, lot[0].id, 4, 0));
    queue->item_count = items;
    assert_true(pieces_make(queue, lot[0].id, 4, 0));
    queue_destroy(queue);
}

/* A renderer is told, once, that others have finished what it is working on, and may drop it half done: the whole tile
 * when all pieces are back, a piece when the whole tile is. */
static void test_finished_is_told(void **state)
{
    for (int whole = 0; whole < 2; whole++) {
        struct queue *queue = queue_create(&four);
        struct tile last, lot[LOT_TILES];
        uint32_t count = break_last(queue, &last, lot),
                 renderer = queue_tile_count(queue, 2) > 0 ? 2 : 1;
        assert_true(count > 0 && queue_is_recalled(queue, 0, last.id));
        assert_int_equal(told_finished(queue, 0, last.id), 0); /* only that others have it */
        const struct tile *late = whole ? &lot[0] : &last;
        uint32_t loser = whole ? renderer : 0;
        assert_int_equal(queue_is_recalled(queue, loser, late->id), !whole);
        if (whole) assert_int_equal(queue_finish(queue, 0, last.id, 101, 1e-4), ANSWER_COUNTS);
        for (; !whole && count > 0; count = queue_next(queue, renderer, 101, lot)) {
            for (uint32_t i = 0; i < count; i++) {
                assert_int_equal(told_finished(queue, 0, last.id), 0);
                assert_true(queue_finish(queue, renderer, lot[i].id, 101, 1e-4) == ANSWER_KEPT);
            }
            if (queue_complete(queue)) break;
        }
        assert_true(queue_is_recalled(queue, loser, late->id));
        assert_int_equal(told_finished(queue, loser, late->id), 1);
        assert_int_equal(told_finished(queue, loser, late->id), 0);
        double wasted = queue_count(queue).wasted_s;
        queue_drop(queue, loser, late->id, 102, 0.5);
        struct tile tile;
        assert_false(queue_find_held(queue, loser, late->id, &tile));
        assert_true(fabs(queue_count(queue).wasted_s - wasted - 0.5) < 1e-9);
        queue_destroy(queue);
    }
}

/* A tile that takes far too long is broken up while others still wait, but not early in the run. */
static void test_overdue_is_broken_up(void **state)
{
    struct queue *queue = queue_create(&four);
    struct tile first, lot[LOT_TILES];
    uint32_t count = queue_next(queue, 0, 0, lot);
    first = lot[0];
    for (uint32_t i = 1; i < count; i++)
        assert_true(queue_finish(queue, 0, lot[i].id, 1e-3, 1e-3));
    count = queue_next(queue, 1, 1e-3, lot);
    for (uint32_t i = 0; i < count; i++)
        assert_true(queue_finish(queue, 1, lot[i].id, 2e-3, 1e-3));
    assert_true(queue->waiting.count > 0 && queue_tile_count(queue, 0) == 1);
    queue_look(queue, 0.1); /* overdue, but most of the run is to come */
    count = queue_next(queue, 1, 0.1, lot);
    assert_true(count > 0);
    for (uint32_t i = 0; i < count; i++) /* or it would be what is taken over first */
        assert_true(queue_finish(queue, 1, lot[i].id, 0.1, 1e-3));
    assert_int_equal(queue->items[first.id].pieces, 0);
    queue_look(queue, 100);
    count = queue_next(queue, 2, 100, lot);
    assert_true(count > 0 && queue->waiting.count > 0);
    assert_true(queue->items[first.id].pieces > 1);
    assert_true(queue_is_recalled(queue, 0, first.id));
    assert_true(queue->items[lot[0].id].is_piece);
    assert_int_equal(queue->items[lot[0].id].whole, first.id);
    queue_destroy(queue);
}

/* The number of pieces into which a tile of 64 x 64 pixels is broken when it is overdue by the time of so many shortest
 * lots. They are predicted from that time. */
static uint32_t pieces_of_overdue(double lots)
{
    const struct queue_config config = {
        .width = 2048, .height = 2048, .renderers = 4, .tile_edge = 64};
    struct queue *queue = queue_create(&config);
    struct tile held[LOT_TILES], lot[LOT_TILES];
    const double start = 1e9;
    assert_true(queue_next(queue, 0, start, held) == 1 && tile_pixels(&held[0]) == 64 * 64);
    assert_true(queue_next(queue, 1, start, lot) == 1);
    assert_true(queue_finish(queue, 1, lot[0].id, start + 1, 1e-3));
    serve_for(queue, 1e6); /* the shortest lot takes far longer than all the rest */
    queue_look(queue, 1e12);
    const struct pace *pace = &queue->pace;
    double overdue = lots * pace_least(pace, 0), work = 0,
           known = overdue / pace_seconds(pace, 0, 1);
    assert_true(pace->renderers[0].is_overdue);
    queue_next(queue, 1, pace->renderers[0].free_at + overdue, lot);
    const struct item *whole = &queue->items[held[0].id];
    for (uint32_t i = 0; i < whole->pieces; i++)
        work += (double)queue->items[whole->first_piece + i].work;
    assert_sum(work, known, known);
    uint32_t pieces = whole->pieces;
    queue_destroy(queue);
    return pieces;
}

/* If an overdue tile takes as long again, each of its pieces takes a shortest lot at most; but there are two of them at
 * least, and 1024 at most. */
static void test_overdue_is_broken_into_shortest_lots(void **state)
{
    assert_int_equal(pieces_of_overdue(0.4), 2);
    assert_int_equal(pieces_of_overdue(4.1), 8);
    assert_int_equal(pieces_of_overdue(4.5), 16);
    assert_int_equal(pieces_of_overdue(1e6), 1024);
}

/* Whether a tile of edge x edge pixels is broken up while others wait, when the rest of the run is this part of the
 * time by which it is overdue, times the speed of its holder. */
static bool is_broken_up(uint32_t edge, double part, double speed)
{
    const struct queue_config config = {
        .width = 1024, .height = 1024, .renderers = 4, .tile_edge = edge};
    struct queue *queue = queue_create(&config);
    struct tile held[LOT_TILES], lot[LOT_TILES];
    struct pace_renderer *holder = &queue->pace.renderers[0];
    uint32_t count = queue_next(queue, 0, 0, held), others = queue_next(queue, 1, 0, lot);
    for (uint32_t i = 1; i < count; i++)
        assert_true(queue_finish(queue, 0, held[i].id, 1e-3, 1e-3));
    for (uint32_t i = 0; i < others; i++)
        assert_true(queue_finish(queue, 1, lot[i].id, 1e-3, 1e-3));
    queue_look(queue, 1e6);
    assert_true(holder->is_overdue && tile_pixels(&held[0]) == edge * edge);
    holder->speed = speed; /* it does not count among those of the others */
    double rest = pace_even_end(&queue->pace, 1e-3, queue->waiting_work);
    assert_true(queue_next(queue, 1, holder->free_at + rest / (part * speed), lot) > 0);
    bool is_broken = queue->items[held[0].id].pieces > 0;
    queue_destroy(queue);
    return is_broken;
}

/* The fewer pixels a tile has, the more of its time may be that of a single one, and the earlier it is broken up; but
 * not a tile that may well be back soon. */
static void test_overdue_few_pixels_are_broken_up_earlier(void **state)
{
    assert_true(is_broken_up(16, 3.0 / 256 / 1.05, 1));
    assert_false(is_broken_up(16, 3.0 / 256 * 1.05, 1));
    assert_true(is_broken_up(8, 3.0 / 64 / 1.05, 1));
    assert_false(is_broken_up(8, 3.0 / 64 * 1.05, 1));
    assert_true(is_broken_up(4, 0.14, 1));
    assert_false(is_broken_up(4, 0.16, 1));
    assert_true(is_broken_up(8, 3.0 / 64 / 1.05, 0.25));
    assert_false(is_broken_up(8, 3.0 / 64 * 1.05, 0.25));
}

/* A tile of any size, of a renderer of any speed, is broken up when no more than a 700th of the time by which it is
 * overdue is left to each of the four renderers. */
static void test_overdue_near_the_end_is_broken_up(void **state)
{
    assert_true(is_broken_up(32, 4.0 / 700 / 1.05, 1));
    assert_false(is_broken_up(32, 4.0 / 700 * 1.05, 1));
    assert_true(is_broken_up(32, 4.0 / 700 / 1.05 / 0.25, 0.25));
    assert_false(is_broken_up(32, 4.0 / 700 * 1.05 / 0.25, 0.25));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pieces_replace),
        cmocka_unit_test(test_pieces_are_worth_an_answer),
        cmocka_unit_test(test_whole_before_pieces),
        cmocka_unit_test(test_whole_before_last_piece),
        cmocka_unit_test(test_pieces_of_a_piece),
        cmocka_unit_test(test_pieces_of_what_takes_long),
        cmocka_unit_test(test_pieces_within_the_limit),
        cmocka_unit_test(test_finished_is_told),
        cmocka_unit_test(test_overdue_is_broken_up),
        cmocka_unit_test(test_overdue_is_broken_into_shortest_lots),
        cmocka_unit_test(test_overdue_few_pixels_are_broken_up_earlier),
        cmocka_unit_test(test_overdue_near_the_end_is_broken_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
