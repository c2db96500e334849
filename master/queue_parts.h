/*
 * What the parts of the queue share; for all others there is queue.h.
 *
 *   queue.c            tiles that wait, are out and come back, under all schedules
 *   queue_start.c      which tiles there are in the beginning
 *   queue_plain.c      the schedules that hand out one tile at a time
 *   queue_dynamic.c    the dynamic schedule; the rest is of it:
 *   queue_predict.c    what tiles are predicted to take
 *   queue_join.c       cheap ones become one
 *   queue_split.c      large ones become two
 *   queue_lot.c        what a lot is made of
 *   queue_repeat.c     what others do a second time
 *   queue_pieces.c     a tile that somebody has, in pieces for others
 *   queue_withdraw.c   tiles that are not wanted any more
 *   queue_crowd.c      renderers that share cores
 */
#ifndef FARM_MASTER_QUEUE_PARTS_H
#define FARM_MASTER_QUEUE_PARTS_H

#include "common/whole.h"
#include "master/agenda.h"
#include "master/cost.h"
#include "master/holdings.h"
#include "master/outlook.h"
#include "master/pace.h"
#include "master/queue.h"
#include "master/share.h"

/* The dynamic schedule sends tiles in lots, so that they may be small: rays of 16 x 16 pixels find
 * more of the scene in the cache than those of more (1 to 10 % less CPU time for lantern and garden than
 * 32 x 32), and of smaller tiles the overhead begins to show at one sample per pixel. */
#define DYNAMIC_EDGE 16u

/* A lot has at most so many pixels, unless one tile has more: 400 KB of floats. */
#define LOT_PIXELS 32768u

/* No tile is predicted to be more work: what renderers tell can be as much more than what their clocks let expect as
 * many of them share a core, each such surprise makes the next one larger, and predictions have to stay numbers. A tile
 * of the most pixels that each took SECONDS_MOST is 1e15. */
#define WORK_MOST 1e20

/* A tile under dynamic and tiles. */
struct item {
    uint32_t x, y, w, h;
    uint32_t pass;
    float work;    /* predicted */
    float worst;   /* if the tile is all that its neighbourhood may be */
    float seconds; /* that it took; before it is finished, for which it is known to be in work */
    double priority;
    uint32_t copies; /* renderers that have it */
    uint32_t hold;   /* of one of them (master/holdings.h), or HOLD_NONE */
    bool finished;
    bool skipped;  /* by an earlier run */
    uint32_t rest; /* the tile that was split off it last; 0: there is none */

    /* See queue_pieces.c. */
    uint32_t first_piece, pieces; /* ids of its pieces, if it has any */
    uint32_t missing;             /* of these */
    uint32_t whole;               /* the id of what it is a piece of */
    bool is_piece;
    bool kept;     /* a piece that is back, and may count yet */
    bool replaced; /* by what it was joined to, which counts in its place */
};

/* Of all who share some cores. */
struct turns {
    double wall, cpu;       /* of their tiles */
    uint32_t working, idle; /* see queue_crowd.c */
};

struct queue {
    struct queue_config config;
    bool is_dynamic;
    bool is_static; /* strips, cyclic or cyclic-rows: shares in place of items */
    struct shares shares;
    unsigned char *share_finished; /* per id */

    struct item *items;
    uint32_t item_count, item_room;
    uint32_t first_probe, probes, next_probe, probe_stride, probes_back;
    bool needs_no_probes;  /* all is finished or withdrawn, and no more work has come since */
    bool probes_ended;     /* queue_end_probes() */
    bool settled;          /* the map predicts: all probes are back, or enough */
    struct agenda waiting; /* items */
    double waiting_work;
    uint64_t waiting_pixels;
    uint32_t next_cheap;    /* id from which on cheap tiles are looked for */
    struct outlook outlook; /* dynamic */
    struct cost_map map;
    struct pace pace;

    struct holdings holdings;
    struct recall *recalls; /* not told yet */
    uint32_t recall_count;
    struct fate *fates; /* not told yet */
    uint32_t fate_count;
    uint32_t *probes_given; /* per renderer: probe tiles that it has had */
    struct turns *turns;    /* per group of the crowd; NULL: each renderer has a core */
    bool counted; /* their renderers are, until one gets or gives back a tile, or is late */
    bool *silent; /* per renderer */
    uint32_t silent_count;
    bool withdraws; /* what nobody has begun, until there is more work */
    bool stopped;
    uint64_t pixels_skipped; /* finished by an earlier run */
    uint64_t news;
    double retry; /* when somebody idle had better ask again; HUGE_VAL: nobody */
    struct queue_count count;
    uint32_t largest;
};

static inline uint64_t area(const struct item *item)
{
    return (uint64_t)item->w * item->h;
}

/* Whether the picture is put together of this tile. */
static inline bool is_of_picture(const struct item *item)
{
    return item->pass != TILE_PROBE && !item->replaced && !item->is_piece;
}

/* The tile of this id. */
struct tile queue_tile_of(const struct queue *queue, uint32_t id);

/* Memory for so many tiles in all, written to, so that the pages are there before all renderers wait. */
void queue_reserve(struct queue *queue, uint32_t room);

/* Adds a tile that does not wait yet; returns its id. Pointers to items are of no use then. */
uint32_t queue_new_item(struct queue *queue, const struct item *item);

/* The tile waits, and waits no longer. */
void queue_set_waiting(struct queue *queue, uint32_t id);
void queue_unset_waiting(struct queue *queue, uint32_t id);

/* Whether nobody has had the tile, or what it is a piece of. */
bool queue_is_untouched(const struct queue *queue, uint32_t id);

