/* Tests of the slots of a tray, and of how the master handles what is in them. This file replaces MPI. */
#include <mpi.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "common/clock.h"
#include "common/message.h"
#include "common/tray.h"
#include "master/server.h"
#include "test/arrivals_fixture.h"
#include "test/mpi_done.h"
#include "test/unit.h"

/* ---- slots and arrivals ---- */

static void test_slots(void **state)
{
    struct tray tray;
    memset(&tray, 0xff, sizeof tray); /* what the memory held before */
    tray_init(&tray);
    for (unsigned turn = 0; turn < TRAY_SLOTS; turn++) {
        assert_int_equal(slots_bytes(&tray.results, turn), 0);
        slots_fill(&tray.results, turn, 8 + turn);
        assert_int_equal(slots_bytes(&tray.results, turn), 8 + turn);
    }
    /* The first one is next. */
    assert_int_equal(slots_bytes(&tray.results, TRAY_SLOTS), 8);
    assert_int_equal(slots_bytes(&tray.lots, 0), 0);
    slots_empty(&tray.results, 0);
    assert_int_equal(slots_bytes(&tray.results, TRAY_SLOTS), 0);
    assert_int_equal(slots_bytes(&tray.results, 1), 9);
}

/* The contents of two slots share no cache line. */
static void test_slots_apart(void **state)
{
    struct tray *tray = NULL;
    assert_int_equal(offsetof(struct tray, lot) % 64 + sizeof tray->lot[0] % 64, 0);
    assert_int_equal(offsetof(struct tray, result) % 64 + sizeof tray->result[0] % 64, 0);
}

/* Each rank has a flag of its own; taking the flags clears them. */
static void test_flags(void **state)
{
    enum { RANKS = 130 };
    struct arrivals *arrivals = arrivals_create(RANKS);
    assert_int_equal(arrivals_words(RANKS), 3);
    assert_int_equal(arrivals_words(128), 2);
    for (uint32_t rank = 0; rank < RANKS; rank += 43)
        arrivals_leave(arrivals, rank);
    arrivals_leave(arrivals, 43);
    assert_true(arrivals_take(arrivals, 0) == ((uint64_t)1 << 43 | 1));
    assert_true(arrivals_take(arrivals, 1) == (uint64_t)1 << 22);
    assert_true(arrivals_take(arrivals, 2) == 2);
    for (uint32_t word = 0; word < 3; word++)
        assert_true(arrivals_take(arrivals, word) == 0);
    free(arrivals);
}

/* Counts begin anew at 0 after 2^32: what comes then is no less news. */
static void test_counts_begin_anew(void **state)
{
    struct tray tray;
    struct arrivals *arrivals = arrivals_create(2);
    tray_init(&tray);
    atomic_store(&tray.sent, UINT32_MAX);
    atomic_store(&arrivals->messages, UINT32_MAX);
    assert_false(tray_has_news(&tray, UINT32_MAX) || arrivals_has_messages(arrivals, UINT32_MAX));
    tray_count_sent(&tray);
    arrivals_send(arrivals);
    assert_true(tray_has_news(&tray, UINT32_MAX) && arrivals_has_messages(arrivals, UINT32_MAX));
    assert_false(tray_has_news(&tray, 0) || arrivals_has_messages(arrivals, 0));
    tray_free(&tray);
    free(arrivals);
}

#define TURNS 20000

/* The trays of two renderers, and the state of reading them. */
static struct {
    struct tray *trays[2];
    struct arrivals *arrivals;
    unsigned turns[2];
} shelf;

/* Reads the next result of a tray, if there is one, and checks all of it. */
static bool read_slot(unsigned who)
{
    struct slots *slots = &shelf.trays[who]->results;
    for (; slots_bytes(slots, shelf.turns[who]) > 0; shelf.turns[who]++) {
        uint32_t found[2], turn = shelf.turns[who];
        memcpy(found, shelf.trays[who]->result[turn % TRAY_SLOTS], sizeof found);
        if (found[0] != turn || found[1] != ~turn) return false;
        slots_empty(slots, turn);
    }
    return true;
}

