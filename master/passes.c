/* The passes of adaptive sampling: adds the next pass to the queue when one is complete, cuts pass 0 off when it
 * would not be done within a time limit, and reserves time for the end of that limit. */
#include <math.h>

#include "common/clock.h"
#include "master/image_file.h"
#include "master/pass_tiles.h"
#include "master/server.h"

/*
 * The part of the remaining time that a pass is to take at most. For the first pass after pass 0 it is known
 * only roughly how long its samples take: 0.7 to 2 times what is predicted, so that half is the most that still
 * fits. Later passes know it from that one. If a pass is cut off at the end, whole tiles lack samples, which
 * costs more than an additional pass.
 */
#define SHARE_FIRST 0.5
#define SHARE_LATER 0.9

/* When no more time is left than a pass of SHARE_LATER leaves, as a part of the time so far, the next pass is
 * the last one. It is planned rather too long than that renderers have nothing to do at the end. */
#define LAST_LEFT  0.08
#define SHARE_LAST 1.1

/* Seconds for which renderers are assumed to have been busy before anything was measured: negligible beside what
 * is measured. */
#define BUSY_BEFORE 0.01

/* The largest part of a time limit that is reserved for its end. Whoever asks for a picture in less time than
 * writing takes gets one that is late rather than one that was hardly rendered. */
#define KEPT_MOST 0.5

/* Seconds per pixel for filling it from its neighbours, and for planning: 7 to 13 and 30 to 50 ns were measured,
 * in pictures of 0.3 to 11 million pixels and on two cores. */
#define FILL_PIXEL_S 12e-9
#define PLAN_PIXEL_S 40e-9

/* Measures how long writing the image files takes, by trying; rendered: the picture as it is, otherwise any of its
 * size. */
static void estimate_writing(struct server *server, bool rendered)
{
    struct service *service = server->service;
    double seconds = 0;
    if (!(service->limit > 0)) return;
    for (int i = 0; i < SERVICE_IMAGES; i++)
        if (service->images[i] && *service->images[i])
            seconds += image_seconds(service->images[i], service->canvas, rendered, i == 0,
                                     i == 0 ? thread_pool_size(service->pool) : 1);
    server->writing_s = seconds;
}

/* There is a limit only with adaptive sampling. */
void foresee_end(struct server *server)
{
    double pixels = (double)canvas_pixels(server->service->canvas);
    estimate_writing(server, false);
    if (!(server->service->limit > 0)) return;
    server->fill_s = FILL_PIXEL_S * pixels;
    server->served->last_plan_s = PLAN_PIXEL_S * pixels;
}

double rendering_ends(const struct server *server)
{
    const struct service *service = server->service;
    double end = server->writing_s + server->served->last_plan_s + server->fill_s;
    return service->deadline - fmin(end, KEPT_MOST * service->limit);
}

/* Wall seconds until the time limit ends rendering, less the time of another plan, which takes as long as the
 * last one. 0 or less: a plan would come too late. */
static double seconds_left(const struct server *server)
{
    return rendering_ends(server) - clock_wall() - server->served->last_plan_s;
}

/* CPU seconds of rendering that this run has put into the picture. */
static double rendered_s(const struct server *server)
{
    return adaptive_seconds(server->service->adaptive) - server->rendered_before;
}

/* What the next pass may take, in CPU seconds of all renderers together, if processors are used as much as they
 * were so far in this run. */
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

/* The part of the time that may go into probes, which usually take next to none of it. Where samples are as
 * expensive as that, a picture of evenly spread single samples is more than what the time would do for whole
 * pixels; but the error is stated for pixels. */
#define PROBES_PART 0.5

static void end_late_probes(struct server *server)
{
    double elapsed = server_elapsed(server), left = seconds_left(server);
    if (elapsed > PROBES_PART * (elapsed + left)) queue_end_probes(server->service->queue, elapsed);
}

/*
 * Pass 0 is cut off when no more than this part of what is left of it fits into the remaining time, rather than
 * as soon as a little of it will not fit. Its tiles are rendered faster than the pixels of a lattice, by up to a
 * third in the lantern; and the predicted end is too late at first, by up to half; from the middle of the pass
 * on it is rather too early.
 */
#define CUT_BELOW       0.7
#define CUT_BELOW_LATER 0.9
#define CUT_LATER       0.5

/* The end of pass 0 is predicted when this part of the pass is finished, or this part of the time is over. By
 * then the expensive tiles, which come first, have told something about the others, or the pass is far from
 * being done in time. */
#define CUT_FROM  (1.0 / 32)
#define CUT_AFTER 0.1

/* Seconds between checks whether pass 0 will be done in time; a check takes some microseconds. So many
 * consecutive ones have to agree: a renderer that is late for a moment makes the end look further away. */
#define CUT_LOOK_EVERY 0.01
#define CUT_LOOKS      3

/*
 * If pass 0 would not be done in time, it is cut off while there is time for something else: tiles that no
 * renderer has begun are withdrawn. When the rest is in, the remaining pixels get their first samples lattice by
 * lattice, so that those for which there is no time lie between others that have some. The lock is held.
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

/* Adds the next pass to the queue, or what is left of this one, or finds that there is none. The lock is held. */
static void begin_pass(struct server *server)
{
    struct service *service = server->service;
    /* A pass that an earlier run has begun is planned already. */
    if (adaptive_is_complete(service->adaptive))
        server->last_pass = !adaptive_plan(service->adaptive, seconds_for_pass(server));
    if (server->last_pass) return;
    server->tiles_before = queue_count(service->queue).tiles;
    pass_tiles_add(service->queue, service->adaptive);
}

/* Whether to measure again how long writing takes: after pass 0, and when all pixels have samples. */
static bool is_writing_to_be_measured(const struct adaptive *adaptive)
{
    if (!adaptive_is_first(adaptive)) return false;
    return adaptive_passes(adaptive) == 1 || adaptive_unsampled(adaptive) == 0;
}

/* After a pass 0 that was cut off, fills the picture to see how long that takes, and measures how long writing
 * such a picture takes. */
static void measure_end(struct server *server)
{
    const struct adaptive *adaptive = server->service->adaptive;
    double begin = clock_wall();
    if (adaptive_unsampled(adaptive) == 0) {
        server->fill_s = 0;
    } else if (adaptive_passes(adaptive) == 1) {
        fill_picture(server);
        server->fill_s = clock_wall() - begin;
    }
    if (is_writing_to_be_measured(adaptive)) estimate_writing(server, true);
}

/* Plans the next pass, when all that the last one has asked for is in. The next plan is assumed to take as long. */
static void plan_next_pass(struct server *server)
{
    struct adaptive *adaptive = server->service->adaptive;
    double begin = clock_wall();
    if (server->is_cut) adaptive_cut(adaptive, fmax(server->cut_s - rendered_s(server), 0));
    measure_end(server);
    double looked = clock_wall();
    /* What an earlier run has left need not be a complete pass. */
    if (adaptive_is_complete(adaptive)) watch_pass(server->service->watch, looked);
    begin_pass(server);
    double end = clock_wall();
    server->served->last_plan_s = end - looked;
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
        plan_next_pass(server);
    pthread_mutex_unlock(&server->lock);
}
