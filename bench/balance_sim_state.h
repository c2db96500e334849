/* Between the files of the simulated farm: its state, and what renderers and master do with it. */
#ifndef FARM_BENCH_BALANCE_SIM_STATE_H
#define FARM_BENCH_BALANCE_SIM_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bench/balance_events.h"
#include "bench/balance_sim.h"
#include "common/nap.h"

/* More lots than the queue lets a renderer hold. */
#define HELD 4

enum {
    EVENT_READY,
    EVENT_RESULT,
    EVENT_SERVED,
    EVENT_LOT,
    EVENT_SEEN,
    EVENT_TELL,
    EVENT_DROP,
    EVENT_GIVE_UP,
    EVENT_CHECK,
    EVENT_LOOK,
    EVENT_CORE,
    EVENT_OWN
};

struct part {
    struct tile tile;
    struct lot *lot;
    struct part *next;       /* of those that go into the same answer */
    double begun_s, seconds; /* when it was begun (NAN: it has no core yet), and what it took */
    double span_s, left_s;   /* of shared cores: what it takes of one, and will take yet */
    double cost_s;           /* what it takes a processor of speed 1 */
    double cpu_s;            /* that it took */
    double tell_s;   /* in work for so long it is told of, and again when it is twice as long */
    bool told;       /* it was: an answer is due when it is done */
    bool working;    /* it is being rendered */
    bool dropped;    /* others have it now, or have finished it */
    bool unfinished; /* it stands for another one, which has been in work for so many seconds */
};

struct lot {
    struct lot *before, *after;      /* all lots that there are */
    uint32_t count, begun, finished; /* parts */
    uint32_t accepted;               /* parts, by the master */
    bool calls, has_called;          /* the master is to be woken if it is the last one; it was */
    double answer_s, answered;       /* when an answer is due, and when the last one was given */
    size_t whole;                    /* bytes of the result if all that is left goes into one */
    bool opened, in_tray;            /* the result is begun; in a slot of the tray */
    struct part *ready, **last;      /* what goes into the next one */
    struct part notice;              /* that a part takes long */
    bool tells;                      /* the master has not heard of that yet */
    struct part parts[];             /* [count] */
};

/* Seconds that are nothing: rounding. */
#define GRAIN 1e-12

#define NO_CORE UINT32_MAX
#define NOBODY  UINT32_MAX

/* A rank, or a node whose first rank hands out to the others. */
struct renderer {
    struct lot *held[HELD];
    unsigned count;
    uint32_t working; /* of its cores */
    double idle_since;
    unsigned full;    /* slots of its tray, with results */
    double arrived_s; /* when its last message is there: they do not overtake each other */
    double debt_s;    /* rank 0: what serving has taken from the tile in work */
    /* With shared cores, of which it gets one: what it works on, where (NO_CORE: it waits for one),
     * and who is behind it in the queue for them. */
    struct part *part;
    uint32_t core, behind;
    bool ready; /* it has reported for work */
    bool asks;  /* the master has found nothing for it */
};

/* One of the shared cores. */
struct core {
    uint32_t who;        /* NOBODY: idle */
    double since, until; /* seconds: accounted for until then; the end of its slice */
    double rate;         /* of that, what the renderer gets */
    uint32_t turn;       /* of its last event; earlier ones are void */
};

struct sim {
    const struct machine *machine;
    struct queue *queue;
    const struct picture_costs *costs;
    struct sim_outcome *outcome;
    struct renderer *renderers;
    double now;

    struct core *cores;   /* that are shared */
    uint32_t front, back; /* of those who wait for one; NOBODY: none */
    struct events done;   /* parts, where they are not */
    struct events wall;   /* everything else */
    struct nap own_nap;   /* of rank 0's renderer */
    struct lot *lots;     /* all that are not accepted yet */
    double *kept_s;       /* by id, of pieces that are back and may count: cost_s */
    uint32_t kept_room;

