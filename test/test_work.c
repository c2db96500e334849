/* Tests of what a renderer on another rank does with the master's messages. This file replaces MPI. */
#include <limits.h>
#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/bell.h"
#include "common/clock.h"
#include "common/tray.h"
#include "master/builder.h"
#include "test/arrivals_fixture.h"
#include "test/fatal.h"
#include "test/unit.h"
#include "test/view_fixture.h"
#include "worker/node_scene.h"
#include "worker/render.h"
#include "worker/work.h"
#include "worker/worker.h"

#define EDGE 8u

/* A message of the master; one of a sequence is received at each poll. tag 0: there is no message yet, and the poll
 * takes `size` microseconds. */
struct line {
    int tag;
    const void *bytes;
    size_t size;
};

static struct {
    const struct line *lines;
    size_t count, said;
    void *buffer; /* of the posted receive */
    int heard;    /* bytes of the last message */
    char result[2 * TRAY_RESULT_BYTES];
    size_t result_bytes;
    struct result_header headers[8]; /* that the first results begin with */
    size_t sizes[8];
    struct renderer_stats goodbye;
    unsigned results, stats, messages;
    unsigned wanted; /* results before STOP */
    struct bell bell;
    bool was_called;   /* between the last lot and the last result */
    struct tray *tray; /* NULL: this renderer has none */
    struct arrivals *arrivals;
    unsigned left; /* results in it, which it leaves there */
    unsigned full; /* its last slots for results hold others, all the time */
    const struct line
        *late_lot;         /* comes into the tray with the second message, before it; NULL: none */
    unsigned looks;        /* for a message while it is quiet */
    double heard_at;       /* seconds: when the second message was heard */
    unsigned held_up;      /* so many looks it takes until a result is sent; then it says STOP */
    size_t eager;          /* what has fewer bytes is sent at once all the same */
    unsigned held_up_left; /* of these behind the last wanted result */
} master;

/* The master sends nothing after its first message. */
static atomic_bool quiet;

/* ---- the calls of worker/work.c, receive.c and send.c ---- */

/* Any three that are not MPI_REQUEST_NULL. */
#define RECEIVE ((MPI_Request)0x77000001)
#define SEND    ((MPI_Request)0x77000002)
#define EAGER   ((MPI_Request)0x77000003)

int MPI_Comm_rank(MPI_Comm comm, int *rank)
{
    (void)comm;
    *rank = 1;
    return MPI_SUCCESS;
}

int MPI_Irecv(void *buffer, int count, MPI_Datatype type, int source, int tag, MPI_Comm comm,
              MPI_Request *request)
{
    (void)count, (void)type, (void)source, (void)tag, (void)comm;
    master.buffer = buffer;
    *request = RECEIVE;
    return MPI_SUCCESS;
}

static void take_result(const void *result, size_t bytes)
{
    assert_true(bytes <= sizeof master.result);
    memcpy(master.result, result, bytes);
    master.result_bytes = bytes;
    if (master.results >= sizeof master.sizes / sizeof *master.sizes) return;
    master.sizes[master.results] = bytes;
    memcpy(&master.headers[master.results], result, sizeof *master.headers);
}

static void count_result(const void *result, size_t bytes)
{
    take_result(result, bytes);
    master.results++;
    if (master.results == master.wanted) master.held_up_left = master.held_up;
    master.was_called = master.bell.rung;
}

/* The slots stay full. */
static void look_into_tray(void)
{
    while (master.tray && master.left < TRAY_SLOTS - master.full) {
        uint32_t bytes = slots_bytes(&master.tray->results, master.left);
        if (bytes == 0) return;
        assert_true(arrivals_take(master.arrivals, 0) >> 1 == 1);
        count_result(master.tray->result[master.left++], bytes);
    }
}

int MPI_Isend(const void *buffer, int count, MPI_Datatype type, int rank, int tag, MPI_Comm comm,
              MPI_Request *request)
{
    (void)type, (void)rank, (void)comm;
    /* What is still being sent stays as it is. READY and STATS are sent with a new request, which has no value. */
    if (tag == TAG_RENDERER_TO_MASTER_RESULT || tag == TAG_RENDERER_TO_MASTER_PONG)
        assert_true(*request == MPI_REQUEST_NULL);
    *request = (size_t)count < master.eager ? EAGER : SEND;
    master.messages++;
    /* It is counted before it is sent. */
    if (master.arrivals) assert_false(arrivals_has_messages(master.arrivals, master.messages));
    master.stats += tag == TAG_RENDERER_TO_MASTER_STATS;
    if (tag == TAG_RENDERER_TO_MASTER_STATS) memcpy(&master.goodbye, buffer, (size_t)count);
    look_into_tray();
    if (tag == TAG_RENDERER_TO_MASTER_RESULT) count_result(buffer, (size_t)count);
    return MPI_SUCCESS;
}

static bool is_quiet(void)
{
    bool says_nothing = master.said > 0 && atomic_load(&quiet);
    master.looks += says_nothing;
    return says_nothing;
}

/* Whether the send of a result is still incomplete. */
static bool is_held_up(void)
{
    if (master.results == 0 || master.held_up == 0) return false;
    if (--master.held_up == 0 && master.tray) tray_count_sent(master.tray);
    return true;
}

/* Puts a lot into the first slot. said: the number of things that the master has said before it. */
static void put_lot(struct tray *tray, const struct line *lot, unsigned said)
{
    memcpy(tray->lot[0], lot->bytes, lot->size);
    tray->sent_before[0] = said;
    slots_fill(&tray->lots, 0, (uint32_t)lot->size);
}

