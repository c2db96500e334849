#include "worker/work.h"

#include <errno.h>
#include <math.h>
#include <semaphore.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "common/bell.h"
#include "common/clock.h"
#include "common/cores.h"
#include "common/message.h"
#include "common/nap.h"
#include "common/processor.h"
#include "common/tray.h"
#include "worker/render.h"
#include "worker/survey.h"

/* ---- waiting ---- */

static void wait_request(MPI_Request *request)
{
    struct nap nap = {0};
    int done = 0;
    for (;;) {
        MPI_Test(request, &done, MPI_STATUS_IGNORE);
        if (done) return;
        nap_take(&nap);
    }
}

/* Every rank waits here until all have come. */
static void wait_for_all(MPI_Comm comm)
{
    MPI_Request request;
    MPI_Ibarrier(comm, &request);
    wait_request(&request);
}

/* A broadcast in pieces: counts are ints in MPI, and a piece in flight stays small. */
static void broadcast(MPI_Comm comm, void *data, size_t bytes)
{
    const size_t piece = (size_t)64 << 20;
    for (size_t done = 0; done < bytes; done += piece) {
        int count = (int)(bytes - done < piece ? bytes - done : piece);
        MPI_Request request;
        MPI_Ibcast((char *)data + done, count, MPI_BYTE, 0, comm, &request);
        wait_request(&request);
    }
}

int agree_on_status(MPI_Comm comm, int status)
{
    broadcast(comm, &status, sizeof status);
    return status;
}

struct berth *gather_berths(MPI_Comm comm)
{
    int rank, ranks;
    const int bytes = (int)sizeof(struct berth);
    struct berth own, *all = NULL;
    MPI_Request request;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &ranks);
    berth_find(&own);
    if (rank == 0) all = allocate((size_t)ranks, sizeof *all);
    MPI_Igather(&own, bytes, MPI_BYTE, all, bytes, MPI_BYTE, 0, comm, &request);
    wait_request(&request);
    return all;
}

/* ---- one scene per node ---- */

/*
 * One window per node: the head, the scene block, the BVH, and on rank 0's node a tray for each of the
 * others. Collective calls are few, because MPI's own wait spins, and on a machine with more ranks than cores
 * that shows.
 *
 *   window  | head | ... | scene | ... | BVH | ... | trays |      each at a multiple of a cache line
 */
#define CACHE_LINE ((size_t)64)

/* built is posted for every other rank when the BVH is there: who waits for that sleeps, and is there at
 * once, which it would not be after naps as long as a BVH takes. */
struct window_head {
    uint64_t offset; /* of the scene */
    uint64_t trays;  /* offset of the first one; 0: there are none */
    sem_t built;
    struct bell bell; /* see struct node_scene */
};
#define HEAD_BYTES (2 * CACHE_LINE)
_Static_assert(sizeof(struct window_head) <= HEAD_BYTES, "the scene begins behind it");

static size_t round_up(size_t bytes)
{
    return (bytes + CACHE_LINE - 1) / CACHE_LINE * CACHE_LINE;
}

/* MPICH keeps shared windows here; writing to one that does not fit is a bus error. */
#define SHARED_MEMORY_FOLDER "/dev/shm"

static void check_room(size_t bytes)
{
    struct statvfs file_system;
    if (statvfs(SHARED_MEMORY_FOLDER, &file_system) != 0) return;
    uint64_t room = (uint64_t)file_system.f_bavail * file_system.f_frsize;
    if (room < bytes)
        fatal("the scene needs %.1f MB of shared memory, but " SHARED_MEMORY_FOLDER
              " has only %.1f MB left: enlarge it (containers: --shm-size)",
              1e-6 * (double)bytes, 1e-6 * (double)room);
}

/*
 * The start of the node's window as this rank sees it; the node's first rank provides the memory. A
 * rank alone on its node needs no window.
 */
static char *allocate_window(struct node_scene *shared, size_t bytes)
{
    int unit, node_size;
    char *memory;
    MPI_Aint size;
    MPI_Comm_size(shared->node, &node_size);
    shared->window = MPI_WIN_NULL;
    shared->own_memory = NULL;
    if (node_size == 1) return shared->own_memory = allocate_large(bytes);
    if (shared->leads) check_room(bytes);
    MPI_Win_allocate_shared(shared->leads ? (MPI_Aint)bytes : 0, 1, MPI_INFO_NULL, shared->node,
                            &memory, &shared->window);
    MPI_Win_shared_query(shared->window, 0, &size, &unit, &memory);
    MPI_Win_lock_all(MPI_MODE_NOCHECK, shared->window);
    return memory;
}

