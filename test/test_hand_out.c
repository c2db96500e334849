/* What the master tells a renderer, and what it makes of its answers: MPI is played by this file. */
#include <math.h>
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
#include "common/tray.h"
#include "master/server.h"
#include "test/arrivals_fixture.h"
#include "test/fatal.h"
#include "test/mpi_done.h"

/* Renderer 0 is rank 0's own, 1 is the one that is told. */
#define RENDERERS 2

/* What was sent to renderer 1 since the last look. */
static struct {
    uint32_t lots, starts, stops;
    struct lot_header headers[4];
    uint32_t drops, drop_messages;
    struct drop drop[8 * LOT_TILES];
    char lot[TILES_MAX_BYTES]; /* the last one */
} sent;

/* What comes from it next. */
static struct {
    int tag; /* 0: nothing does */
    size_t size;
    char bytes[1 << 20];
} letter;

/* ---- the calls of master/post.c ---- */

/* Any that is not MPI_REQUEST_NULL. */
#define REQUEST ((MPI_Request)0x77000001)

/* Where the next message goes: with one other rank there is one receive. */
static char *receive;

int MPI_Comm_size(MPI_Comm comm, int *size)
{
    (void)comm;
    *size = RENDERERS;
    return MPI_SUCCESS;
}

int MPI_Irecv(void *buffer, int count, MPI_Datatype type, int source, int tag, MPI_Comm comm,
              MPI_Request *request)
{
    (void)count, (void)type, (void)source, (void)tag, (void)comm;
    receive = buffer;
    *request = REQUEST;
    return MPI_SUCCESS;
}

int MPI_Testsome(int count, MPI_Request *requests, int *done, int *slots, MPI_Status *statuses)
{
    (void)count, (void)requests;
    *done = letter.tag != 0;
    if (!*done) return MPI_SUCCESS;
    assert_non_null(receive);
    memcpy(receive, letter.bytes, letter.size);
    receive = NULL; /* until there is another receive */
    slots[0] = 0;
    statuses[0].MPI_SOURCE = 1;
    statuses[0].MPI_TAG = letter.tag;
    letter.tag = 0;
    return MPI_SUCCESS;
}

int MPI_Get_count(const MPI_Status *status, MPI_Datatype type, int *count)
{
    (void)status, (void)type;
    *count = (int)letter.size;
    return MPI_SUCCESS;
}

static void note_drops(const struct drop *drops, size_t bytes)
{
    assert_true(drop_message_valid(drops, bytes));
    memcpy(sent.drop + sent.drops, drops, bytes);
    sent.drops += (uint32_t)(bytes / sizeof *drops);
    sent.drop_messages++;
}

int MPI_Isend(const void *buffer, int count, MPI_Datatype type, int rank, int tag, MPI_Comm comm,
              MPI_Request *request)
{
    (void)type, (void)comm;
    *request = REQUEST;
    assert_int_equal(rank, 1);
    sent.stops += tag == TAG_MASTER_TO_RENDERER_STOP;
    sent.starts += tag == TAG_MASTER_TO_RENDERER_START;
    if (tag == TAG_MASTER_TO_RENDERER_DROP) note_drops(buffer, (size_t)count);
    if (tag != TAG_MASTER_TO_RENDERER_TILES) return MPI_SUCCESS;
    assert_true(sent.lots < 4 && (size_t)count > sizeof *sent.headers);
    memcpy(&sent.headers[sent.lots], buffer, sizeof *sent.headers);
    memcpy(sent.lot, buffer, (size_t)count);
    assert_true(lot_header_valid(&sent.headers[sent.lots++]));
    return MPI_SUCCESS;
}

/* ---- a farm of two renderers ---- */

struct farm {
    struct contact contacts[RENDERERS];
    struct drops drops[RENDERERS];
    struct renderer_stats stats[RENDERERS];
    struct tray *trays[RENDERERS];
    struct arrivals *arrivals;
    struct canvas canvas;
    struct watch watch;
    struct service service;
    struct server server;
};

