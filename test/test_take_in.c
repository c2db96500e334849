/* What the master makes of the messages and trays of a renderer on another rank: valid ones are counted, others end the
 * run. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "master/queue_parts.h"
#include "test/fatal.h"
#include "test/master_fixture.h"
#include "test/unit.h"

/* The master itself counts what a renderer has brought into the picture: so much is known even if it leaves without a
 * word. */
static void test_answers_are_counted(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    const struct renderer_stats *stats = &farm->stats[1];
    struct tile tile;
    double start = clock_thread_cpu();
    arrive_as(farm, TAG_RENDERER_TO_MASTER_PONG, "", 0); /* is none */
    hand_out(&farm->server, 1);
    for (uint32_t i = 1; i <= 9; i++) {
        assert_true(first_held(farm, &tile));
        write_part(
            &tile,
            (struct result_header){
                .pixels = 16, .start_s = 5 * i, .busy_s = 2, .cpu_s = 1, .counts = {.rays = {3}}});
        size_t bytes = letter.size;
        arrive(farm);
        assert_true(stats->tiles == i && stats->pixels == 16 * i && stats->bytes == bytes * i);
        assert_true(stats->busy_s == 2 * i && stats->cpu_s == i && stats->finish_s == 5 * i + 2);
        assert_true(stats->counts.rays[0] == 3 * i && farm->served.counts.rays[0] == 3 * i);
    }
    assert_int_equal(render_counts_rays(&farm->served.counts), 3 * 9); /* of which the bar tells */
    assert_true(farm->served.messages == 10 && farm->server.pixels == 16 * 9);
    assert_int_equal(farm->served.answers, 2); /* one of eight is measured */
    assert_true(farm->served.service_cpu_s > 0);
    assert_true(farm->served.service_cpu_s <= clock_thread_cpu() - start);
    farm_close(farm);
}

/* What was planned before an answer counts once, and the end of the render phase is that of its last answer; after a
 * time limit it has ended already. */
static void test_times_of_the_phase(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct tile tile;
    hand_out(&farm->server, 1);
    farm->server.planned_s = 0.5;
    for (int late = 0; late <= 1; late++) {
        farm->served.timed_out = late;
        farm->server.finished_at = 7;
        assert_true(first_held(farm, &tile));
        write_part(&tile, (struct result_header){.pixels = 16, .busy_s = 2});
        arrive(farm);
        assert_true(farm->served.plan_s == 0.5 && farm->server.planned_s == 0);
        assert_int_equal(farm->server.finished_at == 7, late);
    }
    farm_close(farm);
}

/* A tile that was dropped does not count as rendered, but costs time if it was begun. The report that a tile takes long
 * may come when it is back already. */
static void test_what_is_not_finished(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct tile tile, back;
    fall_silent(farm);
    assert_true(first_held(farm, &back));
    write_part(&back, (struct result_header){.pixels = 16, .start_s = 5, .busy_s = 2});
    arrive(farm);
    write_part(&back, (struct result_header){.pixels = RESULT_UNFINISHED, .busy_s = 1});
    arrive(farm);
    while (other_goes_on(farm))
        ;
    assert_true(first_held(farm, &tile));
    uint32_t holds = queue_tile_count(farm->service.queue, 1);
    write_part(&tile, (struct result_header){.pixels = RESULT_DROPPED, .start_s = 9});
    arrive(farm);
    assert_int_equal(queue_tile_count(farm->service.queue, 1), holds - 1);
    assert_true(farm->stats[1].finish_s == 7 && farm->stats[1].tiles == 1);
    assert_true(first_held(farm, &tile));
    write_part(&tile, (struct result_header){.pixels = RESULT_DROPPED, .start_s = 9, .busy_s = 3});
    arrive(farm);
    assert_true(farm->stats[1].busy_s == 5 && farm->stats[1].finish_s == 12);
    assert_int_equal(farm->stats[1].tiles, 1);
    farm_close(farm);
}

/* What a tile is said to have taken so far reaches the queue: its renderer counts as late, and others are to ask again,
 * as they may take over what it holds. */
