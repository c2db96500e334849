/* An indexed heap: numbered things, the one with the highest key on top; of equal keys the lowest number. */
#ifndef FARM_MASTER_HEAP_H
#define FARM_MASTER_HEAP_H

#include <stdbool.h>
#include <stdint.h>

#define HEAP_ABSENT UINT32_MAX

struct heap_entry {
    double key; /* not NaN */
    uint32_t id;
};

/* A heap that is all zero is empty. */
struct heap {
    struct heap_entry *entries; /* [count] */
    uint32_t *places;           /* by id: its index in entries, or HEAP_ABSENT */
    uint32_t count, ids;        /* ids: capacity, ids are below it */
};

/* Makes room for ids below this number; never shrinks. */
void heap_reserve(struct heap *heap, uint32_t ids);
void heap_free(struct heap *heap);

/* Puts id in, or changes its key: O(log n). */
void heap_put(struct heap *heap, uint32_t id, double key);

/* Removes id, if it is in: O(log n). */
void heap_remove(struct heap *heap, uint32_t id);

/* Changes many keys at once: heap_change() for ids that are in, and heap_remove() for some, then heap_restore() before
 * anything else. O(n) in all. */
void heap_change(struct heap *heap, uint32_t id, double key);
void heap_restore(struct heap *heap);

/* Whether id, which may be beyond the room, is in. */
bool heap_has(const struct heap *heap, uint32_t id);

/* Whether a is to be above b. */
static inline bool heap_before(const struct heap_entry *a, const struct heap_entry *b)
{
    return a->key > b->key || (a->key == b->key && a->id < b->id);
}

/* The top is about to be taken: asks for the memory of the first levels. */
void heap_expect(const struct heap *heap);

/* The id on top; HEAP_ABSENT when the heap is empty. */
static inline uint32_t heap_top(const struct heap *heap)
{
    return heap->count ? heap->entries[0].id : HEAP_ABSENT;
}

#endif
