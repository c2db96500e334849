/*
 * Who has which tiles: per renderer a list in the order in which it got them, in lots. A renderer
 * has a few lots at a time and answers the oldest one first, so its tiles are found near the front.
 */
#ifndef FARM_MASTER_HOLDINGS_H
#define FARM_MASTER_HOLDINGS_H

#include <stdbool.h>
#include <stdint.h>

#include "master/heap.h"

#define HOLD_NONE UINT32_MAX

/* A tile that a renderer has. */
struct hold {
    uint32_t id;   /* of the tile */
    uint32_t next; /* in its list, or HOLD_NONE */
    uint32_t lot;  /* of this renderer, by number */
    uint32_t renderer;
    uint32_t other; /* the next hold on the same tile, in a ring of all of them */
    bool may_pass;  /* may be passed on */
    bool passed_on; /* handed out to somebody else, too, or of no use any more */
    double work;    /* predicted */
};

struct holder {
    uint32_t first, last; /* holds, or HOLD_NONE */
    uint32_t count;
    uint32_t open;       /* of these, tiles that may be passed on and have not been */
    uint32_t lots;       /* that it has */
    uint32_t lots_given; /* ever; the number of the next one */
};

struct holdings {
    struct holder *holders;
    struct hold *holds;
    uint32_t hold_count, free; /* free: a list of holds not in use */
    uint32_t busy;             /* renderers that have something */
    struct heap stocked;       /* renderers by their open tiles after a lot, if two or more */
};

void holdings_init(struct holdings *holdings, uint32_t renderers);
void holdings_free(struct holdings *holdings);

/* The renderer gets this tile as part of the lot that it is getting, and the lot is complete. other: a
 * hold that somebody has on the tile already, or HOLD_NONE. Returns the index of the hold. */
uint32_t holdings_give(struct holdings *holdings, uint32_t renderer, uint32_t id, double work,
                       bool may_pass, uint32_t other);
void holdings_end_lot(struct holdings *holdings, uint32_t renderer);

/* The renderer with most open tiles, two at least; HEAP_ABSENT: there is none. The heap hears of lots alone, for tiles
 * go all the time and this is asked only at the end: what has gone of them, it hears here. */
uint32_t holdings_most_open(struct holdings *holdings);

/* The renderer's hold on a tile; NULL: it has no such tile. */
struct hold *holdings_find(const struct holdings *holdings, uint32_t renderer, uint32_t id);

/* Somebody else gets the tile, too, or nobody needs it any more. */
void holdings_pass_on(struct holdings *holdings, struct hold *hold);

/* It has it no longer: returns what it was, with a hold of somebody else in other, or HOLD_NONE. The
 * renderer has the tile (asserted). */
struct hold holdings_take(struct holdings *holdings, uint32_t renderer, uint32_t id);

#endif
