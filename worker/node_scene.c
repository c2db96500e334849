#include "worker/node_scene.h"

#include <errno.h>
#include <semaphore.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "common/bell.h"
#include "common/build.h"
#include "common/clock.h"
#include "common/cores.h"
#include "common/message.h"
#include "common/processor.h"
#include "common/tray.h"
#include "worker/collective.h"

/*
 * One window per node: the head, the scene block, the BVH, and on rank 0's node a tray for each of the
 * others, and what arrives from them. Collective calls are few, because MPI's own wait spins, and on a machine
 * with more ranks than cores that shows.
 *
 *   window  | head | ... | scene | ... | BVH | ... | trays | arrivals |   each at a multiple of a
 *                                                                           cache line
 */
#define CACHE_LINE ((size_t)64)

/* built is posted for every other rank when the BVH is there: who waits for that sleeps, and is there at
 * once, which it would not be after naps as long as a BVH takes. */
struct window_head {
    uint64_t offset;   /* of the scene */
    uint64_t trays;    /* offset of the first one; 0: there are none */
    uint64_t arrivals; /* offset, where there are trays */
    sem_t built;
    struct bell bell; /* see struct node_scene */
};
#define HEAD_BYTES (2 * CACHE_LINE)
_Static_assert(sizeof(struct window_head) <= HEAD_BYTES, "the scene begins behind it");

/* NULL: there are none. */
static struct tray *first_tray(struct window_head *head)
{
    return head->trays > 0 ? (void *)((char *)head + head->trays) : NULL;
}

/* Where there are trays. */
static struct arrivals *find_arrivals(struct window_head *head)
{
    return (void *)((char *)head + head->arrivals);
}

static size_t whole_lines(size_t bytes)
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

/* Of trays and arrivals. */
static size_t trays_bytes(MPI_Comm comm, size_t trays)
{
    int ranks;
    MPI_Comm_size(comm, &ranks);
    if (trays == 0) return 0;
    return trays * sizeof(struct tray) + sizeof(struct arrivals) +
           arrivals_words((uint32_t)ranks) * sizeof(uint64_t);
}

/* Each rank of the master's node finds its tray and the arrivals, the master all of them. */
static void find_trays(MPI_Comm comm, struct node_scene *shared)
{
    struct tray *trays = first_tray(shared->head);
    int rank, ranks, node_rank;
    MPI_Group all, node;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &ranks);
    MPI_Comm_rank(shared->node, &node_rank);
    shared->tray = trays && node_rank > 0 ? trays + node_rank - 1 : NULL;
    shared->arrivals = trays ? find_arrivals(shared->head) : NULL;
    shared->trays = rank == 0 ? allocate_zeroed((size_t)ranks, sizeof *shared->trays) : NULL;
    if (!shared->trays || !trays) return;
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

static void init_trays(MPI_Comm comm, struct window_head *head, size_t trays)
{
    int ranks;
    MPI_Comm_size(comm, &ranks);
    for (size_t i = 0; i < trays; i++) {
        struct tray *tray = first_tray(head) + i;
        /* So that the master, who sees all of them, has their pages before the first result comes: page faults
         * took a fifth of its time with 44 ranks. */
        memset(tray, 0, sizeof *tray);
        tray_init(tray);
    }
    arrivals_init(find_arrivals(head), (uint32_t)ranks);
}

/* By the first rank of the node, whose window has so many bytes for scene and BVH. */
static void init_window(char *window, size_t content, size_t trays)
{
    /* MPI promises less than a cache line, and maybe not the same to every rank. */
    struct window_head *head = (void *)window;
    head->offset = HEAD_BYTES + (-(uintptr_t)window % CACHE_LINE);
    if (sem_init(&head->built, 1, 0) != 0) fatal("cannot create a semaphore");
    bell_init(&head->bell);
    head->trays = trays > 0 ? head->offset + content : 0;
    head->arrivals = head->trays + trays * sizeof(struct tray);
}

/* By the first ranks of all nodes: from rank 0, who has the block, to where each has room for it. */
static void send_scene(MPI_Comm leaders, const struct welcome *welcome, struct scene *block,
                       char *scene)
{
    const char *why;
    if (block) memcpy(scene, block, welcome->scene_bytes);
    free(block);
    if (leaders != MPI_COMM_NULL) broadcast(leaders, scene, welcome->scene_bytes);
    if (!scene_valid(scene, welcome->scene_bytes, &why))
        fatal("the scene arrived damaged: %s", why);
    if (welcome->bvh_bytes < bvh_bytes_bound((const void *)scene))
        fatal("rank 0 has left too little room for the BVH");
}

/* Brings the scene into the window of every node. */
static void distribute(MPI_Comm comm, const struct welcome *welcome, struct scene *block,
                       struct node_scene *shared)
{
    size_t bytes = whole_lines(welcome->scene_bytes),
           content = bytes + whole_lines(welcome->bvh_bytes);
    MPI_Comm leaders = split_nodes(comm, shared);
    gather_processes(shared);
    size_t trays = count_trays(comm, shared);
    char *window =
        allocate_window(shared, HEAD_BYTES + CACHE_LINE + content + trays_bytes(comm, trays));
    struct window_head *head = shared->head = (void *)window;
    if (shared->leads) {
        init_window(window, content, trays);
        if (trays > 0) init_trays(comm, head, trays);
        send_scene(leaders, welcome, block, window + head->offset);
    }
    if (leaders != MPI_COMM_NULL) MPI_Comm_free(&leaders);
    publish(shared);
    char *scene = window + head->offset;
    shared->bell = &head->bell;
    shared->scene = (const void *)scene;
    shared->bvh = (void *)(scene + bytes);
    find_trays(comm, shared);
    enum processor_level level = shared->scene->view.processor;
    if (!processor_has(level))
        fatal("farm.kernel = %s is not for this processor", processor_level_names[level]);
}

int share_scene(MPI_Comm comm, const struct welcome *welcome, struct scene *block,
                struct node_scene *shared)
{
    struct welcome heard = {0};
    if (welcome) heard = *welcome;
    broadcast(comm, &heard, sizeof heard);
    if (!welcome_valid(&heard, farm_build))
        fatal("this is farm %s, but rank 0 runs another build", farm_build);
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

/* By the first rank of the node. */
static void free_window(struct node_scene *shared)
{
    sem_destroy(&shared->head->built);
    bell_free(shared->bell);
    struct tray *trays = first_tray(shared->head);
    for (int i = 1; i < shared->process_count && trays; i++)
        tray_free(trays + i - 1);
}

void unshare_scene(struct node_scene *shared)
{
    if (shared->window != MPI_WIN_NULL) {
        wait_for_all(shared->node);
        if (shared->leads) free_window(shared);
        MPI_Win_unlock_all(shared->window);
        MPI_Win_free(&shared->window);
    }
    free(shared->own_memory);
    free(shared->trays);
    MPI_Comm_free(&shared->node);
}