int MPI_Test(MPI_Request *request, int *done, MPI_Status *status)
{
    look_into_tray();
    *done = *request != SEND || !is_held_up();
    if (*request != RECEIVE) {
        if (*done) *request = MPI_REQUEST_NULL;
        return MPI_SUCCESS;
    }
    if (is_quiet()) {
        *done = 0;
        return MPI_SUCCESS;
    }
    assert_true(master.said < master.count);
    const struct line *line = &master.lines[master.said];
    bool stop = line->tag == TAG_MASTER_TO_RENDERER_STOP;
    if (stop && (master.results < master.wanted || master.held_up > 0)) {
        *done = 0;
        return MPI_SUCCESS;
    }
    master.said++;
    if (master.said == 2) master.heard_at = clock_wall();
    *done = line->tag != 0;
    if (!*done && line->size) clock_sleep(1e-6 * (double)line->size);
    if (!*done) return MPI_SUCCESS;
    if (line->tag == TAG_MASTER_TO_RENDERER_TILES) bell_wait(&master.bell, 0);
    if (master.said == 2 && master.late_lot) put_lot(master.tray, master.late_lot, 1);
    if (line->size) memcpy(master.buffer, line->bytes, line->size);
    master.heard = (int)line->size;
    status->MPI_TAG = line->tag;
    status->MPI_SOURCE = 0;
    *request = MPI_REQUEST_NULL;
    return MPI_SUCCESS;
}

int MPI_Get_count(const MPI_Status *status, MPI_Datatype type, int *count)
{
    (void)status, (void)type;
    *count = master.heard;
    return MPI_SUCCESS;
}

/* ---- the tests ---- */

/* The master sends `count` of its messages, from number `first` on. */
static void say(struct tray *tray, size_t first, size_t count)
{
    for (size_t i = first; i < first + count; i++)
        if (master.lines[i].tag != 0) tray_count_sent(tray);
}

#define QUIET_S 0.1

/* Far less than a renderer sleeps if nobody wakes it. */
#define SOON 0.5

/* A master that says the first message and, after a while, all others. */
struct late_master {
    bool rings; /* behind them */
    clockid_t renderer;
    double cpu_s; /* of the renderer, meanwhile */
    double spoke; /* seconds: when it said them */
};

static void *speak_late(void *argument)
{
    struct late_master *late = argument;
    clock_sleep(QUIET_S); /* for the start */
    double cpu = clock_read(late->renderer);
    clock_sleep(QUIET_S);
    late->cpu_s = clock_read(late->renderer) - cpu;
    late->spoke = clock_wall();
    atomic_store(&quiet, false);
    if (late->rings) say(master.tray, 1, master.count - 1);
    return NULL;
}

/* The options of a run; all zero: the defaults. */
struct manner {
    struct tray *tray;        /* NULL: the renderer has none */
    struct late_master *late; /* NULL: all is said at once */
    /* As the master's. */
    unsigned held_up;
    size_t eager;
    unsigned full;
    const struct line *late_lot;
    bool served;   /* by another thread: nothing is said or filled here */
    bool adaptive; /* the sampling is */
    uint32_t edge; /* of the picture; 0: EDGE */
};

static void begin_to_speak(const struct manner *manner, pthread_t *thread)
{
    if (manner->late) {
        assert_int_equal(pthread_getcpuclockid(pthread_self(), &manner->late->renderer), 0);
        atomic_store(&quiet, true);
        say(manner->tray, 0, 1);
        assert_int_equal(pthread_create(thread, NULL, speak_late, manner->late), 0);
    } else if (manner->tray && !manner->served) {
        say(manner->tray, 0, manner->held_up ? master.count - 1 : master.count);
    }
}

/* Runs a renderer with an empty scene, two tiles high, until the master sends STOP. */
static void follow_in(const struct manner *manner, const struct line *lines, size_t count,
                      unsigned wanted)
{
    struct view view = small_view(manner->edge ? manner->edge : EDGE);
    if (manner->adaptive) view.max_samples = 64;
    struct prepared prepared = prepare_scene(builder_create(), &view);
    pthread_t thread;
    memset(&master, 0, sizeof master);
    master.lines = lines;
    master.count = count;
    master.wanted = wanted;
    master.tray = manner->tray;
    master.held_up = manner->held_up;
    master.eager = manner->eager;
    master.full = manner->full;
    master.late_lot = manner->late_lot;
    bell_init(&master.bell);
    if (manner->tray) master.arrivals = arrivals_create(2);
    struct node_scene shared = {.scene = prepared.scene,
                                .bell = &master.bell,
                                .tray = manner->tray,
                                .arrivals = master.arrivals};
    for (unsigned i = 1; i <= manner->full && !manner->served; i++)
        slots_fill(&manner->tray->results, TRAY_SLOTS - i, 8);
    begin_to_speak(manner, &thread);
    work(prepared.renderer, &shared);
    if (manner->late) pthread_join(thread, NULL);
    /* All messages that were sent were counted. */
    if (master.arrivals) assert_false(arrivals_has_messages(master.arrivals, master.messages));
    free(master.arrivals);
    bell_free(&master.bell);
    prepared_free(&prepared);
}

/* tray: NULL for none. */
static void follow_with(struct tray *tray, const struct line *lines, size_t count, unsigned wanted)
{
    follow_in(&(struct manner){.tray = tray}, lines, count, wanted);
}

static void follow(const struct line *lines, size_t count, unsigned wanted)
{
    follow_with(NULL, lines, count, wanted);
}

struct lot_of_two {
    struct lot_header header;
    struct tile tiles[2];
};

static const struct start start = {.elapsed_s = 1000};
static const struct lot_of_two lot = {
    .header = {.answer_s = 1e9, .wakes_master = 1},
    .tiles = {{.id = 5, .w = EDGE, .h = EDGE / 2, .step = 1},
              {.id = 9, .y = EDGE / 2, .w = EDGE, .h = EDGE / 2, .step = 1}}};

#define NOTHING                                                                                    \
    {                                                                                              \
        0, NULL, 0                                                                                 \
    }
#define LOT                                                                                        \
    {                                                                                              \
        TAG_MASTER_TO_RENDERER_TILES, &lot, sizeof lot                                             \
    }
