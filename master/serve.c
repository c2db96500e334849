#include "master/serve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/bell.h"
#include "common/clock.h"
#include "common/message.h"
#include "common/nap.h"
#include "common/tray.h"
#include "master/fill.h"
#include "master/server.h"

double server_elapsed(const struct server *server)
{
    return clock_wall() - server->start;
}

bool server_is_through(struct server *server, uint32_t renderer)
{
    bool over = queue_over(server->service->queue, renderer);
    return over && (server->last_pass || server->service->ending);
}

/* Seconds between updates of the progress: two per step of the bar, which moves ten times a second. */
#define SHOW_EVERY 0.05

/* Seconds from the start of the run until rendering_ends(), more than 0; 0: there is no limit. */
static double rendering_limit(const struct server *server)
{
    const struct service *service = server->service;
    if (!(service->limit > 0)) return 0;
    return fmax(service->limit - (service->deadline - rendering_ends(server)), SHOW_EVERY);
}

/* For the trace: notes what serving has taken since it was last noted. Reading a thread's CPU time takes 0.6 us. */
static void note_service(struct server *server, double now, bool is_due)
{
    if (!server->service->timeline || (!is_due && now < server->noted_at + SHOW_EVERY)) return;
    double cpu = clock_thread_cpu();
    struct timeline_service service = {.start_s = server->noted_at - server->start,
                                       .end_s = now - server->start,
                                       .cpu_s = cpu - server->noted_cpu};
    timeline_add_service(server->service->timeline, &service);
    server->noted_at = now;
    server->noted_cpu = cpu;
}

static void show_progress(struct server *server, double now)
{
    if (now < server->next_show) return;
    server->next_show = now + SHOW_EVERY;
    const struct queue *queue = server->service->queue;
    const struct adaptive *adaptive = server->service->adaptive;
    pthread_mutex_lock(&server->lock);
    struct queue_count count = queue_count(queue);
    struct progress_state state = {
        .share_done = count.share_finished,
        .share_before = count.share_skipped,
        .tiles_done = count.finished,
        .tiles = count.tiles,
        .tiles_before = server->tiles_before,
        .pass = adaptive ? adaptive_passes(adaptive) : 0,
        .rays = render_counts_rays(&server->served->counts),
        .ends = rendering_ends(server),
        .limit = rendering_limit(server),
        .only_limit = server->service->only_limit,
    };
    /* So late, a preview would delay what is written at the end, which contains the last row of errors in any
     * case. */
    if (!server->service->ending && now + server->writing_s < rendering_ends(server)) {
        struct snapshot *snapshot = &server->service->watch->snapshot;
        bool due = snapshot_is_due(snapshot, now);
        double begin = clock_wall();
        if (due) fill_picture(server);
        watch_look(server->service->watch, now);
        if (due) snapshot_took(snapshot, clock_wall() - begin);
    }
    pthread_mutex_unlock(&server->lock);
    progress_update(server->service->progress, &state, now);
}

/* Whether to wait for a renderer that has not left yet. One that was asked for a sign of life and gave none has
 * used up part of its time before the end. */
static bool is_awaited(const struct server *server, const struct contact *contact)
{
    double since = contact->is_asked ? contact->heard_at : server->ended_at;
    return !server->service->ending || server->awake_s - since <= SERVE_GRACE;
}

static bool all_left(struct server *server)
{
    pthread_mutex_lock(&server->lock);
    bool own_done = server->own_done;
    pthread_mutex_unlock(&server->lock);
    if (!own_done) return false;
    while (server->first_there < server->renderers && server->contacts[server->first_there].is_gone)
        server->first_there++;
    for (uint32_t i = server->first_there; i < server->renderers; i++) {
        const struct contact *contact = &server->contacts[i];
        if (!contact->is_gone && is_awaited(server, contact)) return false;
    }
    return true;
}

/* Whether nothing that is being rendered matters any more. */
static bool is_over(struct server *server)
{
    pthread_mutex_lock(&server->lock);
    bool complete = server->last_pass && queue_complete(server->service->queue);
    pthread_mutex_unlock(&server->lock);
    return complete || *server->service->stop;
}

