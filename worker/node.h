/* Nodes: the ranks that can share memory. */
#ifndef FARM_WORKER_NODE_H
#define FARM_WORKER_NODE_H

#include <mpi.h>
#include <stdint.h>

/* What a rank tells of itself, see common/segment.h. */
struct node_sign {
    uint64_t reach; /* who has the same is on the same node; 0: alone on its node */
    uint64_t key;
};

/* What it is told. */
struct node_place {
    uint64_t key;        /* of the node's first rank, the lowest one: names what they share */
    int32_t first;       /* that rank */
    int32_t index, size; /* this rank's place on its node, from 0, and how many there are */
    int32_t nodes;       /* altogether */
};

/* signs, places: of so many ranks, in their order. */
void node_places(const struct node_sign *signs, int ranks, struct node_place *places);

struct node {
    struct node_place place;
    MPI_Comm
        leaders; /* to first ranks: those of all nodes, in their order; MPI_COMM_NULL to others, and
                       * where there is one node. To be freed by the caller. */
};

/* Every rank of comm calls this. MPI_Comm_split_type() and a window of shared memory would do the same, but wait
 * without sleeping: with 44 ranks on two cores, three quarters of what a small picture takes altogether. */
void node_find(MPI_Comm comm, struct node *node);

#endif