static struct farm *farm_open(const struct queue_config *config)
{
    struct farm *farm = calloc(1, sizeof *farm);
    assert_non_null(farm);
    canvas_init(&farm->canvas, config->width, config->height);
    farm->arrivals = arrivals_create(RENDERERS);
    farm->service = (struct service){.queue = queue_create(config),
                                     .canvas = &farm->canvas,
                                     .watch = &farm->watch,
                                     .trays = farm->trays,
                                     .arrivals = farm->arrivals,
                                     .stats = farm->stats,
                                     .patience = 60};
    farm->server = (struct server){.service = &farm->service,
                                   .start = clock_wall(),
                                   .woken = clock_wall(),
                                   .last_pass = true,
                                   .first_remote = 1,
                                   .flag_words = arrivals_words(RENDERERS),
                                   .renderers = RENDERERS,
                                   .post = post_open(sizeof letter.bytes),
                                   .contacts = farm->contacts,
                                   .drops = farm->drops,
                                   .message = calloc(TILES_MAX_BYTES, 1)};
    assert_int_equal(pthread_mutex_init(&farm->server.lock, NULL), 0);
    memset(&sent, 0, sizeof sent);
    letter.tag = 0;
    letter.size = 0;
    return farm;
}

static void farm_close(struct farm *farm)
{
    pthread_mutex_destroy(&farm->server.lock);
    post_close(farm->server.post, true);
    preview_free(&farm->server.preview);
    queue_destroy(farm->service.queue);
    canvas_free(&farm->canvas);
    free(farm->arrivals);
    free(farm->server.sampled);
    free(farm->server.message);
    free(farm);
}

/* Seconds by which everything is overdue. */
#define LONG_AFTER 1e3

/* Renderer 0 asks for a lot, and finishes it; returns whether it got any. */
static bool other_goes_on(struct farm *farm)
{
    struct queue *queue = farm->service.queue;
    struct tile lot[LOT_TILES];
    double now = server_elapsed(&farm->server);
    uint32_t count = queue_next(queue, 0, now, lot);
    for (uint32_t i = 0; i < count; i++)
        queue_finish(queue, 0, lot[i].id, now, 1e-4);
    return count > 0;
}

/* All that renderer 1 has is done, each tile in so many seconds of rendering. */
static void finish_all(struct server *server, double seconds)
{
    struct queue *queue = server->service->queue;
    struct tile tile;
    for (uint32_t id = 0; queue_tile_count(queue, 1) > 0; id++)
        if (queue_find_held(queue, 1, id, &tile))
            queue_finish(queue, 1, id, server_elapsed(server), seconds);
}

/* Renderer 1 was quick, has got many tiles, and does not answer: others may have them. */
static void fall_silent(struct farm *farm)
{
    hand_out(&farm->server, 1);
    finish_all(&farm->server, 1e-4);
    hand_out(&farm->server, 1);
    farm->server.start -= LONG_AFTER;
    queue_look(farm->service.queue, server_elapsed(&farm->server));
}

/* A part of a RESULT for a tile that renderer 1 has, behind what is in the letter; of the pixels only the room
 * is there. */
static void write_part(const struct tile *tile, struct result_header header)
{
    header.tile_id = tile->id;
    memcpy(letter.bytes + letter.size, &header, sizeof header);
    if (header.pixels > tile_pixels(tile))
        letter.size += sizeof header;
    else
        letter.size += result_bytes(tile, header.pixels, false);
    assert_true(letter.size <= sizeof letter.bytes);
}

/* The first tile that renderer 1 has; false: it has none. */
static bool first_held(const struct farm *farm, struct tile *tile)
{
    if (queue_tile_count(farm->service.queue, 1) == 0) return false;
    uint32_t id = 0;
    while (!queue_find_held(farm->service.queue, 1, id, tile))
        id++;
    return true;
}

/* What is in the letter comes from renderer 1: results. */
static void arrive(struct farm *farm)
{
    letter.tag = TAG_RENDERER_TO_MASTER_RESULT;
    memset(&sent, 0, sizeof sent);
    assert_true(take_in(&farm->server));
    letter.size = 0;
}

