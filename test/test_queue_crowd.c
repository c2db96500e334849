/* The queue with more renderers than cores. */

#include "common/cores.h"
#include "test/queue_fixture.h"
#include "test/unit.h"

/* Four renderers on so many cores of one machine. */
static struct crowd crowd_on(unsigned cores)
{
    struct affinity affinities[4];
    struct crowd crowd;
    for (uint32_t i = 0; i < 4; i++) {
        affinities[i] = (struct affinity){.machine = "one"};
        for (unsigned core = 0; core < cores; core++)
            CPU_SET(core, &affinities[i].cores);
    }
    crowd_init(&crowd, affinities, 4);
    return crowd;
}

/* All tiles are finished except for one of each of the first `keepers` renderers. */
static struct queue *leave_tiles(const struct queue_config *config, uint32_t keepers)
{
    struct queue *queue = queue_create(config);
    struct tile lot[LOT_TILES];
    for (uint32_t renderer = 0; renderer < keepers; renderer++)
        finish_part(queue, renderer, lot, 1, queue_next(queue, renderer, 0, lot));
    while (queue->waiting.count > 0)
        finish_part(queue, 3, lot, 0, queue_next(queue, 3, 1e-3, lot));
    return queue;
}

/* With more renderers than cores, an idle one takes over no tiles while those that hold tiles can use all cores. Late
 * renderers count as using none. */
static void test_idle_without_a_core(void **state)
{
    struct crowd crowd = crowd_on(2);
    struct queue_config config = four;
    config.crowd = &crowd;
    for (uint32_t keepers = 1; keepers < 4; keepers++) {
        struct queue *queue = leave_tiles(&config, keepers);
        struct tile lot[LOT_TILES];
        uint32_t working = 0;
        for (uint32_t i = 0; i < 4; i++)
            working += queue_tile_count(queue, i) > 0;
        assert_int_equal(working, keepers);
        assert_int_equal(queue_idle_cores(queue), keepers == 1);
        assert_int_equal(queue_has_core(queue, 3), keepers == 1);
        assert_true(queue_wake(queue) < 100);
        queue_look(queue, 100);
        assert_int_equal(queue_idle_cores(queue),
                         keepers == 3 ? 1 : 2); /* for as many who are idle */
        assert_true(queue_next(queue, 3, 100, lot) > 0);
        queue_destroy(queue);
    }
    crowd_free(&crowd);
}

/* Where renderers share cores, none is asked to report tiles that take long: it may not have had a core meanwhile.
 * Where there is a core for each, all are, as if nothing was known of cores. */
static void test_shared_cores_report_nothing(void **state)
{
    struct queue_config config = four;
    for (unsigned cores = 0; cores <= 4; cores += 2) {
        struct crowd crowd = crowd_on(cores);
        struct tile lot[LOT_TILES];
        float report_s[LOT_TILES];
        config.crowd = cores ? &crowd : NULL;
        struct queue *queue = queue_create(&config);
        uint32_t count = queue_next(queue, 0, 0, lot);
        assert_true(count > 0);
        assert_int_equal(queue_report_times(queue, 0, lot, count, report_s),
                         cores == 2 ? 0 : count);
        queue_destroy(queue);
        crowd_free(&crowd);
    }
}

/* Four renderers per core share the probes: with more, a few would wait for the last of them. */
static void test_four_per_core_probe(void **state)
{
    struct affinity affinities[8];
    struct crowd crowd;
    for (uint32_t i = 0; i < 8; i++) {
        affinities[i] = (struct affinity){.machine = "one"};
        CPU_SET(0, &affinities[i].cores);
    }
    crowd_init(&crowd, affinities, 8);
    struct queue_config config = with_probes;
    config.renderers = 8;
    config.crowd = &crowd;
    struct queue *queue = queue_create(&config);
    for (uint32_t renderer = 0; renderer < 8; renderer++) {
        struct tile lot[LOT_TILES];
        assert_true(queue_next(queue, renderer, 0, lot) > 0);
        assert_int_equal(lot[0].pass == TILE_PROBE, renderer < 4);
    }
    queue_destroy(queue);
    crowd_free(&crowd);
}

