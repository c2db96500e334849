/* Collective operations. Waiting ranks sleep; MPI's own blocking calls would spin. */
#ifndef FARM_WORKER_COLLECTIVE_H
#define FARM_WORKER_COLLECTIVE_H

#include <mpi.h>
#include <stdbool.h>
#include <stddef.h>

/* Waits until the request is complete; it is MPI_REQUEST_NULL afterwards. */
void wait_request(MPI_Request *request);

/* Waits until all ranks have called this. */
void wait_for_all(void);

/* Whether all ranks pass true. */
bool all_agree(bool yes);

/* Copies the bytes of rank 0 of comm to all other ranks, each of which has room for them. */
void broadcast(MPI_Comm comm, void *data, size_t bytes);

struct affinity;

/*
 * The first collective operation of all. Returns, on rank 0, an array with the affinity of each rank in rank order,
 * which the caller frees; NULL on other ranks.
 */
struct affinity *gather_affinities(void);

/*
 * Returns the exit status of rank 0 on every rank. If all ranks end with the same status, mpiexec returns it; what it
 * returns for different ones depends on the launcher.
 */
int agree_on_status(int status);

#endif