/* What the first rank of the node has written before is visible to all its ranks behind this. */
static void publish(const struct node_scene *shared)
{
    if (shared->window == MPI_WIN_NULL) return;
    MPI_Win_sync(shared->window);
    wait_for_all(shared->node);
    MPI_Win_sync(shared->window);
}

/* The first ranks of all nodes, to whom the scene is sent; MPI_COMM_NULL when there is one node. */
static MPI_Comm split_nodes(MPI_Comm comm, struct node_scene *shared)
{
    int rank, size, node_rank, node_size;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &size);
    MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, rank, MPI_INFO_NULL, &shared->node);
    MPI_Comm_rank(shared->node, &node_rank);
    MPI_Comm_size(shared->node, &node_size);
    shared->leads = node_rank == 0;
    MPI_Comm leaders = MPI_COMM_NULL;
    if (node_size < size) MPI_Comm_split(comm, shared->leads ? 0 : MPI_UNDEFINED, rank, &leaders);
    return leaders;
}

/* The first rank learns who there is, to see them off in the end. */
static void gather_processes(struct node_scene *shared)
{
    int own = (int)getpid(), *all = NULL;
    MPI_Request request;
    MPI_Comm_size(shared->node, &shared->process_count);
    if (shared->leads) all = allocate((size_t)shared->process_count, sizeof *all);
    MPI_Igather(&own, 1, MPI_INT, all, 1, MPI_INT, 0, shared->node, &request);
    wait_request(&request);
    shared->processes = all;
}

/* Trays that this node's first rank makes: for each of the others, where that one is the master. */
static size_t count_trays(MPI_Comm comm, const struct node_scene *shared)
{
    int rank;
    MPI_Comm_rank(comm, &rank);
    return rank == 0 ? (size_t)shared->process_count - 1 : 0;
}

/* Each rank of the master's node finds its tray, the master all of them. */
static void find_trays(MPI_Comm comm, struct tray *trays, struct node_scene *shared)
{
    int rank, ranks, node_rank;
    MPI_Group all, node;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &ranks);
    MPI_Comm_rank(shared->node, &node_rank);
    shared->tray = trays && node_rank > 0 ? trays + node_rank - 1 : NULL;
    shared->trays = rank == 0 ? allocate_zeroed((size_t)ranks, sizeof *shared->trays) : NULL;
    if (rank > 0 || !trays) return;
    MPI_Comm_group(comm, &all);
    MPI_Comm_group(shared->node, &node);
    for (int i = 1; i < shared->process_count; i++) {
        int who;
        MPI_Group_translate_ranks(node, 1, &i, all, &who);
        shared->trays[who] = trays + i - 1;
    }
    MPI_Group_free(&all);
    MPI_Group_free(&node);
}

/* Brings the scene into the window of every node. */
static void distribute(MPI_Comm comm, const struct welcome *welcome, struct scene *block,
                       struct node_scene *shared)
{
    size_t bytes = welcome->scene_bytes;
    MPI_Comm leaders = split_nodes(comm, shared);
    gather_processes(shared);
    size_t trays = count_trays(comm, shared),
           content = round_up(bytes) + round_up(welcome->bvh_bytes);
    char *window =
        allocate_window(shared, HEAD_BYTES + CACHE_LINE + content + trays * sizeof(struct tray));
    /* MPI promises less than a cache line, and maybe not the same to every rank. */
    struct window_head *head = (void *)window;
    if (shared->leads) {
        head->offset = HEAD_BYTES + (-(uintptr_t)window % CACHE_LINE);
        if (sem_init(&head->built, 1, 0) != 0) fatal("cannot create a semaphore");
        bell_init(&head->bell);
        head->trays = trays > 0 ? head->offset + content : 0;
        for (size_t i = 0; i < trays; i++)
            tray_init((struct tray *)(void *)(window + head->trays) + i);
        char *scene = window + head->offset;
        if (block) memcpy(scene, block, bytes);
        free(block);
        if (leaders != MPI_COMM_NULL) broadcast(leaders, scene, bytes);
        const char *why;
        if (!scene_valid(scene, bytes, &why)) fatal("the scene arrived damaged: %s", why);
        if (welcome->bvh_bytes < bvh_bytes_bound((const void *)scene))
            fatal("rank 0 has left too little room for the BVH");
    }
    if (leaders != MPI_COMM_NULL) MPI_Comm_free(&leaders);
    publish(shared);
    char *scene = window + head->offset;
    shared->head = head;
    shared->bell = &head->bell;
    shared->scene = (const void *)scene;
    shared->bvh = (void *)(scene + round_up(bytes));
    find_trays(comm, head->trays > 0 ? (void *)(window + head->trays) : NULL, shared);
    enum processor_level level = shared->scene->view.processor;
    if (!processor_has(level))
        fatal("farm.kernel = %s is not for this processor", processor_level_name(level));
}

