/*
 * A bell wakes a sleeping thread. Another thread, or another process of the same machine, rings it; the bell
 * lies in memory that both share. Ringing has release semantics and waiting has acquire semantics: everything
 * written before bell_ring() is visible after the bell_wait() that this ring ends, or, if nobody was asleep,
 * after the next one.
 */
#ifndef FARM_COMMON_BELL_H
#define FARM_COMMON_BELL_H

#include <semaphore.h>
#include <stdatomic.h>
#include <stdbool.h>

struct bell {
    /* 1: rung since the last wake-up, so that ringing again would wake nobody sooner */
    atomic_uint rung;
    sem_t calls;
};

/* Must be called once before any thread or process uses the bell, where it then stays: it must not be copied. The
 * process ends if the system grants no semaphore. */
void bell_init(struct bell *bell);

/* No thread may use it any more. */
void bell_free(struct bell *bell);

/* Rings the bell; any thread may. Makes a system call only if a thread sleeps. */
void bell_ring(struct bell *bell);

/*
 * Sleeps until the bell rings, for at most this many seconds, or until a signal arrives; returns at once if
 * the bell has been rung since the last wait. Returns whether the bell ended the wait. Only one thread may
 * wait. A process that is stopped (SIGSTOP) in the middle of bell_ring() silences the bell for all others
 * until it continues.
 */
bool bell_wait(struct bell *bell, double seconds);

#endif
