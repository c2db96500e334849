/*
 * The state of serve(), and what its parts do for each other; for all others there is serve.h.
 *
 *   serve.c          the loop, its start and its end
 *     take_in.c      what messages say ------------+--> accept.c    finished tiles into the picture
 *       hand_out.c   work, recalls and STOP        |
 *     own_renderer.c rank 0's second thread -------+
 *     silence.c      who gives no sign of life
 *     passes.c       what adaptive sampling asks for next
 */
#ifndef FARM_MASTER_SERVER_H
#define FARM_MASTER_SERVER_H

#include <pthread.h>

#include "master/post.h"
#include "master/preview.h"
#include "master/serve.h"

/* A renderer on another rank, as the main thread knows it. */
struct contact {
    bool is_ready; /* it may be sent tiles */
    bool is_idle;  /* it asks for work, and there was none */
    bool is_full;  /* it holds as many lots as it may */
    bool is_told;  /* that it is to stop */
    bool is_gone;  /* its statistics are here */
    bool is_asked; /* for a sign of life since its last message came */
    bool is_silent;
    int drops;           /* tiles in DROP messages since its last answer */
    uint32_t drop_count; /* of its drops, that it is to hear of in this turn of the loop */
    double heard;        /* the server's time awake when its last message or result came */
    unsigned lots_put, results_taken; /* into its tray, from it */
};

/* Beside its contact: all contacts are walked, these hardly ever. */
struct drops {
    struct drop drop[DROP_TILES];
};

/* A piece of a tile, until it is known whether that comes as a whole before all of its pieces. */
struct kept_piece {
    uint32_t renderer;
    struct tile tile;
    struct result_header header;
    float *rgb; /* as in the message; owned */
};

struct server {
    struct service *service;
    double start;
    double finished; /* when the last tile came in */

    /* Shared with the rendering thread, under lock: queue, canvas, watch, and what follows. */
    pthread_mutex_t lock;
    struct preview preview;
    double planned_s;       /* plan_s of the pass of which nothing has come in yet */
    double rendered_before; /* adaptive_seconds() of earlier runs */
    bool last_pass;         /* what is in the queue is all there will be */
    bool is_cut;            /* pass 0 would not have been done in time */
    double cut_s;           /* adaptive_seconds() of this run that it was expected to come to */
    uint32_t *sampled; /* of each refined tile that has been handed out: pixels that get samples */
    uint32_t sampled_room;
    struct kept_piece *pieces;
    uint32_t piece_count;
    uint64_t news; /* of the queue, when the idle were last asked */
    bool own_done;
    uint32_t own_tile; /* the id of what rank 0 itself renders; its own renderer looks for what it
                        * has not begun */

    /* Main thread only. */
    struct post *post;
    uint32_t first_rank;   /* of renderer 0 */
    uint32_t first_remote; /* renderers from here on are on other ranks */
    uint32_t renderers;
    uint32_t first_there;     /* all others before it are gone */
    struct contact *contacts; /* per renderer */
    struct drops *drops;      /* per renderer */
    char *message;            /* TILES_MAX_BYTES, zeroed: what fills up parts is 0 or old */
    double ended;             /* time awake, when service->ending was set */
    double awake;             /* seconds of the loop; of a pause in which rank 0 itself was stopped
                               * next to none count, for nobody is to blame for it */
    uint32_t unmeasured;      /* looks that found answers since one was measured */
    double woken;             /* clock_wall() at the last look at it */
    double next_look;         /* when silence is to be looked for */
    double next_show;         /* when the progress is to be looked at */
    double fill_s;   /* that it takes at the end to fill what has no samples; 0: all have some */
    double next_cut; /* server_elapsed() when pass 0 is to be looked at again */
    unsigned late_looks;     /* that found it too late, one after the other */
    uint32_t tiles_before;   /* of passes before this one */
    double polled;           /* when messages were last looked for */
    unsigned messages_taken; /* not what lay in trays */
    uint32_t flag_words;     /* of arrivals: up to the last rank who has a tray */
    double next_look_at_mpi; /* when MPI is looked at, whether something is expected or not */
    uint64_t pixels;         /* that have come in messages */
};