int share_scene(MPI_Comm comm, const struct welcome *welcome, struct scene *block,
                struct node_scene *shared)
{
    struct welcome heard = {0};
    if (welcome) heard = *welcome;
    broadcast(comm, &heard, sizeof heard);
    if (!welcome_valid(&heard, FARM_VERSION))
        fatal("this is farm %s, but rank 0 runs another version", FARM_VERSION);
    if (heard.scene_bytes == 0) return (int)heard.status;
    double start = clock_wall();
    distribute(comm, &heard, block, shared);
    shared->broadcast_s = clock_wall() - start;
    return -1;
}

/* By the first rank of the node, where the others will look for it, and on the cores of all of them:
 * they wait. */
static void build(struct node_scene *shared)
{
    cpu_set_t own;
    unsigned threads = cores_borrow(shared->processes, shared->process_count, &own);
    bvh_build(shared->scene, shared->bvh, threads);
    cores_return(&own);
    if (shared->window != MPI_WIN_NULL) MPI_Win_sync(shared->window);
    for (int i = 1; i < shared->process_count; i++)
        sem_post(&shared->head->built);
}

static void wait_until_built(struct node_scene *shared)
{
    while (sem_wait(&shared->head->built) != 0)
        if (errno != EINTR) fatal("cannot wait for the BVH: %s", strerror(errno));
    MPI_Win_sync(shared->window);
}

void share_bvh(struct node_scene *shared)
{
    double start = clock_wall();
    if (shared->leads)
        build(shared);
    else
        wait_until_built(shared);
    shared->build_s = clock_wall() - start;
}

void unshare_scene(struct node_scene *shared)
{
    if (shared->window != MPI_WIN_NULL) {
        wait_for_all(shared->node);
        if (shared->leads) {
            sem_destroy(&shared->head->built);
            bell_free(shared->bell);
        }
        MPI_Win_unlock_all(shared->window);
        MPI_Win_free(&shared->window);
    }
    free(shared->own_memory);
    free(shared->trays);
    MPI_Comm_free(&shared->node);
}

/* ---- rendering for the master ---- */

/* Lots that the master may have sent: the one in work and the one that waits. */
#define LOTS_AHEAD 2

struct lot {
    struct tile tiles[LOT_TILES];
    float tells[LOT_TILES]; /* seconds in work after which the master is told; may be infinite */
    bool dropped[LOT_TILES];
    uint32_t count;
    bool calls, has_called; /* see call_for_more() */
    double answer_s;
    struct refinement *refinements; /* of all refined tiles in turn; owned */
};

/*
 * One receive is always posted for the next TILES or STOP, results leave through two buffers in
 * turn:
 *
 *   render into buffer b -> Isend from b -> render into the other one -> ...
 *
 * or, where the master is on this node, from the slots of a tray, if one is empty and has room for all that
 * is left of the lot.
 */
struct worker {
    MPI_Comm comm;
    struct renderer *renderer;
    const struct view *view;
    struct bell *bell; /* the master's, if it is on this node: else nobody hears it */
    bool adaptive;
    double start;

    union {
        char tiles[TILES_MAX_BYTES];
        struct drop drops[DROP_TILES];
        struct start start;
        struct tray_note note;
    } * incoming;
    MPI_Request receive;
    bool started;                /* the master has said START */
    struct lot current;          /* in work */
    uint32_t rendering;          /* the tile of it */
    bool given_up;               /* that tile: somebody else has finished it */
    double looked;               /* when messages were last looked for between waves */
    struct lot lots[LOTS_AHEAD]; /* received, not rendered; the oldest first */
    int waiting;
    bool stopped; /* the master has said STOP */

