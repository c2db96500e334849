/* Splitting tiles: which of them are split before they are handed out, and how small their parts are. */
#include <math.h>
#include <string.h>

#include "common/cores.h"
#include "master/queue_parts.h"
#include "test/queue_fixture.h"
#include "test/queue_halves_fixture.h"
#include "test/unit.h"

/* Pixels of the largest tile that is handed out in the right or the left half of a picture, whose pixels cost 1e-4 s in
 * the left half and a hundredth of that in the right one. */
static uint32_t largest_with(double most_work, bool right)
{
    const struct queue_config config = {.width = 640,
                                        .height = 320,
                                        .renderers = 1,
                                        .tile_edge = 16,
                                        .probe_edge = 8,
                                        .most_work = most_work};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    uint32_t largest = 0;
    settle_halves(queue, config.width);
    for (double now = 2e-3; !queue_complete(queue);) {
        uint32_t count = queue_next(queue, 0, now, lot);
        for (uint32_t i = 0; i < count; i++) {
            uint32_t pixels = tile_pixels(&lot[i]);
            double seconds = (lot[i].x < 320 ? 1e-4 : 1e-6) * pixels;
            if ((lot[i].x >= 320) == right && pixels > largest) largest = pixels;
            queue_finish(queue, 0, lot[i].id, now += seconds, seconds);
        }
    }
    queue_destroy(queue);
    return largest;
}

/* Where the predicted cost of a tile is limited, tiles beyond the limit are split, and no others. */
static void test_tiles_take_so_long_at_most(void **state)
{
    assert_int_equal(largest_with(0, false), 256);
    assert_int_equal(largest_with(16e-4, false), 16);
    assert_int_equal(largest_with(16e-4, true), largest_with(0, true));
}

/* A tile is also split if its most expensive spot might take more than four times that limit. */
static void test_worst_cases_are_limited(void **state)
{
    const struct queue_config config = {.width = 640,
                                        .height = 320,
                                        .renderers = 1,
                                        .tile_edge = 16,
                                        .probe_edge = 8,
                                        .most_work = 2};
    const struct pace_lot any = {HUGE_VAL, HUGE_VAL};
    struct queue *queue = queue_create(&config);
    settle_halves(queue, config.width);
    uint32_t id = heap_top(&queue->waiting);
    queue->items[id].work = 1.9f;
    queue->items[id].worst = 7.9f;
    assert_false(split_is_due(queue, id, any, false));
    queue->items[id].worst = 8.1f;
    assert_true(split_is_due(queue, id, any, false));
    queue_destroy(queue);
}

/* No piece is split, as the tile that it is a piece of counts its pieces; nor is any tile when there are as many as
 * there may be. */
static void test_what_is_not_split(void **state)
{
    const struct queue_config config = {.width = 64, .height = 48, .renderers = 4, .tile_edge = 16};
    struct queue *queue = queue_create(&config);
    uint32_t id = heap_top(&queue->waiting);
    assert_true(split_is_possible(queue, id) && pieces_make(queue, id, 2, 0));
    uint32_t piece = queue->items[id].first_piece;
    assert_int_equal(area(&queue->items[piece]), 16 * 8);
    assert_false(split_is_possible(queue, piece));
    queue->count.tiles = QUEUE_MAX_TILES;
    assert_false(split_is_possible(queue, id));
    queue_destroy(queue);
}

/* Pixels of the largest tile in some lots, each of which should be half of a tile of 4 x 4 pixels. The first lot,
 * handed out before anything is known of how long tiles take, has left parts of one. */
static uint32_t largest_of_lots(uint32_t samples)
{
    const uint32_t renderers = 16;
    const struct queue_config config = {.width = 4 * 2 * renderers,
                                        .height = 4,
                                        .renderers = renderers,
                                        .tile_edge = 4,
                                        .samples = samples};
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES];
    uint32_t count = queue_next(queue, 1, 0, lot), largest = 0;
    double now = 0;
    for (uint32_t i = 0; i < count; i++) {
        double seconds = 1e-2 * tile_pixels(&lot[i]);
        queue_finish(queue, 1, lot[i].id, now += seconds, seconds);
    }
    for (uint32_t renderer = 2; renderer < 6; renderer++) {
        count = queue_next(queue, renderer, now, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++)
            if (tile_pixels(&lot[i]) > largest) largest = tile_pixels(&lot[i]);
    }
    queue_destroy(queue);
    return largest;
}

