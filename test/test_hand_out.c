/* What the master sends to a renderer on another rank: lots, recalls, and that it is to stop. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/nap.h"
#include "test/master_fixture.h"
#include "test/unit.h"

/* Lots ask renderer 1 to call half way as long as nothing is known of its speed; `calls`: whether they do so when each
 * tile has taken it so many seconds. */
static void check_calls(enum schedule schedule, double seconds, bool calls)
{
    const struct queue_config config = {
        .schedule = schedule, .width = 64, .height = 64, .renderers = RENDERERS, .tile_edge = 4};
    struct farm *farm = farm_open(&config);
    for (int known = 0; known <= 1; known++) {
        sent.lots = 0;
        hand_out(&farm->server, 1);
        assert_true(sent.lots > 0);
        for (uint32_t i = 0; i < sent.lots; i++)
            assert_int_equal(sent.headers[i].wakes_master, known ? calls : 1);
        finish_all(&farm->server, seconds);
    }
    farm_close(farm);
}

/* A renderer calls for its next lot half way through one, unless that one lasts so long that the master looks for
 * messages anyway. */
static void test_who_calls(void **state)
{
    check_calls(SCHEDULE_DYNAMIC, NAP_CALL / 1000,
                true); /* all 256 tiles take a quarter of NAP_CALL */
    check_calls(SCHEDULE_DYNAMIC, NAP_CALL, false);
    check_calls(SCHEDULE_STRIPS, NAP_CALL, true); /* nobody predicts anything */
}

/* A lot tells after how long each of its tiles is to be reported. */
static void test_report_times(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct lot_header header;
    struct tile tiles[LOT_TILES];
    float sent_s[LOT_TILES], report_s[LOT_TILES];
    hand_out(&farm->server, 1);
    finish_all(&farm->server, 1);
    hand_out(&farm->server, 1);
    assert_true(farm->contacts[1].is_full);
    memcpy(&header, sent.lot, sizeof header);
    const char *at = sent.lot + sizeof header;
    memcpy(sent_s, at, header.reports * sizeof *sent_s);
    memcpy(tiles, at + lot_report_bytes(header.reports), header.reports * sizeof *tiles);
    uint32_t count = queue_report_times(farm->service.queue, 1, tiles, header.reports, report_s);
    assert_true(count > 0 && count == header.reports && report_s[0] > 1);
    assert_memory_equal(sent_s, report_s, count * sizeof *report_s);
    farm_close(farm);
}

/* ---- recalls ---- */

/* How many recalls of this tile were sent, which say that it is finished or else that another renderer has it, too. */
static unsigned count_told(uint32_t id, bool finished)
{
    unsigned count = 0;
    for (uint32_t i = 0; i < sent.drops; i++)
        count += sent.drop[i].tile_id == id && sent.drop[i].finished == finished;
    return count;
}

/* In one turn of the loop a renderer is told of all its tiles that others have finished, once, in as few messages as
 * possible. */
static void test_recalls(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct queue *queue = farm->service.queue;
    fall_silent(farm);
    uint32_t holds = queue_tile_count(queue, 1);
    assert_true(holds > DROP_TILES);
    while (other_goes_on(farm))
        ;
    assert_true(queue_complete(queue));
    tell_recalls(&farm->server);
    struct tile tile;
    uint32_t told = 0;
    for (uint32_t id = 0; told < holds; id++) {
        if (!queue_find_held(queue, 1, id, &tile)) continue;
        assert_true(count_told(id, true) == 1 && count_told(id, false) <= 1);
        told++;
    }
    assert_int_equal(sent.drop_messages, (sent.drops + DROP_TILES - 1) / DROP_TILES);
    uint32_t drops = sent.drops;
    assert_true(drops % DROP_TILES > 0); /* the last message is not full */
    tell_recalls(&farm->server);
    assert_int_equal(sent.drops, drops);
    farm_close(farm);
}

/* A renderer that does not answer is sent a limited number of recalls; when it answers, it is sent the rest. */
static void test_recalls_end(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct tile tile;
    fall_silent(farm);
    for (int i = 0; i < 10; i++)
        assert_true(other_goes_on(farm));
    farm->contacts[1].drops = 2 * LOTS_UNDER_WAY * LOT_TILES - 1; /* one less than there may be */
    tell_recalls(&farm->server);
    assert_int_equal(sent.drops, 1);
    assert_true(first_held(farm, &tile));
    write_part(&tile, (struct result_header){.pixels = tile_pixels(&tile), .busy_s = 1});
    arrive(farm);
    while (other_goes_on(farm))
        ;
    tell_recalls(&farm->server);
    assert_true(sent.drops > 0);
    farm_close(farm);
}

