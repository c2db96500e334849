/* Nodes: groups of ranks that can share memory. */
#ifndef FARM_WORKER_NODE_H
#define FARM_WORKER_NODE_H

#include <mpi.h>
#include <stdint.h>

#include "worker/segment.h"

/* What a rank tells about itself, see worker/segment.h. */
struct node_sign {
    /* Ranks with the same value are on the same node; 0: this rank is alone on its node. */
    uint64_t realm;
    struct segment_address segment;
};

/* What a rank is told about its node. */
struct node_place {
    struct segment_address segment; /* that of the node's first rank, which is its lowest one */
    int32_t first;                  /* that rank */
    /* This rank's index on its node, from 0, and the number of ranks there. */
    int32_t index, size;
    /* In the whole farm: number of nodes, and of ranks that cannot share memory. */
    int32_t nodes, isolated;
};

/* Computes the places of all ranks; signs and places have one element for each rank. */
void node_places(const struct node_sign *signs, int ranks, struct node_place *places);

struct node {
    struct node_place place;
    /*
     * The first ranks of all nodes, in order. MPI_COMM_NULL on other ranks, and if there is only one node.
     * The caller frees it.
     */
    MPI_Comm leaders;
};

/*
 * Collective over all ranks. segment: one that this rank has made, in case it is the first of its node. Ranks
 * sleep while they wait, except for the first ranks of several nodes. MPI_Comm_split_type() and
 * MPI_Win_allocate_shared(), which do the same, spin on all ranks: with 44 ranks on two cores that took three
 * quarters of a small picture's time.
 */
void node_find(struct segment_address segment, struct node *node);

#endif
