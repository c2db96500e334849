#include "worker/node_scene.h"

#include <errno.h>
#include <semaphore.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/bell.h"
#include "common/build.h"
#include "common/clock.h"
#include "common/cores.h"
#include "common/message.h"
#include "common/orphan.h"
#include "common/prefetch.h"
#include "common/processor.h"
#include "common/tray.h"
#include "common/whole.h"
#include "worker/collective.h"
#include "worker/node.h"
#include "worker/segment.h"

/*
 * One segment per node; for a rank alone on its node, ordinary memory. It holds the head, the scene block,
 * the BVH, and on rank 0's node a tray for each of the other ranks and one struct arrivals.
 *
 *   segment | head | ... | scene | ... | BVH | ... | trays | arrivals |
 *
 * Each part begins at a multiple of a cache line.
 */

struct member {
    int32_t process; /* process id */
    int32_t rank;
};

/*
 * The head of the segment. `built` is posted once for every other rank when the BVH is complete. Ranks that
 * wait for it wake up at once, which they would not after polling naps as long as a BVH takes to build.
 */
struct segment_head {
    uint64_t offset;   /* offset of the scene, bytes from the head */
    uint64_t trays;    /* offset of the first tray; 0: there are none */
    uint64_t arrivals; /* offset of struct arrivals, if there are trays */
    sem_t built;
    struct bell bell;        /* see struct node_scene */
    struct member members[]; /* the ranks of the node, in their order */
};

/* The first tray; NULL if there are none. */
static struct tray *first_tray(struct segment_head *head)
{
    return head->trays > 0 ? (void *)((char *)head + head->trays) : NULL;
}

/* Valid only if there are trays. */
static struct arrivals *find_arrivals(struct segment_head *head)
{
    return (void *)((char *)head + head->arrivals);
}

/* Sizes of the parts of a node's segment. */
struct room {
    size_t head, content; /* bytes; content: scene and BVH */
    size_t trays;         /* number of trays */
    size_t ranks;         /* ranks of the whole farm, each with a flag in struct arrivals */
};

/* There are trays only on the node whose first rank is rank 0. */
static struct room find_room(const struct welcome *welcome, const struct node_place *place)
{
    int ranks;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    size_t members = (size_t)place->size;
    return (struct room){
        .head =
            round_up_to(sizeof(struct segment_head) + members * sizeof(struct member), CACHE_LINE),
        .content = round_up_to(welcome->scene_bytes, CACHE_LINE) +
                   round_up_to(welcome->bvh_bytes, CACHE_LINE),
        .trays = place->first == 0 ? members - 1 : 0,
        .ranks = (size_t)ranks};
}

static size_t room_bytes(const struct room *room)
{
    size_t bytes = CACHE_LINE + room->head + room->content;
    if (room->trays == 0) return bytes;
    return bytes + room->trays * sizeof(struct tray) + sizeof(struct arrivals) +
           arrivals_words((uint32_t)room->ranks) * sizeof(uint64_t);
}

/* Called by the first rank of the node. A rank alone on its node shares no memory. */
static struct segment_head *create_node_segment(struct node_scene *shared, const struct room *room,
                                                const struct node_place *place)
{
    shared->segment_bytes = room_bytes(room);
    struct segment_head *head = place->size == 1
                                    ? allocate_large(shared->segment_bytes)
                                    : segment_extend(place->segment, shared->segment_bytes);
    /* malloc()ed memory need not begin at a cache line. */
    head->offset = room->head + (-(uintptr_t)head % CACHE_LINE);
    if (sem_init(&head->built, 1, 0) != 0) fatal("cannot create a semaphore: %s", strerror(errno));
    bell_init(&head->bell);
    head->trays = room->trays > 0 ? head->offset + room->content : 0;
    head->arrivals = head->trays + room->trays * sizeof(struct tray);
    return head;
}

/*
 * Maps the segment of the node, which is still empty, on every rank. The first rank learns the process ids of
 * the others, to borrow their cores and to release their trays in the end. own: the segment that this rank
 * has made.
 */
static void enter_node_segment(const struct room *room, const struct node_place *place,
                               struct segment_address own, struct node_scene *shared)
{
    int rank;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    if (shared->leads) shared->head = create_node_segment(shared, room, place);
    wait_for_all();
    if (!shared->leads) shared->head = segment_open(place->segment, &shared->segment_bytes);
    shared->head->members[place->index] = (struct member){(int32_t)getpid(), rank};
    wait_for_all();
    segment_release(own);
    if (!shared->leads) return;
    shared->processes = allocate((size_t)place->size, sizeof *shared->processes);
    for (int i = 0; i < place->size; i++)
        shared->processes[i] = shared->head->members[i].process;
}

