/* The scene and its BVH, one copy per node in shared memory, and the bells and trays that the ranks of a node
 * share. */
#ifndef FARM_WORKER_NODE_SCENE_H
#define FARM_WORKER_NODE_SCENE_H

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
    struct bvh *bvh; /* built by the first rank of the node */
    /* The memory that the ranks of the node share, of segment_bytes bytes; that of a rank alone is its own. */
    struct segment_head *head;
    size_t segment_bytes;
    struct bell *bell; /* in the segment: wakes the first rank of the node */
    /* In the segment: this rank's lots, results and bell; NULL: rank 0 is on another node. */
    struct tray *tray;
    /* On rank 0, owned: one for every rank, NULL for itself and ranks on other nodes; else NULL. */
    struct tray **trays;
    /* In the segment: from renderers that have trays; NULL: there are none. */
    struct arrivals *arrivals;
    double broadcast_s, build_s; /* wall seconds on this rank */
    bool leads;                  /* this is the first rank of its node, which fills the segment */
    /* On the first rank: process ids of the node's ranks, freed by the caller; NULL on others. */
    int *processes;
    int process_count;
};

/*
 * share_scene() is collective. Rank 0 passes the welcome and, if its scene_bytes is not 0, the
 * scene block, which is freed (bvh_bytes: bvh_bytes_bound()); all others pass NULL twice. If scene_bytes is
 * 0, there is nothing to render, and it returns the exit status of the job. Else it returns -1 and fills in
 * *shared, to be released with unshare_scene(), except for `processes`. There is no BVH before share_bvh(),
 * which every rank calls afterwards: the first rank of each node builds it, and the others wait for it, after
 * whatever else they have to do. Both functions wait without using CPU time.
 */
int share_scene(const struct welcome *welcome, struct scene *block, struct node_scene *shared);
void share_bvh(struct node_scene *shared);
void unshare_scene(struct node_scene *shared);

#endif
