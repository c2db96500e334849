/*
 * What the source files of the queue share; all other code uses queue.h.
 *
 *   queue.c            the life of a tile under all schedules: waiting, out, finished
 *   queue_start.c      the initial tiles
 *   queue_plain.c      the schedules that hand out one tile at a time
 *   queue_dynamic.c    the dynamic schedule; all that follow belong to it:
 *   queue_predict.c    predicted costs of tiles
 *   queue_join.c       joining cheap tiles
 *   queue_split.c      splitting large tiles in two
 *   queue_lot.c        composing a lot
 *   queue_repeat.c     handing out tiles of others a second time
 *   queue_pieces.c     breaking a tile that is out into pieces for other renderers
 *   queue_withdraw.c   withdrawing tiles that are not wanted any more
 *   queue_crowd.c      renderers that share cores
 */
#ifndef FARM_MASTER_QUEUE_PARTS_H
#define FARM_MASTER_QUEUE_PARTS_H

#include "common/whole.h"
#include "master/cost.h"
#include "master/holdings.h"
#include "master/outlook.h"
#include "master/pace.h"
#include "master/queue.h"
#include "master/share.h"

/* Edge of a tile, pixels. As the dynamic schedule sends tiles in lots, they may be small: the rays of 16 x 16
 * pixels find more of the scene in the cache than those of larger tiles (1 to 10 % less CPU time for lantern and
 * garden than 32 x 32). With smaller tiles the overhead begins to show at one sample per pixel. */
#define DYNAMIC_EDGE 16u

/* The most pixels of a lot, unless a single tile has more: 400 KB of floats. */
#define LOT_PIXELS 32768u

/* The most work that a tile may be predicted to be. Where n renderers share a core, the times that they report
 * can be n times what their clocks let expect, and each such surprise makes the next one larger; but predictions
 * have to stay finite numbers. A tile of the most pixels that each took SECONDS_MOST is 1e15. */
#define WORK_MOST 1e20

/* A tile under the schedules dynamic and tiles; its id is its index in queue.items. */
struct item {
    uint32_t x, y, w, h;
    uint32_t pass;
    float work;  /* predicted */
    float worst; /* predicted, if all of it is as expensive as the most expensive spot around */
    /* What it took; before it is finished: how long it is known to have been in work. */
    float seconds;
    double priority;
    uint32_t copies; /* number of renderers that hold it */
    uint32_t hold;   /* the hold of one of them (master/holdings.h), or HOLD_NONE */
    bool finished;
    bool skipped;  /* finished by an earlier run */
    uint32_t rest; /* id of the tile that was split off it last; 0: there is none */

    /* See queue_pieces.c. */
    uint32_t first_piece, pieces; /* ids of its pieces, if it has any */
    uint32_t missing;             /* number of pieces that are not finished */
    uint32_t whole;               /* id of the tile that it is a piece of */
    bool is_piece;
    bool kept; /* a piece that is finished, whose fate is undecided */
    /* Not a tile any more: it was joined to another one, which counts in its place, or withdrawn. */
    bool replaced;
};

/* A group of renderers that share cores. */
struct group_state {
    double wall, cpu;       /* seconds of their tiles, summed */
    uint32_t working, idle; /* renderers with and without work: queue_crowd.c */
};

struct queue {
    struct queue_config config;
    bool is_dynamic;
    bool is_static; /* strips, cyclic or cyclic-rows: uses shares instead of items */
    struct shares shares;

    struct item *items;
    uint32_t item_count, item_room;
    uint32_t first_probe, next_probe, probe_stride, probes_back;
    bool needs_no_probes; /* all was finished or withdrawn, and no work was added since */
    bool probes_ended;    /* queue_end_probes() was called */
    bool settled;         /* the map predicts: all probes are back, or enough of them */
    struct heap waiting;  /* ids of items, by priority */
    double waiting_work;
    uint64_t waiting_pixels;
    uint32_t next_cheap;    /* id at which the search for cheap tiles continues */
    struct outlook outlook; /* dynamic */
    struct cost_map map;
    struct pace pace;

