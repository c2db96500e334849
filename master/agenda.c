#include "master/agenda.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

void agenda_reserve(struct agenda *agenda, uint32_t ids)
{
    if (ids <= agenda->ids) return;
    agenda->keys = reallocate(agenda->keys, ids, sizeof *agenda->keys);
    agenda->sorted = reallocate(agenda->sorted, ids, sizeof *agenda->sorted);
    /* Written to, so that the pages are mapped before all renderers wait for the sorting. */
    for (uint32_t id = agenda->ids; id < ids; id++) {
        agenda->keys[id] = AGENDA_ABSENT;
        agenda->sorted[id] = (struct heap_entry){0};
    }
    heap_reserve(&agenda->later, ids);
    agenda->ids = ids;
}

void agenda_free(struct agenda *agenda)
{
    free(agenda->keys);
    free(agenda->sorted);
    heap_free(&agenda->later);
    *agenda = (struct agenda){0};
}

void agenda_put(struct agenda *agenda, uint32_t id, double key)
{
    assert(id < agenda->ids && key >= 0);
    agenda->count += !agenda_has(agenda, id);
    agenda->keys[id] = key;
    heap_put(&agenda->later, id, key);
}

void agenda_remove(struct agenda *agenda, uint32_t id)
{
    if (!agenda_has(agenda, id)) return;
    agenda->count--;
    agenda->keys[id] = AGENDA_ABSENT;
    heap_remove(&agenda->later, id);
}

/* ---- sorting ---- */

void agenda_unsort(struct agenda *agenda)
{
    heap_clear(&agenda->later);
}

void agenda_change(struct agenda *agenda, uint32_t id, double key)
{
    assert(agenda_has(agenda, id) && key >= 0);
    agenda->keys[id] = key;
}

/* Bucket sort by the upper bits of a key: keys in one bucket have the exponent and the first bits of the
 * mantissa in common. Higher keys are in buckets of lower number. */
#define BUCKET_SHIFT 50
#define BUCKETS      8192

static uint32_t bucket_of(double key)
{
    uint64_t bits;
    key += 0.0; /* turns -0.0 into +0.0 */
    memcpy(&bits, &key, sizeof bits);
    return BUCKETS - 1 - (uint32_t)(bits >> BUCKET_SHIFT);
}

/* Computes where each bucket begins, from the number of ids in each. */
static void find_buckets(const struct agenda *agenda, uint32_t begins[BUCKETS])
{
    uint32_t begin = 0;
    memset(begins, 0, BUCKETS * sizeof *begins);
    for (uint32_t id = 0; id < agenda->ids; id++)
        if (agenda_has(agenda, id)) begins[bucket_of(agenda->keys[id])]++;
    for (uint32_t i = 0; i < BUCKETS; i++) {
        uint32_t count = begins[i];
        begins[i] = begin;
        begin += count;
    }
}

/* Insertion sort: takes linear time where the entries are sorted already. */
static void sort_within_buckets(struct heap_entry *entries, uint32_t count)
{
    for (uint32_t i = 1; i < count; i++) {
        struct heap_entry entry = entries[i];
        uint32_t at = i;
        for (; at > 0 && entries[at - 1].key < entry.key; at--)
            entries[at] = entries[at - 1];
        if (at < i) entries[at] = entry;
    }
}

void agenda_sort(struct agenda *agenda)
{
    uint32_t begins[BUCKETS];
    find_buckets(agenda, begins);
    for (uint32_t id = 0; id < agenda->ids; id++) {
        double key = agenda->keys[id];
        if (key >= 0) agenda->sorted[begins[bucket_of(key)]++] = (struct heap_entry){key, id};
    }
    sort_within_buckets(agenda->sorted, agenda->count);
    agenda->first = 0;
    agenda->end = agenda->count;
}

uint32_t agenda_first(struct agenda *agenda)
{
    const struct heap_entry *entries = agenda->sorted;
    uint32_t first = agenda->first;
    while (first < agenda->end && agenda->keys[entries[first].id] != entries[first].key)
        first++;
    agenda->first = first;
    if (first == agenda->end) return heap_top(&agenda->later);
    if (agenda->later.count > 0 && heap_before(&agenda->later.entries[0], &entries[first]))
        return heap_top(&agenda->later);
    return entries[first].id;
}