/* What the tile has is part of all that waits; or not, while it changes and goes on waiting. */
void queue_count_waiting(struct queue *queue, uint32_t id);
void queue_uncount_waiting(struct queue *queue, uint32_t id);

/* The tile is finished, which took so long. */
void queue_set_finished(struct queue *queue, uint32_t id, double seconds);

/* Counts the tile in the outlook, as what it is; or not, while it is neither finished nor a probe. */
void queue_foresee(struct queue *queue, uint32_t id);
void queue_unforesee(struct queue *queue, uint32_t id);

/* The tile is part of the lot that the renderer is getting. */
void queue_give(struct queue *queue, uint32_t renderer, uint32_t id, double work);

/* The one who has this hold is to hear that it need not render its tile, or, when that is finished, that
 * its answer is of no use. */
void queue_tell(struct queue *queue, struct hold *hold, bool finished);

/* All who have the tile are to hear that it is finished. */
void queue_tell_finished(struct queue *queue, uint32_t id);

/* ---- all schedules but the dynamic one ---- */

/* queue_next() for them: one tile or none. */
uint32_t plain_next(struct queue *queue, uint32_t renderer, struct tile *tile);

/* ---- the dynamic schedule ---- */

/* queue_next() for it. */
uint32_t dynamic_next(struct queue *queue, uint32_t renderer, double now,
                      struct tile tiles[LOT_TILES]);

/* Gives up all that are late by now; whether there was any. */
bool dynamic_check_late(struct queue *queue, double now);

/* A probe tile is back. */
void dynamic_probed(struct queue *queue, double now);

/* A tile is in work for so long. */
void dynamic_takes_long(struct queue *queue, uint32_t renderer, uint32_t id, double now,
                        double seconds);

/* ---- what tiles are predicted to take ---- */

/* Predictions from the probes that are back, one at least, and with them another order. */
void predictions_settle(struct queue *queue, double now);

/* A tile is back, or in work still, that has taken the renderer so many seconds; predicted: its work. */
void predictions_learn(struct queue *queue, uint32_t renderer, const struct tile *tile,
                       double seconds, double predicted);

/* ---- how large a tile may be ---- */

/* Joins cheap tiles that nobody has had; when predictions are new. */
void queue_join(struct queue *queue);

/* Two halves in place of a tile that waits, cut across its longer side; whether it is large enough. */
void split_tile(struct queue *queue, uint32_t id);
bool split_is_possible(const struct queue *queue, uint32_t id);

/* Whether the tile that would be the next one of the lot, or its first one, is to be split before. */
bool split_is_due(const struct queue *queue, uint32_t id, struct pace_lot lot, bool first);

/* How many parts a tile is to fall into that is too dear for a single renderer to begin; 0: it is not. */
uint32_t split_dear_parts(const struct queue *queue, uint32_t id);

/* ---- what a lot is made of ---- */

/* A lot as it grows. */
struct draft {
    uint32_t renderer;
    struct tile *tiles; /* room for LOT_TILES, the caller's */
    uint32_t count;
    uint64_t pixels;
    double work, worst;
};

/* Whether the tile fits into the lot, besides what that has. */
bool lot_has_room(const struct queue *queue, const struct draft *draft, uint32_t id,
                  struct pace_lot lot);

/* The tile, of so much work, is the next one of the lot, which has fewer than LOT_TILES. */
void lot_add(const struct queue *queue, struct draft *draft, uint32_t id, double work);

/* Adds what waits, behind what the draft has, and gives out the lot; returns how many tiles it has. */
uint32_t lot_fill(struct queue *queue, struct draft *draft, double now, struct pace_lot lot);

/* The draft is given out as it is; returns how many tiles it has. */
uint32_t lot_give(struct queue *queue, const struct draft *draft, double now);

/* ---- what others do a second time ---- */

/* What the one who is longest overdue has not begun, before all that waits: a tile at least, and a lot at most. */
void repeat_late(struct queue *queue, struct draft *draft, struct pace_lot lot);

/* The one that is longest overdue has begun all that repeat_late() leaves to it: what it is at is broken into pieces
 * that wait, if that pays. */
void repeat_overdue(struct queue *queue, uint32_t asker, double now);

/* What others have, when nothing waits, if the renderer had better do that; returns how many tiles that is. */
uint32_t repeat_next(struct queue *queue, uint32_t renderer, double now,
                     struct tile tiles[LOT_TILES]);

/* ---- tiles that are not wanted any more ---- */

/* Somebody has left the tile to others: of those who were to leave it to nobody it is withdrawn. */
void withdraw_dropped(struct queue *queue, uint32_t id);

/* When all that is out is with those who are late, it is not waited for. */
void withdraw_lost(struct queue *queue);

/* ---- renderers that share cores ---- */

/* Makes the queue one of its crowd. */
void queue_crowd(struct queue *queue);

/* As many renderers as can work at a time. */
uint32_t queue_processors(const struct queue *queue);

/* Whether this renderer, which has nothing, has a core that nobody else would use; and on how many there
 * are in all. */
bool queue_has_core(struct queue *queue, uint32_t renderer);
uint32_t queue_idle_cores(struct queue *queue);

/* ---- pieces of a tile that somebody has ---- */

/* Breaks the tile into pieces that wait, about so many, which have at least so much work together;
 * false: it is too small, or has some. */
bool pieces_make(struct queue *queue, uint32_t id, uint32_t wanted, double work);

/* The first answer for this tile has come: its pieces are of no use. */
void pieces_drop(struct queue *queue, uint32_t id);

/* A piece is back: it is kept until its whole is. With the last one that is missing all count. */
void pieces_keep(struct queue *queue, uint32_t id);

#endif
