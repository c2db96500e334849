/* The end of a run, whether regular or early: signals, failures, and an MPI that does not finish. */
#ifndef FARM_MASTER_STOP_H
#define FARM_MASTER_STOP_H

#include <stdatomic.h>
#include <stdbool.h>

/* The exit status. STATUS_RESUMABLE: stopped before the end; the same command continues the run (EX_TEMPFAIL of
 * sysexits.h). */
enum { STATUS_DONE = 0, STATUS_FAILED = 1, STATUS_INPUT = 2, STATUS_RESUMABLE = 75 };

/*
 * Blocks SIGUSR1 until stop_install(). As soon as MPI starts, it takes this signal for news of a dead rank: without
 * mpiexec, MPICH then starts one to ask for more, in vain, and waits for ever.
 */
void stop_hold_signal(void);

/*
 * Installs the signal handlers. SIGINT, SIGTERM and SIGUSR1: rank 0 notes the first one, which serve() looks at,
 * and is ended at once by the second one, of whichever kind. (Signals within a tenth of a second count as one:
 * timeout(1) signals a process and then its group.) Before stop_defer() the first one ends the program with
 * a message. The other ranks ignore these signals, as mpiexec passes them to all ranks, and are told by rank 0.
 * SIGHUP is ignored: a run goes on when its terminal goes. SIGPIPE is, too: failed writes to pipes become
 * errors.
 */
void stop_install(int rank);

/* From here on, writing beyond the limit of file sizes (ulimit -f) is an error of the write, not a signal. To be
 * called before MPI starts, which writes files of its own. */
void stop_ignore_file_limit(void);

/* From now on the caller looks at *stop_signal(), which is the number of the signal that was noted, or 0. */
void stop_defer(void);
const atomic_int *stop_signal(void);

/* What one of the signals that end a run is called in messages: by its key, too, where it has one. */
const char *signal_name(int number);

/* Names a file that is of no use yet, an empty journal. It is removed if the job ends before stop_defer(),
 * by a signal or because not all ranks came to the start. path: the caller's, valid as long as the program runs. */
void stop_removes(const char *path);

/*
 * Ends the whole job with this status at once, whatever MPI is doing; may be called by a signal handler. Under
 * Hydra, MPICH's mpiexec, it sends Hydra an abort command: Hydra then ends all ranks, including stopped ones,
 * and returns this status. (When a rank merely exits, Hydra returns 9 for those that it has to kill.) Without
 * Hydra, `end` is called if it is not NULL, then this process exits.
 */
_Noreturn void stop_job(int status, void (*end)(int status));

/* Whether this rank was started by Hydra. */
bool stop_has_launcher(void);

/*
 * Limits the time for which rank 0 waits for the others at the start: unless stop_unwatch_the_start() is called
 * within this time, the job ends with STATUS_RESUMABLE and a message. Otherwise a rank that is stopped before it
 * renders would keep the others waiting for ever, as MPI starts collectively.
 */
void stop_watch_the_start(unsigned seconds);
void stop_unwatch_the_start(void);

/*
 * To be called when all that matters is done: from now on signals are ignored, and do not change the status. If
 * the process still exists after some seconds, the job ends with this status, as MPI_Finalize waits for a rank
 * that is stopped just then. (Over TCP alone, MPICH 4.0.2 was seen to wait in it for ever.)
 */
void stop_watch_the_end(int status);

/*
 * Waits, for some seconds at most, until these processes of this machine have exited: other ranks that have
 * nothing more to do. Stopped ones are sent SIGCONT, for mpiexec would wait for them for ever.
 */
void stop_wait_for_exits(const int *processes, int count);

#endif
