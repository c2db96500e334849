/* Renderers from which nothing has come for a while: when they are asked for a sign of life, and when they are given
 * up. */

#include "test/master_fixture.h"
#include "test/unit.h"

/* All renderers are looked at now and then only, not in each turn of the loop. */
static void test_who_is_silent(void **state)
{
    const struct queue_config config = {
        .width = 64, .height = 64, .renderers = RENDERERS, .tile_edge = 4};
    struct farm *farm = farm_open(&config);
    struct contact *contact = &farm->contacts[1];
    look_for_silence(&farm->server);
    assert_false(contact->is_silent);
    contact->heard_at = -61;
    double begin = clock_wall();
    look_for_silence(&farm->server);
    if (clock_wall() - begin < 0.001) assert_false(contact->is_silent);
    clock_sleep(0.05);
    look_for_silence(&farm->server);
    assert_true(contact->is_silent);
    arrive_as(farm, TAG_RENDERER_TO_MASTER_PONG, "", 0);
    assert_false(contact->is_silent);
    farm_close(farm);
}

/* A renderer that has answered, and falls silent again, is asked again before it is given up. */
static void test_who_is_asked_again(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct contact *contact = &farm->contacts[1];
    contact->is_ready = true;
    for (int i = 0; i < 2; i++) {
        contact->heard_at = -5;
        farm->server.next_look = farm->server.awake_s = 0;
        look_for_silence(&farm->server);
        assert_true(contact->is_asked && !contact->is_silent);
        arrive_as(farm, TAG_RENDERER_TO_MASTER_PONG, "", 0);
        assert_false(contact->is_asked);
    }
    farm_close(farm);
}

/* While rank 0 itself was stopped nobody could be heard: it gives up nobody for that. */
static void test_stopped_master(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    double before = 0, begin = 0;
    for (int turn = 0; turn < 3; turn++) { /* some of each counts */
        begin = clock_wall();
        farm->server.woken_at = begin - 1000;
        look_for_silence(&farm->server);
        assert_true(farm->server.awake_s > before && farm->server.awake_s < 1);
        assert_false(farm->contacts[1].is_silent);
        before = farm->server.awake_s;
    }
    look_for_silence(&farm->server);
    assert_true(farm->server.awake_s - before <= clock_wall() - begin);
    farm_close(farm);
}

/* A renderer that was told to stop, or has left, is neither asked nor given up. */
static void test_who_leaves(void **state)
{
    for (int gone = 0; gone <= 1; gone++) {
        struct farm *farm = farm_open(&small_tiles);
        struct contact *contact = &farm->contacts[1];
        contact->is_ready = true;
        contact->is_told = !gone;
        contact->is_gone = gone;
        contact->heard_at = -61;
        look_for_silence(&farm->server);
        assert_false(contact->is_asked || contact->is_silent);
        farm_close(farm);
    }
}

/* A renderer that has not reported for work may still be building its BVH, and has longer. */
static void test_who_has_not_started(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct contact *contact = &farm->contacts[1];
    farm->service.start_patience = 300;
    for (int seconds = 0; seconds <= 400; seconds += 50) {
        contact->heard_at = -seconds;
        farm->server.next_look = farm->server.awake_s = 0;
        farm->server.woken_at = clock_wall();
        look_for_silence(&farm->server);
        assert_int_equal(contact->is_silent, seconds >= 300);
        assert_false(contact->is_asked); /* it does not listen yet */
    }
    farm_close(farm);
}

/* However short the patience is, a renderer that is asked for a sign of life has time to answer. */
static void test_who_is_asked(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct contact *contact = &farm->contacts[1];
    farm->service.patience = 0.5;
    contact->is_ready = true;
    for (double heard = 0; heard >= -0.5; heard -= 0.125) {
        contact->heard_at = heard - 0.0625;
        farm->server.next_look = farm->server.awake_s = 0;
        farm->server.woken_at = clock_wall();
        look_for_silence(&farm->server);
        assert_int_equal(contact->is_asked, heard < -0.125);
        assert_int_equal(contact->is_silent, heard < -0.375);
    }
    farm_close(farm);
}

/* The run is deserted when all renderers are silent, not when one is, and never while rank 0 renders itself. */
static void test_who_is_left(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    for (unsigned silent = 0; silent < 4; silent++) {
        for (uint32_t i = 0; i < RENDERERS; i++)
            farm->contacts[i].is_silent = silent >> i & 1;
        farm->server.first_remote = 1;
        assert_false(is_deserted(&farm->server));
        farm->server.first_remote = 0;
        assert_int_equal(is_deserted(&farm->server), silent == 3);
    }
    farm->server.first_remote = 1;
    farm_close(farm);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_who_is_silent),       cmocka_unit_test(test_who_is_asked_again),
        cmocka_unit_test(test_stopped_master),      cmocka_unit_test(test_who_leaves),
        cmocka_unit_test(test_who_has_not_started), cmocka_unit_test(test_who_is_asked),
        cmocka_unit_test(test_who_is_left),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
