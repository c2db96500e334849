#include "bench/balance_events.h"

#include <assert.h>
#include <stdbool.h>
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

const struct event *events_first(const struct events *events)
{
    return events->count > 0 ? events->heap : NULL;
}

/* Puts the event at a free place of the heap, and moves it up or down from there. */
static void settle(struct events *events, size_t at, const struct event *last)
{
    for (; at > 0 && before(last, &events->heap[(at - 1) / 2]); at = (at - 1) / 2)
        events->heap[at] = events->heap[(at - 1) / 2];
    for (;;) {
        size_t child = 2 * at + 1;
        if (child >= events->count) break;
        if (child + 1 < events->count && before(&events->heap[child + 1], &events->heap[child]))
            child++;
        if (!before(&events->heap[child], last)) break;
        events->heap[at] = events->heap[child];
        at = child;
    }
    events->heap[at] = *last;
}

void events_add(struct events *events, const struct event *event)
{
    events->heap = grow(events->heap, events->count, sizeof *events->heap);
    struct event added = *event;
    added.order = events->added++;
    settle(events, events->count++, &added);
}

struct event events_take(struct events *events)
{
    assert(events->count > 0);
    struct event first = events->heap[0], last = events->heap[--events->count];
    if (events->count > 0) settle(events, 0, &last);
    return first;
}

void events_remove(struct events *events, const void *what)
{
    size_t at = 0;
    while (at < events->count && events->heap[at].what != what)
        at++;
    assert(at < events->count);
    struct event last = events->heap[--events->count];
    if (at < events->count) settle(events, at, &last);
}