    MPI_Request pong; /* the last sign of life */
    char *buffers[2];
    size_t capacities[2];
    struct tray_note notes[2];
    MPI_Request sends[2];
    int turn;
    struct tray *tray; /* NULL: the master is on another node */
    int slot;          /* of it, into which is rendered; -1: into a buffer */

    /* The result that is being filled, in the buffer or slot. */
    char *result;
    size_t done,
        sent;       /* bytes of finished tiles, and of those that went with a tile that took long */
    double begun;   /* the tile in work */
    double tell_at; /* when the master is to hear of it */
    bool told;      /* it has */
    struct result_header notice;
    char *told_bytes; /* finished tiles that were sent before it; owned */
    size_t told_room;
    MPI_Request telling, finished; /* the notice; these */

    struct renderer_stats stats;
};

static void post_receive(struct worker *worker)
{
    MPI_Irecv(worker->incoming, (int)sizeof *worker->incoming, MPI_BYTE, 0, MPI_ANY_TAG,
              worker->comm, &worker->receive);
}

static void take_start(struct worker *worker, size_t bytes)
{
    const struct start *start = &worker->incoming->start;
    if (!start_message_valid(start, bytes) || worker->started)
        fatal("the master sent a start that makes no sense");
    worker->start = clock_wall() - start->elapsed_s;
    worker->started = true;
}

/* The next tile of a TILES message of which so many bytes are left, with its refinements at
 * refinements[*refined]; returns the length of its part, 0: it is not valid. */
static size_t take_tile(const struct worker *worker, struct lot *lot, const char *part,
                        size_t bytes, size_t *refined)
{
    if (lot->count == LOT_TILES || bytes < sizeof(struct tile)) return 0;
    struct tile *tile = &lot->tiles[lot->count++];
    memcpy(tile, part, sizeof *tile);
    const struct view *view = worker->view;
    if (!tile_message_valid(tile, sizeof *tile, view->region_w, view->region_h)) return 0;
    if (!tile_is_refined(tile)) return sizeof *tile;
    uint32_t pixels = tile_pixels(tile);
    struct refinement *refinements = lot->refinements + *refined;
    if (!worker->adaptive || tile_part_bytes(tile) > bytes) return 0;
    memcpy(refinements, part + sizeof *tile, pixels * sizeof *refinements);
    *refined += pixels;
    return refinements_valid(refinements, pixels, level_last(view)) ? tile_part_bytes(tile) : 0;
}

/* What a lot begins with, with so many floats; returns its length. */
static size_t take_lot_header(struct lot *lot, const char *message, size_t bytes, uint32_t *tells)
{
    struct lot_header header;
    if (bytes < sizeof header) fatal("the master sent a lot without tiles");
    memcpy(&header, message, sizeof header);
    size_t length = sizeof header + lot_tells_bytes(header.tells);
    if (!lot_header_valid(&header)) fatal("the master sent a lot that makes no sense");
    if (bytes <= length) fatal("the master sent a lot without tiles");
    *lot = (struct lot){.answer_s = header.answer_s, .calls = header.calls};
    for (uint32_t i = header.tells; i < LOT_TILES; i++)
        lot->tells[i] = HUGE_VALF;
    memcpy(lot->tells, message + sizeof header, header.tells * sizeof *lot->tells);
    if (!lot_tells_valid(lot->tells, header.tells))
        fatal("the master sent a lot that makes no sense");
    *tells = header.tells;
    return length;
}

/* A lot of so many bytes, from a message or from the tray: nothing of it is looked at twice before it is
 * used. */
static void take_lot(struct worker *worker, const char *message, size_t bytes)
{
    struct lot *lot = &worker->lots[worker->waiting++];
    uint32_t tells;
    size_t done = take_lot_header(lot, message, bytes, &tells), length = worker->started ? 1 : 0,
           refined = 0;
    /* The refinements in a message are fewer than its bytes. */
    if (worker->adaptive) lot->refinements = allocate(bytes, sizeof *lot->refinements);
    while (length > 0 && done < bytes) {
        length = take_tile(worker, lot, message + done, bytes - done, &refined);
        done += length;
    }
    if (done < bytes) fatal("the master sent a tile that is not part of the picture");
    if (tells > 0 && tells != lot->count) fatal("the master sent a lot that makes no sense");
}

