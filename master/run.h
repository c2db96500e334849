/*
 * A run on rank 0, from the arguments to the exit status:
 *
 *   main.c --> prepare.c  --> run_journal.c   loads the scene, makes the queue, takes over an earlier run
 *          --> serve.h                        renders
 *          --> conclude.c --> run_journal.c   writes the picture and the report, or keeps the journal
 */
#ifndef FARM_MASTER_RUN_H
#define FARM_MASTER_RUN_H

#include "common/thread_pool.h"
#include "master/crowd.h"
#include "master/load.h"
#include "master/options.h"
#include "master/report.h"
#include "master/save.h"
#include "master/serve.h"
#include "master/stop.h"

/* The state of a run on rank 0. */
struct run {
    char **arguments; /* argv as it was given; owned */
    struct options options;
    struct job job;
    struct crowd crowd; /* which renderers share cores */
    struct queue *queue;
    struct canvas canvas;
    struct canvas reference; /* rgb is NULL: there is no reference */
    struct watch watch;
    struct adaptive *adaptive; /* NULL: sampling is not adaptive */
    /* Threads for work that all ranks of the node wait for: planning passes and writing the picture. NULL: rank 0
     * works alone. */
    struct thread_pool *pool;
    struct save *save; /* NULL: output.journal is empty, or the journal is closed */
    struct timeline timeline;
    struct renderer_stats *stats;
    struct report report;
    double start;
    int processes;
    struct affinity *affinities; /* per process: where it may run; owned */
    uint32_t renderers;
    uint32_t silent; /* number of ranks that did not answer any more in the end */
    int *neighbours; /* on the first rank of each node: process ids of its ranks; owned */
    int neighbour_count;
};

/* Whether a report is wanted: an empty name asks for none. */
static inline bool wants_report(const struct settings *settings)
{
    return settings->output.report[0] != '\0';
}

/* Flushes standard output. Returns an exit status: STATUS_FAILED after reporting that not all of it could be
 * written. picture: the file that the message says is there all the same; NULL: none. */
int close_output(const char *picture);

/* ---- prepare.c ---- */

/* Does everything that can fail because of the input, before any process starts to render. Returns the exit
 * status, or -1 to go on with *block, the scene, which the caller frees. */
int prepare(struct run *run, struct scene **block);

/* ---- run_journal.c ---- */

/* Percentage of the picture. Numbers of tiles cannot be compared: each run cuts the picture as it needs. */
double per_cent(const struct run *run, uint64_t pixels);

/* What is still to be rendered. With adaptive sampling: pixels without any samples, and, after the first pass, an
 * estimate of the tiles that they are. */
uint32_t tiles_left(const struct run *run);
uint64_t pixels_left(const struct run *run);

/* Opens the journal, if one is wanted, and takes over what an earlier run has left in it; false after reporting why
 * that is not possible. */
bool open_run_journal(struct run *run, const struct scene *scene);

/* Keeps the journal for a later run and prints the command that starts that run; then: what it will do, as in
 * "to go on". Returns whether the journal could be kept. */
bool keep_run_journal(struct run *run, const char *then);

/* ---- conclude.c ---- */

/* Warns of the ranks that do not answer any more. */
void name_silent(const struct run *run);

/* Ends a run whose picture is complete or whose time is over: writes all that was asked for. Returns the exit
 * status. */
int run_conclude(struct run *run, const struct served *served);

/* Ends a run that was stopped by a signal, or that has no renderer left (deserted): writes what there is.
 * Returns the exit status. */
int end_early(struct run *run, bool deserted);

#endif