/* A small tile stays whole where its pixels have few samples, and only there: its parts would together cost more than
 * it does. */
static void test_small_are_split_by_their_samples(void **state)
{
    assert_int_equal(largest_of_lots(0), 16);
    assert_int_equal(largest_of_lots(1), 16);
    assert_int_equal(largest_of_lots(16), 16);
    assert_int_equal(largest_of_lots(17), 8);
    assert_int_equal(largest_of_lots(4096), 8);
}

/* Whether a tile of 4 x 4 pixels that is predicted to be this part of a renderer's share is split wherever there is
 * room for it, whatever its most expensive spot may cost. All pixels cost the same. serving: what an answer takes the
 * master, seconds; a renderer's share takes 3.2 s. */
static bool is_small_split(uint32_t samples, double part, double serving)
{
    const uint32_t renderers = 16;
    const struct queue_config config = {.width = 128,
                                        .height = 4,
                                        .renderers = renderers,
                                        .tile_edge = 4,
                                        .probe_edge = 4,
                                        .samples = samples};
    const struct pace_lot any = {HUGE_VAL, HUGE_VAL};
    struct queue *queue = queue_create(&config);
    float seconds[LOT_TILES];
    for (uint32_t k = 0; k < LOT_TILES; k++)
        seconds[k] = 1;
    for (double now = 0; !queue->settled || !(queue->pace.scale > 0); now += 1) {
        struct tile lot[LOT_TILES];
        uint32_t count = queue_next(queue, 0, now, lot);
        for (uint32_t i = 0; i < count; i++) {
            if (lot[i].pass == TILE_PROBE) queue_probed(queue, &lot[i], seconds);
            queue_finish(queue, 0, lot[i].id, now, 0.1 * tile_pixels(&lot[i]));
        }
    }
    serve_for(queue, serving);
    uint32_t id = heap_top(&queue->waiting);
    assert_int_equal(area(&queue->items[id]), 16);
    double share = queue->pace.total / renderers;
    queue->items[id].work = (float)(part * share);
    queue->items[id].worst = (float)share;
    bool is_split = split_is_due(queue, id, any, false);
    queue_destroy(queue);
    return is_split;
}

/* Small tiles are split if they are dear all over, their parts cost no more, and the master keeps up with them: for 16
 * renderers in a tenth of a share, 0.32 s, if an answer takes it less than 8 ms (SERVICE_MOST in master/pace.c). */
static void test_small_are_split_if_dear_all_over(void **state)
{
    assert_true(is_small_split(64, 0.11, 1e-6));
    assert_false(is_small_split(64, 0.09, 1e-6));
    assert_false(is_small_split(16, 0.11, 1e-6));
    assert_true(is_small_split(64, 0.11, 7e-3));
    assert_false(is_small_split(64, 0.11, 9e-3));
}

/* Before there are predictions a lot has several tiles, however large the initial ones are: a single one may be more
 * than a renderer's share of all work. */
static void test_blind_lots_have_several_tiles(void **state)
{
    for (uint32_t edge = 16; edge <= 512; edge *= 2) {
        const struct queue_config config = {
            .width = 2560, .height = 1920, .renderers = 44, .tile_edge = edge, .probe_edge = 8};
        struct queue *queue = queue_create(&config);
        struct tile lot[LOT_TILES];
        uint32_t count;
        while ((count = queue_next(queue, 0, 0, lot)) > 0 && lot[0].pass == TILE_PROBE)
            for (uint32_t i = 0; i < count; i++)
                queue_finish(queue, 0, lot[i].id, 1e-3, 1e-4);
        assert_false(queue->settled);
        assert_true(count >= 8);
        queue_destroy(queue);
    }
}

