/*
 * A bell wakes one who sleeps, from another thread or from another process of the same machine: it lies in
 * memory that both have. Whatever was done before bell_ring() is seen behind the bell_wait() that this ends,
 * or that comes next.
 */
#ifndef FARM_COMMON_BELL_H
#define FARM_COMMON_BELL_H

#include <semaphore.h>
#include <stdatomic.h>
#include <stdbool.h>

struct bell {
    atomic_uint rung; /* since somebody woke up: once more would wake nobody sooner */
    sem_t calls;
};

void bell_init(struct bell *bell);
void bell_free(struct bell *bell);

/* By anybody. Takes a system call only if somebody sleeps. */
void bell_ring(struct bell *bell);

/* By one thread: sleeps until the bell rings, if it has not since the last time, for so many seconds at most,
 * or until a signal comes; whether it was the bell. A process that is stopped while it rings silences the bell
 * for all until it goes on. */
bool bell_wait(struct bell *bell, double seconds);

#endif
