/* The scene and its BVH, one copy per node in shared memory, and what else the ranks of a node share. */
#ifndef FARM_WORKER_NODE_SCENE_H
#define FARM_WORKER_NODE_SCENE_H

#include <mpi.h>
#include <stdbool.h>

#include "common/protocol.h"
#include "common/scene.h"
#include "worker/bvh.h"

struct segment_head;
struct bell;
struct tray;
struct arrivals;

struct node_scene {
    const struct scene *scene;
    struct bvh *bvh;           /* to be built by the first rank of the node */
    struct segment_head *head; /* of that memory, of so many bytes */
    size_t segment_bytes;
    struct bell *bell;   /* in it: wakes the first rank of the node */
    struct tray *tray;   /* in it: this rank's lots, results and bell; NULL: rank 0 is elsewhere */
    struct tray **trays; /* to rank 0: of every rank, NULL on other nodes; owned */
    struct arrivals *arrivals;   /* in it: from those who have trays; NULL: nobody has */
    double broadcast_s, build_s; /* wall seconds on this rank */
    void *own_memory; /* of a rank alone on its node, in place of shared one; else NULL */
    bool leads;       /* the first rank of its node, who puts things there */
    int *processes; /* to it: ids of the ranks on the node; the caller's to free; NULL to others */
    int process_count;
};

/*
 * Every rank of comm calls this. Rank 0 passes the welcome and, when its scene_bytes is not 0, the
 * scene block, which is freed (bvh_bytes: bvh_bytes_bound()); all others pass NULL twice. Returns
 * the exit status of the job when there is nothing to render (scene_bytes 0), else -1 with *shared
 * filled in, to be given back with unshare_scene(), but for processes. There is no BVH before
 * share_bvh(), which every rank calls behind this: the first one of each node builds it, while others
 * that have something else to do come later. Both wait without using CPU.
 */
int share_scene(MPI_Comm comm, const struct welcome *welcome, struct scene *block,
                struct node_scene *shared);
void share_bvh(struct node_scene *shared);
void unshare_scene(MPI_Comm comm, struct node_scene *shared);

#endif