/* Renderer 1 asks for a lot, and finishes all of it but this tile; returns whether that is in the lot. *others counts
 * the tiles that renderer 0 has, too. */
static bool overtake(struct farm *farm, uint32_t but, uint32_t *others)
{
    struct queue *queue = farm->service.queue;
    struct tile lot[LOT_TILES], tile;
    bool found = false;
    uint32_t count = queue_next(queue, 1, LONG_AFTER, lot);
    assert_true(count > 0);
    tell_recalls(&farm->server);
    for (uint32_t i = 0; i < count; i++) {
        if (lot[i].id == but) {
            found = true;
            continue;
        }
        *others += queue_find_held(queue, 0, lot[i].id, &tile);
        queue_finish(queue, 1, lot[i].id, LONG_AFTER, 1);
    }
    tell_recalls(&farm->server);
    return found;
}

/* Renderer 0, on the master's own rank, gives up the tile in work where renderer 1 has finished it: not if that one
 * merely has it, too, or has finished others. Renderer 1 is told nothing. */
static void test_own_recalls(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct queue *queue = farm->service.queue;
    struct tile lot[LOT_TILES];
    assert_true(other_goes_on(farm)); /* lots are larger then */
    uint32_t count = queue_next(queue, 0, 0, lot), own = lot[count - 1].id, others = 0;
    assert_true(count > 1);
    queue_look(queue, LONG_AFTER);
    farm->server.own_tile = own;
    while (!overtake(farm, own, &others))
        ;
    assert_true(others > 0);
    assert_false(farm->service.given_up);
    queue_finish(queue, 1, own, LONG_AFTER, 1);
    tell_recalls(&farm->server);
    assert_true(farm->service.given_up);
    assert_int_equal(sent.drop_messages, 0);
    farm_close(farm);
}

/* ---- trays ---- */

/* Whether the last lot is one tile, of which all pixels get samples. */
static bool is_refined_lot(void)
{
    struct lot_header header;
    struct tile tile;
    static struct refinement refinements[TILE_MAX_PIXELS];
    memcpy(&header, sent.lot, sizeof header);
    const char *at = sent.lot + sizeof header + lot_report_bytes(header.reports);
    memcpy(&tile, at, sizeof tile);
    memcpy(refinements, at + sizeof tile, tile_pixels(&tile) * sizeof *refinements);
    return refinements_valid(refinements, tile_pixels(&tile), LEVEL_MAX) &&
           refinements_sampled(refinements, tile_pixels(&tile)) == tile_pixels(&tile);
}

/* A lot goes through the tray if that is free and large enough. A lot of a later pass is too large, as it says how many
 * samples each pixel gets: it goes by MPI. */
static void test_trays(void **state)
{
    struct view view = {.min_samples = 4, .max_samples = 64};
    for (int refined = 0; refined <= 1; refined++) {
        struct farm *farm = farm_open(&small_tiles);
        struct tray *tray = aligned_alloc(64, sizeof *tray);
        tray_init(tray);
        farm->trays[1] = tray;
        farm->service.adaptive = adaptive_create(&view, &farm->canvas, 1e-3);
        if (refined) finish_first_pass(farm);
        assert_false(bell_wait(&tray->bell, 0));
        hand_out(&farm->server, 1);
        assert_true(bell_wait(&tray->bell, 0));
        assert_int_equal(sent.lots, refined);
        if (refined) assert_true(is_refined_lot());
        assert_int_equal(tray->sent, refined ? 1 : TRAY_SLOTS);
        for (unsigned turn = 0; turn < TRAY_SLOTS; turn++)
            assert_int_equal(slots_bytes(&tray->lots, turn) > 0, !refined);
        adaptive_destroy(farm->service.adaptive);
        tray_free(tray);
        free(tray);
        farm_close(farm);
    }
}

/* ---- who gets work when there is some ---- */

/* Renderer 1 is at the last of its tiles, and nothing waits. */
static void come_to_the_last(struct farm *farm)
{
    struct queue *queue = farm->service.queue;
    struct tile tile;
    do {
        memset(&sent, 0, sizeof sent);
        hand_out(&farm->server, 1);
        while (queue_tile_count(queue, 1) > 1 && first_held(farm, &tile))
            queue_finish(queue, 1, tile.id, server_elapsed(&farm->server), LONG_AFTER);
    } while (sent.lots > 0);
    assert_int_equal(queue_tile_count(queue, 1), 1);
}

