/* Collective operations. Waiting ranks sleep; MPI's own blocking calls would spin. */
#ifndef FARM_WORKER_COLLECTIVE_H
#define FARM_WORKER_COLLECTIVE_H

#include <mpi.h>
#include <stdbool.h>
#include <stddef.h>

/* Waits until the request is complete; it is MPI_REQUEST_NULL afterwards. */
void wait_request(MPI_Request *request);

/* Waits until all ranks of comm have called this. */
void wait_for_all(MPI_Comm comm);

/* Whether all ranks of comm pass true. */
bool all_agree(MPI_Comm comm, bool yes);

/* Copies the bytes of rank 0 of comm to all other ranks, each of which has room for them. */
void broadcast(MPI_Comm comm, void *data, size_t bytes);

/*
 * Collective, before anything else. Returns, on rank 0, the berth of each rank, in order; the caller frees
 * the array. NULL on other ranks.
 */
struct berth;
struct berth *gather_berths(MPI_Comm comm);

/*
 * Returns the exit status of rank 0, for every rank to end with: so mpiexec returns that status whatever it
 * makes of different ones.
 */
int agree_on_status(MPI_Comm comm, int status);

#endif