static void test_what_takes_long(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct queue *queue = farm->service.queue;
    struct tile tile;
    hand_out(&farm->server, 1);
    for (uint32_t seconds = 1; seconds <= 1000; seconds += 999) {
        assert_true(first_held(farm, &tile));
        uint64_t news = queue_news(queue);
        write_part(&tile, (struct result_header){.pixels = RESULT_UNFINISHED, .busy_s = seconds});
        arrive(farm);
        assert_int_equal(queue_news(queue) != news, seconds == 1000);
        write_part(&tile, (struct result_header){.pixels = 16, .busy_s = seconds});
        arrive(farm);
    }
    farm_close(farm);
}

/* The tray of renderer 1, until take_tray(). */
static struct tray *give_tray(struct farm *farm)
{
    struct tray *tray = aligned_alloc(64, sizeof *tray);
    tray_init(tray);
    return farm->trays[1] = tray;
}

static void take_tray(struct farm *farm)
{
    tray_free(farm->trays[1]);
    free(farm->trays[1]);
    farm->trays[1] = NULL;
}

/* The first result, of so many bytes, lies in the renderer's tray; the master looks. */
static void leave_in_tray(struct farm *farm, uint32_t bytes)
{
    slots_fill(&farm->trays[1]->results, 0, bytes);
    arrivals_leave(farm->arrivals, 1);
    assert_true(take_in(&farm->server));
}

/* A result in the tray is taken in, and its slot is free again. */
static void test_answer_in_a_tray(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct tray *tray = give_tray(farm);
    struct tile tile;
    hand_out(&farm->server, 1);
    assert_true(first_held(farm, &tile));
    write_part(&tile, (struct result_header){.pixels = 16, .busy_s = 1});
    memcpy(tray->result[0], letter.bytes, letter.size);
    farm->server.awake_s = 3;
    leave_in_tray(farm, (uint32_t)letter.size);
    assert_true(farm->contacts[1].heard_at == 3);
    assert_true(farm->stats[1].tiles == 1 && slots_bytes(&tray->results, 0) == 0);
    take_tray(farm);
    farm_close(farm);
}

/* The time for which answers have waited is that of each of them, since messages were last looked for. A look that
 * finds nothing ends such a time. */
static void test_waits_are_counted(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct tray *tray = give_tray(farm);
    struct tile tile;
    hand_out(&farm->server, 1);
    for (uint32_t i = 0, id = 0; i < 2; i++, id++, letter.size = 0) {
        while (!queue_find_held(farm->service.queue, 1, id, &tile))
            id++;
        write_part(&tile, (struct result_header){.pixels = 16, .busy_s = 1});
        memcpy(tray->result[i], letter.bytes, letter.size);
        slots_fill(&tray->results, i, (uint32_t)letter.size);
    }
    farm->server.polled_at = clock_wall() - 1000;
    assert_false(take_in(&farm->server));
    assert_true(farm->served.answer_wait_most_s == 0);
    assert_true(farm->server.polled_at > clock_wall() - 100);
    arrivals_leave(farm->arrivals, 1);
    farm->server.polled_at = clock_wall() - 100;
    farm->served.answer_wait_s = 1000; /* of earlier answers */
    assert_true(take_in(&farm->server));
    farm->served.answer_wait_s -= 1000;
    assert_true(farm->stats[1].tiles == 2 && farm->served.answers == 2);
    /* The queue hears what each has taken. */
    const struct pace_service *service = &farm->service.queue->pace.service;
    assert_true(service->answers == 1 && service->pixels == 16);
    assert_true(service->seconds > 0 && service->seconds == farm->served.service_cpu_s / 2);
    assert_true(farm->served.answer_wait_s >= 200 && farm->served.answer_wait_s < 400);
    assert_true(fabs(farm->served.answer_wait_most_s * 2 - farm->served.answer_wait_s) < 1e-6);
    take_tray(farm);
    farm_close(farm);
}

static const struct renderer_stats goodbye = {.rank = 1, .tiles = 5, .host = "host"};

static void say_goodbye(void *state)
{
    arrive_as(state, TAG_RENDERER_TO_MASTER_STATS, &goodbye, sizeof goodbye);
}

