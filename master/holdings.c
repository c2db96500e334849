#include "master/holdings.h"

#include <assert.h>
#include <stdlib.h>

#include "common/message.h"

void holdings_init(struct holdings *holdings, uint32_t renderers)
{
    *holdings = (struct holdings){.free = HOLD_NONE};
    holdings->holders = allocate_zeroed(renderers, sizeof *holdings->holders);
    heap_reserve(&holdings->stocked, renderers);
    for (uint32_t i = 0; i < renderers; i++)
        holdings->holders[i].first = holdings->holders[i].last = HOLD_NONE;
}

void holdings_free(struct holdings *holdings)
{
    free(holdings->holders);
    free(holdings->holds);
    heap_free(&holdings->stocked);
    *holdings = (struct holdings){0};
}

static uint32_t new_hold(struct holdings *holdings)
{
    uint32_t hold = holdings->free;
    if (hold != HOLD_NONE) {
        holdings->free = holdings->holds[hold].next;
        return hold;
    }
    holdings->holds = grow(holdings->holds, holdings->hold_count, sizeof *holdings->holds);
    return holdings->hold_count++;
}

/* Puts the hold into the circular list of another hold on the same tile. */
static void join_ring(struct holdings *holdings, uint32_t hold, uint32_t other)
{
    struct hold *holds = holdings->holds;
    holds[hold].other = other == HOLD_NONE ? hold : holds[other].other;
    if (other != HOLD_NONE) holds[other].other = hold;
}

/* Takes the hold out of its circular list; returns another one of the list, or HOLD_NONE. The list has one or
 * two entries as a rule. */
static uint32_t leave_ring(struct holdings *holdings, uint32_t hold)
{
    struct hold *holds = holdings->holds;
    uint32_t before = hold;
    while (holds[before].other != hold)
        before = holds[before].other;
    holds[before].other = holds[hold].other;
    return before == hold ? HOLD_NONE : before;
}

uint32_t holdings_give(struct holdings *holdings, uint32_t renderer, uint32_t id, double work,
                       bool may_pass, uint32_t other)
{
    struct holder *holder = &holdings->holders[renderer];
    uint32_t hold = new_hold(holdings);
    holdings->holds[hold] = (struct hold){.id = id,
                                          .next = HOLD_NONE,
                                          .lot = holder->lots_given,
                                          .renderer = renderer,
                                          .may_pass = may_pass,
                                          .work = work};
    join_ring(holdings, hold, other);
    if (holder->last == HOLD_NONE)
        holder->first = hold;
    else
        holdings->holds[holder->last].next = hold;
    holder->last = hold;
    if (holder->count++ == 0) holdings->busy++;
    holder->open += may_pass;
    return hold;
}

void holdings_end_lot(struct holdings *holdings, uint32_t renderer)
{
    struct holder *holder = &holdings->holders[renderer];
    holder->lots_given++;
    holder->lots++;
    heap_put(&holdings->stocked, renderer, holder->open);
}

uint32_t holdings_most_open(struct holdings *holdings)
{
    struct heap *stocked = &holdings->stocked;
    uint32_t renderer;
    while ((renderer = heap_top(stocked)) != HEAP_ABSENT) {
        uint32_t open = holdings->holders[renderer].open;
        if (open == stocked->entries[0].key) break;
        heap_put(stocked, renderer, open);
    }
    return renderer;
}

/* The index of the renderer's hold on this tile, or HOLD_NONE; *before: the one before it in the list, or
 * HOLD_NONE. */
static uint32_t find(const struct holdings *holdings, uint32_t renderer, uint32_t id,
                     uint32_t *before)
{
    uint32_t hold = holdings->holders[renderer].first;
    *before = HOLD_NONE;
    while (hold != HOLD_NONE && holdings->holds[hold].id != id) {
        *before = hold;
        hold = holdings->holds[hold].next;
    }
    return hold;
}

struct hold *holdings_find(const struct holdings *holdings, uint32_t renderer, uint32_t id)
{
    uint32_t before, hold = find(holdings, renderer, id, &before);
    return hold == HOLD_NONE ? NULL : &holdings->holds[hold];
}

/* Whether the renderer has no tile of this lot left. The lots of a renderer follow each other in its list, and
 * it has two at most: so what is left of a lot is at the beginning or at the end of the list. */
static bool lot_is_over(const struct holdings *holdings, const struct holder *holder, uint32_t lot)
{
    return holder->count == 0 ||
           (holdings->holds[holder->first].lot != lot && holdings->holds[holder->last].lot != lot);
}

void holdings_recall(struct holdings *holdings, struct hold *hold)
{
    assert(!hold->recalled);
    hold->recalled = true;
    holdings->holders[hold->renderer].open -= hold->may_pass;
}

struct hold holdings_take(struct holdings *holdings, uint32_t renderer, uint32_t id)
{
    struct holder *holder = &holdings->holders[renderer];
    uint32_t before, hold = find(holdings, renderer, id, &before);
    assert(hold != HOLD_NONE);
    struct hold was = holdings->holds[hold];
    was.other = leave_ring(holdings, hold);
    if (before == HOLD_NONE)
        holder->first = was.next;
    else
        holdings->holds[before].next = was.next;
    if (holder->last == hold) holder->last = before;
    if (--holder->count == 0) holdings->busy--;
    holder->open -= was.may_pass && !was.recalled;
    if (lot_is_over(holdings, holder, was.lot)) holder->lots--;
    holdings->holds[hold].next = holdings->free;
    holdings->free = hold;
    return was;
}
