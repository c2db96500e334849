#include "bench/balance_events.h"

#include <assert.h>
#include <stdlib.h>

#include "common/message.h"

void events_free(struct events *events)
{
    free(events->heap);
    *events = (struct events){0};
}

static bool before(const struct event *a, const struct event *b)
{
    return a->time != b->time ? a->time < b->time : a->order < b->order;
}

void events_add(struct events *events, const struct event *event)
{
    if (events->count == events->capacity) {
        events->capacity = events->capacity ? 2 * events->capacity : 256;
        events->heap = reallocate(events->heap, events->capacity, sizeof *events->heap);
    }
    struct event added = *event;
    added.order = events->added++;
    size_t at = events->count++;
    while (at > 0 && before(&added, &events->heap[(at - 1) / 2])) {
        events->heap[at] = events->heap[(at - 1) / 2];
        at = (at - 1) / 2;
    }
    events->heap[at] = added;
}

const struct event *events_first(const struct events *events)
{
    return events->count > 0 ? events->heap : NULL;
}

struct event events_take(struct events *events)
{
    assert(events->count > 0);
    struct event first = events->heap[0], last = events->heap[--events->count];
    size_t at = 0;
    for (;;) {
        size_t child = 2 * at + 1;
        if (child >= events->count) break;
        if (child + 1 < events->count && before(&events->heap[child + 1], &events->heap[child]))
            child++;
        if (!before(&events->heap[child], &last)) break;
        events->heap[at] = events->heap[child];
        at = child;
    }
    events->heap[at] = last;
    return first;
}