/* A PONG is a sign of life. A renderer that has sent its statistics at the end is gone, and does not come again. */
static void test_goodbye(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct contact *contact = &farm->contacts[1];
    farm->server.awake_s = 3;
    arrive_as(farm, TAG_RENDERER_TO_MASTER_PONG, "", 0);
    assert_true(contact->heard_at == 3 && sent.lots == 0);
    farm->service.ending = true;
    say_goodbye(farm);
    assert_true(contact->is_gone && farm->stats[1].tiles == 5);
    assert_fatal(say_goodbye, farm, "farm: rank 0: rank 1 sent statistics that make no sense\n");
    farm_close(farm);
}

/* Nothing is left to do: that is the end, too. */
static void test_goodbye_after_the_last_tile(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    while (other_goes_on(farm))
        ;
    say_goodbye(farm);
    assert_true(farm->contacts[1].is_gone && farm->stats[1].tiles == 5);
    farm_close(farm);
}

/* Probes are no part of the picture: they cost time, and that is all. */
static void test_probes_are_not_counted(void **state)
{
    struct queue_config config = small_tiles;
    config.probe_edge = 4;
    struct farm *farm = farm_open(&config);
    const struct renderer_stats *stats = &farm->stats[1];
    struct tile tile;
    hand_out(&farm->server, 1);
    for (uint32_t id = 0; !queue_find_held(farm->service.queue, 1, id, &tile) || tile.pass == 0;
         id++)
        assert_true(id < 1000);
    write_part(&tile, (struct result_header){
                          .pixels = tile_pixels(&tile), .start_s = 5, .busy_s = 2, .cpu_s = 1});
    arrive(farm);
    assert_true(stats->busy_s == 2 && stats->cpu_s == 1 && farm->served.probe_s == 2);
    assert_true(stats->tiles == 0 && stats->pixels == 0 && stats->finish_s == 7);
    farm_close(farm);
}

/* ---- messages that make no sense ---- */

/* Messages that make no sense, from a renderer that has tiles, some of which others have, too. */
enum wrong {
    DROP_UNASKED,
    DROPPED_IN_NO_TIME,
    RESULT_TOO_LONG,
    RESULT_TOO_SHORT,
    RESULT_WITHOUT_PIXELS,
    SECOND_PART_TOO_SHORT,
    RESULT_EMPTY,
    RESULT_OF_OTHERS,
    UNFINISHED_IN_NO_TIME,
    TRAY_TOO_LONG,
    READY_AGAIN,
    STATS_EARLY,
    PONG_LONG,
    OTHER_KIND
};

struct attempt {
    struct farm *farm;
    enum wrong wrong;
};

static void send_result(struct farm *farm, enum wrong wrong)
{
    struct tile tile;
    struct result_header header = {.pixels = 16, .busy_s = 1};
    uint32_t id = 0;
    while (!queue_find_held(farm->service.queue, 1, id, &tile) ||
           queue_is_recalled(farm->service.queue, 1, id) != (wrong == DROPPED_IN_NO_TIME))
        id++;
    if (wrong == DROP_UNASKED) header.pixels = RESULT_DROPPED;
    if (wrong == DROPPED_IN_NO_TIME) header.pixels = RESULT_DROPPED, header.busy_s = (double)NAN;
    if (wrong == UNFINISHED_IN_NO_TIME)
        header.pixels = RESULT_UNFINISHED, header.busy_s = (double)NAN;
    if (wrong == RESULT_TOO_SHORT) header.pixels = RESULT_UNFINISHED;
    if (wrong == RESULT_OF_OTHERS) tile.id = 9999;
    if (wrong == SECOND_PART_TOO_SHORT)
        write_part(&tile, (struct result_header){.pixels = RESULT_UNFINISHED, .busy_s = 1});
    write_part(&tile, header);
    if (wrong == SECOND_PART_TOO_SHORT) letter.size -= 8;
    if (wrong == RESULT_TOO_LONG) letter.size += 8;
    if (wrong == RESULT_WITHOUT_PIXELS) letter.size = sizeof header;
    if (wrong == RESULT_TOO_SHORT) letter.size = sizeof header - 8;
    if (wrong == RESULT_EMPTY) letter.size = 0;
    arrive(farm);
}

