/* What renderers on other ranks send to the master: validates messages and the contents of trays, and handles them. */
#include <math.h>
#include <string.h>

#include "common/clock.h"
#include "common/message.h"
#include "common/prefetch.h"
#include "common/tray.h"
#include "master/server.h"

/* Takes in the notice that the renderer has dropped a tile; returns its length, 0: it was not allowed to. The
 * lock is held. */
static size_t take_dropped(struct server *server, uint32_t renderer, const struct tile *tile,
                           const struct result_header *header)
{
    if (!queue_is_recalled(server->service->queue, renderer, tile->id) || !dropped_valid(header))
        return 0;
    accept_dropped(server, renderer, tile, header);
    renderer_stats_add(&server->service->stats[renderer], tile, header);
    return sizeof *header;
}

/* Takes in the notice that a tile takes the renderer long; returns its length. The tile may be back already, as
 * a message that MPI moves in pieces can be overtaken. The lock is held. */
static size_t take_unfinished(struct server *server, uint32_t renderer,
                              const struct result_header *header)
{
    struct queue *queue = server->service->queue;
    struct tile tile;
    if (!unfinished_valid(header)) return 0;
    if (queue_find_held(queue, renderer, header->tile_id, &tile))
        queue_takes_long(queue, renderer, tile.id, server_elapsed(server), header->busy_s);
    return sizeof *header;
}

/* The tile's pixels are about to be copied from the result to the canvas: asks for the memory of both, which
 * arrives while the queue is told. */
static void expect_tile(const struct server *server, const struct tile *tile, const float *rgb)
{
    size_t bytes = 3 * (size_t)tile_pixels(tile) * sizeof *rgb;
    prefetch_block(rgb, bytes < CANVAS_AHEAD ? bytes : CANVAS_AHEAD);
    canvas_expect(server->service->canvas, tile);
}

/* Takes in the first part of a RESULT; returns the length of the part, 0: it is not valid. The lock is held. */
static size_t take_part(struct server *server, uint32_t renderer, const char *part, size_t bytes)
{
    struct result_header header;
    struct tile tile;
    if (bytes < sizeof header) return 0;
    memcpy(&header, part, sizeof header);
    if (header.pixels == RESULT_UNFINISHED) return take_unfinished(server, renderer, &header);
    if (!queue_find_held(server->service->queue, renderer, header.tile_id, &tile))
        fatal("rank %u sent a result for a tile that it was not asked for",
              rank_of(server, renderer));
    if (header.pixels == RESULT_DROPPED) return take_dropped(server, renderer, &tile, &header);
    bool halves = server->service->adaptive != NULL;
    if (!result_message_valid(&header, bytes, &tile, halves)) return 0;
    /* The floats follow the header, which like all parts is a multiple of 8 bytes long, in an allocated block:
     * they are aligned. */
    const float *rgb = (const void *)(part + sizeof header);
    if (tile.pass == TILE_PROBE) {
        accept_probes(server, renderer, &tile, rgb, &header);
    } else {
        if (!halves) expect_tile(server, &tile, rgb);
        accept_tile(server, renderer, &tile, rgb, &header);
    }
    /* All that is known of the renderer until its last message comes, or if that never comes. */
    renderer_stats_add(&server->service->stats[renderer], &tile, &header);
    server->pixels += header.pixels;
    return result_bytes(&tile, header.pixels, halves);
}

/* Takes in a result from a message or a tray. In a tray its bytes may change meanwhile, so that what is checked
 * is read only once. */
static void take_parts(struct server *server, uint32_t renderer, const char *result, size_t bytes)
{
    size_t done = 0, length = 1;
    server->contacts[renderer].drops = 0;
    server->service->stats[renderer].bytes += bytes;
    pthread_mutex_lock(&server->lock);
    queue_expect(server->service->queue, renderer);
    while (length > 0 && done < bytes) {
        length = take_part(server, renderer, result + done, bytes - done);
        done += length;
    }
    pthread_mutex_unlock(&server->lock);
    if (bytes == 0 || done < bytes)
        fatal("rank %u sent a result that is not valid", rank_of(server, renderer));
}

/* Takes in the results in the renderer's tray; returns how many. */
static int take_tray(struct server *server, uint32_t renderer)
{
    struct tray *tray = tray_of(server, renderer);
    struct contact *contact = &server->contacts[renderer];
    int results = 0;
    for (uint32_t bytes; (bytes = slots_bytes(&tray->results, contact->results_taken)) > 0;) {
        unsigned turn = contact->results_taken++;
        if (bytes > TRAY_RESULT_BYTES)
            fatal("rank %u left a result that makes no sense", rank_of(server, renderer));
        if (results++ == 0) {
            tray_expect_lot(tray, contact->lots_put);
            note_sign(server, renderer);
        }
        take_parts(server, renderer, tray->result[turn % TRAY_SLOTS], bytes);
        slots_empty(&tray->results, turn);
    }
    server->served->messages += (uint64_t)results;
    if (results > 0) hand_out(server, renderer);
    return results;
}

