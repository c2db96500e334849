/* What the master sends to renderers on other ranks: lots, recalls, and the messages START, PING and STOP. */
#include <assert.h>
#include <string.h>

#include "common/nap.h"
#include "common/tray.h"
#include "master/server.h"

/* The most tiles in DROP messages to a renderer that does not answer: each tile of all its lots twice, when
 * another renderer has got it and when that one has finished it. */
#define DROPS_MOST (2 * LOTS_UNDER_WAY * LOT_TILES)

struct tray *tray_of(const struct server *server, uint32_t renderer)
{
    return server->service->trays[rank_of(server, renderer)];
}

static void send(struct server *server, uint32_t renderer, enum message_tag tag, const void *bytes,
                 size_t size)
{
    struct tray *tray = tray_of(server, renderer);
    post_send(server->post, (int)rank_of(server, renderer), tag, bytes, size);
    if (tray) tray_count_sent(tray);
}

void tell_stop(struct server *server, uint32_t renderer)
{
    struct contact *contact = &server->contacts[renderer];
    if (contact->is_told) return;
    contact->is_told = true;
    send(server, renderer, TAG_MASTER_TO_RENDERER_STOP, NULL, 0);
}

void ask_for_sign(struct server *server, uint32_t renderer)
{
    send(server, renderer, TAG_MASTER_TO_RENDERER_PING, NULL, 0);
}

static void send_drops(struct server *server, uint32_t renderer)
{
    struct contact *contact = &server->contacts[renderer];
    send(server, renderer, TAG_MASTER_TO_RENDERER_DROP, server->drops[renderer],
         contact->drop_count * sizeof(struct drop));
    contact->drop_count = 0;
}

/* Adds the recall to what is sent to its renderer. One that does not answer is sent no more of them: they would
 * pile up. */
static void note_recall(struct server *server, const struct recall *recall)
{
    struct contact *contact = &server->contacts[recall->renderer];
    if (recall->renderer < server->first_remote) {
        if (recall->finished && recall->id == server->own_tile) server->service->given_up = true;
        return;
    }
    if (contact->is_told || contact->drops == DROPS_MOST) return;
    contact->drops++;
    server->drops[recall->renderer][contact->drop_count++] =
        (struct drop){recall->id, recall->finished};
    if (contact->drop_count == DROP_TILES) send_drops(server, recall->renderer);
}

void tell_recalls(struct server *server)
{
    struct recall recall;
    bool any = false;
    pthread_mutex_lock(&server->lock);
    for (; queue_next_recall(server->service->queue, &recall); any = true)
        note_recall(server, &recall);
    pthread_mutex_unlock(&server->lock);
    for (uint32_t i = server->first_remote; any && i < server->renderers; i++)
        if (server->contacts[i].drop_count > 0) send_drops(server, i);
}

/* Writes the beginning of a TILES message; returns its length. Where no tile of the lot is to be reported,
 * however long it takes, there are no floats. */
static size_t put_lot_header(struct server *server, uint32_t renderer, const struct tile *tiles,
                             uint32_t count, char *message)
{
    const struct queue *queue = server->service->queue;
    float report_s[LOT_TILES];
    struct lot_header header = {
        .answer_s = queue_answer_after(queue),
        .reports = queue_report_times(queue, renderer, tiles, count, report_s),
        .wakes_master = queue_lot_seconds(queue, renderer, tiles, count) < NAP_CALL};
    memcpy(message, &header, sizeof header);
    memcpy(message + sizeof header, report_s, header.reports * sizeof *report_s);
    return sizeof header + lot_report_bytes(header.reports);
}

/* Writes the TILES message of a lot into `message`, which has room for TILES_MAX_BYTES; returns its length. The
 * lock is held. */
static size_t put_lot(struct server *server, uint32_t renderer, const struct tile *tiles,
                      uint32_t count, char *message)
{
    size_t bytes = put_lot_header(server, renderer, tiles, count, message);
    for (uint32_t i = 0; i < count; i++) {
        assert(bytes + tile_part_bytes(&tiles[i]) <= TILES_MAX_BYTES);
        memcpy(message + bytes, &tiles[i], sizeof *tiles);
        if (tile_is_refined(&tiles[i]))
            take_refinements(server, &tiles[i], (void *)(message + bytes + sizeof *tiles));
        bytes += tile_part_bytes(&tiles[i]);
    }
    return bytes;
}

/* Sends the lot in server->message: in the renderer's tray, or as an MPI message where it has none, the lot is
 * too long for it, or its slot is still full. */
static void send_lot(struct server *server, uint32_t renderer, size_t bytes)
{
    struct tray *tray = tray_of(server, renderer);
    struct contact *contact = &server->contacts[renderer];
    if (!tray || bytes > TRAY_LOT_BYTES || slots_bytes(&tray->lots, contact->lots_put) > 0)
        send(server, renderer, TAG_MASTER_TO_RENDERER_TILES, server->message, bytes);
    else
        tray_put_lot(tray, contact->lots_put++, server->message, bytes);
}

void hand_out(struct server *server, uint32_t renderer)
{
    struct queue *queue = server->service->queue;
    struct tile tiles[LOT_TILES];
    uint32_t count;
    do {
        pthread_mutex_lock(&server->lock);
        count = queue_next(queue, renderer, server_elapsed(server), tiles);
        size_t bytes = count > 0 ? put_lot(server, renderer, tiles, count, server->message) : 0;
        server->contacts[renderer].is_idle = queue_tile_count(queue, renderer) == 0;
        server->contacts[renderer].is_full = queue_is_full(queue, renderer);
        pthread_mutex_unlock(&server->lock);
        if (count > 0) send_lot(server, renderer, bytes);
    } while (count > 0);
}

void hand_out_start(struct server *server, uint32_t renderer)
{
    struct start start = {.elapsed_s = server_elapsed(server),
                          .patience = server->service->patience};
    send(server, renderer, TAG_MASTER_TO_RENDERER_START, &start, sizeof start);
    hand_out(server, renderer);
}

void hand_out_to_idle(struct server *server)
{
    pthread_mutex_lock(&server->lock);
    uint64_t news = queue_news(server->service->queue);
    bool due = news != server->news || server_elapsed(server) >= queue_wake(server->service->queue);
    if (due) queue_look(server->service->queue, server_elapsed(server));
    bool all = news != server->news;
    server->news = news;
    pthread_mutex_unlock(&server->lock);
    if (!due) return;
    for (uint32_t i = server->first_remote; i < server->renderers; i++) {
        const struct contact *contact = &server->contacts[i];
        bool asks = contact->is_idle || (all && !contact->is_full);
        if (asks && contact->is_ready && !contact->is_told) hand_out(server, i);
    }
}
