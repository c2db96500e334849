/* Accepts finished, dropped and probe tiles: updates the queue, the picture, the journal and the timeline, and
 * keeps finished pieces of tiles until their fate is known. */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "common/clock.h"
#include "common/message.h"
#include "master/server.h"

static void note_in_timeline(struct service *service, enum timeline_kind kind, uint32_t renderer,
                             const struct tile *tile, const struct result_header *header)
{
    if (service->timeline) timeline_add(service->timeline, kind, renderer, tile, header);
}

/* For the heat map: charges a tile's time to the pixels that have got samples. */
static void note_costs(struct service *service, const struct tile *tile, double seconds)
{
    struct timeline *timeline = service->timeline;
    if (!timeline || !timeline->costs) return;
    if (service->adaptive)
        adaptive_spread(service->adaptive, tile, seconds, timeline->costs);
    else
        timeline_spread(timeline, tile, seconds);
}

void take_refinements(struct server *server, const struct tile *tile,
                      struct refinement *refinements)
{
    adaptive_refinements(server->service->adaptive, tile, refinements);
    if (tile->id >= server->sampled_room) {
        server->sampled_room = 2 * tile->id + 1024;
        server->sampled =
            reallocate(server->sampled, server->sampled_room, sizeof *server->sampled);
    }
    server->sampled[tile->id] = refinements_sampled(refinements, tile_pixels(tile));
}

static bool is_as_asked(const struct server *server, const struct tile *tile,
                        const struct result_header *header)
{
    uint32_t asked = tile_is_refined(tile) ? server->sampled[tile->id] : tile_pixels(tile);
    return header->pixels == asked;
}

static void put_tile(struct server *server, uint32_t renderer, const struct tile *tile,
                     const float *rgb, const struct result_header *header)
{
    struct service *service = server->service;
    note_in_timeline(service, TIMELINE_TILE, renderer, tile, header);
    note_costs(service, tile, header->cpu_s);
    if (service->adaptive) {
        assert(tile->pass + 1 == adaptive_passes(service->adaptive));
        save_part(service->save, tile, header, rgb);
        adaptive_put(service->adaptive, tile, rgb, header->cpu_s);
    } else {
        canvas_put(service->canvas, tile, rgb);
        save_tile(service->save, tile, header);
    }
    render_counts_add(&server->served->counts, &header->counts);
    watch_add(service->watch, header->pixels, header);
    if (!server->served->timed_out) server->finished_at = clock_wall();
    /* A plan from which no tile comes lies after the render phase, which ends with the last tile. */
    server->served->plan_s += server->planned_s;
    server->planned_s = 0;
}

/* ---- pieces of tiles ---- */

static void keep_piece(struct server *server, uint32_t renderer, const struct tile *tile,
                       const float *rgb, const struct result_header *header)
{
    size_t floats = header->pixels * result_floats(tile, server->service->adaptive != NULL);
    struct kept_piece piece = {.renderer = renderer,
                               .tile = *tile,
                               .header = *header,
                               .rgb = allocate(floats, sizeof *piece.rgb)};
    memcpy(piece.rgb, rgb, floats * sizeof *piece.rgb);
    server->pieces = grow(server->pieces, server->piece_count, sizeof *server->pieces);
    server->pieces[server->piece_count++] = piece;
}

static void settle_piece(struct server *server, const struct fate *fate)
{
    uint32_t i = 0;
    while (i < server->piece_count && server->pieces[i].tile.id != fate->id)
        i++;
    assert(i < server->piece_count);
    struct kept_piece piece = server->pieces[i];
    server->pieces[i] = server->pieces[--server->piece_count];
    if (fate->counts)
        put_tile(server, piece.renderer, &piece.tile, piece.rgb, &piece.header);
    else
        note_in_timeline(server->service, TIMELINE_WASTED, piece.renderer, &piece.tile,
                         &piece.header);
    free(piece.rgb);
}

void put_last_pieces(struct server *server)
{
    for (uint32_t i = 0; i < server->piece_count; i++) {
        struct kept_piece *piece = &server->pieces[i];
        put_tile(server, piece->renderer, &piece->tile, piece->rgb, &piece->header);
        free(piece->rgb);
    }
    free(server->pieces);
}

void accept_tile(struct server *server, uint32_t renderer, const struct tile *tile,
                 const float *rgb, const struct result_header *header)
{
    struct service *service = server->service;
    double now = server_elapsed(server);
    double seconds = queue_seconds(service->queue, renderer, header->busy_s, header->cpu_s);
    enum answer answer = queue_finish(service->queue, renderer, tile->id, now, seconds);
    struct fate fate;
    if (answer != ANSWER_IN_VAIN && service->adaptive && !is_as_asked(server, tile, header))
        fatal("rank %u sent other pixels than it was asked for", rank_of(server, renderer));
    if (answer == ANSWER_COUNTS)
        put_tile(server, renderer, tile, rgb, header);
    else if (answer == ANSWER_KEPT)
        keep_piece(server, renderer, tile, rgb, header);
    else
        note_in_timeline(service, TIMELINE_WASTED, renderer, tile, header);
    while (queue_fate(service->queue, &fate))
        settle_piece(server, &fate);
}

void accept_dropped(struct server *server, uint32_t renderer, const struct tile *tile,
                    const struct result_header *header)
{
    if (header->busy_s > 0)
        note_in_timeline(server->service, TIMELINE_WASTED, renderer, tile, header);
    struct queue *queue = server->service->queue;
    double seconds = queue_seconds(queue, renderer, header->busy_s, header->cpu_s);
    queue_drop(queue, renderer, tile->id, server_elapsed(server), seconds);
}

void accept_probes(struct server *server, uint32_t renderer, const struct tile *tile,
                   const float *rgb, const struct result_header *header)
{
    struct service *service = server->service;
    note_in_timeline(service, TIMELINE_PROBES, renderer, tile, header);
    const float *seconds = rgb + 3 * (size_t)tile_pixels(tile);
    preview_put(&server->preview, service->canvas->width, service->canvas->height, tile, rgb);
    if (!queue_probed(service->queue, tile, seconds))
        fatal("rank %u sent probes whose times make no sense", rank_of(server, renderer));
    queue_finish(service->queue, renderer, tile->id, server_elapsed(server), header->busy_s);
    server->served->probe_s += header->busy_s;
}
