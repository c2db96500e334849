/*
 * A priority queue of ids, for the tiles that wait: the highest key comes first, of equal keys the lowest id.
 *
 * Nearly all ids leave in the order in which they were sorted: these are in a sorted array and leave it at the
 * front. Ids that are put in one by one after the sorting are in a heap beside it.
 */
#ifndef FARM_MASTER_AGENDA_H
#define FARM_MASTER_AGENDA_H

#include <stdbool.h>
#include <stdint.h>

#include "master/heap.h"

#define AGENDA_NONE HEAP_ABSENT

/* An agenda that is all zero is empty. */
struct agenda {
    uint32_t count; /* ids that are in the queue */
    uint32_t ids;   /* capacity: ids are below this */
    double *keys;   /* by id; AGENDA_ABSENT: it is not in the queue */
    /* [first .. end - 1]; an entry is valid while its key is still that in keys */
    struct heap_entry *sorted;
    uint32_t first, end;
    struct heap later;
};

#define AGENDA_ABSENT (-1.0)

/* Makes room for ids below this number; never shrinks. */
void agenda_reserve(struct agenda *agenda, uint32_t ids);
void agenda_free(struct agenda *agenda);

/* Puts id in, with a key that is not negative, or gives it another key. */
void agenda_put(struct agenda *agenda, uint32_t id, double key);

/* Changes many keys at once: first agenda_unsort(), then agenda_change() for ids that are in and agenda_remove()
 * for some, then agenda_sort() before anything else. O(n) where keys within a quarter of an octave are equal. */
void agenda_unsort(struct agenda *agenda);
void agenda_change(struct agenda *agenda, uint32_t id, double key);
void agenda_sort(struct agenda *agenda);

/* Takes id out, if it is in. */
void agenda_remove(struct agenda *agenda, uint32_t id);

static inline bool agenda_has(const struct agenda *agenda, uint32_t id)
{
    return id < agenda->ids && agenda->keys[id] >= 0;
}

/* The first id; AGENDA_NONE when there is none. */
uint32_t agenda_first(struct agenda *agenda);

#endif
