/* Slots of a tray, and what the master makes of a note about one: MPI is played by this file. */
#include <mpi.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/clock.h"
#include "common/message.h"
#include "common/tray.h"
#include "master/server.h"
#include "test/mpi_done.h"

/* ---- slots ---- */

static void test_slots(void **state)
{
    (void)state;
    struct tray tray;
    memset(&tray, 0xff, sizeof tray); /* what the memory held before */
    tray_init(&tray);
    assert_int_equal(slots_find(&tray.lots), 0);
    for (int i = 0; i < TRAY_SLOTS; i++) {
        assert_int_equal(slots_find(&tray.results), i);
        assert_false(slots_full(&tray.results, (uint32_t)i));
        slots_fill(&tray.results, i);
        assert_true(slots_full(&tray.results, (uint32_t)i));
    }
    assert_int_equal(slots_find(&tray.results), -1);
    assert_int_equal(slots_find(&tray.lots), 0);
    slots_empty(&tray.results, 1);
    assert_int_equal(slots_find(&tray.results), 1);
    assert_true(slots_full(&tray.results, 0));
}

/* What one slot holds is in no cache line of another's. */
static void test_slots_apart(void **state)
{
    (void)state;
    struct tray *tray = NULL;
    assert_int_equal(offsetof(struct tray, lot) % 64 + sizeof tray->lot[0] % 64, 0);
    assert_int_equal(offsetof(struct tray, result) % 64 + sizeof tray->result[0] % 64, 0);
}

#define TURNS 20000

/* Takes each result that comes, in the order of turns: all of it is there. */
static void *read_all(void *argument)
{
    struct tray *tray = argument;
    for (uint32_t turn = 0; turn < TURNS; turn++) {
        uint32_t found[2], slot = 0;
        while (!slots_full(&tray->results, slot))
            sched_yield();
        memcpy(found, tray->result[slot], sizeof found);
        if (found[0] != turn || found[1] != ~turn) return NULL;
        slots_empty(&tray->results, slot);
    }
    return tray;
}

static void test_threads(void **state)
{
    (void)state;
    struct tray *tray = aligned_alloc(_Alignof(struct tray), sizeof *tray);
    pthread_t thread;
    void *read;
    tray_init(tray);
    assert_int_equal(pthread_create(&thread, NULL, read_all, tray), 0);
    for (uint32_t turn = 0; turn < TURNS; turn++) {
        uint32_t put[2] = {turn, ~turn};
        while (slots_find(&tray->results) != 0)
            sched_yield();
        memcpy(tray->result[0], put, sizeof put);
        slots_fill(&tray->results, 0);
    }
    pthread_join(thread, &read);
    assert_non_null(read);
    free(tray);
}

/* ---- the calls of master/post.c ---- */

/* Renderer 0 is rank 0's own, 1 has a tray, 2 is on another machine. */
#define RENDERERS 3

/* Any that is not MPI_REQUEST_NULL. */
#define UNDER_WAY ((MPI_Request)0x77000001)

static struct {
    /* What has come. */
    int rank;
    const void *note;
    size_t bytes;

    /* What was sent. */
    unsigned sent[RENDERERS];
    int tag;
    size_t size;

    void *buffer;
    jmp_buf end; /* of a job that goes wrong */
} wire;

int MPI_Comm_size(MPI_Comm comm, int *size)
{
    (void)comm;
    *size = RENDERERS;
    return MPI_SUCCESS;
}

/* What comes comes into the last one. */
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
    wire.sent[rank]++;
    wire.tag = tag;
    wire.size = (size_t)count;
    *request = UNDER_WAY;
    return MPI_SUCCESS;
}

int MPI_Testsome(int count, MPI_Request requests[], int *done, int slots[], MPI_Status statuses[])
{
    (void)count, (void)requests;
    memcpy(wire.buffer, wire.note, wire.bytes);
    *done = 1;
    slots[0] = RENDERERS - 2;
    statuses[0].MPI_SOURCE = wire.rank;
    statuses[0].MPI_TAG = TAG_RENDERER_TO_MASTER_TRAY;
    return MPI_SUCCESS;
}

int MPI_Get_count(const MPI_Status *status, MPI_Datatype type, int *count)
{
    (void)status, (void)type;
    *count = (int)wire.bytes;
    return MPI_SUCCESS;
}

/* ---- the master ---- */