#define BEGIN {TAG_MASTER_TO_RENDERER_START, &start, sizeof start}, LOT
#define DROP(drop)                                                                                 \
    {                                                                                              \
        TAG_MASTER_TO_RENDERER_DROP, &drop, sizeof drop                                            \
    }
#define STOP                                                                                       \
    {                                                                                              \
        TAG_MASTER_TO_RENDERER_STOP, NULL, 0                                                       \
    }

static struct result_header header_at(size_t byte)
{
    struct result_header header;
    assert_true(byte + sizeof header <= master.result_bytes);
    memcpy(&header, master.result + byte, sizeof header);
    return header;
}

/* Checks that the result has the first tile, dropped or not, and the complete second tile, and nothing more. */
static void check_result(bool dropped, bool begun)
{
    struct result_header first = header_at(0);
    size_t bytes = dropped ? sizeof first : result_bytes(&lot.tiles[0], first.pixels, false);
    struct result_header second = header_at(bytes);
    assert_int_equal(master.results, 1);
    assert_int_equal(master.stats, 1);
    /* It had no other lot: before the last tile it has called for one. */
    assert_true(master.was_called);
    assert_int_equal(first.tile_id, lot.tiles[0].id);
    assert_int_equal(first.pixels, dropped ? RESULT_DROPPED : tile_pixels(&lot.tiles[0]));
    assert_int_equal(first.busy_s > 0, begun);
    assert_true(second.start_s >= 1000 && second.start_s < 1100);
    assert_int_equal(second.tile_id, lot.tiles[1].id);
    assert_int_equal(second.pixels, tile_pixels(&lot.tiles[1]));
    assert_int_equal(master.result_bytes,
                     bytes + result_bytes(&lot.tiles[1], second.pixels, false));
}

/* The tile in work is given up when it is finished elsewhere; the next one is not. */
static void test_gives_up_what_is_finished(void **state)
{
    static const struct drop drop = {.tile_id = 5, .finished = 1};
    static const struct line lines[] = {BEGIN,      NOTHING, /* before the first tile */
                                        DROP(drop),          /* in it */
                                        NOTHING,    NOTHING, NOTHING, STOP};
    follow(lines, sizeof lines / sizeof *lines, 1);
    check_result(true, true);
}

/* At STOP the tile in work is given up: whoever has stopped the run does not wait for it. */
static void test_stops_in_a_tile(void **state)
{
    static const struct line lines[] = {BEGIN, NOTHING, /* before the first tile */ STOP};
    follow(lines, sizeof lines / sizeof *lines, 0);
    assert_int_equal(master.results, 0);
    assert_int_equal(master.stats, 1);
}

/* A tile that has been begun is finished if another renderer merely has it, too. */
static void test_keeps_what_others_have(void **state)
{
    static const struct drop drop = {.tile_id = 5, .finished = 0};
    static const struct line lines[] = {BEGIN,   NOTHING, DROP(drop), NOTHING,
                                        NOTHING, NOTHING, STOP};
    follow(lines, sizeof lines / sizeof *lines, 1);
    check_result(false, true);
}

/* A tile that has not been begun is dropped in both cases. */
static void test_drops_what_is_not_begun(void **state)
{
    for (uint32_t finished = 0; finished <= 1; finished++) {
        const struct drop drop = {.tile_id = 5, .finished = finished};
        const struct line lines[] = {BEGIN, DROP(drop), NOTHING, NOTHING, NOTHING, STOP};
        follow(lines, sizeof lines / sizeof *lines, 1);
        check_result(true, false);
    }
}

/* One message may name several tiles: the tile in work and the next one. */
static void test_drops_several(void **state)
{
    static const struct drop drops[] = {{.tile_id = 9}, {.tile_id = 5, .finished = 1}};
    static const struct line lines[] = {BEGIN, NOTHING, DROP(drops), NOTHING, NOTHING, STOP};
    follow(lines, sizeof lines / sizeof *lines, 1);
    struct result_header first = header_at(0), second = header_at(sizeof first);
    assert_int_equal(master.result_bytes, 2 * sizeof first);
    assert_true(first.tile_id == 5 && first.pixels == RESULT_DROPPED && first.busy_s > 0);
    assert_true(second.tile_id == 9 && second.pixels == RESULT_DROPPED && !(second.busy_s > 0));
}

/* On a cache line, as it is in the memory that a node shares; to be freed with delete_tray(). */
static struct tray *new_tray(void)
{
    struct tray *tray = aligned_alloc(_Alignof(struct tray), sizeof *tray);
    assert_non_null(tray);
    tray_init(tray);
    return tray;
}

static void delete_tray(struct tray *tray)
{
    tray_free(tray);
    free(tray);
}

/* A renderer whose lot comes through the tray, the second of what the master says, or the one with that number:
 * there, or late. */
static void follow_lot(const struct line *lines, size_t count, unsigned number,
                       struct manner manner)
{
    static const struct line in_tray = LOT;
    struct tray *tray = manner.tray = new_tray();
    tray_count_sent(tray);
    if (manner.late_lot)
        manner.late_lot = &in_tray;
    else
        put_lot(tray, &in_tray, number);
    follow_in(&manner, lines, count, 1);
    assert_int_equal(slots_bytes(&tray->lots, 0), 0);
    delete_tray(tray);
}

#define SAID                                                                                       \
    {                                                                                              \
        TAG_MASTER_TO_RENDERER_START, &start, sizeof start                                         \
    }

/* If the master is on this node, a lot comes in the tray. The result is put there if the next slot is empty, else it
 * is sent in a message. */