    struct holdings holdings;
    struct recall *recalls; /* not told yet */
    uint32_t recall_count;
    struct fate *fates; /* not told yet */
    uint32_t fate_count;
    uint32_t *probes_given;     /* per renderer: probe tiles handed out to it */
    struct group_state *groups; /* per group of the crowd; NULL: each renderer has its own core */
    /* groups[].working and .idle are up to date: no renderer has got or given back a tile, or become late, since */
    bool groups_counted;
    bool *silent; /* per renderer */
    uint32_t silent_count;
    bool withdraws; /* queue_withdraw() is in force, until work is added */
    bool stopped;
    uint64_t pixels_skipped; /* finished by an earlier run */
    uint64_t news;
    queue_part_work *part_work; /* see queue_set_part_work() */
    const void *part_state;
    double retry; /* when an idle renderer should ask again; HUGE_VAL: no such time */
    struct queue_count count;
    uint32_t largest;
};

static inline uint64_t area(const struct item *item)
{
    return (uint64_t)item->w * item->h;
}

/* The tile, which is no probe; its id is left to the caller. */
static inline struct tile item_tile(const struct item *item)
{
    return (struct tile){
        .x = item->x, .y = item->y, .w = item->w, .h = item->h, .step = 1, .pass = item->pass};
}

/* Whether the tile is part of the picture: no probe, no piece, and not replaced. */
static inline bool is_of_picture(const struct item *item)
{
    return item->pass != TILE_PROBE && !item->replaced && !item->is_piece;
}

static inline bool queue_is_finished(const struct queue *queue, uint32_t id)
{
    return queue->is_static ? queue->shares.finished[id] : queue->items[id].finished;
}

struct tile queue_tile_of(const struct queue *queue, uint32_t id);

/* Provides memory for `room` tiles in all. It is written to, so that its pages are mapped before all renderers
 * wait for the queue. */
void queue_reserve(struct queue *queue, uint32_t room);

/* Adds a tile that does not wait yet; returns its id. Invalidates pointers to items. */
uint32_t queue_new_item(struct queue *queue, const struct item *item);

/* Puts the tile among those that wait; takes it out. */
void queue_set_waiting(struct queue *queue, uint32_t id);
void queue_unset_waiting(struct queue *queue, uint32_t id);

/* Whether the tile waits and has never been handed out, neither itself nor a tile that it is a piece of. */
bool queue_is_untouched(const struct queue *queue, uint32_t id);

/* Adds the tile's work and pixels to the sums of all that wait; subtracts them, before a tile changes that goes
 * on waiting. */
void queue_count_waiting(struct queue *queue, uint32_t id);
void queue_uncount_waiting(struct queue *queue, uint32_t id);

/* Marks the tile as finished; seconds: what it took. */
void queue_set_finished(struct queue *queue, uint32_t id, double seconds);

/* Counts the tile in the outlook, according to its state; takes it out again, while it is neither finished nor a
 * probe. */
void queue_count_outlook(struct queue *queue, uint32_t id);
void queue_uncount_outlook(struct queue *queue, uint32_t id);

/* The tile becomes part of the lot that the renderer is getting; work: predicted. */
void queue_give(struct queue *queue, uint32_t renderer, uint32_t id, double work);

/* Queues a recall for the owner of this hold: it need not render its tile, or, when finished is true, its answer
 * is of no use. */
void queue_tell(struct queue *queue, struct hold *hold, bool finished);

/* Queues recalls for all who hold the tile: it is finished. */
void queue_tell_finished(struct queue *queue, uint32_t id);

/* ---- all schedules but the dynamic one ---- */

/* queue_next() for these schedules: returns 1 and sets *tile, or 0. */
uint32_t plain_next(struct queue *queue, uint32_t renderer, struct tile *tile);

/* ---- the dynamic schedule ---- */

uint32_t dynamic_next(struct queue *queue, uint32_t renderer, double now,
                      struct tile tiles[LOT_TILES]);

/* Marks all renderers as late that are so by now; returns whether there were any. */
bool dynamic_check_late(struct queue *queue, double now);

/* A probe tile is back. */
void dynamic_probed(struct queue *queue, double now);

/* ---- what tiles are predicted to take ---- */

/* Predicts all tiles from the probes that are back, of which there must be one at least, and sorts what waits
 * accordingly. */
void predictions_settle(struct queue *queue, double now);

/* Learns from a tile that is back, or still in work, and has taken the renderer these seconds; predicted: its
 * work. */
void predictions_learn(struct queue *queue, uint32_t renderer, const struct tile *tile,
                       double seconds, double predicted);

