/*
 * Which renderer holds which tiles: per renderer a linked list in the order in which it got them, lot by lot. A
 * renderer has a few lots at a time and answers the oldest one first, so its tiles are found near the front of
 * the list.
 */
#ifndef FARM_MASTER_HOLDINGS_H
#define FARM_MASTER_HOLDINGS_H

#include <stdbool.h>
#include <stdint.h>

#include "master/heap.h"

#define HOLD_NONE UINT32_MAX

/* The fact that a renderer has a tile. */
struct hold {
    uint32_t id;   /* of the tile */
    uint32_t next; /* next hold in the renderer's list, or HOLD_NONE */
    uint32_t lot;  /* number of the lot among those of this renderer */
    uint32_t renderer;
    uint32_t other; /* next hold on the same tile, in a circular list */
    bool may_pass;  /* the tile may be given to another renderer, too */
    bool recalled;  /* another renderer got the tile, too, or it is of no use any more */
    double work;    /* predicted work */
};

struct holder {
    uint32_t first, last; /* its list of holds, or HOLD_NONE */
    uint32_t count;
    uint32_t open;       /* holds with may_pass and not recalled */
    uint32_t lots;       /* lots that it has now */
    uint32_t lots_given; /* lots that it has ever got; the number of the next one */
};

struct holdings {
    struct holder *holders;
    struct hold *holds;
    uint32_t hold_count, free; /* free: head of the list of unused holds */
    uint32_t busy;             /* number of renderers that hold a tile */
    struct heap stocked;       /* renderers by their open tiles; keys may be too high */
};

/* Of this many renderers, none of which holds anything. */
void holdings_init(struct holdings *holdings, uint32_t renderers);
void holdings_free(struct holdings *holdings);

/* Adds a tile to the lot that the renderer is getting; holdings_end_lot() completes the lot. other: a hold of
 * another renderer on the same tile, or HOLD_NONE. Returns the index of the new hold. */
uint32_t holdings_give(struct holdings *holdings, uint32_t renderer, uint32_t id, double work,
                       bool may_pass, uint32_t other);
void holdings_end_lot(struct holdings *holdings, uint32_t renderer);

/* The renderer with most open tiles; HEAP_ABSENT: none has had a lot. The heap is updated only when a lot is
 * complete, as tiles leave all the time and this is asked only at the end: keys that are out of date are corrected
 * here. */
uint32_t holdings_most_open(struct holdings *holdings);

/* The renderer's hold on a tile; NULL: it does not have the tile. Valid until the next holdings_give(). */
struct hold *holdings_find(const struct holdings *holdings, uint32_t renderer, uint32_t id);

/* Marks the hold as recalled. */
void holdings_recall(struct holdings *holdings, struct hold *hold);

/* Removes the renderer's hold on the tile (which it has: asserted). Returns that hold, with `other` set to a
 * hold of another renderer on the tile, or to HOLD_NONE. */
struct hold holdings_take(struct holdings *holdings, uint32_t renderer, uint32_t id);

#endif
