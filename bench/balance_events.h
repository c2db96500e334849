/* A priority queue of events, by their times: a binary heap. */
#ifndef FARM_BENCH_BALANCE_EVENTS_H
#define FARM_BENCH_BALANCE_EVENTS_H

#include <stddef.h>
#include <stdint.h>

struct event {
    double time;
    uint64_t order; /* order of adding: of events at the same time, the first added comes first */
    uint32_t kind;  /* the caller's */
    uint32_t who;
    uint32_t number; /* the caller's, like who and what */
    void *what;
};

struct events {
    struct event *heap; /* owned */
    size_t count;
    uint64_t added;
};

/* Starts empty as (struct events){0}. */
void events_free(struct events *events);
void events_add(struct events *events, const struct event *event);

/* The next event; NULL when there is none. */
const struct event *events_first(const struct events *events);
struct event events_take(struct events *events);

/* Removes the event for this `what`, of which there is one (asserted). O(n). */
void events_remove(struct events *events, const void *what);

#endif
