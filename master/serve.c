#include "master/serve.h"

#include <assert.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/message.h"
#include "common/nap.h"
#include "master/preview.h"

/* Receives posted ahead, so that results land without waiting for us and nothing piles up in MPI's
 * queue of unexpected messages. */
#define RECEIVES 16

/* DROP messages to a renderer that does not answer. */
#define DROPS_MOST 16

struct server {
    struct service *service;
    double start;
    double finished; /* when the last tile came in */

    /* Shared with the rendering thread, under lock: queue, canvas, watch, and what follows. */
    pthread_mutex_t lock;
    struct preview preview;
    uint64_t rays;
    double probe_s; /* of all renderers */
    bool last_pass; /* what is in the queue is all there will be */
    bool own_done;

    /* Main thread only. */
    uint32_t first_rank; /* of renderer 0 */
    uint32_t renderers, remote, left;
    bool *told;     /* per renderer: that it is to stop */
    bool *is_gone;  /* per renderer: its statistics are here */
    bool *is_ready; /* per renderer: it may be sent tiles */
    int *drops;     /* per renderer: DROP messages since its last answer */
    bool *idle;     /* per renderer: it asks for work, and there was none */
    char *message;  /* TILES_MAX_BYTES, zeroed: what fills up parts is 0 or old */
    double ended;   /* clock_wall(), when service->ending was set */
    uint64_t news;  /* of the queue, when the idle were last asked */
    double polled;  /* when messages were last looked for */
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
    size_t largest = queue_largest_lot(server->service->queue);
    size_t floats = server->service->adaptive ? REFINED_FLOATS : 4;
    server->buffer_bytes =
        LOT_TILES * (sizeof(struct result_header) + 8) + largest * floats * sizeof(float);
    if (server->buffer_bytes < sizeof(struct renderer_stats))
        server->buffer_bytes = sizeof(struct renderer_stats);
    _Static_assert(sizeof(struct ready) <= sizeof(struct renderer_stats), "has room, too");
    server->receives = server->remote < RECEIVES ? (int)server->remote : RECEIVES;
    for (int i = 0; i < server->receives; i++) {
        server->buffers[i] = allocate(server->buffer_bytes, 1);
        post_receive(server, i);
    }
}

/* With a silent renderer there may be half of a message that never ends, for which the memory, and this
 * function, would wait: the job is about to end without it. */
