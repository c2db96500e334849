/* The master's main loop, which serves the work queue to the renderers. */
#ifndef FARM_MASTER_SERVE_H
#define FARM_MASTER_SERVE_H

#include <stdatomic.h>
#include <stdbool.h>

#include "common/protocol.h"
#include "master/adaptive.h"
#include "master/canvas.h"
#include "master/progress.h"
#include "master/queue.h"
#include "master/save.h"
#include "master/timeline.h"
#include "master/watch.h"

struct bell;
struct cpu_time;
struct tray;
struct arrivals;

/* Number of image files: the picture, its heat map, and the map of ranks. */
#define SERVICE_IMAGES 3

/*
 * By which rank 0 renders tiles itself: the master does not know the renderer that stands behind it. render() fills
 * floats and header like a RESULT message, as work_on_tile() of worker/work.h does.
 */
struct tile_renderer {
    void *state;
    bool (*render)(void *state, const struct tile *tile, const struct refinement *refinements,
                   struct cpu_time *time, float *floats, struct result_header *header);
};

struct service {
    struct queue *queue;
    struct canvas *canvas;
    struct save *save; /* the journal, which keeps finished tiles; NULL: none */
    struct progress *progress;
    struct watch *watch;
    struct adaptive *adaptive; /* NULL: one pass, with all samples */
    /* By when the picture, as far as it is rendered, is to be written: a time of common/clock.h; HUGE_VAL: no
     * deadline. */
    double deadline;
    double limit; /* seconds from the start of the run to the deadline; 0: none */
    /* Image files that are to be written by the deadline; NULL or empty: none. For the first one, the
     * quantisation error is computed, too. */
    const char *images[SERVICE_IMAGES];
    struct thread_pool *pool;  /* threads that write the first one; NULL: the caller alone */
    bool only_limit;           /* nothing but the time limit is expected to end the run */
    uint32_t processors;       /* of all renderers together: struct crowd */
    struct timeline *timeline; /* records every finished tile; NULL: not wanted */
    /* The renderer in a second thread of this process; NULL: rank 0 only serves. With it, renderer i of the
     * queue is rank i, otherwise rank i + 1. */
    const struct tile_renderer *own;
    const atomic_int *stop; /* not 0: a signal has asked the run to stop */
    /* Wakes the master. Rung by `own`, and by renderers on this machine that have sent something that is not to
     * wait. */
    struct bell *bell;
    bool all_ring;             /* all renderers are on this machine */
    struct tray *const *trays; /* per rank; NULL: none, as it is on another machine */
    struct arrivals *arrivals; /* of the ranks that have a tray; NULL: none has */
    /* Seconds without a sign of life after which others get what a renderer holds; and of a renderer that has not
     * reported for work, which may still be building the BVH of its node. */
    double patience, start_patience;
    /* Set as soon as nothing that is being rendered matters any more: `own` gives up, too. */
    atomic_bool ending;
    /* The tile that `own` is rendering is of no use any more: it gives up this tile, but not the run. */
    atomic_bool given_up;

    struct renderer_stats
        *stats; /* filled in; one per renderer, in rank order; the caller's array */
};

/* What has come of serving. All is wall time but where CPU time is named. */
struct served {
    struct render_counts counts; /* of the tiles of the picture, each counted once */
    /* Seconds of the limit that were reserved for its end: for writing, and for estimating the error. */
    double reserved_s;
    double guessed_rmse; /* estimate for pixels without samples; NaN: none, or unknown */
    bool timed_out;      /* the deadline ended the run */
    bool deserted;       /* no renderer was left */
    /* When rendering began, the pre-pass included: a time of common/clock.h. */
    double began_at;
    double render_s;     /* seconds until the last tile was in the picture */
    double master_cpu_s; /* CPU seconds of this thread: serving and planning passes */
    uint64_t messages;   /* received */
    uint64_t answers;    /* number of answers whose time is in service_cpu_s */
    /* The part of master_cpu_s for these: taking them in, sending more work. */
    double service_cpu_s;
    /* Sum over answers of the time until they were noticed: upper bound. */
    double answer_wait_s;
    double answer_wait_most_s; /* the same: the longest of one answer */
    /* Seconds of planning passes, of those passes of which some result has come in. */
    double plan_s;
    /* Seconds of the last plan, even if it found nothing more to do; before the first one, a guess. */
    double last_plan_s;
    double probe_s; /* seconds of the pre-pass, summed over renderers */
    /* Number of renderers that stopped answering: MPI_Finalize would wait for them for ever. */
    uint32_t silent;
};

/*
 * Serves the queue until every renderer has left. A renderer that has not left within SERVE_GRACE after the end
 * (or after its last sign of life, if it was asked for one) is called silent, and takes part in nothing more.
 * Returns whether the picture is complete. It is not after a stop: then missing pixels are filled with an
 * estimate, fill_unknown(). `served` is set. Every other rank calls work().
 */
bool serve(struct service *service, struct served *served);

/* Seconds. A renderer looks for messages every few milliseconds of its own time. With dozens of processes on a
 * core, or with paging, that is a second. */
#define SERVE_GRACE 5.0

#endif
