/* A master with two renderers: 0 is its own, 1 is on another rank. The MPI functions are defined here, for one source
 * file of a test: they keep in `sent` what the master sends to renderer 1, and deliver what is in `letter`. */
#ifndef FARM_TEST_MASTER_FIXTURE_H
#define FARM_TEST_MASTER_FIXTURE_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/clock.h"
#include "common/tray.h"
#include "master/server.h"
#include "test/arrivals_fixture.h"
#include "test/mpi_done.h"
#include "test/unit.h"

/* Renderer 0 is rank 0's own, 1 is on rank 1. */
#define RENDERERS 2

/* What the master has sent to renderer 1 since this was last cleared. */
static struct {
    uint32_t lots, starts, stops;
    struct start start; /* the last one */
    struct lot_header headers[4];
    uint32_t drops, drop_messages;
    struct drop drop[8 * LOT_TILES];
    char lot[TILES_MAX_BYTES]; /* the last one */
} sent;

/* The message of renderer 1 that arrives next. */
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

static inline void note_drops(const struct drop *drops, size_t bytes)
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
    if (tag == TAG_MASTER_TO_RENDERER_START) memcpy(&sent.start, buffer, sizeof sent.start);
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
    struct drop drops[RENDERERS][DROP_TILES];
    struct renderer_stats stats[RENDERERS];
    struct tray *trays[RENDERERS];
    struct arrivals *arrivals;
    struct canvas canvas;
    struct watch watch;
    struct service service;
    struct served served;
    struct server server;
};

static inline struct farm *farm_open(const struct queue_config *config)
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
                                     .patience = 60,
                                     .start_patience = 60};
    farm->server = (struct server){.service = &farm->service,
                                   .served = &farm->served,
                                   .start = clock_wall(),
                                   .woken_at = clock_wall(),
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

static inline void farm_close(struct farm *farm)
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
static inline bool other_goes_on(struct farm *farm)
{
    struct queue *queue = farm->service.queue;
    struct tile lot[LOT_TILES];
    double now = server_elapsed(&farm->server);
    uint32_t count = queue_next(queue, 0, now, lot);
    for (uint32_t i = 0; i < count; i++)
        queue_finish(queue, 0, lot[i].id, now, 1e-4);
    return count > 0;
}

/* Renderer 1 finishes all tiles that it holds, each in so many seconds. */
static inline void finish_all(struct server *server, double seconds)
{
    struct queue *queue = server->service->queue;
    struct tile tile;
    for (uint32_t id = 0; queue_tile_count(queue, 1) > 0; id++)
        if (queue_find_held(queue, 1, id, &tile))
            queue_finish(queue, 1, id, server_elapsed(server), seconds);
}

/* Renderer 1 was quick, has got many tiles, and does not answer any more: others may take them over. */
static inline void fall_silent(struct farm *farm)
{
    hand_out(&farm->server, 1);
    finish_all(&farm->server, 1e-4);
    hand_out(&farm->server, 1);
    farm->server.start -= LONG_AFTER;
    queue_look(farm->service.queue, server_elapsed(&farm->server));
}

/* Appends to the letter what a RESULT says of a tile that renderer 1 holds. The bytes of the pixels are not written. */
static inline void write_part(const struct tile *tile, struct result_header header)
{
    header.tile_id = tile->id;
    memcpy(letter.bytes + letter.size, &header, sizeof header);
    if (header.pixels > tile_pixels(tile))
        letter.size += sizeof header;
    else
        letter.size += result_bytes(tile, header.pixels, false);
    assert_true(letter.size <= sizeof letter.bytes);
}

/* Sets *tile to the first tile that renderer 1 holds; false: it holds none. */
static inline bool first_held(const struct farm *farm, struct tile *tile)
{
    if (queue_tile_count(farm->service.queue, 1) == 0) return false;
    uint32_t id = 0;
    while (!queue_find_held(farm->service.queue, 1, id, tile))
        id++;
    return true;
}

/* The letter arrives as a RESULT of renderer 1. */
static inline void arrive(struct farm *farm)
{
    letter.tag = TAG_RENDERER_TO_MASTER_RESULT;
    memset(&sent, 0, sizeof sent);
    assert_true(take_in(&farm->server));
    letter.size = 0;
}

/* A message of another kind arrives from renderer 1. */
static inline void arrive_as(struct farm *farm, int tag, const void *bytes, size_t size)
{
    memset(&sent, 0, sizeof sent);
    memcpy(letter.bytes, bytes, size);
    letter.tag = tag;
    letter.size = size;
    assert_true(take_in(&farm->server));
    letter.size = 0;
}

/* So many tiles that lots are large. */
static const struct queue_config small_tiles = {
    .width = 128, .height = 64, .renderers = RENDERERS, .tile_edge = 4};

/* Renderer 0 has finished pass 0. The halves of all pixels differ, so that the next pass asks for all of them. */
static inline void finish_first_pass(struct farm *farm)
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

#endif
