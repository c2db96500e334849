#include "worker/work.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/bell.h"
#include "common/clock.h"
#include "common/cpu_time.h"
#include "common/message.h"
#include "common/nap.h"
#include "common/orphan.h"
#include "worker/collective.h"
#include "worker/node_scene.h"
#include "worker/worker.h"

/*
 * Minimum time in seconds between polls for messages between waves, which may be only a few microseconds
 * apart. Polling MPI after every wave took a hundredth of a renderer's instructions without a tray. A tile
 * that another renderer has finished is rendered in vain for at most about this long.
 */
#define POLL_INTERVAL 50e-6

/* Called between waves: lets MPI make progress, and tells whether to give up the tile. */
static bool poll_whether_to_give_up(void *context)
{
    struct worker *worker = context;
    double now = clock_wall();
    if (now >= worker->polled + POLL_INTERVAL) {
        worker->polled = now;
        receive_all(worker);
        if (now >= worker->report_at) report_unfinished(worker, now);
    }
    return worker->stopped || worker->given_up;
}

/* Largest size of the tile's result: not all pixels of a refined tile need get samples. */
static size_t tile_bytes(const struct worker *worker, const struct tile *tile)
{
    return result_bytes(tile, tile_pixels(tile), worker->adaptive);
}

/* The same for the tiles of a lot from `first` on. */
static size_t lot_bytes(const struct worker *worker, const struct lot *lot, uint32_t first)
{
    size_t bytes = 0;
    for (uint32_t i = first; i < lot->count; i++)
        bytes += tile_bytes(worker, &lot->tiles[i]);
    return bytes;
}

static bool probe_pixel(struct renderer *renderer, uint32_t x, uint32_t y, float *rgb)
{
    struct render_counts counts;
    struct tile pixel = {.x = x, .y = y, .w = 1, .h = 1, .step = 1};
    struct task task = {.tile = &pixel, .survey = true, .to.mean = rgb};
    return renderer_task(renderer, &task, &counts);
}

/*
 * Traces the first sample of every pixel of a valid tile, each on its own, for predictions of what tiles cost
 * (master/cost.h). Writes 3 floats (linear RGB) per pixel in the tile's order to rgb, and its CPU seconds to seconds,
 * not wall seconds: other processes may share the core. Returns false if it was interrupted; both are then undefined.
 */
static bool survey(struct renderer *renderer, const struct tile *tile, float *rgb, float *seconds)
{
    uint32_t pixels = tile_pixels(tile);
    struct cpu_time time = {0};
    for (uint32_t k = 0; k < pixels; k++) {
        uint32_t x, y;
        double ended;
        tile_pixel(tile, k, &x, &y);
        cpu_time_begin(&time);
        if (!probe_pixel(renderer, x, y, rgb + 3 * (size_t)k)) return false;
        seconds[k] = (float)cpu_time_end(&time, &ended);
    }
    return true;
}

bool work_on_tile(struct renderer *renderer, const struct tile *tile,
                  const struct refinement *refinements, struct cpu_time *time, float *floats,
                  struct result_header *header)
{
    const struct view *view = &renderer_scene(renderer)->view;
    uint32_t pixels = tile_pixels(tile);
    if (refinements) pixels = refinements_sampled(refinements, pixels);
    struct task task = {.tile = tile,
                        .refinements = refinements,
                        .to = pixel_floats(floats, pixels, view->max_samples > view->min_samples)};
    *header = (struct result_header){.tile_id = tile->id, .start_s = time->begun};
    bool whole = tile->pass == TILE_PROBE
                     ? survey(renderer, tile, floats, floats + 3 * (size_t)pixels)
                     : renderer_task(renderer, &task, &header->counts);
    double end;
    header->cpu_s = cpu_time_end(time, &end);
    header->busy_s = end - header->start_s;
    header->pixels = whole ? pixels : RESULT_DROPPED;
    return whole;
}

/* Writes the header for a tile that is dropped before it is begun; returns its length. */
static size_t put_dropped(const struct tile *tile, char *part)
{
    struct result_header header = {.tile_id = tile->id, .pixels = RESULT_DROPPED};
    memcpy(part, &header, sizeof header);
    return sizeof header;
}

