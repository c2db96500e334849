#include <math.h>

#include "common/clock.h"
#include "common/whole.h"
#include "master/image_file.h"
#include "master/server.h"

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

/*
 * The share of the time left that a pass is to take at most. Of the first one behind pass 0 it is known only
 * roughly how long its samples take: 0.7 to 2 times what is foreseen, so that half is the most that still fits.
 * Later ones know it from that one. What is cut off at the end lacks samples in whole tiles, which costs more
 * than a pass more.
 */
#define SHARE_FIRST 0.5
#define SHARE_LATER 0.9

/* Where no more is left than a pass of SHARE_LATER leaves, in terms of the time behind, the next one is the last:
 * rather too long than that nobody has anything to do at the end. */
#define LAST_LEFT  0.08
#define SHARE_LAST 1.1

/* Seconds for which renderers are taken to have been busy before anything was measured: nothing beside what is. */
#define BUSY_BEFORE 0.01

/* What is kept of a time limit for writing, at most: who asks for a picture in less time than writing takes gets
 * one that is late rather than one that was hardly rendered. */
#define WRITING_MOST 0.5

void keep_for_writing(struct server *server, bool rendered)
{
    struct service *service = server->service;
    double seconds = 0;
    if (!(service->limit > 0)) return;
    for (int i = 0; i < SERVICE_IMAGES; i++)
        if (service->images[i] && *service->images[i])
            seconds += image_seconds(service->images[i], service->canvas, rendered);
    service->writing_s = fmin(seconds, WRITING_MOST * service->limit);
}

double rendering_ends(const struct server *server)
{
    return server->service->deadline - server->service->writing_s - server->last_plan_s;
}

/* Wall seconds until the time limit ends rendering, when another plan is made, which takes as long as the last
 * one; 0 or less: it would come too late. */
static double seconds_left(const struct server *server)
{
    return rendering_ends(server) - clock_wall() - server->last_plan_s;
}

/* What the next pass may take: seconds of all renderers' processors, which are used as much as they were so far
 * in this run. */
static double seconds_for_pass(const struct server *server)
{
    const struct service *service = server->service;
    double left = seconds_left(server);
    if (!(left < HUGE_VAL)) return HUGE_VAL;
    double elapsed = server_elapsed(server);
    double rendered = adaptive_seconds(service->adaptive) - server->rendered_before;
    double processors = (rendered + BUSY_BEFORE * service->processors) / (elapsed + BUSY_BEFORE);
    double share = left < LAST_LEFT * elapsed                ? SHARE_LAST
                   : adaptive_passes(service->adaptive) == 1 ? SHARE_FIRST
                                                             : SHARE_LATER;
    return share * fmax(left, 0) * processors;
}

/* The next pass, or what is left of this one, or the end of passes; the lock is held. */
static void begin_pass(struct server *server)
{
    struct service *service = server->service;
    const struct canvas *canvas = service->canvas;
    /* One that an earlier run has left is there already. */
    if (adaptive_is_complete(service->adaptive))
        server->last_pass = !adaptive_plan(service->adaptive, seconds_for_pass(server));
    if (server->last_pass) return;
    server->tiles_before = queue_count(service->queue).tiles;
    uint32_t edge = PASS_EDGE, largest = queue_largest_lot(service->queue);
    while (edge * edge > largest)
        edge /= 2;
    struct tile tile = {.step = 1, .pass = adaptive_passes(service->adaptive) - 1};
    for (tile.y = 0; tile.y < canvas->height; tile.y += edge) {
        for (tile.x = 0; tile.x < canvas->width; tile.x += edge) {
            tile.w = smaller(canvas->width - tile.x, edge);
            tile.h = smaller(canvas->height - tile.y, edge);
            add_work(server, tile);
        }
    }
}

void follow_passes(struct server *server)
{
    if (server->last_pass || server->service->ending) return;
    pthread_mutex_lock(&server->lock);
    while (!server->last_pass && queue_complete(server->service->queue) &&
           seconds_left(server) > 0) {
        struct adaptive *adaptive = server->service->adaptive;
        /* What an earlier run has left need not be a whole pass. */
        bool complete = adaptive_is_complete(adaptive);
        if (complete && adaptive_passes(adaptive) == 1) keep_for_writing(server, true);
        double begin = clock_wall();
        if (complete) watch_pass(server->service->watch, begin);
        begin_pass(server);
        server->last_plan_s = clock_wall() - begin;
        server->planned_s += server->last_plan_s;
    }
    pthread_mutex_unlock(&server->lock);
}
