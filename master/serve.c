#include "master/serve.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/message.h"
#include "common/nap.h"

/* Receives posted ahead, so that results land without waiting for us and nothing piles up in MPI's
 * queue of unexpected messages. */
#define RECEIVES 16

struct server {
    struct service *service;
    double start;
    double finished; /* when the last tile came in */

    /* Shared with the rendering thread, under lock: queue, canvas, watch, and the counts below. */
    pthread_mutex_t lock;
    uint64_t rays;
    bool own_done;

    /* Main thread only. */
    uint32_t first_rank; /* of renderer 0 */
    uint32_t renderers, remote, left;
    bool *told;    /* per renderer: that it is to stop */
    bool *is_gone; /* per renderer: its statistics are here */
    bool stopped;  /* by a signal: tiles may stay unfinished */
    int receives;
    size_t buffer_bytes;
    char *buffers[RECEIVES];
    MPI_Request requests[RECEIVES];
};

static void post_receive(struct server *server, int slot)
{
    MPI_Irecv(server->buffers[slot], (int)server->buffer_bytes, MPI_BYTE, MPI_ANY_SOURCE,
              MPI_ANY_TAG, server->service->comm, &server->requests[slot]);
}

static void post_receives(struct server *server)
{
    size_t largest = queue_largest_tile(server->service->queue);
    server->buffer_bytes = sizeof(struct result_header) + largest * 3 * sizeof(float);
    if (server->buffer_bytes < sizeof(struct renderer_stats))
        server->buffer_bytes = sizeof(struct renderer_stats);
    server->receives = server->remote < RECEIVES ? (int)server->remote : RECEIVES;
    for (int i = 0; i < server->receives; i++) {
        server->buffers[i] = allocate(server->buffer_bytes, 1);
        post_receive(server, i);
    }
}

static void cancel_receives(struct server *server)
{
    for (int i = 0; i < server->receives; i++) {
        MPI_Cancel(&server->requests[i]);
        MPI_Wait(&server->requests[i], MPI_STATUS_IGNORE);
        free(server->buffers[i]);
    }
}

static void tell_stop(struct server *server, uint32_t renderer)
{
    if (server->told[renderer]) return;
    server->told[renderer] = true;
    MPI_Send(NULL, 0, MPI_BYTE, (int)(server->first_rank + renderer), TAG_MASTER_TO_RENDERER_STOP,
             server->service->comm);
}

/* Gives a remote renderer all the tiles that it may hold, or tells it that there are no more. */
static void hand_out(struct server *server, uint32_t renderer)
{
    struct service *service = server->service;
    int rank = (int)(server->first_rank + renderer);
    struct tile tile;
    bool more, holds_some = false;
    do {
        pthread_mutex_lock(&server->lock);
        more = queue_next(service->queue, renderer, &tile);
        if (!more) holds_some = queue_holds(service->queue, renderer) > 0;
        pthread_mutex_unlock(&server->lock);
        if (more)
            MPI_Send(&tile, sizeof tile, MPI_BYTE, rank, TAG_MASTER_TO_RENDERER_TILE,
                     service->comm);
    } while (more);
    /* A renderer with nothing to do gets nothing only when nothing is left for it. */
    if (!holds_some) tell_stop(server, renderer);
}

/* A finished tile goes into the picture; the lock is held. */
static void accept_tile(struct server *server, uint32_t renderer, const struct tile *tile,
                        const float *rgb, const struct result_header *header)
{
    struct service *service = server->service;
    if (service->timeline) timeline_add(service->timeline, LOT_TILE, renderer, tile, header);
    canvas_put(service->canvas, tile, rgb);
    queue_finish(service->queue, renderer, tile->id);
    server->rays += render_counts_rays(&header->counts);
    watch_add(service->watch, tile_pixels(tile), &header->counts);
    server->finished = clock_wall();
}

