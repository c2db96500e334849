/*
 * What the source files of serve() share; all other code uses serve.h.
 *
 *   serve.c          the main loop, its start and its end
 *     take_in.c      messages from renderers -----+--> accept.c    finished tiles into the picture
 *       hand_out.c   work, recalls and STOP       |
 *     own_renderer.c rank 0's second thread ------+
 *     silence.c      renderers that give no sign of life
 *     passes.c       the passes of adaptive sampling
 */
#ifndef FARM_MASTER_SERVER_H
#define FARM_MASTER_SERVER_H

#include <pthread.h>

#include "master/post.h"
#include "master/preview.h"
#include "master/serve.h"

/* What the main thread knows of a renderer on another rank. */
struct contact {
    bool is_ready; /* it may be sent tiles */
    bool is_idle;  /* it asked for work, and there was none */
    bool is_full;  /* it holds as many lots as it may */
    bool is_told;  /* it was told to stop */
    bool is_gone;  /* its statistics have come: it has left */
    bool is_asked; /* it was asked for a sign of life since its last message */
    bool is_silent;
    int drops;           /* tiles in DROP messages to it since its last answer */
    uint32_t drop_count; /* entries of its struct drops, to be sent in this turn of the loop */
    double heard_at;     /* server.awake_s when its last message or result came */
    unsigned lots_put, results_taken; /* lots put into its tray, results taken from it */
};

/* A finished piece of a tile, until it is known whether the tile comes as a whole before all of its pieces. */
struct kept_piece {
    uint32_t renderer;
    struct tile tile;
    struct result_header header;
    float *rgb; /* the pixels, as in the message; owned */
};

struct server {
    struct service *service;
    struct served *served;
    double start;
    double finished_at; /* clock_wall() when the last tile came in */

    /* Shared with the rendering thread, under lock: queue, canvas, watch, and what follows. */
    pthread_mutex_t lock;
    struct preview preview;
    double planned_s;       /* wall seconds of the plan whose pass has no result yet */
    double rendered_before; /* adaptive_seconds() of earlier runs */
    bool last_pass;         /* no further pass will be added to the queue */
    bool is_cut;            /* pass 0 was cut off, as it would not have been done in time */
    /* CPU seconds of this run in which pass 0 was expected to be done when it was cut off. */
    double cut_s;
    /* Per id of a refined tile that was handed out: how many of its pixels get samples. */
    uint32_t *sampled;
    uint32_t sampled_room;
    struct kept_piece *pieces;
    uint32_t piece_count;
    uint64_t news; /* queue_news() when idle renderers were last served */
    bool own_done;
    /* Id of the tile that rank 0's own renderer is working on. That renderer itself checks tiles that it has not
     * begun. */
    uint32_t own_tile;

    /* Main thread only. */
    struct post *post;
    uint32_t first_remote; /* renderer on another rank: 1, or 0 where rank 0 does not render */
    uint32_t renderers;
    uint32_t first_there;     /* all renderers on other ranks before this one are gone */
    struct contact *contacts; /* per renderer */
    /* Per renderer: the drops that are to be sent. Apart from the contacts, which are all scanned often. */
    struct drop (*drops)[DROP_TILES];
    /* TILES_MAX_BYTES; padding in it is 0 or stale, never uninitialised */
    char *message;
    double ended_at; /* server.awake_s when service->ending was set */
    /* Seconds that the loop has run. A pause in which rank 0 itself was stopped hardly counts, as no renderer is
     * to blame for it. */
    double awake_s;
    uint32_t unmeasured; /* calls of take_in() with answers since one was measured */
    double woken_at;     /* clock_wall() when `awake_s` was last updated */
    double next_look;    /* when to look for silent renderers next */
    double next_show;    /* when to show progress next */
    /* What the timeline has of serving: until when, and the thread's CPU time then. */
    double noted_at, noted_cpu;
    double writing_s; /* expected seconds for writing the images */
    /* Seconds that it takes at the end to fill pixels without samples; 0: all have some. */
    double fill_s;
    double next_cut; /* server_elapsed() when to check again whether pass 0 will be done in time */
    unsigned late_looks;     /* consecutive checks that found pass 0 too late */
    uint32_t tiles_before;   /* tiles of earlier passes */
    double polled_at;        /* clock_wall() when messages were last looked for */
    unsigned messages_taken; /* messages received by MPI, without results from trays */
    uint32_t flag_words;     /* words of arrivals, up to the last rank that has a tray */
    uint64_t pixels;         /* pixels that have come in results */
};