static void test_tray(void **state)
{
    static const struct line lines[] = {SAID, NOTHING, NOTHING, NOTHING, NOTHING, STOP};
    for (unsigned full = 0; full <= TRAY_SLOTS; full++) {
        follow_lot(lines, sizeof lines / sizeof *lines, 1, (struct manner){.full = full});
        assert_int_equal(master.left, full < TRAY_SLOTS);
        assert_int_equal(master.results, 1);
        assert_int_equal(header_at(0).tile_id, lot.tiles[0].id);
        assert_int_equal(master.result_bytes,
                         2 * result_bytes(&lot.tiles[0], tile_pixels(&lot.tiles[0]), false));
    }
}

/* What the master says is heard in that order, in the tray or not: which tile is to be dropped that the last message
 * names, and which is not that the one before the lot names. */
static void test_order(void **state)
{
    static const struct drop drop = {.tile_id = 5, .finished = 0};
    static const struct line some_lot = LOT;
    static const struct line lines[] = {SAID, DROP(drop), NOTHING, NOTHING, NOTHING, STOP};
    size_t count = sizeof lines / sizeof *lines;
    follow_lot(lines, count, 1, (struct manner){0});
    assert_int_equal(header_at(0).pixels, RESULT_DROPPED);
    /* It comes between the look into the tray and the one for messages. */
    follow_lot(lines, count, 1, (struct manner){.late_lot = &some_lot});
    assert_int_equal(header_at(0).pixels, RESULT_DROPPED);
    follow_lot(lines, count, 2, (struct manner){0});
    assert_int_equal(header_at(0).pixels, tile_pixels(&lot.tiles[0]));
}

/* A lot in the tray that is said to be so long, and to come when so much has been said. */
struct wrong_lot {
    uint32_t bytes;
    unsigned sent_before;
};

static void follow_wrong(void *state)
{
    static const struct line lines[] = {SAID, NOTHING, NOTHING, NOTHING, NOTHING, STOP},
                             in_tray = LOT;
    const struct wrong_lot *wrong = state;
    struct tray *tray = new_tray();
    tray_count_sent(tray);
    put_lot(tray, &in_tray, 1);
    tray->sent_before[0] = wrong->sent_before;
    slots_fill(&tray->lots, 0, wrong->bytes);
    follow_with(tray, lines, sizeof lines / sizeof *lines, 1);
}

/* One that is longer than its slot ends the farm, and one that should have been heard before, for which nobody would
 * look again. */
