/*
 * What a renderer on another rank than the master's keeps, for work.c, which renders, hear.c, which takes
 * messages in, and send.c, which sends results.
 */
#ifndef FARM_WORKER_WORKER_H
#define FARM_WORKER_WORKER_H

#include <mpi.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/cpu_time.h"
#include "common/protocol.h"
#include "common/scene.h"
#include "common/tray.h"
#include "worker/render.h"

struct lot {
    struct tile tiles[LOT_TILES];
    float tells[LOT_TILES]; /* seconds in work after which the master is told; may be infinite */
    bool dropped[LOT_TILES];
    uint32_t count;
    bool calls, has_called; /* see call_for_more() */
    double answer_s;
    struct refinement *refinements; /* of all refined tiles in turn; owned */
};

/* Buffers for results. The master of a few renderers sleeps for up to 10 ms while all have enough to do; parts of a lot
 * of cheap tiles are finished sooner than that, and with two buffers renderers waited for 0 to 4 % of a run on two
 * cores. With eight none of 22 waited for longer than 2.4 ms in all. */
#define SENDS 8

/*
 * Until STOP has come, a receive is posted for the master's next message, whatever it is; results
 * leave through buffers, each of which is filled again when it has been sent:
 *
 *   render into buffer b -> Isend from b -> render into the first free one -> ...
 *
 * or, where the master is on this node, in the slots of a tray, if the next one is empty and has room for all
 * that is left of the lot.
 */
struct worker {
    MPI_Comm comm;
    struct renderer *renderer;
    const struct view *view;
    struct bell *bell; /* the master's, if it is on this node: else nobody hears it */
    bool adaptive;
    double start; /* of the run, on clock_wall() */
    double cpu;   /* clock_thread_cpu() when this rank was ready */

    union {
        char tiles[TILES_MAX_BYTES];
        struct drop drops[DROP_TILES];
        struct start start;
    } * incoming;
    MPI_Request receive;
    unsigned heard;     /* of what the master has said, in messages or in the tray */
    bool unsettled;     /* MPI may have something to move: what this renderer has sent, and now and
                         * then what nobody knows of */
    bool started;       /* the master has said START */
    struct lot current; /* in work */
    uint32_t rendering; /* the tile of it */
    bool given_up;      /* that tile: somebody else has finished it */
    double looked;      /* when messages were last looked for between waves */
    struct lot lots[LOTS_UNDER_WAY]; /* received, not rendered; the oldest first */
    int waiting;
    bool stopped; /* the master has said STOP */

    MPI_Request pong; /* the last sign of life */
    char *buffers[SENDS];
    size_t capacities[SENDS];
    MPI_Request sends[SENDS];
    int buffer; /* in use */

    struct tray *tray;                /* NULL: the master is on another node */
    struct arrivals *arrivals;        /* where there is a tray: what the master has got */
    unsigned lots_taken, results_put; /* from the tray, into it */

    /* The result that is being filled: in the slot whose turn it is, or in the buffer. */
    bool in_tray;
    char *result;
    size_t done,
        sent; /* bytes of finished tiles, and of those that went with a tile that took long */
    struct cpu_time time; /* of the tile in work */
    double tell_at;       /* when the master is to hear of it */
    bool told;            /* it has */
    struct result_header notice;
    char *told_bytes; /* finished tiles that were sent before it; owned */
    size_t told_room;
    MPI_Request telling, finished; /* the notice; these */

    struct renderer_stats stats;
};

/* The next message is awaited: once at the start, then hear() does it. */
void post_receive(struct worker *worker);

/* Takes in what the master has said next, if it is there, and what comes before it in the tray; returns whether it
 * was. What makes no sense ends the farm. */
bool hear(struct worker *worker);

/* Takes in all that have arrived. */
void hear_all(struct worker *worker);

/* Sets worker->result to the next send buffer, or slot of the tray, with room for so many bytes, empty;
 * waits until one is free. */
void begin_result(struct worker *worker, size_t bytes);

/* What has not been sent of the result. In a slot it begins at the front. */
void send_result(struct worker *worker);

/* The master gets so many bytes in a message, which stay as they are until the request is done. */
void send_to_master(struct worker *worker, enum message_tag tag, const void *bytes, size_t size,
                    MPI_Request *request);

/* Whether MPI has taken all that this renderer has sent. */
bool all_is_sent(struct worker *worker);

/* Whether there may be something to hear, or to move for MPI: without a look at that. */
bool is_under_way(const struct worker *worker);

/* The master hears that the tile in work takes long, and before that of what is finished, so that it knows
 * what is not begun; unless the last time is still on its way. now: on clock_wall(). */
void tell(struct worker *worker, double now);

#endif
