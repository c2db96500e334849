/*
 * The pace of the renderers: how fast each one is, when it will have finished what it holds, and how much work
 * to give it next.
 *
 * Work is in the unit of master/cost.h. Seconds are those of whatever clock the caller reads. A renderer of
 * speed 1 takes `scale` seconds per unit of work. Before the first answer nothing is known: scale is 0.
 *
 * Nothing is expected of a renderer that is overdue until it answers.
 */
#ifndef FARM_MASTER_PACE_H
#define FARM_MASTER_PACE_H

#include <stdbool.h>
#include <stdint.h>

#include "master/heap.h"

struct pace_renderer {
    double speed;
    double stretch;    /* renderers per core where it runs, at least 1 */
    double work, busy; /* of its answers, older ones fading: predicted work, measured seconds */
    double held;       /* predicted work that it holds */
    double free_at;    /* when it should have finished that; valid while it holds work */
    bool holds;        /* it holds work */
    bool is_overdue;   /* it is late: nothing is expected of it until it answers */
};

/* How long the last answers took the master, and how many pixels they had: exponentially weighted means,
 * variance and covariance. */
struct pace_service {
    double answers; /* number of answers */
    double seconds, pixels;
    double covariance, variance; /* of seconds and pixels; of pixels */
};

struct pace {
    struct pace_renderer *renderers;
    uint32_t count;
    double speed;                  /* sum over all renderers that are not overdue */
    uint32_t holders;              /* renderers that hold work and are not overdue */
    double holding, holding_until; /* over holders: sums of speed and of speed * free_at */
    double total;                  /* all work of the run, whether answered or not */
    double work, busy;             /* of all answers: predicted work, measured seconds */
    double given, lots;            /* handed out: work, and the number of lots */
    double scale;                  /* seconds per unit of work */
    uint32_t overdue_count;        /* number of renderers that are overdue */
    bool blind;                    /* there are no useful predictions yet */
    struct pace_service service;   /* of the master */
    /* Seconds that the master needs per answer, without the part that is proportional to its pixels. */
    double service_s;
    struct heap last; /* renderers with work; on top the one that will finish it last */
    struct heap soon; /* the same; on top the one that will finish it first */
    struct heap late; /* the same; on top the one that is to be given up for late first */
    struct heap
        overdue; /* those that are, and may hold work; on top the one that is so for longest */
    struct heap spare; /* of these, those that may hold tiles that they have not begun */
    /* The one renderer that pace_place() has yet to put into the heaps, or HEAP_ABSENT. */
    uint32_t unplaced;
};

/* Of this many renderers, none of which has work. */
void pace_init(struct pace *pace, uint32_t renderers);
void pace_free(struct pace *pace);

/* Forgets all but the speeds, when the unit of work changes. No renderer holds any work after that. */
void pace_restart(struct pace *pace);

/* The renderer has been given this work. */
void pace_given(struct pace *pace, uint32_t renderer, double now, double work);

/* The renderer has answered for `work`, which took it `busy` seconds; holds: it still holds work. */
void pace_answered(struct pace *pace, uint32_t renderer, double now, double work, double busy,
                   bool holds);

/* The same for work that it has dropped. */
void pace_dropped(struct pace *pace, uint32_t renderer, double now, double work, bool holds);

/* Updates the heaps last, soon and late, before they are read. A renderer changes with every tile of an answer
 * and with its next lot, but its places in the heaps are updated only once. */
void pace_place(struct pace *pace);

/* Seconds for which all renderers with work are predicted to have enough of it; 0: nothing is known. At most the
 * mean of the seconds that each has answered for so far: from the first answers, cheap tiles may be predicted
 * several times too long. */
double pace_calm(struct pace *pace, double now);

/* Marks the renderer, which holds work, as overdue; due: when it should have finished its work. */
void pace_late(struct pace *pace, uint32_t renderer, double due);

/* The seconds after which the renderer is to report that it is still working on a tile of this work. */
double pace_report_after(const struct pace *pace, uint32_t renderer, double work);

/* Marks all renderers as overdue that are late by now; returns whether there were any. */
bool pace_check(struct pace *pace, double now);

/* When the next renderer will be given up for late; HUGE_VAL: there is none. */
double pace_next_late(struct pace *pace);

/* Reports how many seconds the master took for an answer with this number of pixels: reading it, and sending
 * more work. */
void pace_served(struct pace *pace, double seconds, double pixels);

struct pace_lot {
    double work;  /* predicted work */
    double worst; /* work if all tiles are as expensive as they may be */
};

/* The most work to give to a renderer when `waiting` is the work that waits; 0: none at the moment, as it has
 * enough. */
struct pace_lot pace_lot(const struct pace *pace, uint32_t renderer, double now, double waiting);

/* Seconds from now until all that is held and all that waits is done, if all renderers finish at the same time. */
double pace_even_end(const struct pace *pace, double now, double waiting);

/* Predicted seconds that a renderer takes for this work; 0 while nothing is known. */
double pace_seconds(const struct pace *pace, uint32_t renderer, double work);

/* The seconds after which a renderer that has finished a part of a lot answers with that part. */
double pace_answer_after(const struct pace *pace);

/* The shortest lot that is worth an answer of this renderer, in seconds. */
double pace_least(const struct pace *pace, uint32_t renderer);

#endif