/* Another message from it does. */
static void arrive_as(struct farm *farm, int tag, const void *bytes, size_t size)
{
    memset(&sent, 0, sizeof sent);
    memcpy(letter.bytes, bytes, size);
    letter.tag = tag;
    letter.size = size;
    assert_true(take_in(&farm->server));
    letter.size = 0;
}

/* So many that lots are large. */
static const struct queue_config small_tiles = {
    .width = 128, .height = 64, .renderers = RENDERERS, .tile_edge = 4};

/* ---- the tests ---- */

/* Whether renderer 1 is to call half way: before anything is known, and when each tile has taken it so long. */
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
            assert_int_equal(sent.headers[i].calls, known ? calls : 1);
        finish_all(&farm->server, seconds);
    }
    farm_close(farm);
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
    struct farm *farm = farm_open(&config);
    struct contact *contact = &farm->contacts[1];
    look_for_silence(&farm->server);
    assert_false(contact->is_silent);
    contact->heard = -61;
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

/* However short the patience is, who is asked has time to answer. */
static void test_who_is_asked(void **state)
{
    (void)state;
    struct farm *farm = farm_open(&small_tiles);
    struct contact *contact = &farm->contacts[1];
    farm->service.patience = 0.5;
    contact->is_ready = true;
    for (double heard = 0; heard >= -0.5; heard -= 0.125) {
        contact->heard = heard - 0.0625;
        farm->server.next_look = farm->server.awake = 0;
        farm->server.woken = clock_wall();
        look_for_silence(&farm->server);
        assert_int_equal(contact->is_asked, heard < -0.125);
        assert_int_equal(contact->is_silent, heard < -0.375);
    }
    farm_close(farm);
}

