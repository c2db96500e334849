/*
 * Measures what messages cost between two ranks of one machine: mpiexec -n 2 balance_messages prints "name
 * value" lines for bench/balance_measure.c.
 *
 *   latency_s       from one rank to the other, without content
 *   byte_s          for every further byte, up to 64 KiB
 *   service_s       of the master for one result and its answer: receiving, sending, posting the next
 *                   receive, as in master/post.c
 *   service_tile_s  of the queue for every tile: probes and predictions, handing out, finishing
 *   service_tile_large_s   the same for a large picture on many renderers, whose tiles exceed the caches
 *   service_pixel_s for every pixel of the result: receiving, canvas
 *   fetch_s         in addition, for a result of more than RESULT_SHORT bytes
 *   tray_s, tray_pixel_s   replace service_s and service_pixel_s where result and answer go through a tray
 *   send_s          of a renderer for one result
 *   nap_s           by how much a nap is longer than requested
 */
#include <mpi.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/median.h"
#include "common/clock.h"
#include "common/message.h"
#include "common/nap.h"
#include "common/protocol.h"
#include "common/tray.h"
#include "master/canvas.h"
#include "master/queue.h"
#include "worker/segment.h"

#define ROUNDS 2001

enum { TAG_PING = 1, TAG_DATA = 2, TAG_REPLY = 3 };