/* Ends the render phase: nothing more is handed out, and all renderers are told to give up and leave. */
static void end_all(struct server *server, bool timed_out, double now)
{
    pthread_mutex_lock(&server->lock);
    /* The render phase lasts until now, whether what is rendered until now comes in or not. */
    if (timed_out) server->finished_at = now;
    server->served->timed_out = timed_out;
    server->service->ending = true;
    server->ended_at = server->awake_s;
    queue_stop(server->service->queue);
    pthread_mutex_unlock(&server->lock);
    for (uint32_t i = server->first_remote; i < server->renderers; i++)
        tell_stop(server, i);
}

static void count_silent(struct server *server)
{
    for (uint32_t i = server->first_remote; i < server->renderers; i++) {
        if (server->contacts[i].is_gone) continue;
        server->service->stats[i].silent = 1;
        server->served->silent++;
    }
}

static void end_when_over(struct server *server, double now)
{
    bool over = is_over(server), late = now >= rendering_ends(server),
         deserted = is_deserted(server);
    if (!over && !late && !deserted) return;
    server->served->deserted = !over && !late;
    end_all(server, !over && late, now);
}

/*
 * Sleeps until there is something to do. A renderer that does not ring the bell has a lot in reserve, or has
 * sent its last message: what it sends can wait for the regular poll. Messages from other machines do not ring
 * and have to be polled for.
 */
static void take_nap(struct server *server, struct nap *nap)
{
    struct service *service = server->service;
    pthread_mutex_lock(&server->lock);
    double now = server_elapsed(server), calm = queue_calm(service->queue, now);
    double wake = fmax(queue_wake(service->queue) - now, NAP_SHORTEST);
    pthread_mutex_unlock(&server->lock);
    double most = nap_is_rung(nap)    ? nap_next(nap)
                  : service->all_ring ? NAP_SELDOM
                                      : nap_next_calm(nap, calm);
    if (bell_wait(service->bell, fmin(most, wake))) nap_woken(nap);
}

static void serve_until_done(struct server *server)
{
    struct nap nap = {.heard = server->start};
    while (!all_left(server)) {
        bool busy = take_in(server);
        follow_passes(server);
        double now = clock_wall();
        look_for_silence(server);
        if (!server->service->ending) end_when_over(server, now);
        hand_out_to_idle(server);
        tell_recalls(server);
        show_progress(server, now);
        note_service(server, now, false);
        if (busy)
            nap_heard(&nap, now);
        else
            take_nap(server, &nap);
    }
    note_service(server, clock_wall(), true);
    count_silent(server);
}

/* Corrects what renderers report and computes their waiting time. A renderer that was still busy when the last
 * tile came in, or when time was up, learns of it late (much later if it was stopped). What it did after that is
 * outside the render phase and is subtracted, from each part of its busy time in proportion. What is left of the
 * phase after rendering and sending is waiting. */
static void fill_waits(struct server *server)
{
    double render_s = server->served->render_s;
    for (uint32_t i = 0; i < server->renderers; i++) {
        struct renderer_stats *stats = &server->service->stats[i];
        double behind = fmax(0, stats->finish_s - render_s);
        double share = stats->busy_s > behind ? (stats->busy_s - behind) / stats->busy_s : 0;
        stats->finish_s -= behind;
        stats->busy_s *= share;
        stats->counts.intersect_s *= share;
        stats->counts.shade_s *= share;
        stats->wait_s = fmax(0, render_s - stats->busy_s - stats->send_s);
    }
}

/* One byte per pixel, 0 where it has no samples; owned by the caller. */
static uint8_t *find_known(const struct service *service)
{
    size_t pixels = canvas_pixels(service->canvas);
    const struct coverage *there = service->save ? &save_found(service->save)->all : NULL;
    uint8_t *known = memset(allocate(pixels, 1), 1, pixels);
    uint32_t next = 0;
    struct tile tile;
    while (queue_unfinished(service->queue, &next, &tile))
        for (uint32_t k = 0, x, y; k < tile_pixels(&tile); k++) {
            tile_pixel(&tile, k, &x, &y);
            known[(size_t)y * service->canvas->width + x] = there && coverage_has(there, x, y);
        }
    return known;
}

