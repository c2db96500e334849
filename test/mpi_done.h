/* For tests of the master that replace MPI: a fake whose requests are complete at once. */
#ifndef FARM_TEST_MPI_DONE_H
#define FARM_TEST_MPI_DONE_H

#include <mpi.h>

int MPI_Testall(int count, MPI_Request *requests, int *done, MPI_Status *statuses)
{
    (void)statuses;
    for (int i = 0; i < count; i++)
        requests[i] = MPI_REQUEST_NULL;
    *done = 1;
    return MPI_SUCCESS;
}

int MPI_Cancel(MPI_Request *request)
{
    (void)request;
    return MPI_SUCCESS;
}

int MPI_Wait(MPI_Request *request, MPI_Status *status)
{
    (void)status;
    *request = MPI_REQUEST_NULL;
    return MPI_SUCCESS;
}

#endif
