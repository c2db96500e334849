/*
 * Stops a rank, as SIGSTOP would, when it comes to a certain call; loaded before the C library (LD_PRELOAD).
 * FAULTS_STOP_RANK: which rank; FAULTS_STOP_AT: before which of
 *
 *   init      MPI_Init_thread
 *   share     the first collective call, before the scene is there
 *   memory    it opens the memory that its node shares
 *   ready     its first message, which reports for work
 *   tile      the first tile, or probes: it has work, and has sent nothing to the master yet
 *   later     some tiles later, if it has so many: its results may or may not have been taken
 *   result    the first result that goes as a message
 *   stats     its last message, after STOP
 *   finalize  MPI_Finalize
 *   exit      the end of the process
 */
#include <dlfcn.h>
#include <mpi.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "bench/preload_open.h"
#include "common/protocol.h"

/* Stops only once: a rank that is continued goes on. */
static void stop_at(const char *place)
{
    static bool has_stopped;
    const char *rank = getenv("FAULTS_STOP_RANK"), *at = getenv("FAULTS_STOP_AT");
    const char *own = getenv("PMI_RANK");
    if (!rank || !at || !own || strcmp(rank, own) != 0 || strcmp(at, place) != 0) return;
    if (has_stopped) return;
    has_stopped = true;
    const char *note = getenv("FAULTS_STOP_NOTE"); /* a file for the id of the stopped process */
    FILE *file = note ? fopen(note, "w") : NULL;
    if (file) fprintf(file, "%d\n", (int)getpid());
    if (file) fclose(file);
    raise(SIGSTOP);
}

static bool has_reported;

/* A renderer reads its CPU clock after it has reported for work, then before its first tile and after each one
 * that takes long enough (worker/work.c, common/cpu_time.c). */
int clock_gettime(clockid_t clock, struct timespec *time)
{
    static int (*next)(clockid_t, struct timespec *);
    static int readings;
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "clock_gettime");
    if (has_reported && clock == CLOCK_THREAD_CPUTIME_ID) readings++;
    if (readings == 2) stop_at("tile");
    if (readings == 8) stop_at("later");
    return next(clock, time);
}

int MPI_Init_thread(int *argc, char ***argv, int required, int *provided)
{
    stop_at("init");
    return PMPI_Init_thread(argc, argv, required, provided);
}

int MPI_Ibcast(void *buffer, int count, MPI_Datatype type, int root, MPI_Comm comm,
               MPI_Request *request)
{
    stop_at("share");
    return PMPI_Ibcast(buffer, count, type, root, comm, request);
}

int open(const char *path, int flags, ...)
{
    va_list arguments;
    if (is_segment(path)) stop_at("memory");
    va_start(arguments, flags);
    int file = open_next(path, flags, arguments);
    va_end(arguments);
    return file;
}

int MPI_Isend(const void *buffer, int count, MPI_Datatype type, int rank, int tag, MPI_Comm comm,
              MPI_Request *request)
{
    if (tag == TAG_RENDERER_TO_MASTER_READY) {
        stop_at("ready");
        has_reported = true;
    }
    if (tag == TAG_RENDERER_TO_MASTER_RESULT) stop_at("result");
    if (tag == TAG_RENDERER_TO_MASTER_STATS) stop_at("stats");
    return PMPI_Isend(buffer, count, type, rank, tag, comm, request);
}

int MPI_Finalize(void)
{
    stop_at("finalize");
    return PMPI_Finalize();
}

static __attribute__((destructor)) void leave(void)
{
    stop_at("exit");
}
