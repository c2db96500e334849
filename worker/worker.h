/*
 * The state of a renderer on a rank other than the master's. work.c renders, receive.c receives messages, and
 * send.c sends results.
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
    float report_s[LOT_TILES]; /* seconds in work after which a tile is reported; may be infinite */
    bool dropped[LOT_TILES];
    uint32_t count;
    bool wakes_master, has_woken_master; /* see call_for_more() */
    double answer_s;
    struct refinement *refinements; /* of all refined tiles, one after the other; owned */
};

/*
 * Send buffers for results. With few renderers the master sleeps for up to 10 ms while all have enough to do.
 * Parts of a lot of cheap tiles are finished faster than that: with two buffers renderers waited for 0 to 4 %
 * of a run on two cores. With eight buffers none of 22 renderers waited for longer than 2.4 ms in all.
 */
#define SENDS 8

/*
 * Until STOP has been received, a receive is posted for the master's next message of any kind. Results are
 * sent from buffers, each of which is reused when its send has completed:
 *
 *   render into buffer b -> Isend from b -> render into the first free one -> ...
 *
 * If the master is on this node, a result is put into a slot of the tray instead, provided that the next slot
 * is empty and has room for the rest of the lot.
 */
struct worker {
    struct renderer *renderer;
    const struct view *view;
    /* That of this node's first rank; if the master is on another node, ringing it has no effect. */
    struct bell *bell;
    bool adaptive;
    double start; /* start of the render phase, on clock_wall() */
    double cpu;   /* clock_thread_cpu() when this rank was ready */

    union {
        char tiles[TILES_MAX_BYTES];
        struct drop drops[DROP_TILES];
        struct start start;
    } * incoming;
    MPI_Request receive;
    unsigned received; /* number of things received from the master, in messages or in the tray */
    /* MPI may need calls to make progress with what this renderer has sent, or with something unknown. */
    bool unsettled;
    bool started;    /* START was received */
    double patience; /* as it says */
    /* Seconds that this renderer has waited without receiving anything; when it last looked, on clock_wall(); the
     * count `received` then. */
    double silence_s, looked_at;
    unsigned heard;
    struct lot current; /* the lot in work */
    uint32_t rendering; /* index of the tile in work */
    bool given_up;      /* the tile in work is to be abandoned: another renderer has finished it */
    double polled;      /* when messages were last polled between waves */
    /* Lots received and not begun, the oldest first; `waiting` of them. */
    struct lot lots[LOTS_UNDER_WAY];
    int waiting;
    bool stopped; /* STOP was received */

    MPI_Request pong; /* send of the last PONG */
    char *buffers[SENDS];
    size_t capacities[SENDS];
    MPI_Request sends[SENDS];
    int buffer; /* the one in use */

    struct tray *tray; /* NULL: the master is on another node */
    /* If there is a tray: the master's count of what was sent to it. */
    struct arrivals *arrivals;
    unsigned lots_taken, results_put; /* counts: lots taken from the tray, results put into it */

    /* The result being filled: in a slot of the tray, or in a buffer. */
    bool in_tray;
    char *result;
    /* Bytes of finished tiles, and those of them that were sent before a notice. */
    size_t done, sent;
    struct cpu_time time; /* CPU time of the tile in work */
    double report_at;     /* when to report the tile in work to the master */
    bool reported;        /* it has been reported */
    struct result_header notice;
    char *early_result; /* copy of the finished tiles sent before the notice; owned */
    size_t early_room;
    MPI_Request notice_send, early_send; /* sends of the notice, of early_result */

    struct renderer_stats stats;
};

/* Posts the receive for the next message: called once at the start, afterwards by receive_next(). */
void post_receive(struct worker *worker);

/*
 * Receives the master's next message if it has arrived, after any lots in the tray that precede it, or the
 * next lot in the tray. Returns whether there was one. Invalid data ends the farm.
 */
bool receive_next(struct worker *worker);

/* Receives everything that has arrived. */
void receive_all(struct worker *worker);

/*
 * Sets worker->result to the next slot of the tray, if it is empty, or else to a free send buffer, with room
 * for this many bytes; waits until a buffer is free.
 */
void begin_result(struct worker *worker, size_t bytes);

/* Sends what has not been sent of the result. In a slot it is moved to the front. */
void send_result(struct worker *worker);

/* Sends a message of `size` bytes to the master; they must stay unchanged until the request is complete. */
void send_to_master(struct worker *worker, enum message_tag tag, const void *bytes, size_t size,
                    MPI_Request *request);

/* Whether all sends of this renderer are complete. */
bool all_is_sent(struct worker *worker);

/* Whether there may be something to receive, or work for MPI to progress. Does not call MPI. */
bool may_need_poll(const struct worker *worker);

/*
 * Reports to the master that the tile in work takes long, after sending all finished tiles, so that the
 * master knows which tiles are not begun. Does nothing while the previous report is still being sent. now: on
 * clock_wall().
 */
void report_unfinished(struct worker *worker, double now);

#endif
