/* What ranks do together. Who waits for others sleeps meanwhile: MPI's own calls that wait would spin. */
#ifndef FARM_WORKER_COLLECTIVE_H
#define FARM_WORKER_COLLECTIVE_H

#include <mpi.h>
#include <stdbool.h>
#include <stddef.h>

/* Until the request is done, which is MPI_REQUEST_NULL then. */
void wait_request(MPI_Request *request);

/* Until all ranks of comm are here. */
void wait_for_all(MPI_Comm comm);

/* Whether all ranks of comm say yes. */
bool all_agree(MPI_Comm comm, bool yes);

/* So many bytes of rank 0 of comm to all others, each of which has room for them. */
void broadcast(MPI_Comm comm, void *data, size_t bytes);

/* Every rank calls this, before anything else. Returns, on rank 0, where each rank may run, in their order:
 * the caller's to free; NULL on the others. */
struct berth;
struct berth *gather_berths(MPI_Comm comm);

/*
 * The exit status of rank 0, for every rank to end with: so mpiexec returns it whatever it makes of
 * several.
 */
int agree_on_status(MPI_Comm comm, int status);

#endif
