/* What the master tells a renderer with a lot: MPI is played by this file. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <mpi.h>

#include "common/clock.h"
#include "common/nap.h"
#include "master/server.h"
#include "test/mpi_done.h"

/* Renderer 0 is rank 0's own, 1 is the one that is told. */
#define RENDERERS 2

/* What was sent to renderer 1 since the last look. */
static struct {
    uint32_t lots;
    struct lot_header headers[2];
} sent;

/* ---- the calls of master/post.c ---- */

/* Any that is not MPI_REQUEST_NULL. */
#define REQUEST ((MPI_Request)0x77000001)

int MPI_Comm_size(MPI_Comm comm, int *size)
{
    (void)comm;
    *size = RENDERERS;
    return MPI_SUCCESS;
}

int MPI_Irecv(void *buffer, int count, MPI_Datatype type, int source, int tag, MPI_Comm comm,
              MPI_Request *request)
{
    (void)buffer, (void)count, (void)type, (void)source, (void)tag, (void)comm;
    *request = REQUEST;
    return MPI_SUCCESS;
}

int MPI_Isend(const void *buffer, int count, MPI_Datatype type, int rank, int tag, MPI_Comm comm,
              MPI_Request *request)
{
    (void)type, (void)comm;
    *request = REQUEST;
    if (tag != TAG_MASTER_TO_RENDERER_TILES) return MPI_SUCCESS;
    assert_int_equal(rank, 1);
    assert_true(sent.lots < 2 && (size_t)count > sizeof *sent.headers);
    memcpy(&sent.headers[sent.lots], buffer, sizeof *sent.headers);
    assert_true(lot_header_valid(&sent.headers[sent.lots++]));
    return MPI_SUCCESS;
}

/* ---- the tests ---- */

/* All that renderer 1 has is done, each tile in so many seconds of rendering. */
static void finish_all(struct server *server, double seconds)
{
    struct queue *queue = server->service->queue;
    struct tile tile;
    for (uint32_t id = 0; queue_holds(queue, 1) > 0; id++)
        if (queue_held(queue, 1, id, &tile))
            queue_finish(queue, 1, id, server_elapsed(server), seconds);
}

/* Whether renderer 1 is to call half way: before anything is known, and when each tile has taken it so long. */
static void check_calls(enum schedule schedule, double seconds, bool calls)
{
    const struct queue_config config = {
        .schedule = schedule, .width = 64, .height = 64, .renderers = RENDERERS, .tile_edge = 4};
    struct contact contacts[RENDERERS] = {{0}};
    struct tray *trays[RENDERERS] = {NULL};
    struct service service = {.queue = queue_create(&config), .trays = trays};
    struct server server = {.service = &service,
                            .start = clock_wall(),
                            .last_pass = true,
                            .first_remote = 1,
                            .renderers = RENDERERS,
                            .post = post_open(sizeof(struct start)),
                            .contacts = contacts,
                            .message = calloc(TILES_MAX_BYTES, 1)};
    assert_int_equal(pthread_mutex_init(&server.lock, NULL), 0);
    for (int known = 0; known <= 1; known++) {
        sent.lots = 0;
        hand_out(&server, 1);
        assert_true(sent.lots > 0);
        for (uint32_t i = 0; i < sent.lots; i++)
            assert_int_equal(sent.headers[i].calls, known ? calls : 1);
        finish_all(&server, seconds);
    }
    pthread_mutex_destroy(&server.lock);
    post_close(server.post, true);
    queue_destroy(service.queue);
    free(server.message);
}

/* For the next lot, unless this one gives the master time to look of its own accord. */
static void test_who_calls(void **state)
{
    (void)state;
    check_calls(SCHEDULE_DYNAMIC, NAP_CALL / 1000, true); /* all 256 take a quarter of it */
    check_calls(SCHEDULE_DYNAMIC, NAP_CALL, false);
    check_calls(SCHEDULE_STRIPS, NAP_CALL, true); /* nobody predicts anything */
}

/* All renderers are looked at now and then only, not in each turn of the loop. */
static void test_who_is_silent(void **state)
{
    (void)state;
    const struct queue_config config = {
        .width = 64, .height = 64, .renderers = RENDERERS, .tile_edge = 4};
    struct contact contacts[RENDERERS] = {{0}};
    struct service service = {.queue = queue_create(&config), .patience = 60};
    struct server server = {.service = &service,
                            .first_remote = 1,
                            .renderers = RENDERERS,
                            .woken = clock_wall(),
                            .contacts = contacts};
    assert_int_equal(pthread_mutex_init(&server.lock, NULL), 0);
    look_for_silence(&server);
    assert_false(contacts[1].is_silent);
    contacts[1].heard = -61;
    double begin = clock_wall();
    look_for_silence(&server);
    if (clock_wall() - begin < 0.001) assert_false(contacts[1].is_silent);
    clock_sleep(0.05);
    look_for_silence(&server);
    assert_true(contacts[1].is_silent);
    pthread_mutex_destroy(&server.lock);
    queue_destroy(service.queue);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_who_calls),
        cmocka_unit_test(test_who_is_silent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