static void take_result(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    struct result_header header;
    struct tile tile;
    if (bytes < sizeof header) fatal("renderer %u sent a result of %zu bytes", renderer, bytes);
    memcpy(&header, message, sizeof header);
    pthread_mutex_lock(&server->lock);
    bool held = queue_held(server->service->queue, renderer, header.tile_id, &tile);
    bool valid = held && result_message_valid(&header, bytes, &tile);
    if (valid) {
        /* Behind the header, which is a multiple of 8 bytes long, in an allocated block: aligned.
         */
        const float *rgb = (const void *)(message + sizeof header);
        accept_tile(server, renderer, &tile, rgb, &header);
    }
    pthread_mutex_unlock(&server->lock);
    if (!valid)
        fatal("renderer %u sent a result for tile %u that it was not asked for", renderer,
              header.tile_id);
    hand_out(server, renderer);
}

static void take_stats(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    struct renderer_stats stats;
    if (bytes == sizeof stats) memcpy(&stats, message, sizeof stats);
    int rank = (int)(server->first_rank + renderer);
    pthread_mutex_lock(&server->lock);
    bool due = server->stopped || queue_holds(server->service->queue, renderer) == 0;
    pthread_mutex_unlock(&server->lock);
    if (bytes != sizeof stats || !stats_message_valid(&stats, bytes, rank) || !due ||
        server->is_gone[renderer])
        fatal("renderer %u sent statistics that make no sense", renderer);
    server->service->stats[renderer] = stats;
    server->is_gone[renderer] = true;
    server->left++;
}

static void take_message(struct server *server, int slot, const MPI_Status *status)
{
    int bytes;
    MPI_Get_count(status, MPI_BYTE, &bytes);
    uint32_t renderer = (uint32_t)status->MPI_SOURCE - server->first_rank;
    if (status->MPI_SOURCE <= 0 || renderer >= server->renderers || bytes < 0)
        fatal("a message came from rank %d, who is no renderer", status->MPI_SOURCE);
    server->service->messages++;
    const char *message = server->buffers[slot];
    if (status->MPI_TAG == TAG_RENDERER_TO_MASTER_RESULT)
        take_result(server, renderer, message, (size_t)bytes);
    else if (status->MPI_TAG == TAG_RENDERER_TO_MASTER_STATS)
        take_stats(server, renderer, message, (size_t)bytes);
    else
        fatal("rank %d sent a message of unknown kind %d", status->MPI_SOURCE, status->MPI_TAG);
    post_receive(server, slot);
}

/* Handles all that has arrived; returns whether there was anything. */
static bool receive(struct server *server)
{
    if (server->receives == 0) return false;
    int slots[RECEIVES], count;
    MPI_Status statuses[RECEIVES];
    MPI_Testsome(server->receives, server->requests, &count, slots, statuses);
    for (int i = 0; i < count; i++)
        take_message(server, slots[i], &statuses[i]);
    return count > 0;
}

/* ---- the master's own renderer ---- */

static bool own_next(struct server *server, struct tile *tile)
{
    pthread_mutex_lock(&server->lock);
    bool more = queue_next(server->service->queue, 0, tile);
    pthread_mutex_unlock(&server->lock);
    return more;
}

static void own_leave(struct server *server)
{
    pthread_mutex_lock(&server->lock);
    server->own_done = true;
    pthread_mutex_unlock(&server->lock);
}

/* The second thread of rank 0. It takes tiles straight from the queue and never calls MPI. */
static void *render_own(void *argument)
{
    struct server *server = argument;
    struct service *service = server->service;
    struct renderer_stats *stats = &service->stats[0];
    float *rgb = allocate(queue_largest_tile(service->queue), 3 * sizeof *rgb);
    double cpu = clock_thread_cpu();
    struct tile tile;
    while (own_next(server, &tile)) {
        struct render_counts counts;
        double begin = clock_wall(), begin_cpu = clock_thread_cpu();
        if (!service->own->render(service->own->state, &tile, rgb, &counts)) break;
        double end = clock_wall();
        stats->busy_s += end - begin;
        stats->finish_s = end - server->start;
        stats->tiles++;
        stats->pixels += tile_pixels(&tile);
        render_counts_add(&stats->counts, &counts);
        struct result_header header = {.counts = counts,
                                       .start_s = begin - server->start,
                                       .busy_s = end - begin,
                                       .cpu_s = clock_thread_cpu() - begin_cpu};
        pthread_mutex_lock(&server->lock);
        accept_tile(server, 0, &tile, rgb, &header);
        pthread_mutex_unlock(&server->lock);
    }
    stats->cpu_s = clock_thread_cpu() - cpu;
    free(rgb);
    own_leave(server);
    return NULL;
}

