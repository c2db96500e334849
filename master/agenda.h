/*
 * What waits: numbered things, the one with the highest key first, of equal keys the lowest number.
 *
 * Nearly all leave in the order that they had when they were sorted: those stand in an array and leave it from
 * the front. What is put in later, one by one, is in a heap beside it.
 */
#ifndef FARM_MASTER_AGENDA_H
#define FARM_MASTER_AGENDA_H

#include <stdbool.h>
#include <stdint.h>

#include "master/heap.h"

#define AGENDA_NONE HEAP_ABSENT

/* All zero: empty. */
struct agenda {
    uint32_t count;            /* that wait */
    uint32_t ids;              /* places that there are */
    double *keys;              /* by id, AGENDA_ABSENT: it does not wait */
    struct heap_entry *sorted; /* [first .. end - 1], those among them that are as they were then */
    uint32_t first, end;
    struct heap later;
};

#define AGENDA_ABSENT (-1.0)

/* Room for ids below this number; never less than there was. */
void agenda_reserve(struct agenda *agenda, uint32_t ids);
void agenda_free(struct agenda *agenda);

/* Puts id in, with a key that is not negative, or gives it another key. */
void agenda_put(struct agenda *agenda, uint32_t id, double key);

/* Gives many ids other keys at once: agenda_unsort(), then agenda_change() for those that are in and
 * agenda_remove() for some, and agenda_sort() before anything else. O(n) where keys in a quarter of an
 * octave are equal. */
void agenda_unsort(struct agenda *agenda);
void agenda_change(struct agenda *agenda, uint32_t id, double key);
void agenda_sort(struct agenda *agenda);

/* Takes id out, if it is in. */
void agenda_remove(struct agenda *agenda, uint32_t id);

static inline bool agenda_has(const struct agenda *agenda, uint32_t id)
{
    return id < agenda->ids && agenda->keys[id] >= 0;
}

/* The first id, AGENDA_NONE when there is none. */
uint32_t agenda_first(struct agenda *agenda);

#endif