/* Nobody is left who renders when all are silent, one is not enough; rank 0 itself never is. */
static void test_who_is_left(void **state)
{
    (void)state;
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

/* ---- recalls ---- */

/* How often it was told of this tile, that it is finished or that somebody else has it. */
static unsigned count_told(uint32_t id, bool finished)
{
    unsigned count = 0;
    for (uint32_t i = 0; i < sent.drops; i++)
        count += sent.drop[i].tile_id == id && sent.drop[i].finished == finished;
    return count;
}

/* In one turn of the loop it hears of all that others have done for it, once, in as few messages as may be. */
static void test_recalls(void **state)
{
    (void)state;
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

/* To one who does not answer messages do not pile up; when it does, it hears of the rest. */
static void test_recalls_end(void **state)
{
    (void)state;
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

/* ---- trays ---- */

/* Pass 0 is in, renderer 0 has done it; halves differ, so that all pixels are in the next one. */
static void finish_first_pass(struct farm *farm)
{
    uint32_t pixels = farm->canvas.width * farm->canvas.height;
    struct tile all = {.w = farm->canvas.width, .h = farm->canvas.height, .step = 1, .pass = 1};
    float *part = calloc(pixels, REFINED_FLOATS * sizeof *part);
    for (uint32_t i = 3 * pixels; i < 6 * pixels; i++)
        part[i] = 0.1f;
    adaptive_put(farm->service.adaptive, &all, part, 1);
    free(part);
    assert_true(adaptive_plan(farm->service.adaptive, HUGE_VAL));
    while (other_goes_on(farm))
        ;
    queue_add(farm->service.queue, &all, 1, 1);
}

/* How a run stands that comes to the end of a pass: two of its three processors have rendered all the time. */
struct standing {
    double elapsed, left; /* wall seconds */
    unsigned passes;      /* that are in */
    double earlier;       /* seconds of processors' time, by an earlier run */
};

/* Of pixels that are as uneven as a picture's are. */
static void put_uneven_pass(struct farm *farm, double seconds)
{
    uint32_t pixels = farm->canvas.width * farm->canvas.height;
    struct tile all = {.w = farm->canvas.width, .h = farm->canvas.height, .step = 1, .pass = 1};
    uint32_t in = adaptive_pixels(farm->service.adaptive, &all);
    float *part = calloc(pixels, REFINED_FLOATS * sizeof *part);
    for (uint32_t i = 0; i < 3 * in; i++)
        part[3 * in + i] = (float)exp2(-0.07 * (i % 97));
    for (uint32_t i = 0; i < in; i++)
        part[6 * in + i] = part[3 * in + 3 * i];
    adaptive_put(farm->service.adaptive, &all, part, seconds);
    free(part);
}

/* Samples that it then asks for, in seconds that as many took in the last pass; 0: none, as that would come too
 * late. *took: wall seconds, which pass for the run as well. */
static double asked_for(struct standing standing, double *took)
{
    struct farm *farm = farm_open(&small_tiles);
    struct view view = {.min_samples = 4, .max_samples = 4096};
    uint32_t pixels = farm->canvas.width * farm->canvas.height;
    struct tile all = {.w = farm->canvas.width, .h = farm->canvas.height, .step = 1};
    struct adaptive *adaptive = adaptive_create(&view, &farm->canvas, 1e-5);
    farm->service.adaptive = adaptive;
    double rendered = standing.earlier + 2 * standing.elapsed, samples = 4 * pixels;
    for (unsigned i = 1; i <= standing.passes; i++) {
        put_uneven_pass(farm, i == standing.passes ? rendered : 0);
        if (i == standing.passes) break;
        assert_true(adaptive_plan(adaptive, HUGE_VAL));
        samples = adaptive_work(adaptive, &all).samples;
    }
    while (other_goes_on(farm))
        ;
    farm->watch = (struct watch){.canvas = &farm->canvas, .adaptive = adaptive, .first_samples = 4};
    assert_true(watch_start(&farm->watch, NULL));
    farm->service.processors = 3;
    farm->server.rendered_before = standing.earlier;
    farm->server.last_pass = false;
    double now = clock_wall();
    farm->service.deadline = now + standing.left;
    farm->server.start = now - standing.elapsed;
    follow_passes(&farm->server);
    *took = clock_wall() - now;
    assert_false(farm->server.last_pass);
    double seconds = adaptive_work(adaptive, &all).samples / samples * rendered;
    assert_true((seconds > 0) == !queue_complete(farm->service.queue));
    watch_free(&farm->watch);
    adaptive_destroy(adaptive);
    farm_close(farm);
    return seconds;
}

static void check_asked(struct standing standing, double least, double most)
{
    double seconds = 0, took = HUGE_VAL;
    /* Once more where the test was kept waiting: half of what is taken for work before anything is known (0.01 s). */
    for (int attempt = 0; attempt < 100 && took > 0.005; attempt++)
        seconds = asked_for(standing, &took);
    if (!(seconds >= least && seconds <= most))
        fail_msg("%g s are asked for where %g are left", seconds, standing.left);
}

/* Half of the time that is left, as far as processors are busy, behind pass 0; then nine tenths. At the end
 * somewhat more than there is, but no plan that comes too late. Samples that come later last longer, and
 * less where a pixel gets more at a time. */
static void test_pass_fits_the_time(void **state)
{
    (void)state;
    check_asked((struct standing){10, 4, 1, 0}, 1.5, 4);
    check_asked((struct standing){10, 20, 1, 0}, 9, 20);
    check_asked((struct standing){10, HUGE_VAL, 1, 0}, 100, HUGE_VAL);
    check_asked((struct standing){10, 4, 2, 0}, 5, 9);
    check_asked((struct standing){10, 0.7, 1, 0}, 0.7, 1.5);
    check_asked((struct standing){10, 0, 1, 0}, 0, 0);
    /* All three will render: what an earlier run's have done is not this one's. */
    check_asked((struct standing){0, 4, 1, 20}, 2.3, 6);
}

/* Of a time limit so much is kept as its end takes, but no more than half. */
static void test_time_is_kept(void **state)
{
    (void)state;
    struct farm *farm = farm_open(&small_tiles);
    struct service *service = &farm->service;
    service->images[0] = "picture.png";
    estimate_writing(&farm->server, false);
    assert_true(service->writing_s == 0); /* there is no limit */
    service->limit = 10;
    service->deadline = 100;
    estimate_writing(&farm->server, false);
    assert_true(service->writing_s > 0);
    service->writing_s = 2;
    service->last_plan_s = 0.5;
    farm->server.fill_s = 0.25;
    assert_true(rendering_ends(&farm->server) == 97.25);
    service->writing_s = 5;
    assert_true(rendering_ends(&farm->server) == 95);
    farm_close(farm);
}

/* Whether the last lot is one tile, of which all pixels get samples. */
static bool is_refined_lot(void)
{
    struct lot_header header;
    struct tile tile;
    static struct refinement refinements[TILE_MAX_PIXELS];
    memcpy(&header, sent.lot, sizeof header);
    const char *at = sent.lot + sizeof header + lot_tells_bytes(header.tells);
    memcpy(&tile, at, sizeof tile);
    memcpy(refinements, at + sizeof tile, tile_pixels(&tile) * sizeof *refinements);
    return refinements_valid(refinements, tile_pixels(&tile), LEVEL_MAX) &&
           refinements_sampled(refinements, tile_pixels(&tile)) == tile_pixels(&tile);
}

/* A lot goes through the tray if it is free, and has room: what a pass asks for of each pixel has not. */
static void test_trays(void **state)
{
    (void)state;
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
        assert_int_equal(tray->said, refined ? 1 : TRAY_SLOTS);
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

/* Those who have one lot of the two that they may have, as nothing waited, get another when there is more. */
static void test_news(void **state)
{
    (void)state;
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

/* Renderer 1 has nothing to do, and had better not take what another one is about to finish: it gets it
 * when that is overdue, though nothing has come. */
static void test_idle_get_what_is_overdue(void **state)
{
    (void)state;
    const struct queue_config config = {.width = 32, .height = 32, .renderers = 4, .tile_edge = 8};
    struct farm *farm = farm_open(&config);
    struct queue *queue = farm->service.queue;
    struct tile lot[LOT_TILES];
    farm->contacts[1].is_ready = true;
    uint32_t count = queue_next(queue, 0, 0, lot);
    for (int i = 0; i < 100; i++)
        queue_served(queue, 10, 0); /* an answer is dear: so is a short lot */
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

/* It hears once that it is to stop, and nothing of work afterwards, even when it reports for work only then. */
static void test_stop(void **state)
{
    (void)state;
    struct farm *farm = farm_open(&small_tiles);
    const struct ready ready = {.rank = 1, .host = "host"};
    tell_stop(&farm->server, 1);
    tell_stop(&farm->server, 1);
    assert_int_equal(sent.stops, 1);
    arrive_as(farm, TAG_RENDERER_TO_MASTER_READY, &ready, sizeof ready);
    assert_true(farm->contacts[1].is_ready && sent.starts == 0 && sent.lots == 0);
    assert_string_equal(farm->stats[1].host, "host");
    farm_close(farm);
}

/* ---- answers ---- */

/* What is known of a renderer that leaves without a word: what it has brought into the picture. */
static void test_answers_are_counted(void **state)
{
    (void)state;
    struct farm *farm = farm_open(&small_tiles);
    const struct renderer_stats *stats = &farm->stats[1];
    struct tile tile;
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
        assert_true(stats->counts.rays[0] == 3 * i && farm->service.counts.rays[0] == 3 * i);
    }
    assert_int_equal(render_counts_rays(&farm->service.counts), 3 * 9); /* of which the bar tells */
    assert_true(farm->service.messages == 9 && farm->server.pixels == 16 * 9);
    assert_int_equal(farm->service.answers, 2); /* one of eight is measured */
    farm_close(farm);
}

/* A tile that was dropped before it was begun was no rendering; one that takes long may be back already. */
static void test_what_is_not_finished(void **state)
{
    (void)state;
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
    farm_close(farm);
}

/* The first result, of so many bytes, lies in the renderer's tray; the master looks. */
static void leave_in_tray(struct farm *farm, uint32_t bytes)
{
    slots_fill(&farm->trays[1]->results, 0, bytes);
    arrivals_leave(farm->arrivals, 1);
    assert_true(take_in(&farm->server));
}

/* What lies in the tray is taken, and its place is free again. */
static void test_answer_in_a_tray(void **state)
{
    (void)state;
    struct farm *farm = farm_open(&small_tiles);
    struct tray *tray = aligned_alloc(64, sizeof *tray);
    struct tile tile;
    tray_init(tray);
    farm->trays[1] = tray;
    hand_out(&farm->server, 1);
    assert_true(first_held(farm, &tile));
    write_part(&tile, (struct result_header){.pixels = 16, .busy_s = 1});
    memcpy(tray->result[0], letter.bytes, letter.size);
    farm->server.awake = 3;
    leave_in_tray(farm, (uint32_t)letter.size);
    assert_true(farm->contacts[1].heard == 3);
    assert_true(farm->stats[1].tiles == 1 && slots_bytes(&tray->results, 0) == 0);
    tray_free(tray);
    free(tray);
    farm_close(farm);
}

/* It is heard of, and counted when it has said goodbye. */
static void test_goodbye(void **state)
{
    (void)state;
    struct farm *farm = farm_open(&small_tiles);
    struct contact *contact = &farm->contacts[1];
    farm->server.awake = 3;
    arrive_as(farm, TAG_RENDERER_TO_MASTER_PONG, "", 0);
    assert_true(contact->heard == 3 && sent.lots == 0);
    farm->service.ending = true;
    const struct renderer_stats stats = {.rank = 1, .tiles = 5, .host = "host"};
    arrive_as(farm, TAG_RENDERER_TO_MASTER_STATS, &stats, sizeof stats);
    assert_true(contact->is_gone && farm->stats[1].tiles == 5);
    farm_close(farm);
}

/* Probes are no part of the picture: they cost time, and that is all. */
static void test_probes_are_not_counted(void **state)
{
    (void)state;
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
    assert_true(stats->busy_s == 2 && stats->cpu_s == 1 && farm->service.probe_s == 2);
    assert_true(stats->tiles == 0 && stats->pixels == 0 && stats->finish_s == 7);
    farm_close(farm);
}

/* Messages that make no sense, from a renderer that has tiles, some of which others have, too. */
enum wrong {
    DROP_UNASKED,
    DROPPED_IN_NO_TIME,
    RESULT_TOO_LONG,
    RESULT_TOO_SHORT,
    RESULT_WITHOUT_PIXELS,
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
    write_part(&tile, header);
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

/* They end the run, with a line that says so. */
static void test_wrong_messages(void **state)
{
    (void)state;
    static const char *const said[] = {
        [RESULT_EMPTY] = "rank 1 sent a result that is not valid",
        [RESULT_OF_OTHERS] = "rank 1 sent a result for a tile that it was not asked for",
        [TRAY_TOO_LONG] = "rank 1 left a result that makes no sense",
        [READY_AGAIN] = "rank 1 reported for work in a way that makes no sense",
        [STATS_EARLY] = "rank 1 sent statistics that make no sense",
        [PONG_LONG] = "rank 1 sent a message of unknown kind 9",
        [OTHER_KIND] = "rank 1 sent a message of unknown kind 99"};
    struct farm *farm = farm_open(&small_tiles);
    struct tray *tray = aligned_alloc(64, sizeof *tray);
    tray_init(tray);
    farm->trays[1] = tray;
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
    tray_free(tray);
    free(tray);
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

/* Of a pass exactly those pixels are expected that were asked for: others would get their samples. */
static void test_less_than_asked(void **state)
{
    (void)state;
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
        cmocka_unit_test(test_who_calls),
        cmocka_unit_test(test_who_is_silent),
        cmocka_unit_test(test_who_is_asked),
        cmocka_unit_test(test_who_is_left),
        cmocka_unit_test(test_recalls),
        cmocka_unit_test(test_recalls_end),
        cmocka_unit_test(test_pass_fits_the_time),
        cmocka_unit_test(test_time_is_kept),
        cmocka_unit_test(test_trays),
        cmocka_unit_test(test_news),
        cmocka_unit_test(test_idle_get_what_is_overdue),
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_answers_are_counted),
        cmocka_unit_test(test_probes_are_not_counted),
        cmocka_unit_test(test_what_is_not_finished),
        cmocka_unit_test(test_answer_in_a_tray),
        cmocka_unit_test(test_goodbye),
        cmocka_unit_test(test_wrong_messages),
        cmocka_unit_test(test_less_than_asked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