/* Reads only trays whose flag is set. */
static void *read_all(void *argument)
{
    while (shelf.turns[0] < TURNS || shelf.turns[1] < TURNS) {
        uint64_t up = arrivals_take(shelf.arrivals, 0);
        if (up == 0) sched_yield();
        for (unsigned who = 0; who < 2; who++)
            if (up >> who & 1 && !read_slot(who)) return NULL;
    }
    return argument;
}

static void *write_all(void *argument)
{
    unsigned who = argument == shelf.trays[1];
    struct tray *tray = argument;
    for (uint32_t turn = 0; turn < TURNS; turn++) {
        uint32_t put[2] = {turn, ~turn};
        while (slots_bytes(&tray->results, turn) > 0)
            sched_yield();
        memcpy(tray->result[turn % TRAY_SLOTS], put, sizeof put);
        slots_fill(&tray->results, turn, sizeof put);
        arrivals_leave(shelf.arrivals, who);
    }
    return NULL;
}

static void test_threads(void **state)
{
    pthread_t reader, writers[2];
    void *read;
    memset(&shelf, 0, sizeof shelf);
    shelf.arrivals = arrivals_create(2);
    for (int who = 0; who < 2; who++) {
        shelf.trays[who] = aligned_alloc(_Alignof(struct tray), sizeof(struct tray));
        tray_init(shelf.trays[who]);
    }
    assert_int_equal(pthread_create(&reader, NULL, read_all, &shelf), 0);
    for (int who = 0; who < 2; who++)
        assert_int_equal(pthread_create(&writers[who], NULL, write_all, shelf.trays[who]), 0);
    for (int who = 0; who < 2; who++)
        pthread_join(writers[who], NULL);
    pthread_join(reader, &read);
    assert_non_null(read);
    for (int who = 0; who < 2; who++) {
        tray_free(shelf.trays[who]);
        free(shelf.trays[who]);
    }
    free(shelf.arrivals);
}

/* ---- the calls of master/post.c ---- */

/* Renderer 0 is rank 0's own, 1 has a tray, 2 is on another machine. */
#define RENDERERS 3

/* Any that is not MPI_REQUEST_NULL. */
#define UNDER_WAY ((MPI_Request)0x77000001)

static struct {
    /* What was sent. */
    unsigned sent[RENDERERS];
    int tag;

    unsigned looks; /* at what has come */

    /* What comes once: from rank 1, its last message. */
    bool stats_come;
    struct renderer_stats stats;

    void *buffer;
    jmp_buf end; /* of a job that goes wrong */
} wire;

int MPI_Comm_size(MPI_Comm comm, int *size)
{
    (void)comm;
    *size = RENDERERS;
    return MPI_SUCCESS;
}

/* Remembers the last receive, into which the message will be copied. */
int MPI_Irecv(void *buffer, int count, MPI_Datatype type, int source, int tag, MPI_Comm comm,
              MPI_Request *request)
{
    (void)count, (void)type, (void)source, (void)tag, (void)comm;
    wire.buffer = buffer;
    *request = UNDER_WAY;
    return MPI_SUCCESS;
}

int MPI_Isend(const void *buffer, int count, MPI_Datatype type, int rank, int tag, MPI_Comm comm,
              MPI_Request *request)
{
    (void)buffer, (void)type, (void)comm;
    (void)count;
    wire.sent[rank]++;
    wire.tag = tag;
    *request = UNDER_WAY;
    return MPI_SUCCESS;
}

int MPI_Testsome(int count, MPI_Request requests[], int *done, int slots[], MPI_Status statuses[])
{
    (void)count, (void)requests;
    wire.looks++;
    *done = wire.stats_come ? 1 : MPI_UNDEFINED;
    if (!wire.stats_come) return MPI_SUCCESS;
    memcpy(wire.buffer, &wire.stats, sizeof wire.stats);
    slots[0] = RENDERERS - 2;
    statuses[0].MPI_SOURCE = 1;
    statuses[0].MPI_TAG = TAG_RENDERER_TO_MASTER_STATS;
    wire.stats_come = false;
    return MPI_SUCCESS;
}

