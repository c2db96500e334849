/* The master's side of the farm. */
#ifndef FARM_MASTER_SERVE_H
#define FARM_MASTER_SERVE_H

#include <signal.h>
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
struct tray;
struct arrivals;

/* The picture, its heat map, and who rendered what. */
#define SERVICE_IMAGES 3

struct service {
    struct queue *queue;
    struct canvas *canvas;
    struct save *save; /* where finished tiles are kept; NULL: nowhere */
    struct progress *progress;
    struct watch *watch;
    uint32_t first_samples;    /* per pixel, in pass 0 */
    struct adaptive *adaptive; /* NULL: one pass, with all samples */
    /* A time of common/clock.h: the picture, what is there of it, is to be written by then. HUGE_VAL: none. */
    double deadline;
    double limit; /* seconds until then from the start of the run; 0: none */
    /* Files of the picture's size that are to be written by then; NULL or empty: none. Of the first one it is told
     * what rounding costs. */
    const char *images[SERVICE_IMAGES];
    struct crew *crew;         /* by which the first one is written; NULL: by the caller alone */
    bool only_limit;           /* nothing else is expected to end it */
    uint32_t processors;       /* that renderers have together: struct crowd */
    struct timeline *timeline; /* gets every finished tile; NULL: not kept */
    /* Renders tiles in a second thread of this process; NULL: rank 0 only serves. Renderer i of the
     * queue is then rank i, otherwise rank i + 1. */
    const struct tile_renderer *own;
    const volatile sig_atomic_t *stop; /* not 0: give up what is in work and leave */
    /* Rung by own, and by the renderers on this machine, who has sent something that is not to wait. */
    struct bell *bell;
    bool all_ring;             /* there are no others */
    struct tray *const *trays; /* per rank; NULL: it has none, for it is on another machine */
    struct arrivals *arrivals; /* from those who have one; NULL: nobody has */
    double patience;           /* seconds without a sign of life: others get what a renderer has */
    /* Set as soon as nothing of what is in work matters any more: own gives up, too. */
    atomic_bool ending;
    /* What own renders is of no use any more: it gives up this tile, not the run. */
    atomic_bool given_up;

    /* Results, 0 or false before. */
    struct renderer_stats *stats; /* one per renderer, in rank order; the caller's array */
    struct render_counts counts;  /* of the tiles that are in the picture, each once */
    double writing_s;             /* seconds that writing images is expected to take */
    double kept_s;                /* of the limit, for its end: to write, and to tell the error */
    double guessed_rmse;          /* about, of pixels without samples; NaN: none, or unknown */
    bool timed_out;               /* the deadline ended it */
    bool deserted;                /* nobody was left who renders */
    double began;                 /* a time of common/clock.h: rendering, the pre-pass included */
    double render_s;              /* wall seconds until the last tile was in the picture */
    double master_cpu_s;          /* CPU seconds of serving and of plans, of this thread */
    uint64_t messages;            /* received */
    uint64_t answers;             /* those that are in service_cpu_s */
    double service_cpu_s;         /* of that, for answers: taking them in, sending more work */
    double answer_wait_s;         /* of all answers until they were looked at, at most */
    double answer_wait_most_s;    /* of one */
    double plan_s;                /* wall seconds between passes of which something has come in */
    double last_plan_s; /* the last of them, even if there was no more to do; before it, a guess */
    double probe_s;     /* of the pre-pass, wall seconds of all renderers together */
    uint32_t silent;    /* renderers that answered no more: MPI_Finalize would wait for ever */
};

/*
 * Serves the queue until every renderer has left. Who does not within SERVE_GRACE after the end, or after his last sign
 * of life if he has been asked for one, is silent, and takes part in nothing more. Returns whether the picture is
 * complete (false after a stop: then the picture shows something like it where pixels are missing, fill_unknown()).
 * Every rank calls this or work().
 */
bool serve(struct service *service);

/* Seconds. A renderer looks for messages every few thousandths of a second of its own time; with dozens
 * of processes on a core, or one that pages, that is a second. */
#define SERVE_GRACE 5.0

#endif