static void show_progress(struct server *server)
{
    const struct queue *queue = server->service->queue;
    pthread_mutex_lock(&server->lock);
    struct progress_state state = {
        .pixels_done = queue_pixels_finished(queue),
        .pixels = (uint64_t)server->service->canvas->width * server->service->canvas->height,
        .tiles_done = queue_tiles_finished(queue),
        .tiles = queue_tiles(queue),
        .rays = server->rays,
    };
    watch_look(server->service->watch, clock_wall());
    pthread_mutex_unlock(&server->lock);
    progress_update(server->service->progress, &state, clock_wall());
}

static bool all_left(struct server *server)
{
    pthread_mutex_lock(&server->lock);
    bool own_done = server->own_done;
    pthread_mutex_unlock(&server->lock);
    return own_done && server->left == server->remote;
}

/* Nothing more is handed out, and what is in work is given up. */
static void stop_all(struct server *server)
{
    server->stopped = true;
    pthread_mutex_lock(&server->lock);
    queue_stop(server->service->queue);
    pthread_mutex_unlock(&server->lock);
    for (uint32_t i = server->renderers - server->remote; i < server->renderers; i++)
        tell_stop(server, i);
}

static void serve_until_done(struct server *server)
{
    struct nap nap = {0};
    for (uint32_t i = server->renderers - server->remote; i < server->renderers; i++)
        hand_out(server, i);
    while (!all_left(server)) {
        bool busy = receive(server);
        if (*server->service->stop && !server->stopped) stop_all(server);
        show_progress(server);
        if (busy)
            nap_reset(&nap);
        else
            nap_take(&nap);
    }
}

/* What is left of the render phase after rendering and sending is waiting. */
static void fill_waits(struct server *server)
{
    for (uint32_t i = 0; i < server->renderers; i++) {
        struct renderer_stats *stats = &server->service->stats[i];
        stats->wait_s = fmax(0, server->service->render_s - stats->busy_s - stats->send_s);
    }
}

static void start_server(struct server *server, struct service *service)
{
    int size;
    MPI_Comm_size(service->comm, &size);
    *server = (struct server){.service = service, .own_done = !service->own};
    server->remote = (uint32_t)size - 1;
    server->renderers = server->remote + (service->own ? 1 : 0);
    server->first_rank = service->own ? 0 : 1;
    server->told = allocate_zeroed(server->renderers, sizeof *server->told);
    server->is_gone = allocate_zeroed(server->renderers, sizeof *server->is_gone);
    memset(service->stats, 0, server->renderers * sizeof *service->stats);
    if (pthread_mutex_init(&server->lock, NULL) != 0) fatal("cannot create a lock");
    post_receives(server);
    MPI_Barrier(service->comm);
    server->start = server->finished = clock_wall();
}

bool serve(struct service *service)
{
    struct server server;
    start_server(&server, service);
    double cpu = clock_thread_cpu();
    pthread_t thread;
    if (service->own) {
        service->stats[0].rank = 0;
        gethostname(service->stats[0].host, HOST_NAME_SIZE - 1);
        if (pthread_create(&thread, NULL, render_own, &server) != 0)
            fatal("cannot start the rendering thread");
    }
    serve_until_done(&server);
    if (service->own) pthread_join(thread, NULL);
    cancel_receives(&server);
    pthread_mutex_destroy(&server.lock);
    free(server.told);
    free(server.is_gone);
    service->render_s = server.finished - server.start;
    service->master_cpu_s = clock_thread_cpu() - cpu;
    fill_waits(&server);
    return queue_tiles_finished(service->queue) == queue_tiles(service->queue);
}
