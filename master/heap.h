/* A heap of numbered things, the one with the highest key on top; of equal keys the lowest number. */
#ifndef FARM_MASTER_HEAP_H
#define FARM_MASTER_HEAP_H

#include <stdbool.h>
#include <stdint.h>

#define HEAP_ABSENT UINT32_MAX

struct heap_entry {
    double key; /* not NaN */
    uint32_t id;
};

/* All zero: empty. */
struct heap {
    struct heap_entry *entries; /* [count] */
    uint32_t *places;           /* by id: where in entries, or HEAP_ABSENT */
    uint32_t count, ids;        /* ids: places that there are */
};

/* Room for ids below this number; never less than there was. */
void heap_reserve(struct heap *heap, uint32_t ids);
void heap_free(struct heap *heap);

/* Puts id in, or gives it another key: O(log n). */
void heap_put(struct heap *heap, uint32_t id, double key);

/* Takes id out, if it is in: O(log n). */
void heap_remove(struct heap *heap, uint32_t id);

/* Takes all out. */
void heap_clear(struct heap *heap);

bool heap_has(const struct heap *heap, uint32_t id);

static inline bool heap_before(const struct heap_entry *a, const struct heap_entry *b)
{
    return a->key > b->key || (a->key == b->key && a->id < b->id);
}

/* The id on top, HEAP_ABSENT when the heap is empty. */
static inline uint32_t heap_top(const struct heap *heap)
{
    return heap->count ? heap->entries[0].id : HEAP_ABSENT;
}

#endif