/* The same for all renderers whose flags are set. */
static int take_trays(struct server *server)
{
    struct arrivals *arrivals = server->service->arrivals;
    uint32_t ranks = rank_of(server, server->renderers);
    int results = 0;
    for (uint32_t word = 0; word < server->flag_words; word++)
        for (uint64_t up = arrivals_take(arrivals, word); up; up &= up - 1) {
            uint32_t rank = FLAGS_PER_WORD * word + (uint32_t)__builtin_ctzll(up);
            if (rank >= ranks || !server->service->trays[rank])
                fatal("a flag is up of rank %u, who has no tray", rank);
            results += take_tray(server, rank - rank_of(server, 0));
        }
    return results;
}

static void take_ready(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    struct ready ready = {0};
    if (bytes == sizeof ready) memcpy(&ready, message, sizeof ready);
    int rank = (int)rank_of(server, renderer);
    if (!ready_message_valid(&ready, bytes, rank) || server->contacts[renderer].is_ready)
        fatal("rank %d reported for work in a way that makes no sense", rank);
    server->contacts[renderer].is_ready = true;
    struct renderer_stats *stats = &server->service->stats[renderer];
    memcpy(stats->host, ready.host, sizeof stats->host);
    if (server->contacts[renderer].is_told) return;
    hand_out_start(server, renderer);
}

static void take_stats(struct server *server, uint32_t renderer, const char *message, size_t bytes)
{
    struct renderer_stats stats = {0};
    if (bytes == sizeof stats) memcpy(&stats, message, sizeof stats);
    int rank = (int)rank_of(server, renderer);
    pthread_mutex_lock(&server->lock);
    bool due = server->service->ending || server_is_through(server, renderer);
    pthread_mutex_unlock(&server->lock);
    if (!stats_message_valid(&stats, bytes, rank) || !due || server->contacts[renderer].is_gone)
        fatal("rank %d sent statistics that make no sense", rank);
    server->service->stats[renderer] = stats;
    server->contacts[renderer].is_gone = true;
}

static void take_letter(struct server *server, const struct letter *letter)
{
    uint32_t renderer = (uint32_t)letter->rank - rank_of(server, 0);
    if (letter->rank <= 0 || renderer >= server->renderers)
        fatal("a message came from rank %d, who is no renderer", letter->rank);
    server->served->messages++;
    server->messages_taken++;
    note_sign(server, renderer);
    if (letter->tag == TAG_RENDERER_TO_MASTER_RESULT) {
        take_parts(server, renderer, letter->bytes, letter->size);
        hand_out(server, renderer);
    } else if (letter->tag == TAG_RENDERER_TO_MASTER_STATS) {
        take_stats(server, renderer, letter->bytes, letter->size);
    } else if (letter->tag == TAG_RENDERER_TO_MASTER_READY) {
        take_ready(server, renderer, letter->bytes, letter->size);
    } else if (letter->tag != TAG_RENDERER_TO_MASTER_PONG || letter->size != 0) {
        fatal("rank %d sent a message of unknown kind %d", letter->rank, letter->tag);
    }
}

/* Accounts for the time that `count` answers have waited: at most since messages were last looked for. */
static void note_waits(struct server *server, double looked, int count)
{
    double waited = looked - server->polled_at;
    server->served->answer_wait_s += count * waited;
    if (count > 0)
        server->served->answer_wait_most_s = fmax(server->served->answer_wait_most_s, waited);
    server->polled_at = looked;
}

/* Whether MPI may have received something for the master, or has sends to complete. */
static bool is_mpi_due(const struct server *server)
{
    const struct service *service = server->service;
    bool all_count = service->all_ring && service->arrivals;
    return !all_count || !post_is_settled(server->post) ||
           arrivals_has_messages(service->arrivals, server->messages_taken);
}

/* Handles the messages; returns how many of them are results. */
static int take_letters(struct server *server, const struct letter *letters, int count)
{
    int results = 0;
    for (int i = 0; i < count; i++) {
        results += letters[i].tag == TAG_RENDERER_TO_MASTER_RESULT;
        take_letter(server, &letters[i]);
        post_release(server->post, &letters[i]);
    }
    return results;
}

/* The CPU time is measured for one of MEASURED_EACH calls with answers: reading a thread's CPU time is a system
 * call, which takes as long as an answer does (0.6 us in a virtual machine, an answer of one tile 0.5 us). */
#define MEASURED_EACH 8

bool take_in(struct server *server)
{
    struct letter letters[POST_RECEIVES];
    bool measured = server->unmeasured == 0;
    double looked = clock_wall(), cpu = measured ? clock_thread_cpu() : 0;
    uint64_t pixels = server->pixels;
    int messages = is_mpi_due(server) ? post_collect(server->post, letters) : 0;
    /* Trays are looked at after MPI, but taken in before its messages: the last thing that a renderer sends is a
     * message. */
    int from_trays = take_trays(server);
    int results = from_trays + take_letters(server, letters, messages);
    int count = from_trays + messages;
    note_waits(server, looked, count);
    if (results < count || count == 0) return count > 0;
    server->unmeasured = (server->unmeasured + 1) % MEASURED_EACH;
    if (!measured) return true;
    cpu = clock_thread_cpu() - cpu;
    server->served->answers += (uint64_t)results;
    server->served->service_cpu_s += cpu;
    pthread_mutex_lock(&server->lock);
    queue_served(server->service->queue, cpu / count, (double)(server->pixels - pixels) / count);
    pthread_mutex_unlock(&server->lock);
    return true;
}