/* The share of the work of two tiles, 0..1, that is predicted to be in the first one. */
double predictions_share(const struct queue *queue, const struct item *part,
                         const struct item *rest);

/* ---- how large a tile may be ---- */

/* Joins cheap tiles that have never been handed out; to be called when predictions are new. */
void queue_join(struct queue *queue);

/* Replaces a tile that waits by two halves, cut across its longer side; whether it is large enough for that. */
void split_tile(struct queue *queue, uint32_t id);
bool split_is_possible(const struct queue *queue, uint32_t id);

/* Whether the tile is to be split before it is added to a lot; first: it would be the first tile of the lot. */
bool split_is_due(const struct queue *queue, uint32_t id, struct pace_lot lot, bool first);

/* The number of parts into which a tile is to be broken because it is too expensive for a single renderer to
 * begin; 0: it is not. */
uint32_t split_dear_parts(const struct queue *queue, uint32_t id);

/* ---- what a lot is made of ---- */

/* A lot while it is being composed. */
struct draft {
    uint32_t renderer;
    struct tile *tiles; /* LOT_TILES entries, owned by the caller */
    uint32_t count;
    uint64_t pixels;
    double work, worst;
};

/* Whether the tile still fits into the lot; lot: its limits. */
bool lot_has_room(const struct queue *queue, const struct draft *draft, uint32_t id,
                  struct pace_lot lot);

/* Appends the tile to the lot, which has fewer than LOT_TILES; work: predicted. */
void lot_add(const struct queue *queue, struct draft *draft, uint32_t id, double work);

/* Appends tiles that wait to the draft and hands out the lot; returns how many tiles it has. */
uint32_t lot_fill(struct queue *queue, struct draft *draft, double now, struct pace_lot lot);

/* Hands out the draft as it is; returns how many tiles it has. */
uint32_t lot_give(struct queue *queue, const struct draft *draft, double now);

/* ---- tiles that are handed out a second time ---- */

/* For when there are predictions at last: breaks up the tiles that renderers have already got and that turn out to
 * be too expensive for one of them. */
void repeat_blind(struct queue *queue);

/* Appends to the draft tiles that late renderers have not begun, of the longest overdue first, before anything
 * that waits: one tile at least if there is any, and one lot at most. */
void repeat_late(struct queue *queue, struct draft *draft, struct pace_lot lot);

/* For when repeat_late() has found nothing: breaks the tile that the longest overdue renderer is working on into
 * pieces that wait, if that pays. */
void repeat_overdue(struct queue *queue, uint32_t asker, double now);

/* Hands out tiles that others hold, when nothing waits, if the renderer is likely to finish them first; returns
 * how many tiles there are. */
uint32_t repeat_next(struct queue *queue, uint32_t renderer, double now,
                     struct tile tiles[LOT_TILES]);

/* ---- withdrawn tiles ---- */

/* A renderer has dropped the tile. If no one else holds it, because it was recalled for being withdrawn, it is
 * taken out of the queue. */
void withdraw_dropped(struct queue *queue, uint32_t id);

/* After queue_withdraw(): when only late renderers still hold tiles, these are taken out, too, and not waited
 * for. */
void withdraw_overdue(struct queue *queue);

/* ---- renderers that share cores ---- */

/* Adapts the queue to the crowd of its configuration. */
void queue_crowd(struct queue *queue);

/* The number of renderers that can work at a time. */
uint32_t queue_processors(const struct queue *queue);

/* Whether there is a core for this renderer, which has no work, that no other one would use; and the number of
 * such cores in all. */
bool queue_has_core(struct queue *queue, uint32_t renderer);
uint32_t queue_idle_cores(struct queue *queue);

/* ---- pieces of a tile that is out ---- */

/* Breaks the tile into about `wanted` pieces, which wait. Together they are predicted to be the work of the
 * tile, but at least `work`. false: the tile is too small, or has pieces already. */
bool pieces_make(struct queue *queue, uint32_t id, uint32_t wanted, double work);

/* The first answer for this tile has come: its pieces are of no use any more. */
void pieces_drop(struct queue *queue, uint32_t id);

/* A piece is back: it is kept until its tile is back as a whole. With the last piece that is missing, all pieces
 * count. */
void pieces_keep(struct queue *queue, uint32_t id);

#endif
