/* What the files of the simulated farm share: its state, and what renderers and master do with it. */
#ifndef FARM_BENCH_BALANCE_SIM_STATE_H
#define FARM_BENCH_BALANCE_SIM_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bench/balance_events.h"
#include "bench/balance_sim.h"
#include "common/nap.h"

/* Room for lots of a renderer: more than the queue lets it hold. */
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
    EVENT_PASS,
    EVENT_OWN
};

struct part {
    struct tile tile;
    uint32_t pixels; /* that its result has */
    struct lot *lot;
    struct part *next;       /* next part of the same answer */
    double begun_s, seconds; /* when it was begun (NAN: it has no core yet), and how long it took */
    /* With shared cores: core seconds that it takes, and those that are left. */
    double span_s, left_s;
    double cost_s;   /* seconds that it takes a processor of speed 1 */
    double cpu_s;    /* CPU seconds that it took */
    double tell_s;   /* it is reported after so long in work, and again whenever that doubles */
    bool told;       /* it was reported: an answer is due when it is done */
    bool working;    /* it is being rendered */
    bool dropped;    /* others hold it now, or have finished it */
    bool unfinished; /* a notice that another part has been in work for so many seconds */
};

struct lot {
    struct lot *before, *after;      /* in the list of all lots */
    uint32_t count, begun, finished; /* parts */
    uint32_t accepted;               /* parts that the master has accepted */
    bool calls, has_called;          /* the master is to be woken if this is the last lot; it was */
    double answer_s, answered;       /* when an answer is due, and when the last one was given */
    /* Bytes of the result if all that is left goes into one message. */
    size_t whole;
    bool opened, in_tray;       /* the result is begun; the lot is in a slot of the tray */
    struct part *ready, **last; /* parts that go into the next result */
    struct part notice;         /* the notice that a part takes long */
    bool tells;                 /* the master has not received that notice yet */
    struct part parts[];        /* [count] */
};

/* Seconds that count as zero: rounding errors. */
#define GRAIN 1e-12

#define NO_CORE UINT32_MAX
#define NOBODY  UINT32_MAX

/* A rank, or a node whose first rank distributes work to the others. */
struct renderer {
    struct lot *held[HELD];
    unsigned count;
    uint32_t working; /* number of its cores that work */
    double idle_since;
    unsigned full;    /* slots of its tray that hold results */
    double arrived_s; /* when its last message arrives: messages do not overtake each other */
    double debt_s;    /* rank 0: seconds that serving has taken from the tile in work */
    /* With shared cores, of which it gets one: the part that it works on, the core (NO_CORE: it waits for one),
     * and the next renderer in the queue for cores. */
    struct part *part;
    uint32_t core, behind;
    bool ready; /* it has reported for work */
    bool asks;  /* it asked for work, and the master had none */
};

/* One of the shared cores. */
struct core {
    uint32_t who;        /* NOBODY: idle */
    double since, until; /* seconds: until when work is accounted for; the end of the time slice */
    double rate;         /* the part of the core that the renderer gets */
    uint32_t turn;       /* number of its last event; earlier ones are void */
};

struct kept {
    struct tile tile;
    double cost_s, cpu_s;
};

struct sim {
    const struct machine *machine;
    struct queue *queue;
    const struct picture_costs *costs;
    struct sim_outcome *outcome;
    struct renderer *renderers;
    double now;

    struct core *cores;   /* the shared cores */
    uint32_t front, back; /* of the queue of renderers that wait for a core; NOBODY: none */
    struct events done;   /* ends of parts, where cores are not shared */
    struct events wall;   /* everything else */
    struct nap own_nap;   /* naps of rank 0's renderer */
    struct lot *lots;     /* all lots that are not accepted yet */
    struct kept *kept;    /* by id: pieces that are back and may count */
    uint32_t kept_room;

    /* The master. */
    bool serving;
    double idle_since, calm_until;
    /* When it next looks for letters that it does not know of; HUGE_VAL: there are none. */
    double look;
    struct nap nap; /* its first nap since idle_since */
    uint64_t news;
    double check;          /* when the next EVENT_CHECK comes; HUGE_VAL: none */
    bool plans;            /* a pass is being planned */
    struct event *letters; /* results that have arrived and wait: a ring buffer */
    size_t first, letter_count, letter_room;
};