/* Finds the tray and the arrivals of each rank on the master's node, and all trays on the master. */
static void find_trays(const struct room *room, const struct node_place *place,
                       struct node_scene *shared)
{
    struct tray *trays = first_tray(shared->head);
    bool is_master = place->first == 0 && place->index == 0;
    shared->tray = trays && place->index > 0 ? trays + place->index - 1 : NULL;
    shared->arrivals = trays ? find_arrivals(shared->head) : NULL;
    shared->trays = is_master ? allocate_zeroed(room->ranks, sizeof *shared->trays) : NULL;
    if (!shared->trays || !trays) return;
    for (int i = 1; i < place->size; i++)
        shared->trays[shared->head->members[i].rank] = trays + i - 1;
}

static void init_trays(struct segment_head *head, const struct room *room)
{
    for (size_t i = 0; i < room->trays; i++) {
        struct tray *tray = first_tray(head) + i;
        /*
         * Touches all pages now. Otherwise the master would fault them in while results arrive: page faults
         * took a fifth of its time with 44 ranks.
         */
        memset(tray, 0, sizeof *tray);
        tray_init(tray);
    }
    if (room->trays > 0) arrivals_init(find_arrivals(head), (uint32_t)room->ranks);
}

/* Called by the first ranks of all nodes: copies the block on rank 0, which has validated it, and broadcasts it to the
 * segments of the others. */
static void send_scene(MPI_Comm leaders, const struct welcome *welcome, struct scene *block,
                       char *scene)
{
    const char *why;
    bool is_own = block != NULL;
    if (is_own) memcpy(scene, block, welcome->scene_bytes);
    free(block);
    if (leaders != MPI_COMM_NULL) broadcast(leaders, scene, welcome->scene_bytes);
    if (!is_own && !scene_valid(scene, welcome->scene_bytes, &why))
        fatal("the scene arrived damaged: %s", why);
    if (welcome->bvh_bytes < bvh_bytes_bound((const void *)scene))
        fatal("rank 0 has left too little room for the BVH");
}

/* Brings the scene into the segment of every node. */
static void distribute(const struct welcome *welcome, struct scene *block,
                       struct node_scene *shared)
{
    struct node node;
    const struct segment_address own = segment_make();
    node_find(own, &node);
    const struct room room = find_room(welcome, &node.place);
    shared->process_count = node.place.size;
    shared->leads = node.place.index == 0;
    enter_node_segment(&room, &node.place, own, shared);
    struct segment_head *head = shared->head;
    char *scene = (char *)head + head->offset;
    if (shared->leads) {
        init_trays(head, &room);
        send_scene(node.leaders, welcome, block, scene);
    }
    if (node.leaders != MPI_COMM_NULL) MPI_Comm_free(&node.leaders);
    /* After this barrier all ranks of a node see what its first rank has written. */
    wait_for_all();
    shared->bell = &head->bell;
    shared->scene = (const void *)scene;
    shared->bvh = (void *)(scene + round_up_to(welcome->scene_bytes, CACHE_LINE));
    find_trays(&room, &node.place, shared);
    enum processor_level level = shared->scene->view.processor;
    if (!processor_has(level))
        fatal("farm.kernel = %s is %s", processor_level_names[level], processor_lacks(level));
}

int share_scene(const struct welcome *welcome, struct scene *block, struct node_scene *shared)
{
    struct welcome heard = {0};
    if (welcome) heard = *welcome;
    broadcast(MPI_COMM_WORLD, &heard, sizeof heard);
    if (!welcome_valid(&heard, farm_build))
        fatal("this is farm %s, but rank 0 runs another build", farm_build);
    if (heard.scene_bytes == 0) return (int)heard.status;
    double start = clock_wall();
    *shared = (struct node_scene){0};
    distribute(&heard, block, shared);
    shared->broadcast_s = clock_wall() - start;
    return -1;
}

/*
 * Called by the first rank of the node: builds the BVH in the segment, on the cores of all ranks of the node,
 * since the others wait.
 */
static void build(struct node_scene *shared)
{
    struct core_set own;
    unsigned threads = cores_borrow(shared->processes, shared->process_count, &own);
    bvh_build(shared->scene, shared->bvh, threads);
    cores_return(&own);
    for (int i = 1; i < shared->process_count; i++)
        sem_post(&shared->head->built);
}

void share_bvh(struct node_scene *shared)
{
    double start = clock_wall();
    if (shared->leads)
        build(shared);
    else
        orphan_wait(&shared->head->built, ORPHAN_PATIENCE);
    shared->build_s = clock_wall() - start;
}

/* Called by the first rank of the node. */
static void free_node_segment(struct node_scene *shared)
{
    sem_destroy(&shared->head->built);
    bell_free(shared->bell);
    struct tray *trays = first_tray(shared->head);
    for (int i = 1; i < shared->process_count && trays; i++)
        tray_free(trays + i - 1);
}

void unshare_scene(struct node_scene *shared)
{
    wait_for_all();
    if (shared->leads) free_node_segment(shared);
    if (shared->process_count == 1)
        free(shared->head);
    else
        segment_close(shared->head, shared->segment_bytes);
    free(shared->trays);
}
