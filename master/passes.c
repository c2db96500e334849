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
    double cost = queue_work(service->queue, &tile) * work.samples / first;
    /* Of first samples nobody knows what they are good for: dear ones first, as in pass 0. */
    double priority = adaptive_is_first(service->adaptive) ? cost / work.samples
                                                           : work.removed / fmax(cost, 1e-300);
    queue_add(service->queue, &tile, cost, priority);
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

/* What is kept of a time limit for its end, at most: who asks for a picture in less time than writing takes gets one
 * that is late rather than one that was hardly rendered. */
#define KEPT_MOST 0.5

/* Seconds for a pixel to be filled from those around, and to be planned: 7 to 13 and 30 to 50 ns were measured, of
 * pictures of 0.3 to 11 million and on two cores. */
#define FILL_PIXEL_S 12e-9
#define PLAN_PIXEL_S 40e-9

void guess_times(struct server *server)
{
    struct service *service = server->service;
    double pixels = (double)canvas_pixels(service->canvas);
    if (!(service->limit > 0) || !service->adaptive) return;
    server->fill_s = FILL_PIXEL_S * pixels;
    service->last_plan_s = PLAN_PIXEL_S * pixels;
}

void estimate_writing(struct server *server, bool rendered)
{
    struct service *service = server->service;
    double seconds = 0;
    if (!(service->limit > 0)) return;
    for (int i = 0; i < SERVICE_IMAGES; i++)
        if (service->images[i] && *service->images[i])
            seconds += image_seconds(service->images[i], service->canvas, rendered, i == 0,
                                     i == 0 ? crew_size(service->crew) : 1);
    service->writing_s = seconds;
}

double rendering_ends(const struct server *server)
{
    const struct service *service = server->service;
    double end = service->writing_s + service->last_plan_s + server->fill_s;
    return service->deadline - fmin(end, KEPT_MOST * service->limit);
}

/* Wall seconds until the time limit ends rendering, when another plan is made, which takes as long as the last
 * one; 0 or less: it would come too late. */
static double seconds_left(const struct server *server)
{
    return rendering_ends(server) - clock_wall() - server->service->last_plan_s;
}

/* CPU seconds that this run has rendered for the picture. */
static double rendered_s(const struct server *server)
{
    return adaptive_seconds(server->service->adaptive) - server->rendered_before;
}

/* What the next pass may take: seconds of all renderers' processors, which are used as much as they were so far
 * in this run. */
static double seconds_for_pass(const struct server *server)
{
    const struct service *service = server->service;
    double left = seconds_left(server);
    if (!(left < HUGE_VAL)) return HUGE_VAL;
    double elapsed = server_elapsed(server);
    double processors =
        (rendered_s(server) + BUSY_BEFORE * service->processors) / (elapsed + BUSY_BEFORE);
    double share = left < LAST_LEFT * elapsed             ? SHARE_LAST
                   : adaptive_is_first(service->adaptive) ? SHARE_FIRST
                                                          : SHARE_LATER;
    return share * fmax(left, 0) * processors;
}

/* So much of the time may go into probes, which else take next to none of it. Where samples are as dear as that, a
 * picture of evenly spread single samples is more than what the time would do for whole pixels; but the error is
 * told of pixels. */
#define PROBES_PART 0.5

static void end_late_probes(struct server *server)
{
    double elapsed = server_elapsed(server), left = seconds_left(server);
    if (elapsed > PROBES_PART * (elapsed + left)) queue_end_probes(server->service->queue, elapsed);
}

/* Pass 0 is cut off when no more than this share of what is left of it fits into the time: later than as soon as
 * a bit will not. Its tiles are rendered quicker than the pixels of a lattice, up to a third in the lantern, and
 * the end is foretold too late at first, up to half as late again; from the middle of the pass on rather too
 * early. */
#define CUT_BELOW       0.7
#define CUT_BELOW_LATER 0.9
#define CUT_LATER       0.5