int MPI_Get_count(const MPI_Status *status, MPI_Datatype type, int *count)
{
    (void)status, (void)type;
    *count = (int)sizeof wire.stats;
    return MPI_SUCCESS;
}

/* ---- the master ---- */

struct master_of_test {
    struct server server;
    struct service service;
    struct served served;
    struct canvas canvas;
    struct renderer_stats stats[RENDERERS];
    struct contact contacts[RENDERERS];
    struct drop drops[RENDERERS][DROP_TILES];
    struct tray *tray, *trays[RENDERERS];
    struct arrivals *arrivals;
    struct watch watch;
};

static void set_up(struct master_of_test *test)
{
    static const struct queue_config config = {
        .width = 64, .height = 48, .renderers = RENDERERS, .tile_edge = 16};
    *test =
        (struct master_of_test){.tray = aligned_alloc(_Alignof(struct tray), sizeof(struct tray))};
    memset(&wire, 0, sizeof wire);
    tray_init(test->tray);
    test->arrivals = arrivals_create(RENDERERS);
    test->trays[1] = test->tray;
    canvas_init(&test->canvas, config.width, config.height);
    test->watch = (struct watch){.canvas = &test->canvas, .samples = 1};
    assert_true(watch_start(&test->watch, ""));
    test->service = (struct service){.queue = queue_create(&config),
                                     .canvas = &test->canvas,
                                     .watch = &test->watch,
                                     .trays = test->trays,
                                     .arrivals = test->arrivals,
                                     .all_ring = true,
                                     .stats = test->stats};
    test->server = (struct server){.service = &test->service,
                                   .served = &test->served,
                                   .start = clock_wall(),
                                   .last_pass = true,
                                   .first_remote = 1,
                                   .flag_words = arrivals_words(RENDERERS),
                                   .renderers = RENDERERS,
                                   .message = allocate_zeroed(TILES_MAX_BYTES, 1),
                                   .contacts = test->contacts,
                                   .drops = test->drops,
                                   .post = post_open(sizeof(struct renderer_stats))};
    assert_int_equal(pthread_mutex_init(&test->server.lock, NULL), 0);
}

static void tear_down(struct master_of_test *test)
{
    post_close(test->server.post, true);
    pthread_mutex_destroy(&test->server.lock);
    queue_destroy(test->service.queue);
    watch_free(&test->watch);
    canvas_free(&test->canvas);
    free(test->server.message);
    free(test->tray);
    free(test->arrivals);
}

/* The lot that the master has put into the slot: its first tile. */
static struct tile first_tile(const struct master_of_test *test, unsigned turn)
{
    struct tile tile;
    struct lot_header header;
    const char *lot = test->tray->lot[turn];
    assert_true(slots_bytes(&test->tray->lots, turn) > sizeof header);
    memcpy(&header, lot, sizeof header);
    assert_true(lot_header_valid(&header) && header.reports > 0);
    memcpy(&tile, lot + sizeof header + lot_report_bytes(header.reports), sizeof tile);
    return tile;
}

/* Fills the slot with this number of bytes, and sets the flag if `heard`. */
static void leave(struct master_of_test *test, unsigned turn, size_t bytes, bool heard)
{
    slots_fill(&test->tray->results, turn, (uint32_t)bytes);
    if (heard) arrivals_leave(test->arrivals, 1);
}

/* Writes a result whose pixels have one colour into the slot; returns its length. */
static size_t put_result(struct tray *tray, unsigned turn, const struct tile *tile, float colour)
{
    uint32_t pixels = tile_pixels(tile);
    struct result_header header = {.tile_id = tile->id, .pixels = pixels};
    char *result = tray->result[turn];
    float *rgb = (void *)(result + sizeof header);
    memcpy(result, &header, sizeof header);
    for (uint32_t i = 0; i < 3 * pixels; i++)
        rgb[i] = colour;
    return result_bytes(tile, pixels, false);
}