/* ---- clocks: balance_sim.c ---- */

/* When a process looks for messages again, at `time` or later. It has had nothing to do since idle_since, its
 * first nap takes `nap` seconds, and it expects nothing until calm_until. */
double next_look(const struct sim *sim, double idle_since, double nap, double calm_until,
                 double time);

/* When a process that is woken now runs: it takes as long as a nap is too long. */
double sim_woken(const struct sim *sim);

/* Adds an event on the wall clock. */
void sim_at(struct sim *sim, double time, uint32_t kind, uint32_t who, void *what);

/* ---- shared cores: balance_sim_cores.c ---- */

void cores_init(struct sim *sim);
void cores_free(struct sim *sim);

/* Gives the renderer this part to do; first: it gets a core before all others that wait. */
void cores_begin(struct sim *sim, uint32_t who, struct part *part, bool first);

/* Subtracts what the renderer has done until now from what is left of its part. */
void cores_account(struct sim *sim, uint32_t who);

/* The renderer has finished its part or given it up, and may have begun another one. */
void cores_ended(struct sim *sim, uint32_t who);

/* Handles the event of a core: finishes a part or a time slice, and chooses who is next. */
void cores_look(struct sim *sim, uint32_t core, uint32_t turn);

/* The master uses so many seconds of a core, from renderers if none is idle. */
void cores_serve(struct sim *sim, double span);

/* ---- a renderer: balance_sim_renderer.c ---- */

/* Whether it is rank 0's own. */
bool is_own(const struct sim *sim, uint32_t who);

/* Gets the next lot from the queue; NULL: there is none at present. */
struct lot *next_lot(struct sim *sim, uint32_t who);

/* The renderer receives a lot. */
void sim_hold(struct sim *sim, uint32_t who, struct lot *lot);

/* Rank 0's second thread takes lots directly from the queue, with naps while there are none. */
void take_own(struct sim *sim);

/* The renderer finishes its part. */
void finish_part(struct sim *sim, uint32_t who, struct part *part);

/* Whether serving has taken time from the tile that rank 0 renders, so that it is done later. */
bool pays_debt(struct sim *sim, const struct event *done);

/* Others hold a tile that the renderer may not have begun. */
void sim_drop(struct sim *sim, uint32_t who, uint32_t id);

/* Others have finished a tile that the renderer may be rendering: it gives it up then. */
void sim_give_up(struct sim *sim, uint32_t who, uint32_t id);

/* The renderer reports that it has been rendering a tile for long. */
void sim_tell(struct sim *sim, uint32_t who, uint32_t id);

/* The renderer gives up all that it is rendering. */
void sim_stop(struct sim *sim, uint32_t who);

/* Passes a part that was finished or dropped to the queue. */
void accept_part(struct sim *sim, uint32_t who, struct part *part);

/* Bytes of a result of these parts. */
size_t bytes_of(const struct sim *sim, const struct part *parts);

/* A part has been accepted; with the last one the lot is freed. */
void forget_part(struct sim *sim, struct lot *lot);

/* ---- the master: balance_sim_master.c ---- */

/* A renderer reports for work. */
void sim_ready(struct sim *sim, uint32_t who);

/* Hands out lots to renderers that have asked in vain, or to all. Each renderer that gets some takes half of the
 * time of a result and its answer. */
void hand_out_to(struct sim *sim, bool all);

/* Renderers are told, from this time on, which of their tiles others have taken or finished. */
void sim_tell_recalls(struct sim *sim, double time);

/* When the master notices what rank 0's own renderer did: it looks, or is woken. */
double sim_master_hears(const struct sim *sim);

/* A renderer has no lot in reserve, or none at all: it wakes the master, if it can. */
void sim_ring(struct sim *sim);
void sim_look(struct sim *sim);

/* The seconds of storing the samples of an adaptive run, beside those of passing them on; 0 in other runs. */
double put_seconds(const struct sim *sim, const struct part *part);

/* A result has arrived; it is served when the master has looked and is done with what came before. */
void result_arrives(struct sim *sim, const struct event *letter);
void result_served(struct sim *sim);

/* Checks whether renderers are late. */
void sim_check(struct sim *sim);

#endif