    /* The master. */
    bool serving;
    double idle_since, calm_until;
    /* When it looks next for letters that it does not know of; HUGE_VAL: there are none. */
    double look;
    struct nap nap; /* its first one since then */
    uint64_t news;
    double check;          /* when the next EVENT_CHECK comes; HUGE_VAL: none */
    struct event *letters; /* results that have arrived and wait, a ring */
    size_t first, letter_count, letter_room;
};

/* ---- clocks: balance_sim.c ---- */

/* When somebody who has nothing to do since then, whose first nap takes so many seconds and who expects
 * nothing until calm_until, looks again, at `time` or behind it. */
double next_look(const struct sim *sim, double idle_since, double nap, double calm_until,
                 double time);

/* When somebody who is woken now has woken up: that takes as long as a nap is too long. */
double sim_woken(const struct sim *sim);

/* An event on the wall clock. */
void sim_at(struct sim *sim, double time, uint32_t kind, uint32_t who, void *what);

/* ---- shared cores: balance_sim_cores.c ---- */

void cores_init(struct sim *sim);
void cores_free(struct sim *sim);

/* The renderer has this part to do; first: it gets a core before all others who wait. */
void cores_begin(struct sim *sim, uint32_t who, struct part *part, bool first);

/* What it has done until now goes off what is left of its part. */
void cores_account(struct sim *sim, uint32_t who);

/* It has finished that or given it up, and has begun another one or not. */
void cores_ended(struct sim *sim, uint32_t who);

/* Time for the core to look who is done, and who is next. */
void cores_look(struct sim *sim, uint32_t core, uint32_t turn);

/* The master takes so many seconds of a core, from renderers if none is idle. */
void cores_serve(struct sim *sim, double span);

/* ---- a renderer: balance_sim_renderer.c ---- */

/* Whether it is rank 0's own. */
bool is_own(const struct sim *sim, uint32_t who);

/* The next lot of the queue; NULL: nothing now. */
struct lot *next_lot(struct sim *sim, uint32_t who);

/* The renderer has got a lot. */
void sim_hold(struct sim *sim, uint32_t who, struct lot *lot);

/* The second thread of rank 0: straight from the queue, with naps while there is nothing. */
void take_own(struct sim *sim);

/* Its part is rendered. */
void finish_part(struct sim *sim, uint32_t who, struct part *part);

/* Whether serving has taken time from the tile that rank 0 renders, which is then done later. */
bool pays_debt(struct sim *sim, const struct event *done);

/* Others have a tile that the renderer may not have begun. */
void sim_drop(struct sim *sim, uint32_t who, uint32_t id);

/* Others have finished a tile that the renderer may be rendering, and gives up then. */
void sim_give_up(struct sim *sim, uint32_t who, uint32_t id);

/* It has been rendering a tile for long. */
void sim_tell(struct sim *sim, uint32_t who, uint32_t id);

/* It gives up all that it renders. */
void sim_stop(struct sim *sim, uint32_t who);

/* The queue gets a part that was finished or dropped. */
void accept_part(struct sim *sim, uint32_t who, struct part *part);

/* Of a result of these parts. */
size_t bytes_of(const struct part *parts);

/* A part has been accepted; with the last one the lot is gone. */
void forget_part(struct sim *sim, struct lot *lot);

/* ---- the master: balance_sim_master.c ---- */

/* A renderer reports for work. */
void sim_ready(struct sim *sim, uint32_t who);

/* Lots for those who have asked in vain, or for all. To each that gets something it takes half of what
 * a result and its answer take. */
void hand_out_to(struct sim *sim, bool all);

/* The renderers hear, from this time on, what others have taken from them or finished. */
void sim_tell_recalls(struct sim *sim, double time);

/* When the master hears of what rank 0's own renderer does: it looks, or is woken. */
double sim_master_hears(const struct sim *sim);

/* A renderer has nothing in reserve, or nothing at all: the master wakes up, if it can be woken. */
void sim_ring(struct sim *sim);
void sim_look(struct sim *sim);

/* A result has come; it is served when the master has looked and has done what came before. */
void result_arrives(struct sim *sim, const struct event *letter);
void result_served(struct sim *sim);

/* Time to look whether tiles are late. */
void sim_check(struct sim *sim);

#endif