/* Half of a round trip, seconds. */
static double one_way(int rank, int bytes)
{
    static char buffer[1 << 16];
    static double times[ROUNDS];
    for (int i = 0; i < ROUNDS; i++) {
        double start = clock_wall();
        if (rank == 0) MPI_Send(buffer, bytes, MPI_BYTE, 1, TAG_PING, MPI_COMM_WORLD);
        MPI_Recv(buffer, bytes, MPI_BYTE, 1 - rank, TAG_PING, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        if (rank == 1) MPI_Send(buffer, bytes, MPI_BYTE, 0, TAG_PING, MPI_COMM_WORLD);
        times[i] = (clock_wall() - start) / 2;
    }
    return median_of(times, ROUNDS);
}

/* ---- the master's loop, with results that have already arrived ---- */

#define SLOTS 16
#define LOTS  (ROUNDS + SLOTS)

/* The number of simulated renderers with a tray. */
#define TRAYS 44

struct trays {
    struct tray tray[TRAYS];
    struct arrivals arrivals; /* and its flags */
};

#define TRAYS_BYTES (sizeof(struct trays) + arrivals_words(TRAYS) * sizeof(uint64_t))

struct flood {
    struct canvas canvas;
    struct tile tile;
    size_t bytes;
    struct trays *trays; /* NULL: results come in messages */
    unsigned turns[TRAYS];
    char *buffers[SLOTS];
    MPI_Request requests[SLOTS];
};

static void post(struct flood *flood, int slot)
{
    MPI_Irecv(flood->buffers[slot], (int)flood->bytes, MPI_BYTE, 1, TAG_DATA, MPI_COMM_WORLD,
              &flood->requests[slot]);
}

static void take_result(struct flood *flood, const char *result)
{
    struct result_header header;
    memcpy(&header, result, sizeof header);
    if (!result_message_valid(&header, flood->bytes, &flood->tile, false))
        fatal("a result is wrong");
    canvas_expect(&flood->canvas, &flood->tile);
    canvas_put(&flood->canvas, &flood->tile, (const void *)(result + sizeof header));
}

/* Like take_tray() in master/take_in.c and send_lot() in master/hand_out.c; returns the number of results. */
static int handle_tray(struct flood *flood, uint32_t who)
{
    struct tray *tray = &flood->trays->tray[who];
    int results = 0;
    for (uint32_t bytes; (bytes = slots_bytes(&tray->results, flood->turns[who])) > 0; results++) {
        unsigned turn = flood->turns[who]++;
        if (bytes != flood->bytes) fatal("a result has another length");
        tray_expect_lot(tray, turn);
        take_result(flood, tray->result[turn % TRAY_SLOTS]);
        slots_empty(&tray->results, turn);
        tray_put_lot(tray, turn, &flood->tile, sizeof flood->tile);
    }
    return results;
}

static int handle_trays(struct flood *flood)
{
    int results = 0;
    for (uint32_t word = 0; word < arrivals_words(TRAYS); word++)
        for (uint64_t up = arrivals_take(&flood->trays->arrivals, word); up; up &= up - 1)
            results += handle_tray(flood, FLAGS_PER_WORD * word + (uint32_t)__builtin_ctzll(up));
    return results;
}

static void handle(struct flood *flood, int slot)
{
    take_result(flood, flood->buffers[slot]);
    MPI_Send(&flood->tile, sizeof flood->tile, MPI_BYTE, 1, TAG_REPLY, MPI_COMM_WORLD);
    post(flood, slot);
}

static void empty_trays(struct trays *trays)
{
    memset(trays, 0, TRAYS_BYTES);
    for (int i = 0; i < TRAYS; i++)
        tray_init(&trays->tray[i]);
    arrivals_init(&trays->arrivals, TRAYS);
}

/* Seconds per result of edge x edge pixels; trays: see struct flood. */
static double serve_flood(uint32_t edge, struct trays *trays)
{
    static double times[LOTS];
    struct flood flood = {.tile = {.w = edge, .h = edge, .step = 1}, .trays = trays};
    unsigned samples = 0;
    int handled = 0;
    flood.bytes = result_bytes(&flood.tile, tile_pixels(&flood.tile), false);
    canvas_init(&flood.canvas, edge, edge);
    if (trays) empty_trays(trays);
    for (int i = 0; i < SLOTS; i++) {
        flood.buffers[i] = allocate(flood.bytes, 1);
        post(&flood, i);
    }
    MPI_Barrier(MPI_COMM_WORLD);
    while (handled < LOTS) {
        int slots[SLOTS], count;
        MPI_Status statuses[SLOTS];
        double start = clock_wall();
        /* Like is_mpi_due() in master/take_in.c: no renderer sends a message. */
        if (trays)
            count = handle_trays(&flood);
        else
            MPI_Testsome(SLOTS, flood.requests, &count, slots, statuses);
        for (int i = 0; i < count && !trays; i++)
            handle(&flood, slots[i]);
        handled += count;
        if (count > 0) times[samples++] = (clock_wall() - start) / count;
    }
    for (int i = 0; i < SLOTS; i++) {
        MPI_Cancel(&flood.requests[i]);
        MPI_Wait(&flood.requests[i], MPI_STATUS_IGNORE);
        free(flood.buffers[i]);
    }
    canvas_free(&flood.canvas);
    return median_of(times, samples);
}

/* ---- the renderers ---- */

/* Makes a tile's result; the caller frees it. */
static char *make_result(const struct tile *tile, size_t bytes)
{
    char *result = allocate_zeroed(bytes, 1);
    struct result_header header = {.pixels = tile_pixels(tile)};
    memcpy(result, &header, sizeof header);
    return result;
}

/* Does what renderers do, in turn: each takes the answer to its last result and leaves the next one. */
static void leave_flood(uint32_t edge, struct trays *trays)
{
    struct tile tile = {.w = edge, .h = edge, .step = 1}, reply;
    size_t bytes = result_bytes(&tile, tile_pixels(&tile), false);
    char *message = make_result(&tile, bytes);
    MPI_Barrier(MPI_COMM_WORLD);
    for (unsigned i = 0; i < LOTS; i++) {
        uint32_t who = i % TRAYS;
        unsigned turn = i / TRAYS;
        struct tray *tray = &trays->tray[who];
        if (turn > 0) {
            while (slots_bytes(&tray->lots, turn - 1) == 0) {
            }
            memcpy(&reply, tray->lot[(turn - 1) % TRAY_SLOTS], sizeof reply);
            slots_empty(&tray->lots, turn - 1);
        }
        memcpy(tray->result[turn % TRAY_SLOTS], message, bytes);
        slots_fill(&tray->results, turn, (uint32_t)bytes);
        arrivals_leave(&trays->arrivals, who);
    }
    free(message);
}

/* Sends results in messages, as many as may be under way; returns seconds per Isend. */
static double send_flood(uint32_t edge)
{
    static double times[LOTS];
    struct tile tile = {.w = edge, .h = edge, .step = 1}, reply;
    size_t bytes = result_bytes(&tile, tile_pixels(&tile), false);
    char *message = make_result(&tile, bytes);
    MPI_Barrier(MPI_COMM_WORLD);
    for (int i = 0; i < LOTS; i++) {
        MPI_Request request;
        double start = clock_wall();
        MPI_Isend(message, (int)bytes, MPI_BYTE, 0, TAG_DATA, MPI_COMM_WORLD, &request);
        times[i] = clock_wall() - start;
        MPI_Wait(&request, MPI_STATUS_IGNORE);
        if (i >= SLOTS)
            MPI_Recv(&reply, sizeof reply, MPI_BYTE, 0, TAG_REPLY, MPI_COMM_WORLD,
                     MPI_STATUS_IGNORE);
    }
    for (int i = 0; i < SLOTS; i++)
        MPI_Recv(&reply, sizeof reply, MPI_BYTE, 0, TAG_REPLY, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    free(message);
    return median_of(times, LOTS);
}

/* ---- the queue ---- */

/* The lots that a renderer has: `lots` of them, from number `first` on. */
struct held_lots {
    struct tile tiles[LOTS_UNDER_WAY][LOT_TILES];
    uint32_t counts[LOTS_UNDER_WAY], first, lots;
};

/*
 * The queue at work as the master uses it, for a picture of which a fifth is ten times as expensive as the rest: all
 * renderers in turn answer one lot and ask for more.
 */
struct job {
    struct queue *queue;
    double now;
    unsigned finished;
    uint32_t count;
    struct held_lots *renderers; /* so many */
};

/* The paper's, and one of the section "plan". */
static const struct farm_size {
    uint32_t width, height, samples, renderers;
} usual_farm = {640, 480, 1, 44}, large_farm = {7680, 4320, 256, 10000};

static double seconds_of(const struct tile *tile)
{
    bool dear = (tile->x / 64 + tile->y / 64) % 5 == 0;
    return tile_pixels(tile) * (dear ? 2e-6 : 2e-7);
}

static void finish_tile(struct job *job, uint32_t who, const struct tile *answered)
{
    double seconds = seconds_of(answered);
    struct tile tile;
    if (!queue_find_held(job->queue, who, answered->id, &tile)) fatal("a tile is lost");
    if (tile.pass == TILE_PROBE) {
        float probed[64];
        uint32_t pixels = tile_pixels(&tile);
        if (pixels > 64) fatal("so many probes are in no tile");
        for (uint32_t i = 0; i < pixels; i++)
            probed[i] = (float)(seconds / pixels);
        queue_probed(job->queue, &tile, probed);
    }
    seconds = queue_seconds(job->queue, who, seconds, seconds);
    job->now += seconds_of(answered) / job->count;
    job->finished += queue_finish(job->queue, who, tile.id, job->now, seconds) == ANSWER_COUNTS;
    struct fate fate;
    while (queue_fate(job->queue, &fate))
        job->finished += fate.counts;
}

static void answer_lot(struct job *job, uint32_t who)
{
    uint32_t slot = job->renderers[who].first, pixels = 0;
    for (uint32_t i = 0; i < job->renderers[who].counts[slot]; i++) {
        const struct tile *tile = &job->renderers[who].tiles[slot][i];
        pixels += tile_pixels(tile);
        finish_tile(job, who, tile);
    }
    job->renderers[who].first = (slot + 1) % LOTS_UNDER_WAY;
    job->renderers[who].lots--;
    queue_served(job->queue, 1e-6 + 1e-9 * pixels, pixels);
}

static void ask(struct job *job, uint32_t who)
{
    struct recall recall;
    float report_s[LOT_TILES];
    while (job->renderers[who].lots < LOTS_UNDER_WAY && !queue_over(job->queue, who)) {
        uint32_t slot = (job->renderers[who].first + job->renderers[who].lots) % LOTS_UNDER_WAY;
        uint32_t count = queue_next(job->queue, who, job->now, job->renderers[who].tiles[slot]);
        if (count == 0) break;
        job->renderers[who].counts[slot] = count;
        job->renderers[who].lots++;
        /* The contents of the message: as in master/hand_out.c. */
        const struct tile *tiles = job->renderers[who].tiles[slot];
        (void)queue_answer_after(job->queue);
        (void)queue_lot_seconds(job->queue, who, tiles, count);
        (void)queue_report_times(job->queue, who, tiles, count, report_s);
    }
    while (queue_next_recall(job->queue, &recall))
        ;
    if (queue_wake(job->queue) <= job->now) queue_look(job->queue, job->now);
    (void)queue_calm(job->queue, job->now);
}

/* Seconds per tile. */
static double work_off(struct job *job)
{
    double start = clock_thread_cpu();
    for (uint32_t who = 0; !queue_complete(job->queue); who = (who + 1) % job->count) {
        if (job->renderers[who].lots > 0) answer_lot(job, who);
        ask(job, who);
        job->now += 1e-7;
    }
    return (clock_thread_cpu() - start) / job->finished;
}

/* The median of several times. */
static double queue_time(const struct farm_size *farm, unsigned repeats)
{
    double *times = allocate(repeats, sizeof *times);
    struct job job = {.count = farm->renderers};
    job.renderers = allocate(farm->renderers, sizeof *job.renderers);
    for (unsigned i = 0; i < repeats; i++) {
        struct queue_config config = {
            .schedule = SCHEDULE_DYNAMIC,
            .width = farm->width,
            .height = farm->height,
            .renderers = farm->renderers,
            .master_renders = true,
            .tile_edge = queue_auto_edge(SCHEDULE_DYNAMIC, farm->width, farm->height, farm->samples,
                                         farm->renderers),
            .probe_edge = queue_auto_probe_edge(farm->width, farm->height, farm->samples)};
        job.queue = queue_create(&config);
        job.now = job.finished = 0;
        memset(job.renderers, 0, farm->renderers * sizeof *job.renderers);
        times[i] = work_off(&job);
        queue_destroy(job.queue);
    }
    double middle = median_of(times, repeats);
    free(job.renderers);
    free(times);
    return middle;
}

static double nap_overshoot(void)
{
    static double times[200];
    for (int i = 0; i < 200; i++) {
        double start = clock_wall();
        clock_sleep(1e-4);
        times[i] = clock_wall() - start - 1e-4;
    }
    return median_of(times, 200);
}

/* Edges of square tiles: below RESULT_SHORT bytes, and above. */
#define WHOLE_EDGE 24
#define LARGE_EDGE 32

/* The master's seconds per result, and per pixel of it. */
struct service {
    double result_s, pixel_s;
};

static struct service serve_floods(struct trays *trays)
{
    double small_lot = serve_flood(1, trays), whole_lot = serve_flood(WHOLE_EDGE, trays);
    double pixel_s = (whole_lot - small_lot) / (WHOLE_EDGE * WHOLE_EDGE - 1);
    return (struct service){.result_s = small_lot - pixel_s, .pixel_s = pixel_s};
}

static double send_floods(void)
{
    double small_lot = send_flood(1);
    send_flood(WHOLE_EDGE);
    return small_lot;
}

static void leave_floods(struct trays *trays)
{
    leave_flood(1, trays);
    leave_flood(WHOLE_EDGE, trays);
}

static struct trays *share_trays(int rank)
{
    struct trays *trays = NULL;
    struct segment_address own = segment_make(), address = own;
    size_t bytes;
    if (rank == 0) trays = segment_extend(own, TRAYS_BYTES);
    MPI_Bcast(&address, sizeof address, MPI_BYTE, 0, MPI_COMM_WORLD);
    if (rank != 0) trays = segment_open(address, &bytes);
    MPI_Barrier(MPI_COMM_WORLD);
    segment_release(own);
    return trays;
}

int main(void)
{
    int rank, size;
    MPI_Init(NULL, NULL);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    if (size != 2) fatal("start two of me: mpiexec -n 2");
    nap_sharpen();
    double empty = one_way(rank, 0), large = one_way(rank, 1 << 16);
    struct trays *trays = share_trays(rank);
    if (rank == 0) {
        struct service messages = serve_floods(NULL), tray = serve_floods(trays);
        double large_lot = serve_flood(LARGE_EDGE, NULL);
        double large_s = messages.result_s + messages.pixel_s * LARGE_EDGE * LARGE_EDGE;
        printf("latency_s %.3e\nbyte_s %.3e\n", empty, (large - empty) / (1 << 16));
        printf("service_s %.3e\nservice_pixel_s %.3e\n", messages.result_s, messages.pixel_s);
        printf("fetch_s %.3e\n", large_lot - large_s);
        printf("tray_s %.3e\ntray_pixel_s %.3e\n", tray.result_s, tray.pixel_s);
        printf("service_tile_s %.3e\n", queue_time(&usual_farm, 9));
        printf("service_tile_large_s %.3e\n", queue_time(&large_farm, 3));
        printf("nap_s %.3e\n", nap_overshoot());
    } else {
        double small_lot = send_floods();
        leave_floods(trays);
        send_flood(LARGE_EDGE);
        printf("send_s %.3e\n", small_lot);
    }
    segment_close(trays, TRAYS_BYTES);
    MPI_Finalize();
    return 0;
}