/* Renders a tile into its part of a result. Returns the length of the part, 0 if STOP was received. */
static size_t render_part(struct worker *worker, const struct tile *tile,
                          const struct refinement *refinements, char *part)
{
    struct result_header header;
    /* Aligned: the block is allocated, and all headers and parts have a multiple of 8 bytes. */
    float *floats = (void *)(part + sizeof header);
    bool whole = work_on_tile(worker->renderer, tile, refinements, &worker->time, floats, &header);
    header.start_s -= worker->start;
    renderer_stats_add(&worker->stats, tile, &header);
    memcpy(part, &header, sizeof header);
    if (whole) return result_bytes(tile, header.pixels, worker->adaptive);
    return worker->stopped ? 0 : sizeof header;
}

/*
 * Called before tile i of the current lot: rings the master's bell once, if half of the tiles are done and no
 * other lot is waiting. Expensive tiles come first, so less than half of the lot's time is left; that is
 * enough for an answer. If the lot is long, the master looks in time without being called.
 */
static void call_for_more(struct worker *worker, uint32_t i)
{
    struct lot *lot = &worker->current;
    if (!lot->wakes_master || worker->waiting > 0 || lot->has_woken_master || i < lot->count / 2)
        return;
    lot->has_woken_master = true;
    bell_ring(worker->bell);
}

/* Whether the result must be sent before the next tile is rendered. */
static bool is_full(const struct worker *worker, size_t whole, const struct tile *next)
{
    size_t done = worker->done;
    return !worker->in_tray && result_is_full(whole, done, done + tile_bytes(worker, next));
}

/* Tile i of the current lot is next. */
static void begin_tile(struct worker *worker, uint32_t i)
{
    worker->rendering = i;
    worker->given_up = worker->reported = false;
    double begun = cpu_time_begin(&worker->time);
    worker->report_at = begun + (double)worker->current.report_s[i];
}

/*
 * Renders tiles of the current lot, beginning with number `first`, and sends what it has finished.
 * *refinements points to those of the next refined tile. Ends when an answer is due. One is due also after a
 * tile that was reported: the master has given the following tiles to others, or waits to hear that they are
 * begun. Returns the number of the next tile, 0 if STOP was received.
 */
static uint32_t render_some(struct worker *worker, uint32_t first,
                            const struct refinement **refinements)
{
    struct lot *lot = &worker->current;
    size_t whole = lot_bytes(worker, lot, first);
    begin_result(worker, whole);
    double begin = clock_wall();
    uint32_t i = first;
    bool stopped;
    do {
        worker->rendering = i;
        receive_all(worker);
        if ((stopped = worker->stopped)) break;
        call_for_more(worker, i);
        begin_tile(worker, i);
        const struct tile *tile = &lot->tiles[i];
        const struct refinement *refined = tile_is_refined(tile) ? *refinements : NULL;
        if (refined) *refinements += tile_pixels(tile);
        char *part = worker->result + worker->done;
        size_t bytes =
            lot->dropped[i] ? put_dropped(tile, part) : render_part(worker, tile, refined, part);
        stopped = bytes == 0;
        worker->done += bytes;
    } while (!stopped && ++i < lot->count && !worker->reported &&
             clock_wall() < begin + lot->answer_s && !is_full(worker, whole, &lot->tiles[i]));
    send_result(worker);
    return stopped ? 0 : i;
}

static void render_next(struct worker *worker)
{
    worker->current = worker->lots[0];
    worker->lots[0] = worker->lots[1];
    worker->waiting--;
    struct lot *lot = &worker->current;
    const struct refinement *refinements = lot->refinements;
    uint32_t next = 0;
    do
        next = render_some(worker, next, &refinements);
    while (next > 0 && next < lot->count);
    lot->count = 0;
    free(lot->refinements);
    lot->refinements = NULL;
}

