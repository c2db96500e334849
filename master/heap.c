#include "master/heap.h"

#include <assert.h>
#include <stdlib.h>

#include "common/message.h"
#include "common/prefetch.h"
#include "common/whole.h"

void heap_reserve(struct heap *heap, uint32_t ids)
{
    if (ids <= heap->ids) return;
    heap->entries = reallocate(heap->entries, ids, sizeof *heap->entries);
    heap->places = reallocate(heap->places, ids, sizeof *heap->places);
    for (uint32_t id = heap->ids; id < ids; id++)
        heap->places[id] = HEAP_ABSENT;
    heap->ids = ids;
}

void heap_free(struct heap *heap)
{
    free(heap->entries);
    free(heap->places);
    *heap = (struct heap){0};
}

/* Children of an entry. With four, which are 64 bytes, a path down is half as long as in a binary heap, and
 * those that are compared are adjacent in memory. */
#define CHILDREN 4

void heap_expect(const struct heap *heap)
{
    const uint32_t three_levels = 1 + CHILDREN + CHILDREN * CHILDREN;
    prefetch_block(heap->entries, smaller(heap->count, three_levels) * sizeof *heap->entries);
}

static void set_entry(struct heap *heap, uint32_t place, struct heap_entry entry)
{
    heap->entries[place] = entry;
    heap->places[entry.id] = place;
}

static void rise(struct heap *heap, uint32_t place, struct heap_entry entry)
{
    while (place > 0) {
        uint32_t parent = (place - 1) / CHILDREN;
        if (!heap_before(&entry, &heap->entries[parent])) break;
        set_entry(heap, place, heap->entries[parent]);
        place = parent;
    }
    set_entry(heap, place, entry);
}

/* The highest child of the entry at this place; heap->count or more: it has none. */
static uint64_t first_child(const struct heap *heap, uint32_t place)
{
    uint64_t first = CHILDREN * (uint64_t)place + 1, end = first + CHILDREN;
    if (end > heap->count) end = heap->count;
    for (uint64_t i = first + 1; i < end; i++)
        if (heap_before(&heap->entries[i], &heap->entries[first])) first = i;
    return first;
}

static void sink(struct heap *heap, uint32_t place, struct heap_entry entry)
{
    for (;;) {
        uint64_t child = first_child(heap, place);
        if (child >= heap->count || !heap_before(&heap->entries[child], &entry)) break;
        set_entry(heap, place, heap->entries[child]);
        place = (uint32_t)child;
    }
    set_entry(heap, place, entry);
}

/* Puts the entry at this place and moves it up or down to where it belongs. */
static void settle(struct heap *heap, uint32_t place, struct heap_entry entry)
{
    if (place > 0 && heap_before(&entry, &heap->entries[(place - 1) / CHILDREN]))
        rise(heap, place, entry);
    else
        sink(heap, place, entry);
}

void heap_put(struct heap *heap, uint32_t id, double key)
{
    assert(id < heap->ids && key == key);
    struct heap_entry entry = {key, id};
    if (heap->places[id] == HEAP_ABSENT)
        rise(heap, heap->count++, entry);
    else
        settle(heap, heap->places[id], entry);
}

void heap_remove(struct heap *heap, uint32_t id)
{
    if (!heap_has(heap, id)) return;
    uint32_t place = heap->places[id];
    struct heap_entry last = heap->entries[--heap->count];
    heap->places[id] = HEAP_ABSENT;
    if (last.id != id) settle(heap, place, last);
}

void heap_change(struct heap *heap, uint32_t id, double key)
{
    assert(heap_has(heap, id) && key == key);
    heap->entries[heap->places[id]].key = key;
}

/* From the bottom up, so that all below a place is in order when its turn comes (R. Floyd, "Algorithm 245: Treesort 3",
 * Comm. ACM 7, 1964). */
void heap_restore(struct heap *heap)
{
    for (uint32_t place = heap->count; place-- > 0;)
        sink(heap, place, heap->entries[place]);
}

bool heap_has(const struct heap *heap, uint32_t id)
{
    return id < heap->ids && heap->places[id] != HEAP_ABSENT;
}