/* A renderer that has one lot of the two that it may have, as nothing waited, gets another one when work is added. */
static void test_news(void **state)
{
    const struct queue_config config = {
        .width = 8, .height = 8, .renderers = RENDERERS, .tile_edge = 8};
    struct farm *farm = farm_open(&config);
    come_to_the_last(farm);
    hand_out_to_idle(&farm->server);
    assert_true(sent.lots == 0 && !farm->contacts[1].is_idle);
    for (uint32_t i = 0; i < 8; i++)
        queue_add(farm->service.queue, &(struct tile){.y = i, .w = 8, .h = 1, .step = 1}, 1, 1);
    hand_out_to_idle(&farm->server);
    assert_int_equal(sent.lots, 0); /* it has not said that it is ready */
    farm->contacts[1].is_ready = true;
    farm->server.news = 0;
    hand_out_to_idle(&farm->server);
    assert_true(sent.lots > 0 && farm->server.news == queue_news(farm->service.queue));
    while (queue_tile_count(farm->service.queue, 1) > 0) {
        assert_false(farm->contacts[1].is_idle);
        finish_all(&farm->server, LONG_AFTER);
        memset(&sent, 0, sizeof sent);
        hand_out(&farm->server, 1);
    }
    assert_true(farm->contacts[1].is_idle);
    farm_close(farm);
}

/* Renderer 1 is idle, and does not get a tile that another one is about to finish. It gets that tile when it is
 * overdue, even if no message has come since. */
static void test_idle_get_what_is_overdue(void **state)
{
    const struct queue_config config = {.width = 32, .height = 32, .renderers = 4, .tile_edge = 8};
    struct farm *farm = farm_open(&config);
    struct queue *queue = farm->service.queue;
    struct tile lot[LOT_TILES];
    farm->contacts[1].is_ready = true;
    uint32_t count = queue_next(queue, 0, 0, lot);
    for (int i = 0; i < 100; i++)
        queue_served(queue, 10, 0); /* answers are expensive for the master, so short lots are */
    for (uint32_t i = 1; i < count; i++)
        queue_finish(queue, 0, lot[i].id, 100, 10);
    while (queue_count(queue).finished < queue_count(queue).tiles - 1) {
        count = queue_next(queue, 2, 100, lot);
        for (uint32_t i = 0; i < count; i++)
            queue_finish(queue, 2, lot[i].id, 100, 10);
    }
    farm->server.start -= 100;
    hand_out(&farm->server, 1);
    hand_out_to_idle(&farm->server);
    double wake = queue_wake(queue);
    assert_true(sent.lots == 0 && wake > 100 && wake < HUGE_VAL);
    farm->server.start -= wake - 100;
    hand_out_to_idle(&farm->server);
    assert_true(sent.lots > 0 && queue_wake(queue) > wake);
    farm_close(farm);
}

static const struct ready ready = {.rank = 1, .host = "host"};

/* A renderer that reports for work is told how long the others have worked, and gets work. */
static void test_start(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    farm->server.start -= 100;
    arrive_as(farm, TAG_RENDERER_TO_MASTER_READY, &ready, sizeof ready);
    assert_true(sent.starts == 1 && sent.lots > 0);
    assert_true(sent.start.elapsed_s >= 100 && sent.start.elapsed_s < 150);
    farm_close(farm);
}

/* A renderer that was told to stop is not told of what others have finished: it would not receive it. */
static void test_no_recalls_after_stop(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    fall_silent(farm);
    while (other_goes_on(farm))
        ;
    tell_stop(&farm->server, 1);
    tell_recalls(&farm->server);
    assert_true(sent.stops == 1 && sent.drop_messages == 0);
    farm_close(farm);
}

/* A renderer is told once to stop, and gets no work afterwards, even if it reports for work only then, or there is
 * more. */
static void test_stop(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    tell_stop(&farm->server, 1);
    tell_stop(&farm->server, 1);
    assert_int_equal(sent.stops, 1);
    arrive_as(farm, TAG_RENDERER_TO_MASTER_READY, &ready, sizeof ready);
    assert_true(farm->contacts[1].is_ready && sent.starts == 0 && sent.lots == 0);
    assert_string_equal(farm->stats[1].host, "host");
    farm->contacts[1].is_idle = true;
    queue_add(farm->service.queue, &(struct tile){.w = 8, .h = 1, .step = 1}, 1, 1);
    hand_out_to_idle(&farm->server);
    assert_int_equal(sent.lots, 0);
    farm_close(farm);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_who_calls),
        cmocka_unit_test(test_report_times),
        cmocka_unit_test(test_recalls),
        cmocka_unit_test(test_recalls_end),
        cmocka_unit_test(test_trays),
        cmocka_unit_test(test_news),
        cmocka_unit_test(test_idle_get_what_is_overdue),
        cmocka_unit_test(test_own_recalls),
        cmocka_unit_test(test_start),
        cmocka_unit_test(test_no_recalls_after_stop),
        cmocka_unit_test(test_stop),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