static void take_tray(struct worker *worker, size_t bytes)
{
    struct tray *tray = worker->tray;
    struct tray_note note = worker->incoming->note;
    if (!tray || !tray_message_valid(&note, bytes, TRAY_LOT_BYTES) ||
        !slots_full(&tray->lots, note.slot))
        fatal("the master told of a lot where there is none");
    take_lot(worker, tray->lot[note.slot], note.bytes);
    slots_empty(&tray->lots, note.slot);
}

static void drop_from(struct lot *lot, uint32_t id)
{
    for (uint32_t i = 0; i < lot->count; i++)
        if (lot->tiles[i].id == id) lot->dropped[i] = true;
}

static void take_drop(struct worker *worker, const struct drop *drop)
{
    struct lot *current = &worker->current;
    if (drop->finished && current->count > 0 &&
        current->tiles[worker->rendering].id == drop->tile_id)
        worker->given_up = true;
    drop_from(current, drop->tile_id);
    for (int i = 0; i < worker->waiting; i++)
        drop_from(&worker->lots[i], drop->tile_id);
}

static void take_drops(struct worker *worker, size_t bytes)
{
    const struct drop *drops = worker->incoming->drops;
    if (!drop_message_valid(drops, bytes))
        fatal("the master asked to drop a tile in a way that makes no sense");
    for (size_t i = 0; i < bytes / sizeof *drops; i++)
        take_drop(worker, &drops[i]);
}

/* The master asks again only when it has heard something: the last answer is sent. */
static void take_ping(struct worker *worker, size_t bytes)
{
    int done;
    MPI_Test(&worker->pong, &done, MPI_STATUS_IGNORE);
    if (bytes != 0) fatal("the master asked for a sign of life in a way that makes no sense");
    /* One is still under way. */
    if (!done) return;
    MPI_Isend(NULL, 0, MPI_BYTE, 0, TAG_RENDERER_TO_MASTER_PONG, worker->comm, &worker->pong);
}

/* Takes in a message if one has arrived; returns whether one had. */
static bool hear(struct worker *worker)
{
    int done, bytes;
    MPI_Status status;
    if (worker->stopped || worker->waiting == LOTS_AHEAD) return false;
    MPI_Test(&worker->receive, &done, &status);
    if (!done) return false;
    MPI_Get_count(&status, MPI_BYTE, &bytes);
    if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_STOP) {
        worker->stopped = true;
        return true;
    }
    if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_DROP)
        take_drops(worker, (size_t)bytes);
    else if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_START)
        take_start(worker, (size_t)bytes);
    else if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_PING)
        take_ping(worker, (size_t)bytes);
    else if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_TILES)
        take_lot(worker, worker->incoming->tiles, (size_t)bytes);
    else if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_TRAY)
        take_tray(worker, (size_t)bytes);
    else
        fatal("the master sent a message of unknown kind %d", status.MPI_TAG);
    post_receive(worker);
    return true;
}

