/*
 * A run on rank 0, from the arguments to the exit status:
 *
 *   main.c --> prepare.c --> keep.c          the scene and the queue; what an earlier run has left
 *          --> serve.h                       rendering
 *          --> conclude.c --> keep.c         the picture and the report; or what the next run needs
 */
#ifndef FARM_MASTER_RUN_H
#define FARM_MASTER_RUN_H

#include "common/crew.h"
#include "master/crowd.h"
#include "master/load.h"
#include "master/options.h"
#include "master/report.h"
#include "master/save.h"
#include "master/serve.h"
#include "master/stop.h"

/* What rank 0 carries through the run. */
struct run {
    char **arguments; /* argv as it was given; owned */
    struct options options;
    struct job job;
    struct crowd crowd; /* of the renderers */
    struct queue *queue;
    struct canvas canvas;
    struct canvas reference; /* rgb is NULL: there is none */
    struct watch watch;
    struct adaptive *adaptive; /* NULL: it is not */
    struct crew *
        crew; /* for what the ranks of the node wait for: plans, the picture's file; NULL: rank 0 alone */
    struct save *save; /* NULL: output.journal is empty, or the work on it is done */
    struct timeline timeline;
    struct renderer_stats *stats;
    struct report report;
    double start;
    int processes;
    struct berth *berths; /* per process; owned */
    uint32_t renderers;
    uint32_t silent; /* ranks that answered no more in the end */
    int *neighbours; /* on the first rank of each node: the processes of its ranks; owned */
    int neighbour_count;
};

/* An empty name asks for no report. */
static inline bool wants_report(const struct settings *settings)
{
    return settings->output.report[0] != '\0';
}

/* Whether what was printed reached its reader, as an exit status; says so otherwise. */
int close_output(void);

/* ---- prepare.c ---- */

/*
 * Everything that can go wrong because of the input, before any process starts to render. Returns
 * the exit status, or -1 to go on with *block.
 */
int prepare(struct run *run, struct scene **block);

/* ---- keep.c ---- */

/* What is still to be rendered. */
uint32_t tiles_left(const struct run *run);
uint64_t pixels_left(const struct run *run);

/* Opens the journal, if one is wanted, and takes over what an earlier run has left in it; false after
 * saying why it cannot be. */
bool open_save(struct run *run, const struct scene *scene);

/* Leaves the journal to a later run and tells how to start that, which will `then` happen; returns
 * whether it can be. */
bool keep(struct run *run, const char *then);

/* ---- conclude.c ---- */

/* Names the ranks that answered no more. */
void name_silent(const struct run *run);

/* The picture is complete, or its time is over: writes all that was asked for. Returns the exit status. */
int run_conclude(struct run *run, const struct service *service);

/* The run was stopped by a signal, or nobody was left who renders: writes what there is. Returns the exit
 * status. */
int end_early(struct run *run, bool deserted);

#endif