/* The core of a renderer that has finished its tiles is free for others at once, until one of them gets a tile. */
static void test_finished_leaves_a_core(void **state)
{
    const struct tile more = {.w = 16, .h = 16, .step = 1, .pass = 1};
    struct tile lot[LOT_TILES];
    struct crowd crowd = crowd_on(2);
    struct queue_config config = four;
    config.crowd = &crowd;
    struct queue *queue = leave_tiles(&config, 2);
    assert_int_equal(queue_idle_cores(queue), 0);
    assert_false(queue_has_core(queue, 3));
    queue_finish(queue, 0, queue->holdings.holds[queue->holdings.holders[0].first].id, 1e-3, 1e-3);
    assert_true(queue_has_core(queue, 3));
    assert_int_equal(queue_idle_cores(queue), 1);
    queue_add(queue, &more, 256, 1);
    assert_true(queue_next(queue, 3, 1e-3, lot) > 0);
    assert_int_equal(queue_idle_cores(queue), 0);
    queue_destroy(queue);
    crowd_free(&crowd);
}

/* As many renderers as there are cores have stopped while they held probes, which makes nobody late. The tiles of
 * another renderer that stops later are taken over all the same. */
static void test_stopped_with_probes(void **state)
{
    struct crowd crowd = crowd_on(2);
    struct queue_config config = with_probes;
    config.crowd = &crowd;
    struct queue *queue = queue_create(&config);
    struct tile lot[LOT_TILES], kept[LOT_TILES];
    for (uint32_t renderer = 0; renderer < 2; renderer++)
        assert_true(queue_next(queue, renderer, 0, lot) > 0 && lot[0].pass == TILE_PROBE);
    finish_lot(queue, 2, lot, queue_next(queue, 2, 0, lot), 0);
    assert_true(queue_next(queue, 2, 0, kept) > 0 && kept[0].pass != TILE_PROBE);
    for (uint32_t count; (count = queue_next(queue, 3, 1e-3, lot)) > 0;)
        finish_lot(queue, 3, lot, count, 1e-3);
    assert_int_equal(queue->waiting.count, 0);
    queue_look(queue, 100);
    assert_int_equal(queue_idle_cores(queue), 1); /* two, but one renderer that has nothing */
    for (uint32_t count; (count = queue_next(queue, 3, 100, lot)) > 0;)
        finish_lot(queue, 3, lot, count, 100);
    assert_true(queue_complete(queue));
    queue_destroy(queue);
    crowd_free(&crowd);
}

/* Where renderers share cores, the seconds of a tile follow from its CPU time, as its wall time depends on whose turn
 * it was; where each has its own core, they are the wall time. */
static void test_seconds_of_a_crowd(void **state)
{
    struct affinity affinities[5];
    struct crowd crowd;
    for (unsigned i = 0; i < 5; i++) { /* the last one has a core of its own */
        affinities[i] = (struct affinity){.machine = "one"};
        CPU_SET(i / 2, &affinities[i].cores);
    }
    crowd_init(&crowd, affinities, 5);
    struct queue_config config = four;
    config.renderers = 5;
    struct queue *queue = queue_create(&config);
    assert_true(queue_seconds(queue, 0, 3, 1) == 3);
    queue_destroy(queue);
    config.crowd = &crowd;
    queue = queue_create(&config);
    assert_true(queue_seconds(queue, 4, 3, 1) == 3 && queue_seconds(queue, 4, 1, 1) == 1);
    assert_true(queue_seconds(queue, 2, 1, 0) == 0);         /* a clock with coarse ticks */
    assert_true(queue_seconds(queue, 0, 0.25, 0.25) == 0.5); /* two to a core */
    assert_true(queue_seconds(queue, 1, 1.75, 0.25) ==
                1); /* and another program uses the cores, too */
    queue_destroy(queue);
    crowd_free(&crowd);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_idle_without_a_core),
        cmocka_unit_test(test_shared_cores_report_nothing),
        cmocka_unit_test(test_four_per_core_probe),
        cmocka_unit_test(test_finished_leaves_a_core),
        cmocka_unit_test(test_stopped_with_probes),
        cmocka_unit_test(test_seconds_of_a_crowd),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