/* The next send buffer, or slot of the tray, free and large enough. */
static char *take_buffer(struct worker *worker, size_t bytes)
{
    int turn = worker->turn = 1 - worker->turn;
    double start = clock_wall();
    wait_request(&worker->sends[turn]);
    worker->stats.send_s += clock_wall() - start;
    struct tray *tray = worker->tray;
    worker->slot = tray && bytes <= TRAY_RESULT_BYTES ? slots_find(&tray->results) : -1;
    if (worker->slot >= 0) return tray->result[worker->slot];
    if (worker->capacities[turn] < bytes) {
        free(worker->buffers[turn]);
        worker->buffers[turn] = allocate_zeroed(bytes, 1);
        worker->capacities[turn] = bytes;
    }
    return worker->buffers[turn];
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

/* In place of the result in the slot: the note about it. */
static void send_note(struct worker *worker, size_t bytes)
{
    struct tray_note *note = &worker->notes[worker->turn];
    *note = (struct tray_note){.slot = (uint32_t)worker->slot, .bytes = (uint32_t)bytes};
    slots_fill(&worker->tray->results, worker->slot);
    MPI_Isend(note, sizeof *note, MPI_BYTE, 0, TAG_RENDERER_TO_MASTER_TRAY, worker->comm,
              &worker->sends[worker->turn]);
}

/* What has not been sent of the result. In a slot it begins at the front. */
static void send_result(struct worker *worker)
{
    double start = clock_wall();
    size_t bytes = worker->done - worker->sent;
    const char *rest = worker->result + worker->sent;
    if (bytes == 0) return;
    if (worker->slot >= 0) {
        if (worker->sent > 0) memmove(worker->result, rest, bytes);
        send_note(worker, bytes);
    } else {
        MPI_Isend(rest, (int)bytes, MPI_BYTE, 0, TAG_RENDERER_TO_MASTER_RESULT, worker->comm,
                  &worker->sends[worker->turn]);
    }
    worker->stats.send_s += clock_wall() - start;
    worker->stats.bytes += bytes;
}

/* Takes in what has arrived. */
static void hear_all(struct worker *worker)
{
    while (hear(worker)) {
    }
}

/* Seconds from one look at messages between waves, which may be a few microseconds apart, to the next: to
 * look after every wave took a hundredth of a renderer's instructions. So long is rendered in vain what
 * somebody else has finished. */
#define LOOK_EVERY 50e-6

static bool is_sent(MPI_Request *request)
{
    int sent;
    MPI_Test(request, &sent, MPI_STATUS_IGNORE);
    return sent;
}

/* Sends so many finished bytes of the result, which goes on to be filled. */
static void send_finished(struct worker *worker, size_t bytes)
{
    if (worker->told_room < bytes) {
        worker->told_bytes = reallocate(worker->told_bytes, bytes, 1);
        worker->told_room = bytes;
    }
    memcpy(worker->told_bytes, worker->result + worker->sent, bytes);
    MPI_Isend(worker->told_bytes, (int)bytes, MPI_BYTE, 0, TAG_RENDERER_TO_MASTER_RESULT,
              worker->comm, &worker->finished);
    worker->sent += bytes;
    worker->stats.bytes += bytes;
}

/* The master hears that the tile in work takes long, and before that of what is finished, so that it knows
 * what is not begun; unless the last time is still on its way. */
static void tell(struct worker *worker, double now)
{
    if (!is_sent(&worker->finished) || !is_sent(&worker->telling)) return;
    if (worker->done > worker->sent) send_finished(worker, worker->done - worker->sent);
    worker->notice = (struct result_header){.tile_id = worker->current.tiles[worker->rendering].id,
                                            .pixels = RESULT_UNFINISHED,
                                            .start_s = worker->begun - worker->start,
                                            .busy_s = now - worker->begun};
    MPI_Isend(&worker->notice, (int)sizeof worker->notice, MPI_BYTE, 0,
              TAG_RENDERER_TO_MASTER_RESULT, worker->comm, &worker->telling);
    bell_ring(worker->bell);
    worker->stats.bytes += sizeof worker->notice;
    worker->told = true;
    worker->tell_at = now + worker->notice.busy_s;
}

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
    float *behind = rgb + 3 * (size_t)pixels;
    if (tile->pass == TILE_PROBE) return survey(worker->renderer, tile, rgb, behind);
    struct task task = {.tile = tile,
                        .refinements = refinements,
                        .mean = rgb,
                        .difference = worker->adaptive ? behind : NULL,
                        .rays = worker->adaptive ? behind + 3 * (size_t)pixels : NULL};
    return renderer_task(worker->renderer, &task, counts);
}

/* A header alone in place of a tile; returns its length. */
static size_t put_dropped(struct result_header *header, char *part)
{
    header->pixels = RESULT_DROPPED;
    memcpy(part, header, sizeof *header);
    return sizeof *header;
}