static void test_tray_is_checked(void **state)
{
    struct wrong_lot wrong[] = {{TRAY_LOT_BYTES + 8, 1}, {UINT32_MAX, 1}, {sizeof lot, UINT_MAX}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_fatal(follow_wrong, &wrong[i],
                     "farm: rank 0: the master left a lot where it makes no sense\n");
}

/* A message of one lot, which has all kinds of parts. */
struct large_lot {
    struct lot_header header;
    float report_s[2];
    struct tile tiles[LOT_TILES + 1];
};

static const struct large_lot good_lot = {
    .header = {.answer_s = 1e9, .reports = 2},
    .tiles = {{.id = 5, .w = EDGE, .h = 1, .step = 1},
              {.id = 9, .y = 1, .w = EDGE, .h = 1, .step = 1}}};

/* Bytes of a lot with this number of tiles, with reports for two. */
static size_t large_bytes(size_t tiles)
{
    return offsetof(struct large_lot, tiles) + tiles * sizeof(struct tile);
}

struct unfit_lot {
    struct large_lot lot;
    size_t bytes;
    uint32_t edge; /* of the picture; 0: EDGE */
};

static void follow_unfit(void *state)
{
    const struct unfit_lot *it = state;
    /* What a shorter one lacks is still in the buffer. */
    const struct line lines[] = {SAID,
                                 {TAG_MASTER_TO_RENDERER_TILES, &good_lot, large_bytes(2)},
                                 {TAG_MASTER_TO_RENDERER_TILES, &it->lot, it->bytes},
                                 NOTHING,
                                 NOTHING,
                                 STOP};
    follow_in(&(struct manner){.edge = it->edge}, lines, sizeof lines / sizeof *lines, 2);
}

static void assert_unfit(const struct unfit_lot *unfit, const char *why)
{
    char line[128];
    struct unfit_lot copy = *unfit;
    snprintf(line, sizeof line, "farm: rank 0: the master sent a %s\n", why);
    assert_fatal(follow_unfit, &copy, line);
}

/* A lot whose header makes no sense ends the farm. */
static void test_lot_headers_are_checked(void **state)
{
    struct unfit_lot it = {.lot = good_lot, .bytes = sizeof(struct lot_header) - 8};
    assert_unfit(&it, "lot without tiles");
    it.bytes = large_bytes(0);
    assert_unfit(&it, "lot without tiles");
    it.bytes = large_bytes(2);
    it.lot.header.wakes_master = 2;
    assert_unfit(&it, "lot that makes no sense");
    it.lot = good_lot, it.lot.header.answer_s = (double)NAN;
    assert_unfit(&it, "lot that makes no sense");
    it.lot = good_lot, it.lot.header.reports = LOT_TILES + 1;
    assert_unfit(&it, "lot that makes no sense");
    it.lot = good_lot, it.lot.report_s[1] = NAN;
    assert_unfit(&it, "lot that makes no sense");
    it.lot = good_lot, it.bytes = large_bytes(1); /* a tile less than there are reports */
    assert_unfit(&it, "lot that makes no sense");
}

static void follow_unstarted(void *state)
{
    static const struct line lines[] = {LOT, SAID, STOP};
    follow(lines, sizeof lines / sizeof *lines, 1);
}

/* So does one before START, or whose tiles make no sense, or that has more of them, or more pixels, than there is room
 * for. */
static void test_lot_tiles_are_checked(void **state)
{
    struct unfit_lot it = {.lot = good_lot, .bytes = large_bytes(2) - 8};
    assert_unfit(&it, "tile that is not part of the picture"); /* half a tile */
    it.bytes = large_bytes(2), it.lot.tiles[1].y = EDGE;
    assert_unfit(&it, "tile that is not part of the picture");
    it.lot = good_lot, it.lot.tiles[0].pass = 1; /* without adaptive sampling */
    assert_unfit(&it, "tile that is not part of the picture");
    it.lot = good_lot, it.bytes = large_bytes(LOT_TILES + 1);
    for (size_t i = 0; i <= LOT_TILES; i++)
        it.lot.tiles[i] = good_lot.tiles[0];
    assert_unfit(&it, "tile that is not part of the picture");
    it = (struct unfit_lot){.lot = good_lot, .bytes = large_bytes(2), .edge = 1024};
    it.lot.tiles[0].w = it.lot.tiles[0].h = 1024; /* as many as there may be */
    assert_unfit(&it, "lot of too many pixels");
    assert_fatal(follow_unstarted, NULL,
                 "farm: rank 0: the master sent a tile that is not part of the picture\n");
}

/* A tile of as many pixels as there may be is taken; here the run is stopped before it is begun. */
static void test_largest_tile(void **state)
{
    enum { EDGE_LARGEST = 1024 };
    struct {
        struct lot_header header;
        struct tile tile;
    } largest = {.tile = {.w = EDGE_LARGEST, .h = EDGE_LARGEST, .step = 1}};
    assert_int_equal(tile_pixels(&largest.tile), TILE_MAX_PIXELS);
    const struct line lines[] = {
        SAID, {TAG_MASTER_TO_RENDERER_TILES, &largest, sizeof largest}, STOP};
    follow_in(&(struct manner){.edge = EDGE_LARGEST}, lines, sizeof lines / sizeof *lines, 0);
    assert_int_equal(master.stats, 1);
}

/* Two tiles of a later pass, and the samples of their pixels. */
struct refined_lot {
    struct lot_header header;
    struct {
        struct tile tile;
        struct refinement refinements[EDGE * EDGE / 2];
    } parts[2];
};

/* No pixel of the first tile gets samples, all of the second one do. */
static struct refined_lot refined_lot(void)
{
    struct refined_lot it = {.header = {.answer_s = 1e9}};
    for (uint32_t k = 0; k < 2; k++) {
        it.parts[k].tile = lot.tiles[k];
        it.parts[k].tile.pass = 1;
        for (uint32_t i = 0; i < EDGE * EDGE / 2; i++)
            it.parts[k].refinements[i] = (struct refinement){1, (uint8_t)(1 + k)};
    }
    return it;
}

/* What a lot says of the samples of its second tile begins where that of its first tile ends. */
static void test_refined_lot(void **state)
{
    struct refined_lot refined = refined_lot();
    const struct line lines[] = {SAID,    {TAG_MASTER_TO_RENDERER_TILES, &refined, sizeof refined},
                                 NOTHING, NOTHING,
                                 NOTHING, NOTHING,
                                 STOP};
    follow_in(&(struct manner){.adaptive = true}, lines, sizeof lines / sizeof *lines, 1);
    struct result_header first = header_at(0), second = header_at(sizeof first);
    assert_true(first.tile_id == lot.tiles[0].id && first.pixels == 0);
    assert_true(second.tile_id == lot.tiles[1].id && second.pixels == EDGE * EDGE / 2);
}

struct unfit_refined {
    struct refined_lot lot;
    size_t bytes;
};

static void follow_unfit_refined(void *state)
{
    const struct unfit_refined *it = state;
    struct refined_lot whole = refined_lot();
    const struct line lines[] = {SAID,
                                 {TAG_MASTER_TO_RENDERER_TILES, &whole, sizeof whole},
                                 {TAG_MASTER_TO_RENDERER_TILES, &it->lot, it->bytes},
                                 STOP};
    follow_in(&(struct manner){.adaptive = true}, lines, sizeof lines / sizeof *lines, 2);
}

/* A lot that lacks a part of a tile, or of what it says of the samples, or says something else, ends the farm. */
static void test_refined_lots_are_checked(void **state)
{
    static const char why[] =
        "farm: rank 0: the master sent a tile that is not part of the picture\n";
    struct unfit_refined it = {.lot = refined_lot(), .bytes = sizeof it.lot - 8};
    assert_fatal(follow_unfit_refined, &it, why);
    it.bytes = sizeof it.lot - sizeof it.lot.parts[1].refinements - 8;
    assert_fatal(follow_unfit_refined, &it, why);
    it.bytes = sizeof it.lot;
    it.lot.parts[1].refinements[3].to = LEVEL_MAX;
    assert_fatal(follow_unfit_refined, &it, why);
}

/* A message that is the last but STOP, and the reason why it ends the farm. */
struct wrong_message {
    struct line line;
    const char *why;
};

static void follow_wrong_message(void *state)
{
    const struct wrong_message *wrong = state;
    const struct line lines[] = {SAID, wrong->line, STOP};
    follow(lines, sizeof lines / sizeof *lines, 0);
}

static void test_messages_are_checked(void **state)
{
    static const char zeros[64];
    struct wrong_message wrong[] = {
        {{TAG_MASTER_TO_RENDERER_START, &start, sizeof start}, "sent a start that makes no sense"},
        {{TAG_MASTER_TO_RENDERER_DROP, zeros, 4},
         "asked to drop a tile in a way that makes no sense"},
        {{TAG_MASTER_TO_RENDERER_PING, zeros, 8},
         "asked for a sign of life in a way that makes no sense"},
        {{TAG_MASTER_TO_RENDERER_STOP, zeros, 8}, "said stop in a way that makes no sense"},
        {{99, zeros, 8}, "sent a message of unknown kind 99"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        char line[128];
        snprintf(line, sizeof line, "farm: rank 0: the master %s\n", wrong[i].why);
        assert_fatal(follow_wrong_message, &wrong[i], line);
    }
}

/* It answers the second of two questions whether it is there only if the first answer has been sent. */
static void test_answers_once(void **state)
{
    struct line lines[20] = {BEGIN};
    lines[17] = lines[18] = (struct line){TAG_MASTER_TO_RENDERER_PING, NULL, 0};
    lines[19] = (struct line)STOP;
    for (unsigned late = 0; late <= 1; late++) {
        follow_in(&(struct manner){.held_up = 100 * late}, lines, 20, 1);
        assert_int_equal(master.messages, 4 + !late); /* READY, a result, the answers, STATS */
    }
}

#define LOTS_IN_ALL 7

/* A master in another thread that leaves lots, each with other tiles, while there is room, and takes results; then it
 * says STOP. */
static void *serve_tray(void *argument)
{
    struct tray *tray = argument;
    unsigned put = 0, taken = 0;
    while (taken < LOTS_IN_ALL) {
        if (put < LOTS_IN_ALL && put < taken + LOTS_UNDER_WAY) {
            struct lot_of_two next = lot;
            next.tiles[0].id = 100 + 2 * put;
            next.tiles[1].id = 101 + 2 * put;
            tray_put_lot(tray, put++, &next, sizeof next);
        }
        uint32_t bytes = slots_bytes(&tray->results, taken);
        if (bytes == 0) {
            sched_yield();
            continue;
        }
        struct result_header header;
        memcpy(&header, tray->result[taken % TRAY_SLOTS], sizeof header);
        if (header.tile_id != 100 + 2 * taken) return NULL;
        slots_empty(&tray->results, taken++);
    }
    atomic_store(&quiet, false);
    tray_count_sent(tray);
    return tray;
}

/* More lots than there are slots, one after the other, and as many results: nothing but START and STOP is a message,
 * nor what the renderer sends but READY and STATS. */
static void test_many_lots(void **state)
{
    static const struct line lines[] = {SAID, STOP};
    struct tray *tray = new_tray();
    pthread_t thread;
    void *served;
    tray_count_sent(tray); /* START */
    atomic_store(&quiet, true);
    assert_int_equal(pthread_create(&thread, NULL, serve_tray, tray), 0);
    follow_in(&(struct manner){.tray = tray, .full = TRAY_SLOTS, .served = true}, lines, 2, 0);
    pthread_join(thread, &served);
    assert_non_null(served);
    assert_int_equal(master.messages, 2);
    delete_tray(tray);
}

/* A renderer that is woken when there is a message neither polls nor uses CPU time until then. */
static void test_sleeps_until_it_is_woken(void **state)
{
    static const struct line lines[] = {BEGIN, NOTHING, NOTHING, NOTHING, NOTHING, STOP};
    struct late_master late = {.rings = true};
    struct tray *tray = new_tray();
    follow_in(&(struct manner){.tray = tray, .late = &late}, lines, sizeof lines / sizeof *lines,
              1);
    assert_int_equal(master.results, 1);
    assert_int_equal(master.looks, 0);
    assert_true(late.cpu_s < QUIET_S / 4);
    assert_true(master.heard_at < late.spoke + SOON);
    delete_tray(tray);
}

/* If nobody rings, it still finds the message by polling from time to time. */
static void test_looks_now_and_then(void **state)
{
    static const struct line lines[] = {BEGIN, NOTHING, NOTHING, NOTHING, NOTHING, STOP};
    struct late_master late = {.rings = false};
    struct tray *tray = new_tray();
    follow_in(&(struct manner){.tray = tray, .late = &late}, lines, sizeof lines / sizeof *lines,
              1);
    assert_int_equal(master.results, 1);
    assert_int_equal(master.looks, 0);
    assert_true(master.heard_at < late.spoke + 2);
    delete_tray(tray);
}

/* While its own result is being sent in a message, as no slot is empty, it must poll, so that MPI makes progress. */
static void test_looks_while_it_sends(void **state)
{
    static const struct line lines[] = {BEGIN, NOTHING, NOTHING, NOTHING, NOTHING, STOP};
    struct tray *tray = new_tray();
    double begin = clock_wall();
    follow_in(&(struct manner){.tray = tray, .held_up = 20, .full = TRAY_SLOTS}, lines,
              sizeof lines / sizeof *lines, 1);
    assert_int_equal(master.results, 1);
    assert_int_equal(master.held_up, 0);
    assert_true(clock_wall() < begin + SOON);
    delete_tray(tray);
}

/* It goes on rendering although none of its results has been taken: the first ones are in the tray, later ones are
 * sent in messages. */
static void test_renders_on_while_it_sends(void **state)
{
    static const struct line lines[] = {BEGIN,   NOTHING, NOTHING, LOT,     NOTHING, NOTHING, LOT,
                                        NOTHING, NOTHING, LOT,     NOTHING, NOTHING, STOP};
    struct tray *tray = new_tray();
    follow_in(&(struct manner){.tray = tray, .held_up = 300}, lines, sizeof lines / sizeof *lines,
              4);
    assert_int_equal(master.results, 4);
    assert_int_equal(master.left, TRAY_SLOTS);
    assert_true(master.held_up_left > 200);
    delete_tray(tray);
}

/* A result that is too long for a slot is sent in a message, even though the slot is empty. */
static void test_too_long_for_a_slot(void **state)
{
    enum { EDGE_LARGE = 64 };
    struct {
        struct lot_header header;
        struct tile tile;
    } large = {.header = {.answer_s = 1e9},
               .tile = {.id = 5, .w = EDGE_LARGE, .h = EDGE_LARGE, .step = 1}};
    const struct line lines[] = {SAID,    {TAG_MASTER_TO_RENDERER_TILES, &large, sizeof large},
                                 NOTHING, NOTHING,
                                 NOTHING, STOP};
    size_t bytes = result_bytes(&large.tile, EDGE_LARGE * EDGE_LARGE, false);
    assert_true(bytes > TRAY_RESULT_BYTES && bytes <= sizeof master.result);
    struct tray *tray = aligned_alloc(_Alignof(struct tray), sizeof *tray);
    tray_init(tray);
    follow_in(&(struct manner){.tray = tray, .edge = EDGE_LARGE}, lines,
              sizeof lines / sizeof *lines, 1);
    assert_true(master.results == 1 && master.left == 0 && master.result_bytes == bytes);
    tray_free(tray);
    free(tray);
}

/* With nowhere to put the next result, it calls the master, waits until one is taken, and counts that as sending. */
static void test_waits_for_a_buffer(void **state)
{
    struct lot_of_two calm = lot; /* half way through it nobody calls */
    calm.header.wakes_master = 0;
    struct line lines[2 + 3 * (SENDS + 1)] = {SAID};
    for (size_t i = 1; i + 1 < sizeof lines / sizeof *lines; i++)
        lines[i] = i % 3 == 1 ? (struct line){TAG_MASTER_TO_RENDERER_TILES, &calm, sizeof calm}
                              : (struct line)NOTHING;
    lines[sizeof lines / sizeof *lines - 1] = (struct line)STOP;
    follow_in(&(struct manner){.held_up = 400}, lines, sizeof lines / sizeof *lines, SENDS + 1);
    assert_int_equal(master.results, SENDS + 1);
    assert_true(master.was_called);
    assert_true(master.held_up_left == 0 && master.goodbye.send_s > 0.01);
}

/* A tile that takes long is reported, after the finished tiles are sent; when it is done, it is sent at once. The next
 * lot is sent as if nothing had been reported. With a tray or without. */
static void tell_of(uint32_t number, struct tray *tray)
{
    struct {
        struct lot_header header;
        float report_s[2];
        struct tile tiles[2];
    } long_lot = {.header = {.answer_s = 1e9, .reports = 2}, .report_s = {HUGE_VALF, HUGE_VALF}};
    memcpy(long_lot.tiles, lot.tiles, sizeof lot.tiles);
    long_lot.report_s[number] = 0;
    const struct line lines[] = {{TAG_MASTER_TO_RENDERER_START, &start, sizeof start},
                                 {TAG_MASTER_TO_RENDERER_TILES, &long_lot, sizeof long_lot},
                                 NOTHING, /* before the first tile */
                                 NOTHING, /* in it */
                                 {0, NULL, 200},
                                 LOT,
                                 NOTHING,
                                 NOTHING,
                                 STOP};
    size_t each = result_bytes(&lot.tiles[0], EDGE * EDGE / 2, false);
    follow_with(tray, lines, sizeof lines / sizeof *lines, 4);
    assert_int_equal(master.results, 4);
    assert_int_equal(master.left, tray ? 2 : 0);
    const struct result_header *told = &master.headers[number];
    assert_true(told->tile_id == lot.tiles[number].id && unfinished_valid(told));
    assert_int_equal(master.sizes[number], sizeof *told);
    for (uint32_t i = 0, result = 0; i < 2; i++, result++) {
        if (result == number) result++;
        assert_int_equal(master.headers[result].tile_id, lot.tiles[i].id);
        assert_int_equal(master.headers[result].pixels, EDGE * EDGE / 2);
        assert_int_equal(master.sizes[result], each);
    }
    assert_true(told->busy_s > 0 && master.headers[number + 1].busy_s >= told->busy_s);
    assert_true(master.sizes[3] == 2 * each && header_at(each).tile_id == lot.tiles[1].id);
    assert_int_equal(master.goodbye.bytes, 4 * each + sizeof *told);
}

/* A tile of each of two lots takes long, the last one of the second. What is finished of that is more, and has room;
 * where that of the first is still being sent, nothing of the second is reported. */
static void test_tells_of_two_lots(void **state)
{
    struct {
        struct lot_header header;
        float report_s[4];
        struct tile tiles[3];
    } lots[2];
    for (uint32_t k = 0; k < 2; k++) {
        lots[k].header = (struct lot_header){.answer_s = 1e9, .reports = 3};
        for (uint32_t i = 0; i < 3; i++) {
            lots[k].report_s[i] = i == k + 1 ? 0 : HUGE_VALF;
            lots[k].tiles[i] = (struct tile){.id = i, .y = 2 * i, .w = EDGE, .h = 2, .step = 1};
        }
    }
    struct line lines[20] = {SAID, {TAG_MASTER_TO_RENDERER_TILES, &lots[0], sizeof lots[0]}};
    for (size_t i = 2; i < 19; i++)
        lines[i] = (struct line){0, NULL, 200};
    lines[8] = (struct line){TAG_MASTER_TO_RENDERER_TILES, &lots[1], sizeof lots[1]};
    lines[19] = (struct line)STOP;
    size_t each = result_bytes(&lots[0].tiles[0], 2 * EDGE, false);
    for (unsigned late = 0; late <= 1; late++) {
        struct manner manner = {.held_up = 200 * late, .eager = each};
        follow_in(&manner, lines, sizeof lines / sizeof *lines, late ? 5 : 7);
        assert_int_equal(master.results, late ? 5 : 7);
        assert_true(master.sizes[0] == each && unfinished_valid(&master.headers[1]));
        assert_true(master.sizes[2] == each && master.sizes[3] == each);
        assert_int_equal(master.sizes[4], late ? 3 * each : 2 * each);
    }
}

/* A report ends no more than the answer that it precedes: the tiles after the reported one come together again. */
static void test_reports_one_tile_alone(void **state)
{
    struct {
        struct lot_header header;
        float report_s[4];
        struct tile tiles[3];
    } long_lot = {.header = {.answer_s = 1e9, .reports = 3}, .report_s = {0, HUGE_VALF, HUGE_VALF}};
    for (uint32_t i = 0; i < 3; i++)
        long_lot.tiles[i] = (struct tile){.id = i, .y = 2 * i, .w = EDGE, .h = 2, .step = 1};
    const struct line lines[] = {{TAG_MASTER_TO_RENDERER_START, &start, sizeof start},
                                 {TAG_MASTER_TO_RENDERER_TILES, &long_lot, sizeof long_lot},
                                 NOTHING, /* before the first tile */
                                 NOTHING, /* in it */
                                 {0, NULL, 200},
                                 NOTHING,
                                 NOTHING,
                                 NOTHING,
                                 NOTHING,
                                 STOP};
    size_t each = result_bytes(&long_lot.tiles[0], 2 * EDGE, false);
    follow(lines, sizeof lines / sizeof *lines, 3);
    assert_int_equal(master.results, 3);
    assert_true(unfinished_valid(&master.headers[0]) && master.headers[0].tile_id == 0);
    assert_true(master.sizes[1] == each && master.sizes[2] == 2 * each);
}

/* A tile that goes on and on is reported again only when it has taken twice as long. */
static void tell_again(unsigned held_up)
{
    enum { EDGE_LONG = 128, POLLS = 50 };
    struct {
        struct lot_header header;
        float report_s[2];
        struct tile tile;
    } long_lot = {.header = {.answer_s = 1e9, .reports = 1},
                  .tile = {.w = EDGE_LONG, .h = EDGE_LONG, .step = 1}};
    struct line lines[POLLS + 3] = {
        {TAG_MASTER_TO_RENDERER_START, &start, sizeof start},
        {TAG_MASTER_TO_RENDERER_TILES, &long_lot, sizeof long_lot},
    };
    for (size_t i = 2; i < POLLS + 2; i++)
        lines[i] = (struct line){0, NULL, 200};
    lines[POLLS + 2] = (struct line)STOP;
    follow_in(&(struct manner){.edge = EDGE_LONG, .held_up = held_up}, lines, POLLS + 3, 1);
    assert_true(master.results >= 1 && unfinished_valid(&master.headers[0]));
    for (unsigned i = 1; i < master.results && i < 8; i++) {
        assert_true(unfinished_valid(&master.headers[i]));
        assert_true(master.headers[i].busy_s >= 1.999 * master.headers[i - 1].busy_s);
    }
}

static void test_tells_again_seldom(void **state)
{
    tell_again(0);
    tell_again(20); /* not while the report before is being sent */
}

/* During a long lot the master polls in any case, and is not called. */
static void test_long_lot(void **state)
{
    struct lot_of_two long_lot = lot;
    long_lot.header.wakes_master = 0;
    const struct line lines[] = {{TAG_MASTER_TO_RENDERER_START, &start, sizeof start},
                                 {TAG_MASTER_TO_RENDERER_TILES, &long_lot, sizeof long_lot},
                                 NOTHING,
                                 NOTHING,
                                 NOTHING,
                                 NOTHING,
                                 STOP};
    follow(lines, sizeof lines / sizeof *lines, 1);
    assert_int_equal(master.results, 1);
    assert_false(master.was_called);
}

static void test_tells_of_what_takes_long(void **state)
{
    for (uint32_t number = 0; number < 2; number++) {
        struct tray *tray = new_tray();
        tell_of(number, NULL);
        tell_of(number, tray);
        delete_tray(tray);
    }
}

/* A result that is a little longer than MPI delivers eagerly is sent in two parts, the first with as many tiles as
 * fit. */
static void test_short_results(void **state)
{
    enum { TILES = 12 };
    struct {
        struct lot_header header;
        struct tile tiles[TILES];
    } many = {.header = {.answer_s = 1e9}};
    for (uint32_t i = 0; i < TILES; i++)
        many.tiles[i] = (struct tile){.id = i, .w = EDGE, .h = EDGE, .step = 1};
    size_t each = result_bytes(&many.tiles[0], EDGE * EDGE, false), fit = RESULT_SHORT / each;
    assert_true(fit < TILES && TILES < 2 * fit);
    struct line lines[2 * TILES + 2] = {
        {TAG_MASTER_TO_RENDERER_START, &start, sizeof start},
        {TAG_MASTER_TO_RENDERER_TILES, &many, sizeof many},
    };
    lines[2 * TILES + 1] = (struct line)STOP;
    follow(lines, 2 * TILES + 2, 2);
    assert_int_equal(master.results, 2);
    assert_int_equal(master.result_bytes, (TILES - fit) * each);
    assert_int_equal(header_at(0).tile_id, fit);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gives_up_what_is_finished),
        cmocka_unit_test(test_stops_in_a_tile),
        cmocka_unit_test(test_keeps_what_others_have),
        cmocka_unit_test(test_drops_what_is_not_begun),
        cmocka_unit_test(test_drops_several),
        cmocka_unit_test(test_tray),
        cmocka_unit_test(test_order),
        cmocka_unit_test(test_tray_is_checked),
        cmocka_unit_test(test_lot_headers_are_checked),
        cmocka_unit_test(test_lot_tiles_are_checked),
        cmocka_unit_test(test_largest_tile),
        cmocka_unit_test(test_refined_lot),
        cmocka_unit_test(test_refined_lots_are_checked),
        cmocka_unit_test(test_messages_are_checked),
        cmocka_unit_test(test_answers_once),
        cmocka_unit_test(test_many_lots),
        cmocka_unit_test(test_sleeps_until_it_is_woken),
        cmocka_unit_test(test_looks_now_and_then),
        cmocka_unit_test(test_looks_while_it_sends),
        cmocka_unit_test(test_renders_on_while_it_sends),
        cmocka_unit_test(test_too_long_for_a_slot),
        cmocka_unit_test(test_waits_for_a_buffer),
        cmocka_unit_test(test_tells_of_what_takes_long),
        cmocka_unit_test(test_tells_of_two_lots),
        cmocka_unit_test(test_reports_one_tile_alone),
        cmocka_unit_test(test_tells_again_seldom),
        cmocka_unit_test(test_long_lot),
        cmocka_unit_test(test_short_results),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
