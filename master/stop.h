/* How a run ends, and how before its time: signals, failures, and an MPI that does not come to an end. */
#ifndef FARM_MASTER_STOP_H
#define FARM_MASTER_STOP_H

#include <signal.h>
#include <stdbool.h>

/* The exit status. STATUS_RESUMABLE: stopped before the end, the same command goes on (EX_TEMPFAIL of
 * sysexits.h). */
enum { STATUS_DONE = 0, STATUS_FAILED = 1, STATUS_INPUT = 2, STATUS_RESUMABLE = 75 };

/*
 * SIGINT, SIGTERM and SIGUSR1: rank 0 notes the first one for serve() to see and is ended at once by the
 * second one, of whichever kind (what comes within a tenth of a second is one and the same: timeout(1)
 * signals a process and then its group); before stop_is_served() the first one ends the program with a
 * message. The other ranks ignore them (mpiexec passes signals to all ranks) and are told by rank 0.
 * A run goes on when its terminal goes (SIGHUP). Failed writes to pipes become errors instead of signals.
 */
void stop_install(int rank);

/* A file grown to the limit of files (ulimit -f) is an error of who writes it, from here on: before MPI starts, too,
 * which writes some of its own. */
void stop_ignore_file_limit(void);

/* From now on somebody looks at *stop_signal(): the number of the signal, or 0. */
void stop_is_served(void);
const volatile sig_atomic_t *stop_signal(void);

/* A file that is of no use yet, an empty journal: where the job ends before stop_is_served(), by a signal or because
 * not all ranks came to the start, it is removed. path: the caller's, as long as the program runs. */
void stop_removes(const char *path);

/*
 * Ends the whole job with this status at once, whatever MPI is doing; may be called by a signal handler.
 * Hydra, MPICH's mpiexec, is told so in its own language: it ends all ranks, the stopped ones, too, and
 * returns this status. (When a rank only leaves, it returns 9 for those it has to kill.) Where there is
 * no Hydra, end is called if it is not NULL, then this process leaves.
 */
_Noreturn void stop_job(int status, void (*end)(int status));

/* Whether there is a Hydra. */
bool stop_has_launcher(void);

/*
 * Rank 0 waits for the others, for so many seconds at most: if that has not ended with
 * stop_start_is_over() by then, the job does, with STATUS_RESUMABLE and a message. A rank that is stopped
 * before it renders would keep the others waiting for ever, for MPI begins together.
 */
void stop_watch_the_start(unsigned seconds);
void stop_start_is_over(void);

/*
 * All that matters is done: a signal changes nothing any more, not even the status, and if the process still
 * stands after some seconds the job ends with this status: MPI_Finalize waits for a rank that is stopped just then.
 * (Over TCP alone, MPICH 4.0.2 was seen to wait in it for ever.)
 */
void stop_watch_the_end(int status);

/*
 * Waits for these processes of this machine, other ranks that have nothing more to do than to leave, for
 * some seconds at most; those that are stopped are woken, for mpiexec would wait for them for ever.
 */
void stop_see_off(const int *processes, int count);

#endif