/* Every renderer but 0 holds a lot that it got before there were predictions. Then all probes come back, those of
 * renderer 0 last. */
static void begin_blind(struct queue *queue, struct tile (*lots)[LOT_TILES], uint32_t *counts)
{
    struct tile own[LOT_TILES], probes[LOT_TILES];
    uint32_t count = queue_next(queue, 0, 0, own);
    for (uint32_t i = 1; i < queue->config.renderers; i++) {
        counts[i] = queue_next(queue, i, 0, lots[i]);
        if (lots[i][0].pass != TILE_PROBE) continue;
        uint32_t given = counts[i];
        memcpy(probes, lots[i], given * sizeof *probes);
        counts[i] = queue_next(queue, i, 0, lots[i]);
        answer_probes(queue, i, probes, given);
    }
    assert_false(queue->settled);
    answer_probes(queue, 0, own, count);
    assert_true(queue->settled);
}

/* Pixels of the largest piece of the expensive tiles that late renderers got before there were predictions, and have
 * not begun. The cheap ones go to others whole. */
static uint64_t largest_piece_of_late(uint32_t height, uint32_t samples)
{
    const struct queue_config config = {.width = 640,
                                        .height = height,
                                        .renderers = 44,
                                        .tile_edge = 8,
                                        .probe_edge = 16,
                                        .samples = samples};
    struct queue *queue = queue_create(&config);
    struct tile lots[44][LOT_TILES], lot[LOT_TILES];
    uint32_t counts[44] = {0}, cheap = 0;
    uint64_t largest = 0;
    begin_blind(queue, lots, counts);
    double now = 0.01;
    do {
        uint32_t count = queue_next(queue, 0, now, lot);
        assert_true(count > 0);
        for (uint32_t i = 0; i < count; i++) {
            assert_int_equal(queue->items[lot[i].id].pieces,
                             0); /* or it would go to others whole, too */
            queue_finish(queue, 0, lot[i].id, now, 1e-3);
        }
        queue_look(queue, now = 100);
    } while (queue->pace.spare.count > 0);
    for (uint32_t i = 1; i < config.renderers; i++) {
        for (uint32_t k = 1; k < counts[i]; k++) {
            const struct item *item = &queue->items[lots[i][k].id];
            bool is_dear = item->x < DEAR_WIDTH / 2, is_near = item->x < DEAR_WIDTH;
            if (!is_dear && is_near) continue; /* it may count as expensive, too */
            assert_int_equal(item->pieces > 0, is_dear);
            assert_true(is_dear || item->finished);
            cheap += !is_dear;
            assert_true(!is_dear || queue->items[item->first_piece].work < item->work);
            if (is_dear && area(&queue->items[item->first_piece]) > largest)
                largest = area(&queue->items[item->first_piece]);
        }
    }
    assert_true(cheap > 0);
    queue_destroy(queue);
    return largest;
}

static void test_dear_of_late_are_broken_up(void **state)
{
    assert_int_equal(largest_piece_of_late(480, 1), 16);
    assert_int_equal(largest_piece_of_late(240, 1), 16);
    assert_int_equal(largest_piece_of_late(240, 4096), 8);
}

#define BLIND 44

/* begin_blind() with so many renderers, for a picture of 640 columns. crowd: NULL if each has a core. */
static struct queue *begin_blind_rows(uint32_t height, const struct crowd *crowd,
                                      struct tile (*lots)[LOT_TILES], uint32_t *counts)
{
    const struct queue_config config = {.width = 640,
                                        .height = height,
                                        .renderers = BLIND,
                                        .crowd = crowd,
                                        .tile_edge = 8,
                                        .probe_edge = 8};
    struct queue *queue = queue_create(&config);
    begin_blind(queue, lots, counts);
    return queue;
}

/* Whether the expensive tiles that renderers got before there were predictions are broken into pieces once there are.
 * The more rows the picture has, the less of a renderer's share is one tile. */