static const float *pixel_of(const struct master_of_test *test, const struct tile *tile)
{
    return test->canvas.rgb + 3 * ((size_t)tile->y * test->canvas.width + tile->x);
}

/* Lots and results pass without a message. */
static void test_lots_and_results(void **state)
{
    struct master_of_test test;
    set_up(&test);
    hand_out(&test.server, 1);
    assert_int_equal(wire.sent[1], 0);
    assert_int_equal(test.tray->sent, TRAY_SLOTS);
    assert_true(bell_wait(&test.tray->bell, 0));
    for (unsigned turn = 0; turn < TRAY_SLOTS; turn++)
        assert_int_equal(test.tray->sent_before[turn], turn);
    struct tile tiles[] = {first_tile(&test, 0), first_tile(&test, 1)};
    size_t bytes = put_result(test.tray, 0, &tiles[0], 0.5f);
    leave(&test, 0, bytes, false);
    assert_false(take_in(&test.server));
    leave(&test, 0, bytes, true);
    slots_empty(&test.tray->lots, 0);
    assert_true(take_in(&test.server));
    assert_int_equal(slots_bytes(&test.tray->results, 0), 0);
    assert_int_equal(test.stats[1].tiles, 1);
    assert_int_equal(test.stats[1].bytes, bytes);
    assert_true(*pixel_of(&test, &tiles[0]) == 0.5f);
    /* The next lot is there, where the first one was. */
    assert_true(slots_bytes(&test.tray->lots, 0) > 0 && wire.sent[1] == 0);
    assert_int_equal(test.tray->sent_before[0], TRAY_SLOTS);
    leave(&test, 1, put_result(test.tray, 1, &tiles[1], 0.25f), true);
    assert_true(take_in(&test.server));
    assert_true(*pixel_of(&test, &tiles[1]) == 0.25f);
    assert_false(take_in(&test.server));
    tear_down(&test);
}

/* A second result whose flag is not set yet is taken in with the first one; the flag then finds nothing. */
static void test_flag_that_comes_late(void **state)
{
    struct master_of_test test;
    set_up(&test);
    hand_out(&test.server, 1);
    for (unsigned turn = 0; turn < TRAY_SLOTS; turn++) {
        struct tile tile = first_tile(&test, turn);
        leave(&test, turn, put_result(test.tray, turn, &tile, 0.5f), turn == 0);
    }
    assert_true(take_in(&test.server));
    assert_int_equal(test.stats[1].tiles, 2);
    arrivals_leave(test.arrivals, 1);
    assert_false(take_in(&test.server));
    assert_int_equal(test.served.messages, 2);
    tear_down(&test);
}

/* Results that a renderer has left in its tray before its last message are taken in before this message, even if both
 * are found at once. */
static void test_statistics_come_last(void **state)
{
    struct master_of_test test;
    set_up(&test);
    hand_out(&test.server, 1);
    struct tile tile = first_tile(&test, 0);
    leave(&test, 0, put_result(test.tray, 0, &tile, 0.5f), true);
    test.service.ending = true;
    wire.stats_come = true;
    wire.stats = (struct renderer_stats){.rank = 1, .tiles = 17};
    arrivals_send(test.arrivals);
    assert_true(take_in(&test.server));
    assert_true(*pixel_of(&test, &tile) == 0.5f);
    assert_int_equal(test.stats[1].tiles, 17);
    assert_true(test.contacts[1].is_gone);
    tear_down(&test);
}

/* If all renderers have trays and announce their messages, the master polls MPI for these alone, and until all of its
 * sends are complete. If one has no tray, it polls always. */
static void test_looks_at_mpi(void **state)
{
    struct master_of_test test;
    set_up(&test);
    take_in(&test.server);
    take_in(&test.server);
    assert_int_equal(wire.looks, 0);
    arrivals_send(test.arrivals);
    take_in(&test.server); /* it is not there yet */
    assert_int_equal(wire.looks, 1);
    wire.stats_come = test.service.ending = true;
    wire.stats = (struct renderer_stats){.rank = 1};
    take_in(&test.server);
    assert_true(wire.looks == 2 && test.contacts[1].is_gone);
    take_in(&test.server);
    assert_int_equal(wire.looks, 2);
    tell_stop(&test.server, 2);
    take_in(&test.server);
    take_in(&test.server);
    assert_int_equal(wire.looks, 4);
    tear_down(&test);
    set_up(&test);
    test.service.all_ring = false;
    for (unsigned look = 1; look <= 3; look++) {
        take_in(&test.server);
        assert_int_equal(wire.looks, look);
    }
    tear_down(&test);
}