/* Renders a tile into its part of a result; returns the length of that, 0: the master has said STOP. */
static size_t render_part(struct worker *worker, const struct tile *tile,
                          const struct refinement *refinements, char *part)
{
    struct renderer_stats *stats = &worker->stats;
    struct render_counts counts = {0};
    uint32_t pixels = sampled_pixels(tile, refinements);
    /* Behind the header, a multiple of 8 bytes long like all parts, in an allocated block: aligned. */
    float *rgb = (void *)(part + sizeof(struct result_header));
    double begin = worker->begun, cpu = clock_thread_cpu();
    bool whole = render_pixels(worker, tile, refinements, pixels, rgb, &counts);
    /* Reading the CPU clock is a system call, at which the kernel likes to let another process run: the
     * wall clock is read around it, for that is time of this tile. */
    cpu = clock_thread_cpu() - cpu;
    double end = clock_wall();
    struct result_header header = {.tile_id = tile->id,
                                   .pixels = pixels,
                                   .start_s = begin - worker->start,
                                   .busy_s = end - begin,
                                   .cpu_s = cpu,
                                   .counts = counts};
    stats->busy_s += end - begin;
    if (tile->pass != TILE_PROBE) stats->finish_s = end - worker->start;
    if (!whole) return worker->stopped ? 0 : put_dropped(&header, part);
    memcpy(part, &header, sizeof header);
    size_t bytes = result_bytes(tile, pixels, worker->adaptive);
    if (tile->pass == TILE_PROBE) return bytes;
    stats->tiles++;
    stats->pixels += pixels;
    render_counts_add(&stats->counts, &counts);
    return bytes;
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
    return worker->slot < 0 && result_is_full(whole, done, done + tile_bytes(worker, next));
}

/* Tile i of the current lot is next. */
static void begin_tile(struct worker *worker, uint32_t i)
{
    worker->rendering = i;
    worker->given_up = worker->told = false;
    worker->begun = clock_wall();
    worker->tell_at = worker->begun + (double)worker->current.tells[i];
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
    worker->result = take_buffer(worker, whole);
    worker->done = worker->sent = 0;
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
        size_t bytes = lot->dropped[i]
                           ? put_dropped(&(struct result_header){.tile_id = tile->id}, part)
                           : render_part(worker, tile, refined, part);
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
                              .adaptive = view->max_samples > view->min_samples,
                              .incoming = allocate(1, sizeof *worker->incoming),
                              .pong = MPI_REQUEST_NULL,
                              .telling = MPI_REQUEST_NULL,
                              .finished = MPI_REQUEST_NULL,
                              .sends = {MPI_REQUEST_NULL, MPI_REQUEST_NULL}};
    worker->stats.rank = (uint32_t)rank;
    gethostname(worker->stats.host, HOST_NAME_SIZE - 1);
    post_receive(worker);
    struct ready ready = {.rank = worker->stats.rank};
    memcpy(ready.host, worker->stats.host, sizeof ready.host);
    MPI_Request request;
    MPI_Isend(&ready, sizeof ready, MPI_BYTE, 0, TAG_RENDERER_TO_MASTER_READY, comm, &request);
    bell_ring(worker->bell);
    wait_request(&request);
}

void work(MPI_Comm comm, struct renderer *renderer, const struct node_scene *shared)
{
    struct worker worker;
    start_worker(&worker, comm, renderer, shared);
    double cpu = clock_thread_cpu();
    struct nap nap = {0};
    renderer_on_wave(renderer, hear_whether_to_give_up, &worker);
    while (!worker.stopped) {
        bool heard = hear(&worker);
        if (worker.waiting > 0) {
            render_next(&worker);
            if (worker.waiting == 0) bell_ring(worker.bell);
        } else if (!heard && !worker.stopped) {
            nap_take_soon(&nap);
        }
        if (heard || worker.waiting > 0) nap_reset(&nap);
    }
    for (int i = 0; i < 2; i++) {
        double start = clock_wall();
        wait_request(&worker.sends[i]);
        worker.stats.send_s += clock_wall() - start;
        free(worker.buffers[i]);
    }
    wait_request(&worker.pong);
    wait_request(&worker.finished);
    wait_request(&worker.telling);
    free(worker.told_bytes);
    renderer_on_wave(renderer, NULL, NULL);
    for (int i = 0; i < worker.waiting; i++)
        free(worker.lots[i].refinements);
    free(worker.incoming);
    worker.stats.cpu_s = clock_thread_cpu() - cpu;
    MPI_Request request;
    MPI_Isend(&worker.stats, sizeof worker.stats, MPI_BYTE, 0, TAG_RENDERER_TO_MASTER_STATS, comm,
              &request);
    bell_ring(worker.bell);
    wait_request(&request);
}