static void start_worker(struct worker *worker, struct renderer *renderer,
                         const struct node_scene *shared)
{
    int rank;
    const struct view *view = &shared->scene->view;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    *worker = (struct worker){.renderer = renderer,
                              .view = view,
                              .bell = shared->bell,
                              .tray = shared->tray,
                              .arrivals = shared->arrivals,
                              .adaptive = view->max_samples > view->min_samples,
                              .incoming = allocate(1, sizeof *worker->incoming),
                              .pong = MPI_REQUEST_NULL,
                              .notice_send = MPI_REQUEST_NULL,
                              .early_send = MPI_REQUEST_NULL};
    for (int i = 0; i < SENDS; i++)
        worker->sends[i] = MPI_REQUEST_NULL;
    worker->stats.rank = (uint32_t)rank;
    gethostname(worker->stats.host, HOST_NAME_SIZE - 1);
    post_receive(worker);
    struct ready ready = {.rank = worker->stats.rank};
    memcpy(ready.host, worker->stats.host, sizeof ready.host);
    MPI_Request request;
    send_to_master(worker, TAG_RENDERER_TO_MASTER_READY, &ready, sizeof ready, &request);
    bell_ring(worker->bell);
    wait_request(&request);
    worker->cpu = clock_thread_cpu();
}

/* Waits until all sends are complete, then sends the statistics to the master. */
static void end_worker(struct worker *worker)
{
    double start = clock_wall();
    for (int i = 0; i < SENDS; i++)
        wait_request(&worker->sends[i]);
    worker->stats.send_s += clock_wall() - start;
    wait_request(&worker->pong);
    wait_request(&worker->early_send);
    wait_request(&worker->notice_send);
    worker->stats.cpu_s = clock_thread_cpu() - worker->cpu;
    MPI_Request request;
    send_to_master(worker, TAG_RENDERER_TO_MASTER_STATS, &worker->stats, sizeof worker->stats,
                   &request);
    bell_ring(worker->bell);
    wait_request(&request);
    for (int i = 0; i < SENDS; i++)
        free(worker->buffers[i]);
    for (int i = 0; i < worker->waiting; i++)
        free(worker->lots[i].refinements);
    free(worker->early_result);
    free(worker->incoming);
}

/*
 * Seconds for which a renderer waits for the bell if it knows of no pending communication. Then it polls MPI
 * all the same, in case MPI itself needs to make progress with something. No such case is known; a wake-up
 * with its poll takes some 20 us, which is negligible.
 */
#define SLEEP_LONGEST 1.0

/*
 * A rank 0 that lives asks a renderer from which nothing comes for a sign of life every second or so, also while it
 * renders. A look that was late because the process or its machine was suspended counts as one second.
 */
static void leave_if_orphaned(struct worker *worker)
{
    double now = clock_wall();
    bool heard = worker->received != worker->heard;
    worker->silence_s =
        heard ? 0 : worker->silence_s + fmin(now - worker->looked_at, SLEEP_LONGEST);
    worker->heard = worker->received;
    worker->looked_at = now;
    orphan_leave(worker->silence_s, worker->started ? worker->patience : ORPHAN_PATIENCE);
}

/* Waits until there may be something to receive. */
static void wait_for_message(struct worker *worker, struct nap *nap)
{
    leave_if_orphaned(worker);
    if (nap_spins(nap)) return;
    if (!worker->tray) {
        nap_take(nap);
        return;
    }
    bool moves = may_need_poll(worker);
    bool rung = bell_wait(&worker->tray->bell, moves ? nap_next(nap) : SLEEP_LONGEST);
    /* The bell may have been rung for something received while rendering. */
    if (rung && tray_has_news(worker->tray, worker->received)) nap_reset(nap);
    if (!rung && !moves) worker->unsettled = true;
}

void work(struct renderer *renderer, const struct node_scene *shared)
{
    struct worker worker;
    start_worker(&worker, renderer, shared);
    struct nap nap = {0};
    renderer_on_wave(renderer, poll_whether_to_give_up, &worker);
    while (!worker.stopped) {
        bool received = receive_next(&worker);
        if (worker.waiting > 0) {
            render_next(&worker);
            if (worker.waiting == 0) bell_ring(worker.bell);
        } else if (!received && !worker.stopped) {
            wait_for_message(&worker, &nap);
        }
        if (received || worker.waiting > 0) nap_reset(&nap);
    }
    renderer_on_wave(renderer, NULL, NULL);
    end_worker(&worker);
}