static void cancel_receives(struct server *server)
{
    if (server->service->silent > 0) return;
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

static double elapsed(const struct server *server)
{
    return clock_wall() - server->start;
}

/* Tells renderers what others have taken from them. One who does not answer hears no more of it: his
 * messages would pile up. The master's own renderer looks itself. */
static void tell_recalls(struct server *server)
{
    uint32_t renderer, id;
    for (;;) {
        pthread_mutex_lock(&server->lock);
        bool more = queue_recall(server->service->queue, &renderer, &id);
        pthread_mutex_unlock(&server->lock);
        if (!more) return;
        int rank = (int)(server->first_rank + renderer);
        if (rank == 0 || server->told[renderer] || server->drops[renderer] == DROPS_MOST) continue;
        server->drops[renderer]++;
        MPI_Send(&id, sizeof id, MPI_BYTE, rank, TAG_MASTER_TO_RENDERER_DROP,
                 server->service->comm);
    }
}

/* Whether nothing is left for this renderer, in later passes either; the lock is held. */
static bool is_through(struct server *server, uint32_t renderer)
{
    bool over = queue_over(server->service->queue, renderer);
    return over && (server->last_pass || server->service->ending);
}

/* The TILES message of a lot into room for TILES_MAX_BYTES; returns its length. The lock is held. */
static size_t put_lot(const struct server *server, const struct tile *tiles, uint32_t count,
                      char *message)
{
    struct lot_header header = {.answer_s = queue_answer_after(server->service->queue)};
    size_t bytes = sizeof header;
    memcpy(message, &header, sizeof header);
    for (uint32_t i = 0; i < count; i++) {
        assert(bytes + tile_part_bytes(&tiles[i]) <= TILES_MAX_BYTES);
        memcpy(message + bytes, &tiles[i], sizeof *tiles);
        if (tile_is_refined(&tiles[i]))
            adaptive_take(server->service->adaptive, &tiles[i],
                          (void *)(message + bytes + sizeof *tiles));
        bytes += tile_part_bytes(&tiles[i]);
    }
    return bytes;
}

/* Gives a remote renderer all the lots that it may hold, or tells it that there are no more. */
static void hand_out(struct server *server, uint32_t renderer)
{
    struct queue *queue = server->service->queue;
    int rank = (int)(server->first_rank + renderer);
    struct tile tiles[LOT_TILES];
    uint32_t count;
    size_t bytes;
    bool over;
    do {
        pthread_mutex_lock(&server->lock);
        count = queue_next(queue, renderer, elapsed(server), tiles);
        bytes = put_lot(server, tiles, count, server->message);
        over = is_through(server, renderer);
        server->idle[renderer] = queue_holds(queue, renderer) == 0;
        pthread_mutex_unlock(&server->lock);
        if (count > 0)
            MPI_Send(server->message, (int)bytes, MPI_BYTE, rank, TAG_MASTER_TO_RENDERER_TILES,
                     server->service->comm);
    } while (count > 0);
    tell_recalls(server);
    if (over) tell_stop(server, renderer);
}

/* To renderers that have nothing to do, when there may be something. */
static void hand_out_to_idle(struct server *server)
{
    pthread_mutex_lock(&server->lock);
    uint64_t news = queue_news(server->service->queue);
    bool due = news != server->news || elapsed(server) >= queue_wake(server->service->queue);
    bool complete = queue_complete(server->service->queue);
    pthread_mutex_unlock(&server->lock);
    if (!due && !complete) return;
    bool all = news != server->news || complete;
    server->news = news;
    for (uint32_t i = server->renderers - server->remote; i < server->renderers; i++)
        if ((all || server->idle[i]) && server->is_ready[i] && !server->told[i])
            hand_out(server, i);
}

static void note_lot(struct service *service, enum lot_kind kind, uint32_t renderer,
                     const struct tile *tile, const struct result_header *header)
{
    if (service->timeline) timeline_add(service->timeline, kind, renderer, tile, header);
}

/* A finished tile goes into the picture and the journal, unless somebody else was first; the lock is held. */
static void accept_tile(struct server *server, uint32_t renderer, const struct tile *tile,
                        const float *rgb, const struct result_header *header)
{
    struct service *service = server->service;
    double now = elapsed(server);
    bool first = queue_finish(service->queue, renderer, tile->id, now, header->busy_s);
    note_lot(service, first ? LOT_TILE : LOT_WASTED, renderer, tile, header);
    if (!first) return;
    if (service->adaptive) {
        if (adaptive_work(service->adaptive, tile).pixels != header->pixels)
            fatal("renderer %u sent other pixels than it was asked for", renderer);
        adaptive_put(service->adaptive, tile, rgb);
    } else {
        canvas_put(service->canvas, tile, rgb);
        save_tile(service->save, tile, header->busy_s, &header->counts);
    }
    server->rays += render_counts_rays(&header->counts);
    watch_add(service->watch, tile_pixels(tile), header);
    server->finished = server->start + now;
}

/* Probes go into the preview, and what they cost to the queue; the lock is held. */
static void accept_probes(struct server *server, uint32_t renderer, const struct tile *tile,
                          const float *rgb, const struct result_header *header)
{
    struct service *service = server->service;
    note_lot(service, LOT_PREPASS, renderer, tile, header);
    const float *seconds = rgb + 3 * (size_t)tile_pixels(tile);
    preview_put(&server->preview, service->canvas->width, service->canvas->height, tile, rgb);
    queue_probed(service->queue, tile, seconds);
    queue_finish(service->queue, renderer, tile->id, elapsed(server), header->busy_s);
    server->probe_s += header->busy_s;
}

/* A tile that the renderer has left to others; 0: nobody asked it to. The lock is held. */
static size_t take_dropped(struct server *server, uint32_t renderer, uint32_t id)
{
    struct queue *queue = server->service->queue;
    if (!queue_recalled(queue, renderer, id)) return 0;
    queue_drop(queue, renderer, id, elapsed(server));
    return sizeof(struct result_header);
}

/* What is known of a remote renderer before its last message, or if that never comes. */
static void count_part(struct renderer_stats *stats, const struct tile *tile,
                       const struct result_header *header)
{
    stats->busy_s += header->busy_s;
    stats->cpu_s += header->cpu_s;
    if (tile->pass == TILE_PROBE) return;
    stats->finish_s = header->start_s + header->busy_s;
    stats->tiles++;
    stats->pixels += header->pixels;
    render_counts_add(&stats->counts, &header->counts);
}

/* Takes in the first part of so many bytes of a RESULT; returns its length, 0: it is not valid. The
 * lock is held. */
static size_t take_part(struct server *server, uint32_t renderer, const char *part, size_t bytes)
{
    struct result_header header;
    struct tile tile;
    if (bytes < sizeof header) return 0;
    memcpy(&header, part, sizeof header);
    if (header.pixels == RESULT_DROPPED) return take_dropped(server, renderer, header.tile_id);
    if (!queue_held(server->service->queue, renderer, header.tile_id, &tile)) return 0;
    bool halves = server->service->adaptive != NULL;
    if (!result_message_valid(&header, bytes, &tile, halves)) return 0;
    /* Behind the header, which is a multiple of 8 bytes long like all parts, in an allocated block:
     * aligned. */
    const float *rgb = (const void *)(part + sizeof header);
    if (tile.pass == TILE_PROBE)
        accept_probes(server, renderer, &tile, rgb, &header);
    else
        accept_tile(server, renderer, &tile, rgb, &header);
    count_part(&server->service->stats[renderer], &tile, &header);
    return result_bytes(&tile, header.pixels, halves);
}

static void take_result(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    size_t done = 0, length = 1;
    server->drops[renderer] = 0;
    server->service->stats[renderer].bytes += bytes;
    pthread_mutex_lock(&server->lock);
    while (length > 0 && done < bytes) {
        length = take_part(server, renderer, message + done, bytes - done);
        done += length;
    }
    pthread_mutex_unlock(&server->lock);
    if (bytes == 0 || done < bytes)
        fatal("renderer %u sent a result for a tile that it was not asked for", renderer);
    hand_out(server, renderer);
}

static void take_ready(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    struct ready ready = {0};
    if (bytes == sizeof ready) memcpy(&ready, message, sizeof ready);
    int rank = (int)(server->first_rank + renderer);
    if (!ready_message_valid(&ready, bytes, rank) || server->is_ready[renderer])
        fatal("renderer %u reported for work in a way that makes no sense", renderer);
    server->is_ready[renderer] = true;
    struct renderer_stats *stats = &server->service->stats[renderer];
    memcpy(stats->host, ready.host, sizeof stats->host);
    if (server->told[renderer]) return;
    struct start start = {.elapsed_s = elapsed(server)};
    MPI_Send(&start, sizeof start, MPI_BYTE, rank, TAG_MASTER_TO_RENDERER_START,
             server->service->comm);
    hand_out(server, renderer);
}

static void take_stats(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    struct renderer_stats stats;
    if (bytes == sizeof stats) memcpy(&stats, message, sizeof stats);
    int rank = (int)(server->first_rank + renderer);
    pthread_mutex_lock(&server->lock);
    bool due = server->service->ending || is_through(server, renderer);
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
    else if (status->MPI_TAG == TAG_RENDERER_TO_MASTER_READY)
        take_ready(server, renderer, message, (size_t)bytes);
    else
        fatal("rank %d sent a message of unknown kind %d", status->MPI_SOURCE, status->MPI_TAG);
    post_receive(server, slot);
}

/* An answer has waited since the last look at the most. */
static void note_wait(struct server *server, double looked)
{
    struct service *service = server->service;
    double waited = looked - server->polled;
    service->answer_wait_s += waited;
    service->answer_wait_most_s = fmax(service->answer_wait_most_s, waited);
}

/* Handles all that has arrived; returns whether there was anything. */
static bool receive(struct server *server)
{
    if (server->receives == 0) return false;
    int slots[RECEIVES], count;
    MPI_Status statuses[RECEIVES];
    double looked = clock_wall(), cpu = clock_thread_cpu();
    MPI_Testsome(server->receives, server->requests, &count, slots, statuses);
    for (int i = 0; i < count; i++) {
        note_wait(server, looked);
        take_message(server, slots[i], &statuses[i]);
    }
    server->polled = looked;
    if (count <= 0) return false;
    pthread_mutex_lock(&server->lock);
    queue_served(server->service->queue, (clock_thread_cpu() - cpu) / count);
    pthread_mutex_unlock(&server->lock);
    return true;
}

/* ---- the master's own renderer ---- */

/* The next lot; 0: nothing is left. Waits while others have what is left. */
static uint32_t own_next(struct server *server, struct tile *tiles)
{
    struct queue *queue = server->service->queue;
    struct nap nap = {0};
    for (;;) {
        pthread_mutex_lock(&server->lock);
        uint32_t count = queue_next(queue, 0, elapsed(server), tiles);
        bool over = is_through(server, 0);
        pthread_mutex_unlock(&server->lock);
        if (count > 0 || over) return count;
        nap_take(&nap);
    }
}

static void own_leave(struct server *server)
{
    pthread_mutex_lock(&server->lock);
    server->own_done = true;
    pthread_mutex_unlock(&server->lock);
}

/* Whether the tile is still to be rendered by this renderer. */
static bool own_keeps(struct server *server, const struct tile *tile)
{
    struct queue *queue = server->service->queue;
    pthread_mutex_lock(&server->lock);
    bool dropped = queue_recalled(queue, 0, tile->id);
    if (dropped) queue_drop(queue, 0, tile->id, elapsed(server));
    bool over = is_through(server, 0);
    pthread_mutex_unlock(&server->lock);
    return !dropped && !over;
}

/* Memory for the pixels of a tile. */
struct own_memory {
    float *rgb;                     /* REFINED_FLOATS each */
    struct refinement *refinements; /* NULL: not adaptive */
};

/* What a tile's pass asks for; returns how many of its pixels get samples. */
static uint32_t own_refinements(struct server *server, const struct tile *tile,
                                struct refinement *refinements)
{
    struct adaptive *adaptive = server->service->adaptive;
    if (!adaptive || tile->pass == TILE_PROBE) return tile_pixels(tile);
    pthread_mutex_lock(&server->lock);
    adaptive_take(adaptive, tile, refinements);
    uint32_t pixels = adaptive_work(adaptive, tile).pixels;
    pthread_mutex_unlock(&server->lock);
    return pixels;
}

/* Renders or probes a tile and hands it in; false: the run is stopped. */
static bool render_one(struct server *server, const struct tile *tile,
                       const struct own_memory *memory)
{
    const struct tile_renderer *own = server->service->own;
    struct renderer_stats *stats = &server->service->stats[0];
    struct render_counts counts = {0};
    uint32_t pixels = own_refinements(server, tile, memory->refinements);
    float *rgb = memory->rgb, *behind = rgb + 3 * (size_t)pixels;
    bool probes = tile->pass == TILE_PROBE;
    const struct refinement *refinements = tile_is_refined(tile) ? memory->refinements : NULL;
    double begin = elapsed(server), cpu = clock_thread_cpu();
    if (probes
            ? !own->probe(own->state, tile, rgb, behind)
            : !own->render(own->state, tile, refinements, rgb, memory->refinements ? behind : NULL,
                           memory->refinements ? behind + 3 * (size_t)pixels : NULL, &counts))
        return false;
    double end = elapsed(server);
    stats->busy_s += end - begin;
    struct result_header header = {.pixels = pixels,
                                   .start_s = begin,
                                   .busy_s = end - begin,
                                   .cpu_s = clock_thread_cpu() - cpu,
                                   .counts = counts};
    pthread_mutex_lock(&server->lock);
    if (probes)
        accept_probes(server, 0, tile, rgb, &header);
    else
        accept_tile(server, 0, tile, rgb, &header);
    pthread_mutex_unlock(&server->lock);
    if (probes) return true;
    stats->finish_s = end;
    stats->tiles++;
    stats->pixels += pixels;
    render_counts_add(&stats->counts, &counts);
    return true;
}

/* The second thread of rank 0. It takes tiles straight from the queue and never calls MPI. */
static void *render_own(void *argument)
{
    struct server *server = argument;
    struct service *service = server->service;
    uint32_t largest = queue_largest_lot(service->queue);
    struct own_memory memory = {.rgb = allocate(largest, REFINED_FLOATS * sizeof *memory.rgb)};
    if (service->adaptive) memory.refinements = allocate(largest, sizeof *memory.refinements);
    double cpu = clock_thread_cpu();
    struct tile tiles[LOT_TILES];
    bool goes_on = true;
    uint32_t count;
    while (goes_on && (count = own_next(server, tiles)) > 0)
        for (uint32_t i = 0; i < count && goes_on; i++)
            goes_on = !own_keeps(server, &tiles[i]) || render_one(server, &tiles[i], &memory);
    service->stats[0].cpu_s = clock_thread_cpu() - cpu;
    free(memory.rgb);
    free(memory.refinements);
    own_leave(server);
    return NULL;
}

/* ---- passes ---- */

/* Tiles of a pass are at most this wide and high: in a few of its pixels a late pass has as many
 * samples as a small tile has in pass 0, and rays are the faster the more of them are together. */
#define PASS_EDGE 128u

/* A tile of the pass into the queue, unless no pixel of it gets samples. */
static void add_work(struct server *server, struct tile tile)
{
    struct service *service = server->service;
    struct adaptive_work work = adaptive_work(service->adaptive, &tile);
    if (work.samples == 0) return;
    /* Predicted from what all of its pixels took in pass 0. */
    double first = (double)tile_pixels(&tile) * service->first_samples;
    double cost = queue_work(service->queue, &tile) * (double)work.samples / first;
    queue_add(service->queue, &tile, cost, work.removed / fmax(cost, 1e-300));
}

/* The next pass, or the end of passes; the lock is held. */
static void begin_pass(struct server *server)
{
    struct service *service = server->service;
    const struct canvas *canvas = service->canvas;
    server->last_pass = !adaptive_plan(service->adaptive);
    if (server->last_pass) return;
    uint32_t edge = PASS_EDGE, largest = queue_largest_lot(service->queue);
    while (edge * edge > largest)
        edge /= 2;
    struct tile tile = {.step = 1, .pass = adaptive_passes(service->adaptive) - 1};
    for (tile.y = 0; tile.y < canvas->height; tile.y += edge) {
        for (tile.x = 0; tile.x < canvas->width; tile.x += edge) {
            tile.w = canvas->width - tile.x < edge ? canvas->width - tile.x : edge;
            tile.h = canvas->height - tile.y < edge ? canvas->height - tile.y : edge;
            add_work(server, tile);
        }
    }
}

static void follow_passes(struct server *server)
{
    if (server->last_pass || server->service->ending) return;
    pthread_mutex_lock(&server->lock);
    while (!server->last_pass && queue_complete(server->service->queue)) {
        watch_pass(server->service->watch, clock_wall());
        begin_pass(server);
    }
    pthread_mutex_unlock(&server->lock);
}

static void show_progress(struct server *server)
{
    const struct queue *queue = server->service->queue;
    double pixels = (double)server->service->canvas->width * server->service->canvas->height;
    pthread_mutex_lock(&server->lock);
    struct queue_count count = queue_count(queue);
    struct progress_state state = {
        .pixels_done = (uint64_t)(count.share_finished * pixels),
        .pixels_before = (uint64_t)(count.share_skipped * pixels),
        .pixels = (uint64_t)pixels,
        .tiles_done = count.finished,
        .tiles = count.tiles,
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

/* Whether nothing of what is in work matters any more. */
static bool is_over(struct server *server)
{
    pthread_mutex_lock(&server->lock);
    bool complete = server->last_pass && queue_complete(server->service->queue);
    pthread_mutex_unlock(&server->lock);
    return complete || *server->service->stop;
}

/* Nothing more is handed out, and what is in work is given up. */
static void end_all(struct server *server)
{
    server->service->ending = true;
    server->ended = clock_wall();
    pthread_mutex_lock(&server->lock);
    queue_stop(server->service->queue);
    pthread_mutex_unlock(&server->lock);
    for (uint32_t i = server->renderers - server->remote; i < server->renderers; i++)
        tell_stop(server, i);
}

static bool is_out_of_patience(const struct server *server)
{
    return server->service->ending && clock_wall() - server->ended > SERVE_GRACE;
}

static void count_silent(struct server *server)
{
    for (uint32_t i = server->renderers - server->remote; i < server->renderers; i++) {
        if (server->is_gone[i]) continue;
        server->service->stats[i].silent = 1;
        server->service->silent++;
    }
}

static void serve_until_done(struct server *server)
{
    struct nap nap = {0};
    while (!all_left(server) && !is_out_of_patience(server)) {
        bool busy = receive(server);
        double now = clock_wall();
        follow_passes(server);
        if (!server->service->ending && (is_over(server) || now >= server->service->deadline)) {
            server->service->timed_out = !is_over(server);
            end_all(server);
        }
        hand_out_to_idle(server);
        tell_recalls(server);
        show_progress(server);
        if (busy)
            nap_reset(&nap);
        else
            nap_take(&nap);
    }
    count_silent(server);
}

/* What is left of the render phase after rendering and sending is waiting. */
static void fill_waits(struct server *server)
{
    for (uint32_t i = 0; i < server->renderers; i++) {
        struct renderer_stats *stats = &server->service->stats[i];
        stats->wait_s = fmax(0, server->service->render_s - stats->busy_s - stats->send_s);
    }
}

/* Where tiles are missing, the picture shows the preview. */
static void fill_from_preview(struct server *server)
{
    uint32_t next = 0;
    struct tile tile;
    while (queue_unfinished(server->service->queue, &next, &tile))
        if (!tile_is_refined(&tile)) preview_fill(&server->preview, server->service->canvas, &tile);
}

static void end_server(struct server *server)
{
    pthread_mutex_destroy(&server->lock);
    preview_free(&server->preview);
    free(server->told);
    free(server->is_gone);
    free(server->idle);
    free(server->drops);
    free(server->message);
    free(server->is_ready);
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
    server->drops = allocate_zeroed(server->renderers, sizeof *server->drops);
    server->idle = allocate_zeroed(server->renderers, sizeof *server->idle);
    server->is_ready = allocate_zeroed(server->renderers, sizeof *server->is_ready);
    server->message = allocate_zeroed(TILES_MAX_BYTES, 1);
    server->last_pass = !service->adaptive;
    memset(service->stats, 0, server->renderers * sizeof *service->stats);
    for (uint32_t i = 0; i < server->renderers; i++)
        service->stats[i].rank = server->first_rank + i;
    service->ending = false;
    service->silent = 0;
    if (pthread_mutex_init(&server->lock, NULL) != 0) fatal("cannot create a lock");
    post_receives(server);
    server->start = server->finished = server->polled = clock_wall();
}

bool serve(struct service *service)
{
    struct server server;
    start_server(&server, service);
    double cpu = clock_thread_cpu();
    pthread_t thread;
    if (service->own) {
        gethostname(service->stats[0].host, HOST_NAME_SIZE - 1);
        if (pthread_create(&thread, NULL, render_own, &server) != 0)
            fatal("cannot start the rendering thread");
    }
    serve_until_done(&server);
    if (service->own) pthread_join(thread, NULL);
    cancel_receives(&server);
    service->render_s = server.finished - server.start;
    service->master_cpu_s = clock_thread_cpu() - cpu;
    service->probe_s = server.probe_s;
    fill_waits(&server);
    fill_from_preview(&server);
    end_server(&server);
    /* Between passes the queue is complete, the picture not. */
    return service->timed_out || (server.last_pass && queue_complete(service->queue));
}