/* That is foretold when so much of the pass is finished, or so much of the time is over: by then the dear tiles, which
 * come first, have told something about the others, or the pass will not be done by far. */
#define CUT_FROM  (1.0 / 32)
#define CUT_AFTER 0.1

/* Seconds from one look at whether pass 0 will be done in time to the next, which is some microseconds' work. So many
 * in turn have to say the same: somebody who is late for a moment makes the end look further away. */
#define CUT_LOOK_EVERY 0.01
#define CUT_LOOKS      3

/*
 * Where pass 0 would not be done in time it is cut off while there is time for something else: what nobody has
 * begun is taken back. When the rest is in, the pixels that are left get their first samples lattice by lattice, so
 * that those for which there is no time lie between others that have some. The lock is held.
 */
static void cut_when_late(struct server *server)
{
    struct queue *queue = server->service->queue;
    double elapsed = server_elapsed(server), left = seconds_left(server);
    if (server->is_cut || !(left < HUGE_VAL) || adaptive_passes(server->service->adaptive) > 1)
        return;
    if (!(left > 0) || queue_complete(queue) || elapsed < server->next_cut) return;
    server->next_cut = elapsed + CUT_LOOK_EVERY;
    struct queue_count count = queue_count(queue);
    double done = (count.share_finished - count.share_skipped) / (1 - count.share_skipped);
    bool known = done >= CUT_FROM || elapsed >= CUT_AFTER * (elapsed + left);
    double below = done < CUT_LATER ? CUT_BELOW : CUT_BELOW_LATER;
    bool late = known && left < below * (queue_ends(queue, elapsed) - elapsed);
    server->late_looks = late ? server->late_looks + 1 : 0;
    if (server->late_looks < CUT_LOOKS) return;
    server->cut_s = rendered_s(server) / done;
    server->is_cut = true;
    queue_withdraw(queue);
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

/* What writing takes is tried again behind pass 0, and when all pixels have samples. */
static bool is_to_try(const struct adaptive *adaptive)
{
    if (!adaptive_is_first(adaptive)) return false;
    return adaptive_passes(adaptive) == 1 || adaptive_unsampled(adaptive) == 0;
}

/* Behind a pass 0 that was cut off the picture is filled to see how long that takes, and to try how long writing such
 * a picture takes. */
static void look_at_picture(struct server *server)
{
    const struct adaptive *adaptive = server->service->adaptive;
    double begin = clock_wall();
    if (adaptive_unsampled(adaptive) == 0) {
        server->fill_s = 0;
    } else if (adaptive_passes(adaptive) == 1) {
        fill_picture(server);
        server->fill_s = clock_wall() - begin;
    }
    if (is_to_try(adaptive)) estimate_writing(server, true);
}

/* Between passes, when all that the last one has asked for is in. What the plan takes is taken to be what it takes the
 * next time. */
static void go_on(struct server *server)
{
    struct adaptive *adaptive = server->service->adaptive;
    double begin = clock_wall();
    if (server->is_cut) adaptive_cut(adaptive, fmax(server->cut_s - rendered_s(server), 0));
    look_at_picture(server);
    double looked = clock_wall();
    /* What an earlier run has left need not be a whole pass. */
    if (adaptive_is_complete(adaptive)) watch_pass(server->service->watch, looked);
    begin_pass(server);
    double end = clock_wall();
    server->service->last_plan_s = end - looked;
    server->planned_s += end - begin;
    if (server->service->timeline && !server->last_pass) {
        struct timeline_plan plan = {.start_s = begin - server->start,
                                     .end_s = end - server->start,
                                     .pass = adaptive_passes(adaptive) - 1};
        timeline_add_plan(server->service->timeline, &plan);
    }
}

void follow_passes(struct server *server)
{
    if (server->last_pass || server->service->ending) return;
    pthread_mutex_lock(&server->lock);
    end_late_probes(server);
    cut_when_late(server);
    while (!server->last_pass && queue_complete(server->service->queue) && seconds_left(server) > 0)
        go_on(server);
    pthread_mutex_unlock(&server->lock);
}
