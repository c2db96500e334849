#include "common/message.h"
#include "master/server.h"

static void note_lot(struct service *service, enum lot_kind kind, uint32_t renderer,
                     const struct tile *tile, const struct result_header *header)
{
    if (service->timeline) timeline_add(service->timeline, kind, renderer, tile, header);
}

uint32_t take_refinements(struct server *server, const struct tile *tile,
                          struct refinement *refinements)
{
    adaptive_take(server->service->adaptive, tile, refinements);
    if (tile->id >= server->sampled_room) {
        server->sampled_room = tile->id < 512 ? 1024 : 2 * tile->id;
        server->sampled =
            reallocate(server->sampled, server->sampled_room, sizeof *server->sampled);
    }
    server->sampled[tile->id] = refinements_sampled(refinements, tile_pixels(tile));
    return server->sampled[tile->id];
}

/* Whether the answer has the pixels that were asked for. */
static bool is_as_asked(const struct server *server, const struct tile *tile,
                        const struct result_header *header)
{
    uint32_t asked = tile_is_refined(tile) ? server->sampled[tile->id] : tile_pixels(tile);
    return header->pixels == asked;
}

void accept_tile(struct server *server, uint32_t renderer, const struct tile *tile,
                 const float *rgb, const struct result_header *header)
{
    struct service *service = server->service;
    double now = server_elapsed(server);
    double seconds = queue_seconds(service->queue, renderer, header->busy_s, header->cpu_s);
    bool first = queue_finish(service->queue, renderer, tile->id, now, seconds);
    note_lot(service, first ? LOT_TILE : LOT_WASTED, renderer, tile, header);
    if (!first) return;
    if (service->adaptive) {
        if (!is_as_asked(server, tile, header))
            fatal("renderer %u sent other pixels than it was asked for", renderer);
        save_part(service->save, tile, header, rgb);
        adaptive_put(service->adaptive, tile, rgb, header->cpu_s);
    } else {
        canvas_put(service->canvas, tile, rgb);
        save_tile(service->save, tile, header);
    }
    render_counts_add(&service->counts, &header->counts);
    server->rays += render_counts_rays(&header->counts);
    watch_add(service->watch, tile_pixels(tile), header);
    server->finished = server->start + now;
}

void accept_dropped(struct server *server, uint32_t renderer, const struct tile *tile,
                    const struct result_header *header)
{
    if (header->busy_s > 0) note_lot(server->service, LOT_WASTED, renderer, tile, header);
    struct queue *queue = server->service->queue;
    double seconds = queue_seconds(queue, renderer, header->busy_s, header->cpu_s);
    queue_drop(queue, renderer, tile->id, server_elapsed(server), seconds);
}

void accept_probes(struct server *server, uint32_t renderer, const struct tile *tile,
                   const float *rgb, const struct result_header *header)
{
    struct service *service = server->service;
    note_lot(service, LOT_PREPASS, renderer, tile, header);
    const float *seconds = rgb + 3 * (size_t)tile_pixels(tile);
    preview_put(&server->preview, service->canvas->width, service->canvas->height, tile, rgb);
    queue_probed(service->queue, tile, seconds);
    queue_finish(service->queue, renderer, tile->id, server_elapsed(server), header->busy_s);
    server->probe_s += header->busy_s;
}