static bool are_blind_broken_up(uint32_t height, const struct crowd *crowd)
{
    struct tile lots[BLIND][LOT_TILES];
    uint32_t counts[BLIND] = {0}, dear = 0, broken = 0;
    struct queue *queue = begin_blind_rows(height, crowd, lots, counts);
    for (uint32_t i = 1; i < BLIND; i++) {
        for (uint32_t k = 0; k < counts[i]; k++) {
            const struct item *item = &queue->items[lots[i][k].id];
            assert_int_equal(queue_is_recalled(queue, i, lots[i][k].id), item->pieces > 0);
            assert_true(item->pieces == 0 || item->x < DEAR_WIDTH / 2);
            dear += item->x < DEAR_WIDTH / 2;
            broken += item->pieces > 0;
        }
    }
    assert_true(dear > 0 && (broken == 0 || broken == dear));
    queue_destroy(queue);
    return broken > 0;
}

static void test_blind_are_broken_up(void **state)
{
    assert_true(are_blind_broken_up(128, NULL));
    assert_false(are_blind_broken_up(240, NULL));
}

/* Where renderers share cores, there is no idle one for the pieces. */
static void test_blind_on_shared_cores(void **state)
{
    static struct affinity affinities[BLIND];
    struct crowd crowd;
    for (uint32_t i = 0; i < BLIND; i++) {
        affinities[i] = (struct affinity){.machine = "one"};
        for (size_t core = 0; core < BLIND - 1; core++)
            CPU_SET(core, &affinities[i].cores);
    }
    crowd_init(&crowd, affinities, BLIND);
    assert_int_equal(crowd.processors, BLIND - 1);
    assert_false(are_blind_broken_up(96, &crowd));
    crowd_free(&crowd);
}

/* When work is withdrawn, pieces of which none has been handed out are withdrawn as well: their tiles are dropped by
 * the renderers that have not begun them, before or after that. */
static void withdraw_blind(bool before)
{
    struct tile lots[BLIND][LOT_TILES], lot[LOT_TILES], tile;
    uint32_t counts[BLIND] = {0}, recalled = 0;
    struct queue *queue = begin_blind_rows(128, NULL, lots, counts);
    for (uint32_t i = 1; i < BLIND; i++)
        for (uint32_t k = 1; k < counts[i]; k++) {
            if (!queue_is_recalled(queue, i, lots[i][k].id)) continue;
            recalled++;
            if (before) queue_drop(queue, i, lots[i][k].id, 0.01, 0);
        }
    assert_true(recalled > 0);
    queue_withdraw(queue);
    assert_int_equal(queue->waiting.count, 0);
    for (uint32_t i = 1; i < BLIND; i++) {
        queue_finish(queue, i, lots[i][0].id, 0.01, 1e-3);
        for (uint32_t k = 1; k < counts[i]; k++)
            if (queue_find_held(queue, i, lots[i][k].id, &tile))
                queue_drop(queue, i, tile.id, 0.01, 0);
    }
    assert_true(queue_complete(queue));
    assert_int_equal(queue_next(queue, 0, 0.01, lot), 0);
    assert_int_equal(queue_count(queue).tiles, BLIND - 1);
    queue_destroy(queue);
}

static void test_blind_are_withdrawn(void **state)
{
    withdraw_blind(false);
    withdraw_blind(true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tiles_take_so_long_at_most),
        cmocka_unit_test(test_worst_cases_are_limited),
        cmocka_unit_test(test_what_is_not_split),
        cmocka_unit_test(test_small_are_split_by_their_samples),
        cmocka_unit_test(test_small_are_split_if_dear_all_over),
        cmocka_unit_test(test_blind_lots_have_several_tiles),
        cmocka_unit_test(test_dear_of_late_are_broken_up),
        cmocka_unit_test(test_blind_are_broken_up),
        cmocka_unit_test(test_blind_on_shared_cores),
        cmocka_unit_test(test_blind_are_withdrawn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
