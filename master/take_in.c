#include <math.h>
#include <string.h>

#include "common/clock.h"
#include "common/message.h"
#include "common/tray.h"
#include "master/server.h"

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

/* A tile that the renderer has left to others; 0: nobody asked it to. The lock is held. */
static size_t take_dropped(struct server *server, uint32_t renderer, const struct tile *tile,
                           const struct result_header *header)
{
    if (!queue_recalled(server->service->queue, renderer, tile->id) || !dropped_valid(header))
        return 0;
    accept_dropped(server, renderer, tile, header);
    struct renderer_stats *stats = &server->service->stats[renderer];
    stats->busy_s += header->busy_s;
    stats->cpu_s += header->cpu_s;
    if (header->busy_s > 0) stats->finish_s = header->start_s + header->busy_s;
    return sizeof *header;
}

/* A tile takes the renderer long; it may be back already, for what MPI moves in pieces is overtaken. The lock
 * is held. */
static size_t take_unfinished(struct server *server, uint32_t renderer,
                              const struct result_header *header)
{
    struct queue *queue = server->service->queue;
    struct tile tile;
    if (!unfinished_valid(header)) return 0;
    if (queue_held(queue, renderer, header->tile_id, &tile))
        queue_takes_long(queue, renderer, tile.id, server_elapsed(server), header->busy_s);
    return sizeof *header;
}

/* Takes in the first part of so many bytes of a RESULT; returns its length, 0: it is not valid. The
 * lock is held. */
static size_t take_part(struct server *server, uint32_t renderer, const char *part, size_t bytes)
{
    struct result_header header;
    struct tile tile;
    if (bytes < sizeof header) return 0;
    memcpy(&header, part, sizeof header);
    if (header.pixels == RESULT_UNFINISHED) return take_unfinished(server, renderer, &header);
    if (!queue_held(server->service->queue, renderer, header.tile_id, &tile)) return 0;
    if (header.pixels == RESULT_DROPPED) return take_dropped(server, renderer, &tile, &header);
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
    server->pixels += header.pixels;
    return result_bytes(&tile, header.pixels, halves);
}

/* Takes in a result, wherever it lies: nothing of it is looked at twice before it is used. */
static void take_parts(struct server *server, uint32_t renderer, const char *result, size_t bytes)
{
    size_t done = 0, length = 1;
    server->contacts[renderer].drops = 0;
    server->service->stats[renderer].bytes += bytes;
    pthread_mutex_lock(&server->lock);
    while (length > 0 && done < bytes) {
        length = take_part(server, renderer, result + done, bytes - done);
        done += length;
    }
    pthread_mutex_unlock(&server->lock);
    if (bytes == 0 || done < bytes)
        fatal("renderer %u sent a result for a tile that it was not asked for", renderer);
}

static void take_tray(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    struct tray_note note = {0};
    struct tray *tray = tray_of(server, renderer);
    if (bytes == sizeof note) memcpy(&note, message, sizeof note);
    bool full = tray && tray_message_valid(&note, bytes, TRAY_RESULT_BYTES) &&
                slots_full(&tray->results, note.slot);
    if (!full) fatal("renderer %u told of a result where there is none", renderer);
    take_parts(server, renderer, tray->result[note.slot], note.bytes);
    slots_empty(&tray->results, note.slot);
}

static void take_ready(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    struct ready ready = {0};
    if (bytes == sizeof ready) memcpy(&ready, message, sizeof ready);
    int rank = (int)(server->first_rank + renderer);
    if (!ready_message_valid(&ready, bytes, rank) || server->contacts[renderer].is_ready)
        fatal("renderer %u reported for work in a way that makes no sense", renderer);
    server->contacts[renderer].is_ready = true;
    struct renderer_stats *stats = &server->service->stats[renderer];
    memcpy(stats->host, ready.host, sizeof stats->host);
    if (server->contacts[renderer].is_told) return;
    hand_out_start(server, renderer);
}

static void take_stats(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    struct renderer_stats stats;
    if (bytes == sizeof stats) memcpy(&stats, message, sizeof stats);
    int rank = (int)(server->first_rank + renderer);
    pthread_mutex_lock(&server->lock);
    bool due = server->service->ending || server_is_through(server, renderer);
    pthread_mutex_unlock(&server->lock);
    if (bytes != sizeof stats || !stats_message_valid(&stats, bytes, rank) || !due ||
        server->contacts[renderer].is_gone)
        fatal("renderer %u sent statistics that make no sense", renderer);
    server->service->stats[renderer] = stats;
    server->contacts[renderer].is_gone = true;
    server->left++;
}

static bool is_result(const struct letter *letter)
{
    return letter->tag == TAG_RENDERER_TO_MASTER_RESULT ||
           letter->tag == TAG_RENDERER_TO_MASTER_TRAY;
}

static void take_letter(struct server *server, const struct letter *letter)
{
    uint32_t renderer = (uint32_t)letter->rank - server->first_rank;
    if (letter->rank <= 0 || renderer >= server->renderers)
        fatal("a message came from rank %d, who is no renderer", letter->rank);
    server->service->messages++;
    note_sign(server, renderer);
    if (letter->tag == TAG_RENDERER_TO_MASTER_RESULT)
        take_parts(server, renderer, letter->bytes, letter->size);
    else if (letter->tag == TAG_RENDERER_TO_MASTER_TRAY)
        take_tray(server, renderer, letter->bytes, letter->size);
    else if (letter->tag == TAG_RENDERER_TO_MASTER_STATS)
        take_stats(server, renderer, letter->bytes, letter->size);
    else if (letter->tag == TAG_RENDERER_TO_MASTER_READY)
        take_ready(server, renderer, letter->bytes, letter->size);
    else if (letter->tag != TAG_RENDERER_TO_MASTER_PONG || letter->size != 0)
        fatal("rank %d sent a message of unknown kind %d", letter->rank, letter->tag);
    if (is_result(letter)) hand_out(server, renderer);
}

/* An answer has waited since the last look at the most. */
static void note_wait(struct server *server, double looked)
{
    struct service *service = server->service;
    double waited = looked - server->polled;
    service->answer_wait_s += waited;
    service->answer_wait_most_s = fmax(service->answer_wait_most_s, waited);
}

/* One of so many looks that find answers is measured: a thread's CPU time is a call into the system, which
 * takes as long as an answer does (0.6 us in a virtual machine, an answer of one tile 0.5 us). */
#define MEASURED_EACH 8

bool take_in(struct server *server)
{
    struct letter letters[POST_RECEIVES];
    bool measured = server->unmeasured == 0;
    double looked = clock_wall(), cpu = measured ? clock_thread_cpu() : 0;
    uint64_t pixels = server->pixels;
    int count = post_collect(server->post, letters), results = 0;
    for (int i = 0; i < count; i++) {
        note_wait(server, looked);
        results += is_result(&letters[i]);
        take_letter(server, &letters[i]);
        post_release(server->post, &letters[i]);
    }
    server->polled = looked;
    if (results < count || count == 0) return count > 0;
    server->unmeasured = (server->unmeasured + 1) % MEASURED_EACH;
    if (!measured) return true;
    cpu = clock_thread_cpu() - cpu;
    server->service->answers += (uint64_t)results;
    server->service->service_cpu_s += cpu;
    pthread_mutex_lock(&server->lock);
    queue_served(server->service->queue, cpu / count, (double)(server->pixels - pixels) / count);
    pthread_mutex_unlock(&server->lock);
    return true;
}
