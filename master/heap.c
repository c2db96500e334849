#include "master/heap.h"

#include <assert.h>
#include <stdlib.h>

#include "common/message.h"

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

/* Children of an entry: of four, which are 64 bytes, a path down has half as many places as of two, and those
 * who are compared lie side by side. */
#define CHILDREN 4

static bool comes_before(const struct heap_entry *a, const struct heap_entry *b)
{
    return a->key > b->key || (a->key == b->key && a->id < b->id);
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
        if (!comes_before(&entry, &heap->entries[parent])) break;
        set_entry(heap, place, heap->entries[parent]);
        place = parent;
    }
    set_entry(heap, place, entry);
}

/* The child of this place that comes before its others; not below count: it has none. */
static uint64_t first_child(const struct heap *heap, uint32_t place)
{
    uint64_t first = CHILDREN * (uint64_t)place + 1, end = first + CHILDREN;
    if (end > heap->count) end = heap->count;
    for (uint64_t i = first + 1; i < end; i++)
        if (comes_before(&heap->entries[i], &heap->entries[first])) first = i;
    return first;
}

static void sink(struct heap *heap, uint32_t place, struct heap_entry entry)
{
    for (;;) {
        uint64_t child = first_child(heap, place);
        if (child >= heap->count || !comes_before(&heap->entries[child], &entry)) break;
        set_entry(heap, place, heap->entries[child]);
        place = (uint32_t)child;
    }
    set_entry(heap, place, entry);
}

/* The entry takes the place, then the one where it belongs. */
static void settle(struct heap *heap, uint32_t place, struct heap_entry entry)
{
    if (place > 0 && comes_before(&entry, &heap->entries[(place - 1) / CHILDREN]))
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

void heap_change(struct heap *heap, uint32_t id, double key)
{
    assert(heap_has(heap, id) && key == key);
    heap->entries[heap->places[id]].key = key;
}

/* From the last one that has a child up: each begins a heap when it has sunk (R. Floyd, Algorithm 245, Comm.
 * ACM 7, 1964). */
void heap_order(struct heap *heap)
{
    if (heap->count < 2) return;
    for (uint32_t place = (heap->count - 2) / CHILDREN + 1; place-- > 0;)
        sink(heap, place, heap->entries[place]);
}

void heap_remove(struct heap *heap, uint32_t id)
{
    if (!heap_has(heap, id)) return;
    uint32_t place = heap->places[id];
    struct heap_entry last = heap->entries[--heap->count];
    heap->places[id] = HEAP_ABSENT;
    if (last.id != id) settle(heap, place, last);
}

bool heap_has(const struct heap *heap, uint32_t id)
{
    return id < heap->ids && heap->places[id] != HEAP_ABSENT;
}
