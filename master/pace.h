/*
 * How fast the renderers are, when each will have done what it has, and how much to give one next.
 *
 * Work is what cost.h predicts. Seconds are whatever clock the caller reads; a renderer of speed 1
 * takes `scale` seconds for one of work. Nothing is known before the first answer: scale is 0.
 */
#ifndef FARM_MASTER_PACE_H
#define FARM_MASTER_PACE_H

#include <stdbool.h>
#include <stdint.h>

#include "master/heap.h"

struct pace_renderer {
    double speed;
    double stretch;    /* renderers to a core where it runs, at least 1 */
    double work, busy; /* answered: predicted work, measured seconds; the past fades */
    double held;       /* work that it has */
    double free_at;    /* when that should be done; of use while it has some */
    double since;      /* when it got some after it had none; NAN: nobody knows */
    double rendered;   /* seconds that it has told of since then */
    uint32_t awaited;  /* lots that it has got since then when it should have had none left */
    bool holds;        /* it has some */
    bool lost;         /* it is late with that: nobody counts on it until it answers */
};

/* How long answers take the master, and how many pixels they have: means, and how they go together, of
 * the last ones. */
struct pace_service {
    double answers; /* that there were */
    double seconds, pixels;
    double covariance, variance; /* of both; of pixels */
};

struct pace {
    struct pace_renderer *renderers;
    uint32_t count;
    double speed;                  /* of all together but the lost */
    uint32_t holders;              /* that have work, but the lost */
    double holding, holding_until; /* of those that have work: sums of speed, of speed * free_at */
    double total;                  /* work that there is to do, answered or not */
    double work, busy;             /* answered, all together */
    double given, lots;            /* work, in so many lots */
    double scale;                  /* seconds per work */
    uint32_t lost_count;           /* renderers that are lost */
    bool blind;                    /* predictions are not worth much yet */
    struct pace_service service;   /* of the master */
    double delay_s; /* of a lot and its answer on their way, and of looking for them: mean of those
                       * between two times without work */
    double service_s;  /* of it per answer, beside what goes with its pixels */
    struct heap last;  /* renderers that have work, the one that will have done it last on top */
    struct heap soon;  /* the same, the one that will have done it first on top */
    struct heap late;  /* the same, the one that is to be given up for late first on top */
    struct heap lost;  /* those that were and may have something, the longest overdue on top */
    struct heap spare; /* of the lost, those who may have something that they have not begun */
    uint32_t unplaced; /* who may not be in his places yet, or HEAP_ABSENT: pace_place() */
};

void pace_init(struct pace *pace, uint32_t renderers);
void pace_free(struct pace *pace);

/* Forgets all but the speeds: the unit of work is another one, and nobody holds any. */
void pace_restart(struct pace *pace);

/* The renderer has been given so much work. */
void pace_given(struct pace *pace, uint32_t renderer, double now, double work);

/* After a restart: it has had so much work for some time. */
void pace_has(struct pace *pace, uint32_t renderer, double now, double work);

/* It has answered for so much of it, which took it busy seconds, and holds more or not. */
void pace_answered(struct pace *pace, uint32_t renderer, double now, double work, double busy,
                   bool holds);

/* The same for work that it leaves to others, busy seconds having gone into it. */
void pace_dropped(struct pace *pace, uint32_t renderer, double now, double work, double busy,
                  bool holds);

/* To be called before anybody looks in the heaps for those who have work: a renderer changes with every
 * tile of an answer and with its next lot, and is put in its places once. */
void pace_place(struct pace *pace);

/* Seconds for which all that have work have enough of it, as predicted; no more than all have answered for in the
 * mean, for what the first answers tell, of cheap tiles, may be several times too much. 0: nothing is known. */
double pace_calm(struct pace *pace, double now);

/* Gives up the renderer, which has some, for late: it should have been done with it by then. */
void pace_late(struct pace *pace, uint32_t renderer, double due);

/* A renderer tells of a tile of so much work when it has been in work for so many seconds. */
double pace_tell_after(const struct pace *pace, uint32_t renderer, double work);

/* Gives up all that are late by now; whether there was any. */
bool pace_check(struct pace *pace, double now);

/* When the next one will be given up for late; HUGE_VAL: there is none. */
double pace_next_late(struct pace *pace);

/* The master took so long for an answer of so many pixels: reading it, and sending more. */
void pace_served(struct pace *pace, double seconds, double pixels);

struct pace_lot {
    double work;  /* predicted */
    double worst; /* if all were as dear as it may be */
};

/* How much work to give to a renderer when so much waits; 0: none now, for it has enough. */
struct pace_lot pace_lot(const struct pace *pace, uint32_t renderer, double now, double waiting);

/* Seconds from now until all have done what they have and what waits, when they end together. */
double pace_even_end(const struct pace *pace, double now, double waiting);

/* Seconds that a renderer takes for so much work; 0 while nothing is known. */
double pace_seconds(const struct pace *pace, uint32_t renderer, double work);

/* After so many seconds a renderer that has finished a part of a lot answers with that part. */
double pace_answer_after(const struct pace *pace);

/* The least that is worth an answer of this renderer, in seconds. */
double pace_least(const struct pace *pace, uint32_t renderer);

#endif