void fill_picture(struct server *server)
{
    const struct service *service = server->service;
    if (service->adaptive) {
        if (adaptive_unsampled(service->adaptive) > 0)
            fill_unknown(service->canvas, adaptive_levels(service->adaptive), &server->preview);
    } else if (!queue_complete(service->queue) && server->preview.edge > 0) {
        uint8_t *known = find_known(service);
        fill_unknown(service->canvas, known, &server->preview);
        free(known);
    }
}

static double guessed_rmse(const struct server *server)
{
    const struct adaptive *adaptive = server->service->adaptive;
    if (!adaptive || adaptive_unsampled(adaptive) == 0) return (double)NAN;
    return sqrt(fill_error(server->service->canvas, adaptive_levels(adaptive), &server->preview));
}

static void end_server(struct server *server)
{
    pthread_mutex_destroy(&server->lock);
    preview_free(&server->preview);
    free(server->contacts);
    free(server->drops);
    free(server->sampled);
    free(server->message);
}

/* Of a message from a renderer: the result of the largest lot, whose tiles are padded to multiples of 8 bytes
 * (result_bytes()), or what it sends at its end. Probes have a float more per pixel than tiles of the picture. */
static size_t largest_message(const struct service *service)
{
    const struct tile probe = {.pass = TILE_PROBE};
    size_t floats = service->adaptive ? REFINED_FLOATS : result_floats(&probe, false);
    size_t bytes = LOT_TILES * (sizeof(struct result_header) + 8) +
                   queue_largest_lot(service->queue) * floats * sizeof(float);
    _Static_assert(sizeof(struct ready) <= sizeof(struct renderer_stats), "has room, too");
    return bytes > sizeof(struct renderer_stats) ? bytes : sizeof(struct renderer_stats);
}

static void start_server(struct server *server, struct service *service, struct served *served)
{
    *served = (struct served){0};
    *server = (struct server){.service = service, .served = served, .own_done = !service->own};
    server->first_remote = server->first_there = service->own ? 1 : 0;
    server->renderers = (uint32_t)post_ranks() - 1 + server->first_remote;
    server->contacts = allocate_zeroed(server->renderers, sizeof *server->contacts);
    server->drops = allocate(server->renderers, sizeof *server->drops);
    server->message = allocate_zeroed(TILES_MAX_BYTES, 1);
    server->last_pass = !service->adaptive;
    if (service->adaptive) server->rendered_before = adaptive_seconds(service->adaptive);
    memset(service->stats, 0, server->renderers * sizeof *service->stats);
    for (uint32_t i = 0; i < server->renderers; i++)
        service->stats[i].rank = rank_of(server, i);
    for (uint32_t rank = 0; rank < rank_of(server, server->renderers); rank++)
        if (service->trays[rank]) server->flag_words = arrivals_words(rank + 1);
    foresee_end(server);
    if (pthread_mutex_init(&server->lock, NULL) != 0) fatal("cannot create a lock");
    server->post = post_open(largest_message(service));
    server->start = server->finished_at = server->polled_at = server->woken_at = server->noted_at =
        clock_wall();
    server->noted_cpu = clock_thread_cpu();
}

bool serve(struct service *service, struct served *served)
{
    struct server server;
    start_server(&server, service, served);
    double cpu = clock_thread_cpu();
    pthread_t thread;
    if (service->own) {
        gethostname(service->stats[0].host, HOST_NAME_SIZE - 1);
        if (pthread_create(&thread, NULL, render_own, &server) != 0)
            fatal("cannot start the rendering thread");
    }
    serve_until_done(&server);
    if (service->own) pthread_join(thread, NULL);
    post_close(server.post, served->silent == 0);
    served->began_at = server.start;
    served->reserved_s = service->limit > 0 ? service->deadline - rendering_ends(&server) : 0;
    served->render_s = server.finished_at - server.start;
    served->master_cpu_s = clock_thread_cpu() - cpu;
    fill_waits(&server);
    fill_picture(&server);
    served->guessed_rmse = guessed_rmse(&server);
    put_last_pieces(&server); /* replaces what was guessed there */
    end_server(&server);
    /* Between passes the queue is complete, but not the picture. */
    return served->timed_out || (server.last_pass && queue_complete(service->queue));
}