/* A header alone, in a slot. */
static void put_header(struct master_of_test *test, unsigned turn, struct result_header header)
{
    memcpy(test->tray->result[turn], &header, sizeof header);
    leave(test, turn, sizeof header, true);
}

/* The notice that a tile takes long may come after the tile; then it has no effect. */
static void test_takes_long(void **state)
{
    struct master_of_test test;
    set_up(&test);
    hand_out(&test.server, 1);
    struct tile tile = first_tile(&test, 0), held;
    struct result_header header = {.tile_id = tile.id, .pixels = RESULT_UNFINISHED, .busy_s = 0.25};
    put_header(&test, 0, header);
    assert_true(take_in(&test.server));
    assert_true(queue_find_held(test.service.queue, 1, tile.id, &held));
    assert_int_equal(test.stats[1].tiles, 0);
    leave(&test, 1, put_result(test.tray, 1, &tile, 0.5f), true);
    assert_true(take_in(&test.server));
    assert_int_equal(test.stats[1].tiles, 1);
    put_header(&test, 0, header);
    assert_true(take_in(&test.server));
    assert_int_equal(test.stats[1].tiles, 1);
    tear_down(&test);
}

/* If no slot is empty, or the renderer is on another machine, lots are sent in messages. */
static void test_no_room(void **state)
{
    struct master_of_test test;
    set_up(&test);
    for (unsigned turn = 0; turn < TRAY_SLOTS; turn++)
        slots_fill(&test.tray->lots, turn, 8);
    for (uint32_t who = 1; who < RENDERERS; who++) {
        hand_out(&test.server, who);
        assert_true(wire.sent[who] > 0);
        assert_int_equal(wire.tag, TAG_MASTER_TO_RENDERER_TILES);
    }
    tear_down(&test);
}

static void end_job(int status)
{
    (void)status;
    longjmp(wire.end, 1);
}

/* Whether the job ends if the slot has this number of bytes and the flag of this rank is set. */
static bool is_refused(struct master_of_test *test, size_t bytes, uint32_t rank)
{
    if (setjmp(wire.end)) return true;
    leave(test, 0, bytes, false);
    arrivals_leave(test->arrivals, rank);
    take_in(&test->server);
    return false;
}

static void test_trays_are_checked(void **state)
{
    struct master_of_test test;
    set_up(&test);
    message_set_rank(0, end_job);
    hand_out(&test.server, 1);
    struct tile tile = first_tile(&test, 0);
    const struct {
        size_t bytes;
        uint32_t rank;
    } wrong[] = {{TRAY_RESULT_BYTES + 8, 1}, {UINT32_MAX, 1}, {8, 1}, {0, 0}, {0, 2}, {0, 63}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        put_result(test.tray, 0, &tile, 0.5f);
        test.contacts[1].results_taken = 0;
        assert_true(is_refused(&test, wrong[i].bytes, wrong[i].rank));
        /* The job is over: what it holds is given back for the next one. */
        pthread_mutex_unlock(&test.server.lock);
    }
    assert_int_equal(test.stats[1].tiles, 0);
    message_set_rank(0, NULL);
    tear_down(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slots),
        cmocka_unit_test(test_slots_apart),
        cmocka_unit_test(test_flags),
        cmocka_unit_test(test_counts_begin_anew),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_lots_and_results),
        cmocka_unit_test(test_flag_that_comes_late),
        cmocka_unit_test(test_statistics_come_last),
        cmocka_unit_test(test_looks_at_mpi),
        cmocka_unit_test(test_takes_long),
        cmocka_unit_test(test_no_room),
        cmocka_unit_test(test_trays_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
