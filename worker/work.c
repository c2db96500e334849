#include "worker/work.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/bell.h"
#include "common/clock.h"
#include "common/message.h"
#include "common/nap.h"
#include "worker/collective.h"
#include "worker/node_scene.h"
#include "worker/survey.h"
#include "worker/worker.h"

/* Seconds from one look at messages between waves, which may be a few microseconds apart, to the next: to
 * look at MPI after every wave, as without a tray, took a hundredth of a renderer's instructions. So long is
 * rendered in vain what somebody else has finished. */
#define LOOK_EVERY 50e-6

/* Between waves: lets MPI move what is under way, and hears whether to give up the tile. */
static bool hear_whether_to_give_up(void *context)
{
    struct worker *worker = context;
    double now = clock_wall();
    if (now >= worker->looked + LOOK_EVERY) {
        worker->looked = now;
        hear_all(worker);
        if (now >= worker->tell_at) tell(worker, now);
    }
    return worker->stopped || worker->given_up;
}

/* At most: of refined tiles not all pixels get samples. */
static size_t tile_bytes(const struct worker *worker, const struct tile *tile)
{
    return result_bytes(tile, tile_pixels(tile), worker->adaptive);
}

/* Of the tiles from the first one on. */
static size_t lot_bytes(const struct worker *worker, const struct lot *lot, uint32_t first)
{
    size_t bytes = 0;
    for (uint32_t i = first; i < lot->count; i++)
        bytes += tile_bytes(worker, &lot->tiles[i]);
    return bytes;
}

/* Pixels of a tile that get samples. */
static uint32_t sampled_pixels(const struct tile *tile, const struct refinement *refinements)
{
    uint32_t pixels = tile_pixels(tile);
    return refinements ? refinements_sampled(refinements, pixels) : pixels;
}

/* Renders a tile, or probes, into pixels; false: it was given up. */
static bool render_pixels(struct worker *worker, const struct tile *tile,
                          const struct refinement *refinements, uint32_t pixels, float *rgb,
                          struct render_counts *counts)
{
    if (tile->pass == TILE_PROBE)
        return survey(worker->renderer, tile, rgb, rgb + 3 * (size_t)pixels);
    struct pixel_floats to = pixel_floats(rgb, pixels, worker->adaptive);
    struct task task = {.tile = tile, .refinements = refinements, .to = to};
    return renderer_task(worker->renderer, &task, counts);
}

/* A header alone in place of a tile that was not begun; returns its length. */
static size_t put_dropped(const struct tile *tile, char *part)
{
    struct result_header header = {.tile_id = tile->id, .pixels = RESULT_DROPPED};
    memcpy(part, &header, sizeof header);
    return sizeof header;
}

/* Renders a tile into its part of a result; returns the length of that, 0: the master has said STOP. */
static size_t render_part(struct worker *worker, const struct tile *tile,
                          const struct refinement *refinements, char *part)
{
    struct render_counts counts = {0};
    uint32_t pixels = sampled_pixels(tile, refinements);
    /* Behind the header, a multiple of 8 bytes long like all parts, in an allocated block: aligned. */
    float *rgb = (void *)(part + sizeof(struct result_header));
    double begin = worker->time.begun, end;
    bool whole = render_pixels(worker, tile, refinements, pixels, rgb, &counts);
    double cpu = cpu_time_end(&worker->time, &end);
    struct result_header header = {.tile_id = tile->id,
                                   .pixels = whole ? pixels : RESULT_DROPPED,
                                   .start_s = begin - worker->start,
                                   .busy_s = end - begin,
                                   .cpu_s = cpu,
                                   .counts = counts};
    renderer_stats_add(&worker->stats, tile, &header);
    memcpy(part, &header, sizeof header);
    if (whole) return result_bytes(tile, pixels, worker->adaptive);
    return worker->stopped ? 0 : sizeof header;
}

/* Before tile i of the current lot: wakes the master, once, if half of the tiles are done and there is no lot
 * behind this one. Dear tiles come first, so what is left is less than half of the time; enough for an
 * answer. If the lot is long, the master looks in time without that. */