static void try_wrong(void *state)
{
    const struct attempt *it = state;
    const struct ready ready = {.rank = 1};
    const struct renderer_stats stats = {.rank = 1};
    if (it->wrong < TRAY_TOO_LONG) send_result(it->farm, it->wrong);
    if (it->wrong == TRAY_TOO_LONG) leave_in_tray(it->farm, TRAY_RESULT_BYTES + 8);
    if (it->wrong == READY_AGAIN)
        arrive_as(it->farm, TAG_RENDERER_TO_MASTER_READY, &ready, sizeof ready);
    if (it->wrong == STATS_EARLY)
        arrive_as(it->farm, TAG_RENDERER_TO_MASTER_STATS, &stats, sizeof stats);
    if (it->wrong == PONG_LONG) arrive_as(it->farm, TAG_RENDERER_TO_MASTER_PONG, "", 1);
    if (it->wrong == OTHER_KIND) arrive_as(it->farm, 99, "", 0);
}

/* Messages that make no sense end the run, with a line that says so. */
static void test_wrong_messages(void **state)
{
    static const char *const said[] = {
        [RESULT_EMPTY] = "rank 1 sent a result that is not valid",
        [RESULT_OF_OTHERS] = "rank 1 sent a result for a tile that it was not asked for",
        [TRAY_TOO_LONG] = "rank 1 left a result that makes no sense",
        [READY_AGAIN] = "rank 1 reported for work in a way that makes no sense",
        [STATS_EARLY] = "rank 1 sent statistics that make no sense",
        [PONG_LONG] = "rank 1 sent a message of unknown kind 9",
        [OTHER_KIND] = "rank 1 sent a message of unknown kind 99"};
    struct farm *farm = farm_open(&small_tiles);
    give_tray(farm);
    farm->contacts[1].is_ready = true;
    fall_silent(farm);
    while (!queue_has_recalls(farm->service.queue))
        assert_true(other_goes_on(farm));
    for (enum wrong wrong = 0; wrong <= OTHER_KIND; wrong++) {
        char line[256];
        snprintf(line, sizeof line, "farm: rank 0: %s\n",
                 said[wrong] ? said[wrong] : said[RESULT_EMPTY]);
        assert_fatal(try_wrong, &(struct attempt){farm, wrong}, line);
    }
    take_tray(farm);
    farm_close(farm);
}

static void try_less(void *state)
{
    struct farm *farm = state;
    struct tile tile;
    assert_true(first_held(farm, &tile));
    uint32_t pixels = tile_pixels(&tile) - 1;
    write_part(&tile, (struct result_header){.pixels = pixels, .busy_s = 1});
    letter.size = result_bytes(&tile, pixels, true);
    arrive(farm);
}

/* An answer must have exactly the pixels that the pass has asked for: else samples would go to the wrong pixels. */
static void test_less_than_asked(void **state)
{
    struct view view = {.min_samples = 4, .max_samples = 64};
    struct farm *farm = farm_open(&small_tiles);
    farm->service.adaptive = adaptive_create(&view, &farm->canvas, 1e-3);
    finish_first_pass(farm);
    hand_out(&farm->server, 1);
    assert_fatal(try_less, farm, "farm: rank 0: rank 1 sent other pixels than it was asked for\n");
    adaptive_destroy(farm->service.adaptive);
    farm_close(farm);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_answers_are_counted),
        cmocka_unit_test(test_what_is_not_finished),
        cmocka_unit_test(test_what_takes_long),
        cmocka_unit_test(test_answer_in_a_tray),
        cmocka_unit_test(test_goodbye),
        cmocka_unit_test(test_waits_are_counted),
        cmocka_unit_test(test_probes_are_not_counted),
        cmocka_unit_test(test_wrong_messages),
        cmocka_unit_test(test_less_than_asked),
        cmocka_unit_test(test_times_of_the_phase),
        cmocka_unit_test(test_goodbye_after_the_last_tile),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
