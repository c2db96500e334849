/*
 * Who has which tiles: per renderer a list in the order in which it got them, in lots. A renderer
 * has a few lots at a time and answers a lot as a whole, so its tiles are found near the front.
 */
#ifndef FARM_MASTER_HOLDINGS_H
#define FARM_MASTER_HOLDINGS_H

#include <stdbool.h>
#include <stdint.h>

#define HOLD_NONE UINT32_MAX

/* A tile that a renderer has. */
struct hold {
    uint32_t id;    /* of the tile */
    uint32_t next;  /* in its list, or HOLD_NONE */
    uint32_t lot;   /* of this renderer, by number */
    bool passed_on; /* handed out to somebody else because this renderer will be late */
    double work;    /* predicted */
};

struct holder {
    uint32_t first, last; /* holds, or HOLD_NONE */
    uint32_t count;
    uint32_t lots;       /* that it has */
    uint32_t lots_given; /* ever; the number of the next one */
};

struct holdings {
    struct holder *holders;
    struct hold *holds;
    uint32_t hold_count, free; /* free: a list of holds not in use */
};

void holdings_init(struct holdings *holdings, uint32_t renderers);
void holdings_free(struct holdings *holdings);

/* The renderer gets this tile as part of the lot that it is getting, and the lot is complete. */
void holdings_give(struct holdings *holdings, uint32_t renderer, uint32_t id, double work);
void holdings_end_lot(struct holdings *holdings, uint32_t renderer);

/* The renderer's hold on a tile; NULL: it has no such tile. */
struct hold *holdings_find(const struct holdings *holdings, uint32_t renderer, uint32_t id);

/* It has it no longer: returns what it was. The renderer has the tile (asserted). */
struct hold holdings_take(struct holdings *holdings, uint32_t renderer, uint32_t id);

#endif
