/* How a run ends before its time: signals, failures, and an MPI that does not come to an end. */
#ifndef FARM_MASTER_STOP_H
#define FARM_MASTER_STOP_H

#include <signal.h>
#include <stdbool.h>

/*
 * SIGINT and SIGTERM: rank 0 notes the first one for serve() to see and ends at once with the second
 * one; before stop_is_served() the first one ends the program with a message. The other ranks ignore
 * them (mpiexec passes signals to all ranks) and are told by rank 0. Failed writes of all kinds
 * become errors instead of signals.
 */
void stop_install(int rank);

/* From now on somebody looks at *stop_signal(): the number of the signal, or 0. */
void stop_is_served(void);
const volatile sig_atomic_t *stop_signal(void);

/*
 * All that matters is done: signals act as usual again, and if the process still stands after some
 * seconds it leaves with this status. (Over TCP alone, MPICH 4.0.2 was seen to wait in MPI_Finalize
 * for ever.)
 */
void stop_watch_the_end(int status);

#endif