/* ---- serve.c ---- */

/* Seconds since the start of the render phase. */
double server_elapsed(const struct server *server);

/* The rank of a renderer. Where rank 0 does not render, renderer 0 is rank 1. */
static inline uint32_t rank_of(const struct server *server, uint32_t renderer)
{
    return renderer + 1 - server->first_remote;
}

/* Whether nothing is left for this renderer, in later passes either. The lock is held. */
bool server_is_through(struct server *server, uint32_t renderer);

/* Fills pixels that have no samples with an estimate: fill_unknown(). The lock is held, or nothing is rendered
 * any more. */
void fill_picture(struct server *server);

/* ---- accept.c; the lock is held ---- */

/* Sets *refinements to what the pass of this refined tile asks for, in the tile's order. The answer is to have as many
 * pixels as get samples. */
void take_refinements(struct server *server, const struct tile *tile,
                      struct refinement *refinements);

/* Puts a finished tile into the picture and the journal, unless another answer for it was first. */
void accept_tile(struct server *server, uint32_t renderer, const struct tile *tile,
                 const float *rgb, const struct result_header *header);

/* For the end of a run that was stopped, when no more answers come: puts the pieces of unfinished tiles into the
 * picture. */
void put_last_pieces(struct server *server);

/* Notes that the renderer has dropped a tile; it is allowed to (queue_is_recalled()). */
void accept_dropped(struct server *server, uint32_t renderer, const struct tile *tile,
                    const struct result_header *header);

/* Puts probes into the preview, and passes their costs to the queue. */
void accept_probes(struct server *server, uint32_t renderer, const struct tile *tile,
                   const float *rgb, const struct result_header *header);

/* ---- hand_out.c ---- */

/* The tray that this process shares with the renderer; NULL: it is on another machine. */
struct tray *tray_of(const struct server *server, uint32_t renderer);

/* Sends the answer to READY, and the first lots. */
void hand_out_start(struct server *server, uint32_t renderer);

/* Gives a remote renderer all the lots that it may hold. */
void hand_out(struct server *server, uint32_t renderer);

/* The same for renderers without work, when there may be some for them. */
void hand_out_to_idle(struct server *server);

/* Sends recalls, at the end of a turn of the loop, so that each renderer gets one message: tiles that others
 * have taken over or finished. The master's own renderer checks tiles that it has not begun by itself. */
void tell_recalls(struct server *server);

/* Asks the renderer for a sign of life. */
void ask_for_sign(struct server *server, uint32_t renderer);

/* Tells a renderer to give up whatever it is doing and leave. */
void tell_stop(struct server *server, uint32_t renderer);

/* ---- take_in.c ---- */

/* Handles all that has arrived; returns whether there was anything. */
bool take_in(struct server *server);

/* ---- own_renderer.c ---- */

/* The second thread of rank 0; argument: the struct server. Renders what the queue gives to renderer 0 until
 * nothing is left for it, and never calls MPI. */
void *render_own(void *argument);

/* ---- silence.c ---- */

/* To be called once per turn of the loop: advances server.awake_s. Now and then it asks renderers from which
 * nothing has come for a while for a sign of life, and gives up those that do not answer. */
void look_for_silence(struct server *server);

/* Notes that a message of this renderer has come. */
void note_sign(struct server *server, uint32_t renderer);

/* Whether no renderer is left. */
bool is_deserted(const struct server *server);

/* ---- passes.c ---- */

/* When rendering is to end because of the deadline, a time of common/clock.h: early enough to write files and to
 * estimate the error at the end, which takes about as long as a plan. HUGE_VAL: there is no deadline. */
double rendering_ends(const struct server *server);

/* Under a time limit, before anything is rendered: how long writing the image files takes is measured by trying, for
 * planning a pass and filling the picture it is guessed. */
void foresee_end(struct server *server);

/* Puts the next pass into the queue when the current one is complete. */
void follow_passes(struct server *server);

#endif
