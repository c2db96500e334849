#include "worker/collective.h"

#include "common/cores.h"
#include "common/message.h"
#include "common/nap.h"
#include "common/orphan.h"

void wait_request(MPI_Request *request)
{
    struct nap nap = {0};
    int done = 0;
    for (;;) {
        MPI_Test(request, &done, MPI_STATUS_IGNORE);
        if (done) return;
        orphan_leave(nap.waited, ORPHAN_PATIENCE);
        nap_take(&nap);
    }
}

void wait_for_all(void)
{
    MPI_Request request;
    MPI_Ibarrier(MPI_COMM_WORLD, &request);
    wait_request(&request);
}

bool all_agree(bool yes)
{
    int own = yes, all;
    MPI_Request request;
    MPI_Iallreduce(&own, &all, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD, &request);
    wait_request(&request);
    return all;
}

/* Sends the bytes in pieces, as counts in MPI are ints, and so that the memory in flight stays small. */
void broadcast(MPI_Comm comm, void *data, size_t bytes)
{
    const size_t piece = (size_t)64 << 20;
    for (size_t done = 0; done < bytes; done += piece) {
        int count = (int)(bytes - done < piece ? bytes - done : piece);
        MPI_Request request;
        MPI_Ibcast((char *)data + done, count, MPI_BYTE, 0, comm, &request);
        wait_request(&request);
    }
}

int agree_on_status(int status)
{
    broadcast(MPI_COMM_WORLD, &status, sizeof status);
    return status;
}

struct affinity *gather_affinities(void)
{
    int rank, ranks;
    const int bytes = (int)sizeof(struct affinity);
    struct affinity own, *all = NULL;
    MPI_Request request;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    affinity_find(&own);
    if (rank == 0) all = allocate((size_t)ranks, sizeof *all);
    MPI_Igather(&own, bytes, MPI_BYTE, all, bytes, MPI_BYTE, 0, MPI_COMM_WORLD, &request);
    wait_request(&request);
    return all;
}
