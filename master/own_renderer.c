/* The second thread of rank 0: a renderer that takes lots from the queue and hands in its tiles under the lock, without
 * messages. */
#include <stdlib.h>

#include "common/bell.h"
#include "common/clock.h"
#include "common/cpu_time.h"
#include "common/message.h"
#include "common/nap.h"
#include "master/server.h"

/* Releases the lock. Wakes the main thread if what was done under it gives other renderers something to do, or
 * lets them leave. */
static void own_unlock(struct server *server)
{
    const struct queue *queue = server->service->queue;
    bool rings =
        queue_news(queue) != server->news || queue_has_recalls(queue) || queue_complete(queue);
    pthread_mutex_unlock(&server->lock);
    if (rings) bell_ring(server->service->bell);
}

/* Gets the next lot; 0: nothing is left. Waits while other renderers hold what is left. */
static uint32_t own_next(struct server *server, struct tile *tiles)
{
    struct queue *queue = server->service->queue;
    struct nap nap = {0};
    for (;;) {
        pthread_mutex_lock(&server->lock);
        uint32_t count = queue_next(queue, 0, server_elapsed(server), tiles);
        bool over = server_is_through(server, 0);
        own_unlock(server);
        if (count > 0 || over) return count;
        nap_take(&nap);
    }
}

static void own_leave(struct server *server)
{
    pthread_mutex_lock(&server->lock);
    server->own_done = true;
    pthread_mutex_unlock(&server->lock);
    bell_ring(server->service->bell);
}

/* Whether this renderer is still to render the tile; it counts as begun then. */
static bool own_keeps(struct server *server, const struct tile *tile)
{
    struct queue *queue = server->service->queue;
    pthread_mutex_lock(&server->lock);
    bool dropped = queue_is_recalled(queue, 0, tile->id);
    if (dropped) queue_drop(queue, 0, tile->id, server_elapsed(server), 0);
    bool over = server_is_through(server, 0);
    server->own_tile = tile->id;
    server->service->given_up = false;
    own_unlock(server);
    return !dropped && !over;
}

struct own_work {
    float *rgb;                     /* REFINED_FLOATS per pixel */
    struct refinement *refinements; /* one per pixel; NULL: not adaptive */
    struct cpu_time time;
};

/* Gets what the tile's pass asks for; NULL: it is not refined. */
static const struct refinement *own_refinements(struct server *server, const struct tile *tile,
                                                struct refinement *refinements)
{
    if (!tile_is_refined(tile)) return NULL;
    pthread_mutex_lock(&server->lock);
    take_refinements(server, tile, refinements);
    pthread_mutex_unlock(&server->lock);
    return refinements;
}

/* Hands in a tile, or the notice that it was given up. */
static void own_answer(struct server *server, const struct tile *tile, const float *rgb,
                       const struct result_header *header, bool whole)
{
    pthread_mutex_lock(&server->lock);
    if (!whole)
        accept_dropped(server, 0, tile, header);
    else if (tile->pass == TILE_PROBE)
        accept_probes(server, 0, tile, rgb, header);
    else
        accept_tile(server, 0, tile, rgb, header);
    own_unlock(server);
}

/* Renders or probes a tile and hands it in; false: the run is stopped. */
static bool render_one(struct server *server, const struct tile *tile, struct own_work *work)
{
    const struct tile_renderer *own = server->service->own;
    const struct refinement *refinements = own_refinements(server, tile, work->refinements);
    float *rgb = work->rgb;
    struct result_header header;
    cpu_time_begin(&work->time);
    bool whole = own->render(own->state, tile, refinements, &work->time, rgb, &header);
    header.start_s -= server->start;
    renderer_stats_add(&server->service->stats[0], tile, &header);
    if (!whole && !server->service->given_up) return false;
    own_answer(server, tile, rgb, &header, whole);
    return true;
}

void *render_own(void *argument)
{
    struct server *server = argument;
    struct service *service = server->service;
    uint32_t largest = queue_largest_lot(service->queue);
    struct own_work work = {.rgb = allocate(largest, REFINED_FLOATS * sizeof *work.rgb)};
    if (service->adaptive) work.refinements = allocate(largest, sizeof *work.refinements);
    double cpu = clock_thread_cpu();
    struct tile tiles[LOT_TILES];
    bool goes_on = true;
    uint32_t count;
    while (goes_on && (count = own_next(server, tiles)) > 0)
        for (uint32_t i = 0; i < count && goes_on; i++)
            goes_on = !own_keeps(server, &tiles[i]) || render_one(server, &tiles[i], &work);
    service->stats[0].cpu_s = clock_thread_cpu() - cpu;
    free(work.rgb);
    free(work.refinements);
    own_leave(server);
    return NULL;
}