struct master_of_test {
    struct server server;
    struct service service;
    struct canvas canvas;
    struct renderer_stats stats[RENDERERS];
    struct contact contacts[RENDERERS];
    struct drops drops[RENDERERS];
    struct tray *tray, *trays[RENDERERS];
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
    test->trays[1] = test->tray;
    canvas_init(&test->canvas, config.width, config.height);
    test->watch = (struct watch){.canvas = &test->canvas, .samples = 1, .first_samples = 1};
    assert_true(watch_start(&test->watch, ""));
    test->service = (struct service){.queue = queue_create(&config),
                                     .canvas = &test->canvas,
                                     .watch = &test->watch,
                                     .trays = test->trays,
                                     .stats = test->stats};
    test->server = (struct server){.service = &test->service,
                                   .start = clock_wall(),
                                   .last_pass = true,
                                   .first_remote = 1,
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
}

/* The lot that the master has put into a slot: its first tile. */
static struct tile first_tile(const struct master_of_test *test, uint32_t slot)
{
    struct tile tile;
    struct lot_header header;
    const char *lot = test->tray->lot[slot];
    assert_true(slots_full(&test->tray->lots, slot));
    memcpy(&header, lot, sizeof header);
    assert_true(lot_header_valid(&header) && header.tells > 0);
    memcpy(&tile, lot + sizeof header + lot_tells_bytes(header.tells), sizeof tile);
    return tile;
}

/* Into the slot, all pixels of one colour; returns its length. */
static uint32_t put_result(struct tray *tray, int slot, const struct tile *tile, float colour)
{
    uint32_t pixels = tile_pixels(tile);
    struct result_header header = {.tile_id = tile->id, .pixels = pixels};
    char *result = tray->result[slot];
    float *rgb = (void *)(result + sizeof header);
    memcpy(result, &header, sizeof header);
    for (uint32_t i = 0; i < 3 * pixels; i++)
        rgb[i] = colour;
    slots_fill(&tray->results, slot);
    return (uint32_t)result_bytes(tile, pixels, false);
}

/* The master hears of it. */
static void tell(struct master_of_test *test, int rank, const void *note, size_t bytes)
{
    wire.rank = rank;
    wire.note = note;
    wire.bytes = bytes;
    assert_true(take_in(&test->server));
}

static void test_lots_and_results(void **state)
{
    (void)state;
    struct master_of_test test;
    set_up(&test);
    hand_out(&test.server, 1);
    assert_true(wire.sent[1] > 0 && wire.tag == TAG_MASTER_TO_RENDERER_TRAY);
    assert_int_equal(wire.size, sizeof(struct tray_note));
    struct tile tile = first_tile(&test, 0);
    struct tray_note note = {.slot = 1, .bytes = put_result(test.tray, 1, &tile, 0.5f)};
    tell(&test, 1, &note, sizeof note);
    assert_false(slots_full(&test.tray->results, 1));
    assert_int_equal(test.stats[1].tiles, 1);
    assert_int_equal(test.stats[1].bytes, note.bytes);
    const float *rgb = test.canvas.rgb + 3 * ((size_t)tile.y * test.canvas.width + tile.x);
    assert_true(rgb[0] == 0.5f);
    tear_down(&test);
}

/* A header alone, in a slot. */
static struct tray_note put_header(struct tray *tray, int slot, struct result_header header)
{
    memcpy(tray->result[slot], &header, sizeof header);
    slots_fill(&tray->results, slot);
    return (struct tray_note){.slot = (uint32_t)slot, .bytes = sizeof header};
}

/* That a tile takes long may be heard when it is back; then it is no news. */
static void test_takes_long(void **state)
{
    (void)state;
    struct master_of_test test;
    set_up(&test);
    hand_out(&test.server, 1);
    struct tile tile = first_tile(&test, 0), held;
    struct result_header header = {.tile_id = tile.id, .pixels = RESULT_UNFINISHED, .busy_s = 0.25};
    struct tray_note note = put_header(test.tray, 0, header);
    tell(&test, 1, &note, sizeof note);
    assert_true(queue_held(test.service.queue, 1, tile.id, &held));
    assert_int_equal(test.stats[1].tiles, 0);
    note = (struct tray_note){.slot = 1, .bytes = put_result(test.tray, 1, &tile, 0.5f)};
    tell(&test, 1, &note, sizeof note);
    assert_int_equal(test.stats[1].tiles, 1);
    note = put_header(test.tray, 0, header);
    tell(&test, 1, &note, sizeof note);
    assert_int_equal(test.stats[1].tiles, 1);
    tear_down(&test);
}

/* No slot is empty, or the renderer is on another machine: lots come in messages. */
static void test_no_room(void **state)
{
    (void)state;
    struct master_of_test test;
    set_up(&test);
    slots_fill(&test.tray->lots, 0);
    slots_fill(&test.tray->lots, 1);
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

/* Whether the job ends with that note. */
static bool is_refused(struct master_of_test *test, int rank, struct tray_note note, size_t bytes)
{
    if (setjmp(wire.end)) return true;
    tell(test, rank, &note, bytes);
    return false;
}

static void test_notes_are_checked(void **state)
{
    (void)state;
    struct master_of_test test;
    set_up(&test);
    message_set_rank(0, end_job);
    hand_out(&test.server, 1);
    struct tile tile = first_tile(&test, 0);
    const struct tray_note good = {.slot = 1, .bytes = put_result(test.tray, 1, &tile, 0.5f)};
    const size_t size = sizeof good;
    assert_true(is_refused(&test, 1, (struct tray_note){TRAY_SLOTS, good.bytes}, size));
    assert_true(is_refused(&test, 1, (struct tray_note){1, TRAY_RESULT_BYTES + 8}, size));
    assert_true(is_refused(&test, 1, (struct tray_note){1, 0}, size));
    assert_true(is_refused(&test, 1, good, size - 1));
    assert_true(is_refused(&test, 1, (struct tray_note){0, good.bytes}, size));
    assert_true(is_refused(&test, 2, good, size));
    assert_int_equal(test.stats[1].tiles, 0);
    message_set_rank(0, NULL);
    tear_down(&test);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slots),
        cmocka_unit_test(test_slots_apart),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_lots_and_results),
        cmocka_unit_test(test_takes_long),
        cmocka_unit_test(test_no_room),
        cmocka_unit_test(test_notes_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