static void call_for_more(struct worker *worker, uint32_t i)
{
    struct lot *lot = &worker->current;
    if (!lot->calls || worker->waiting > 0 || lot->has_called || i < lot->count / 2) return;
    lot->has_called = true;
    bell_ring(worker->bell);
}

/* Whether the result that goes into the buffer, or the tray, is to be sent before the next tile. */
static bool is_full(const struct worker *worker, size_t whole, const struct tile *next)
{
    size_t done = worker->done;
    return !worker->in_tray && result_is_full(whole, done, done + tile_bytes(worker, next));
}

/* Tile i of the current lot is next. */
static void begin_tile(struct worker *worker, uint32_t i)
{
    worker->rendering = i;
    worker->given_up = worker->told = false;
    double begun = cpu_time_begin(&worker->time);
    worker->tell_at = begun + (double)worker->current.tells[i];
}

/* Renders tiles of the current lot, from the first one on, with the refinements that are next, until
 * an answer is due, as it is behind a tile that the master was told of: it has taken the next ones for others,
 * or waits to hear that they are begun. Returns the number of the next tile, 0: the master has said STOP. What
 * was finished until then is sent. */
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
        hear_all(worker);
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
    } while (!stopped && ++i < lot->count && !worker->told &&
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

static void start_worker(struct worker *worker, MPI_Comm comm, struct renderer *renderer,
                         const struct node_scene *shared)
{
    int rank;
    const struct view *view = &shared->scene->view;
    MPI_Comm_rank(comm, &rank);
    *worker = (struct worker){.comm = comm,
                              .renderer = renderer,
                              .view = view,
                              .bell = shared->bell,
                              .tray = shared->tray,
                              .arrivals = shared->arrivals,
                              .adaptive = view->max_samples > view->min_samples,
                              .incoming = allocate(1, sizeof *worker->incoming),
                              .pong = MPI_REQUEST_NULL,
                              .telling = MPI_REQUEST_NULL,
                              .finished = MPI_REQUEST_NULL};
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

/* What is under way arrives; then the master hears how it was. */
static void end_worker(struct worker *worker)
{
    double start = clock_wall();
    for (int i = 0; i < SENDS; i++)
        wait_request(&worker->sends[i]);
    worker->stats.send_s += clock_wall() - start;
    wait_request(&worker->pong);
    wait_request(&worker->finished);
    wait_request(&worker->telling);
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
    free(worker->told_bytes);
    free(worker->incoming);
}

/* Seconds for which a renderer waits for the bell if it knows of nothing under way. Then it looks at MPI
 * all the same, which may have something to move that only MPI knows of. Nothing is known that needs that;
 * a wake-up with its look takes some 20 us, which is nothing of a second. */
#define SLEEP_LONGEST 1.0

/* Until there may be something to hear. */
static void wait_for_message(struct worker *worker, struct nap *nap)
{
    if (nap_spins(nap)) return;
    if (!worker->tray) {
        nap_take(nap);
        return;
    }
    bool moves = is_under_way(worker);
    bool rung = bell_wait(&worker->tray->bell, moves ? nap_next(nap) : SLEEP_LONGEST);
    /* It may have rung for what was heard while he rendered. */
    if (rung && tray_has_news(worker->tray, worker->heard)) nap_reset(nap);
    if (!rung && !moves) worker->unsettled = true;
}

void work(MPI_Comm comm, struct renderer *renderer, const struct node_scene *shared)
{
    struct worker worker;
    start_worker(&worker, comm, renderer, shared);
    struct nap nap = {0};
    renderer_on_wave(renderer, hear_whether_to_give_up, &worker);
    while (!worker.stopped) {
        bool heard = hear(&worker);
        if (worker.waiting > 0) {
            render_next(&worker);
            if (worker.waiting == 0) bell_ring(worker.bell);
        } else if (!heard && !worker.stopped) {
            wait_for_message(&worker, &nap);
        }
        if (heard || worker.waiting > 0) nap_reset(&nap);
    }
    renderer_on_wave(renderer, NULL, NULL);
    end_worker(&worker);
}
