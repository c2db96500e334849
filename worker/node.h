/* Nodes: the ranks that can share memory. */
#ifndef FARM_WORKER_NODE_H
#define FARM_WORKER_NODE_H

#include <mpi.h>
#include <stdint.h>

#include "common/segment.h"

/* What a rank tells of itself, see common/segment.h. */
struct node_sign {
    uint64_t reach; /* who has the same is on the same node; 0: alone on its node */
    struct segment_address segment;
};

/* What it is told. */
struct node_place {
    struct segment_address segment; /* of the node's first rank, the lowest one */
    int32_t first;                  /* that rank */
    int32_t index, size;   /* this rank's place on its node, from 0, and how many there are */
    int32_t nodes, loners; /* altogether: nodes, and ranks that can share no memory */
};

/* signs, places: of so many ranks, in their order. */
void node_places(const struct node_sign *signs, int ranks, struct node_place *places);

struct node {
    struct node_place place;
    /* To first ranks: those of all nodes, in their order; MPI_COMM_NULL to others, and where there is one node. The
     * caller's to free. */
    MPI_Comm leaders;
};

/*
 * Every rank of comm calls this; segment: what it has made, in case it is the first one of its node. Who waits sleeps,
 * but for the first ranks of several nodes. In MPI_Comm_split_type() and MPI_Win_allocate_shared(), which do the same,
 * all ranks spin: with 44 on two cores that took three quarters of a small picture's time.
 */
void node_find(MPI_Comm comm, struct segment_address segment, struct node *node);

#endif