/* ---- serve.c ---- */

/* Seconds since the start of the render phase. */
double server_elapsed(const struct server *server);

/* Of a renderer. Where rank 0 does not render, the first one is rank 1. */
static inline uint32_t rank_of(const struct server *server, uint32_t renderer)
{
    return server->first_rank + renderer;
}

/* Whether nothing is left for this renderer, in later passes either; the lock is held. */
bool server_is_through(struct server *server, uint32_t renderer);

/* Where nobody has rendered pixels, the picture shows something like it: fill_unknown(). The lock is held, or nobody
 * renders. */
void fill_picture(struct server *server);

/* ---- accept.c; the lock is held ---- */

/* What a refined tile's pass asks for, in the tile's order: the answer is to have as many pixels as get
 * samples, whose number is returned. */
uint32_t take_refinements(struct server *server, const struct tile *tile,
                          struct refinement *refinements);

/* A finished tile goes into the picture and the journal, unless somebody else was first. */
void accept_tile(struct server *server, uint32_t renderer, const struct tile *tile,
                 const float *rgb, const struct result_header *header);

/* At the end of a run that was stopped, when no more answers come: pieces of tiles that are not finished. */
void put_last_pieces(struct server *server);

/* A tile that the renderer has left to others; it may (queue_is_recalled()). */
void accept_dropped(struct server *server, uint32_t renderer, const struct tile *tile,
                    const struct result_header *header);

/* Probes go into the preview, and what they cost to the queue. */
void accept_probes(struct server *server, uint32_t renderer, const struct tile *tile,
                   const float *rgb, const struct result_header *header);

/* ---- hand_out.c ---- */

/* What this process shares with the renderer; NULL: that one is on another machine. */
struct tray *tray_of(const struct server *server, uint32_t renderer);

/* The answer to READY, and the first lots. */
void hand_out_start(struct server *server, uint32_t renderer);

/* Gives a remote renderer all the lots that it may hold. */
void hand_out(struct server *server, uint32_t renderer);

/* The same for those who have nothing to do, when there may be something. */
void hand_out_to_idle(struct server *server);

/* Tells renderers what others have taken from them, or finished for them: at the end of a turn of the loop,
 * so that each gets one message. Of what it has not begun the master's own renderer looks itself. */
void tell_recalls(struct server *server);

/* Asks for a sign of life. */
void ask_for_sign(struct server *server, uint32_t renderer);

/* Whatever a renderer is doing, it is to give that up and leave. */
void tell_stop(struct server *server, uint32_t renderer);

/* ---- take_in.c ---- */

/* Handles all that has arrived; returns whether there was anything. */
bool take_in(struct server *server);

/* ---- own_renderer.c ---- */

/* The second thread of rank 0: takes the struct server, renders what the queue gives to renderer 0 until
 * nothing is left for it, and never calls MPI. */
void *render_own(void *argument);

/* ---- silence.c ---- */

/* Once per turn of the loop: lets the time awake pass, and now and then asks those from whom nothing has come
 * for a while, gives up those who do not answer. */
void look_for_silence(struct server *server);

/* A message of this renderer has come. */
void note_sign(struct server *server, uint32_t renderer);

/* Whether there is nobody who renders. */
bool is_deserted(const struct server *server);

/* ---- passes.c ---- */

/* When rendering is to end for the deadline: in time for files, and for what is told of the error at the end, which
 * takes about as long as a plan. HUGE_VAL: there is no deadline. */
double rendering_ends(const struct server *server);

/* Guesses what of a time limit it takes to plan a pass, and to fill the picture at the end, before either was done. */
void guess_times(struct server *server);

/* Tries how long files take that are to be written: whether the picture is rendered, or as for any of its size. */
void estimate_writing(struct server *server, bool rendered);

/* Puts the next pass into the queue when one is complete. */
void follow_passes(struct server *server);

#endif
