/* Tests that rank 0's own renderer gives up a tile that another renderer has finished, and no other tile. */
#include <stdlib.h>

#include "common/bell.h"
#include "common/clock.h"
#include "common/cpu_time.h"
#include "master/server.h"
#include "test/unit.h"

/* Renderer 0 is rank 0's own, 1 answers at once. */
#define RENDERERS 2

/* The state of a test. */
struct scene_of_test {
    struct server server;
    struct service service;
    unsigned begun; /* tiles, by the own renderer */
};

/* Seconds after which everything is overdue. */
#define LONG_AFTER 1e3

static bool is_unfinished(const struct queue *queue, uint32_t id)
{
    struct tile tile;
    uint32_t next = 0;
    while (queue_unfinished(queue, &next, &tile))
        if (tile.id == id) return true;
    return false;
}

/* Renderer 1 renders one lot; returns whether it got one. If it also gets the own renderer's tile, that one must not
 * give it up yet. */
static bool other_goes_on(struct scene_of_test *test)
{
    struct queue *queue = test->service.queue;
    struct tile lot[LOT_TILES];
    double now = server_elapsed(&test->server);
    uint32_t count = queue_next(queue, 1, now, lot);
    tell_recalls(&test->server);
    assert_false(test->service.given_up && is_unfinished(queue, test->server.own_tile));
    for (uint32_t i = 0; i < count; i++)
        queue_finish(queue, 1, lot[i].id, now, 1e-4);
    return count > 0;
}

/* While the own renderer is at its first tile, the other one renders everything else, and then this tile. */
static bool render(void *state, const struct tile *tile, const struct refinement *refinements,
                   struct cpu_time *time, float *floats, struct result_header *header)
{
    struct scene_of_test *test = state;
    struct server *server = &test->server;
    struct queue *queue = test->service.queue;
    double end;
    (void)refinements, (void)floats;
    *header = (struct result_header){.pixels = RESULT_DROPPED, .start_s = time->begun};
    assert_int_equal(test->begun++, 0);
    assert_false(test->service.given_up);
    assert_true(other_goes_on(test));
    tell_recalls(server);
    assert_false(queue_is_recalled(queue, 0, tile->id) || test->service.given_up);
    server->start -= LONG_AFTER;
    queue_look(queue, server_elapsed(server));
    for (int lots = 0; lots < 100 && !queue_complete(queue); lots++)
        other_goes_on(test);
    assert_true(queue_is_recalled(queue, 0, tile->id) && queue_complete(queue));
    tell_recalls(server);
    assert_true(test->service.given_up);
    header->cpu_s = cpu_time_end(time, &end);
    header->busy_s = end - header->start_s;
    return false;
}

static void test_gives_up_what_is_finished(void **state)
{
    static const struct queue_config config = {
        .width = 64, .height = 48, .renderers = RENDERERS, .tile_edge = 16};
    struct renderer_stats stats[RENDERERS] = {{0}};
    struct contact contacts[RENDERERS] = {{0}};
    struct bell bell;
    struct scene_of_test test = {
        .service = {.queue = queue_create(&config), .bell = &bell, .stats = stats}};
    struct tile_renderer own = {.state = &test, .render = render};
    contacts[1].is_told = true; /* no messages to it */
    test.service.own = &own;
    test.server = (struct server){.service = &test.service,
                                  .start = clock_wall(),
                                  .last_pass = true,
                                  .first_remote = 1,
                                  .renderers = RENDERERS,
                                  .contacts = contacts};
    assert_int_equal(pthread_mutex_init(&test.server.lock, NULL), 0);
    bell_init(&bell);
    render_own(&test.server);
    assert_int_equal(test.begun, 1);
    assert_true(test.server.own_done);
    /* It has reported that to the queue, and has not left as after a stop. */
    assert_int_equal(queue_tile_count(test.service.queue, 0), 0);
    assert_int_equal(stats[0].tiles, 0);
    assert_true(queue_count(test.service.queue).wasted_s > 0);
    /* The main thread is woken when it has left. */
    double begin = clock_wall();
    bell_wait(&bell, LONG_AFTER);
    assert_true(clock_wall() - begin < LONG_AFTER / 2);
    bell_free(&bell);
    pthread_mutex_destroy(&test.server.lock);
    queue_destroy(test.service.queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gives_up_what_is_finished),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
