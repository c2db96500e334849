#include "common/bell.h"

#include <errno.h>
#include <string.h>

#include "common/clock.h"
#include "common/message.h"

void bell_init(struct bell *bell)
{
    atomic_init(&bell->rung, 0);
    if (sem_init(&bell->calls, 1, 0) != 0) fatal("cannot create a semaphore: %s", strerror(errno));
}

void bell_free(struct bell *bell)
{
    sem_destroy(&bell->calls);
}

void bell_ring(struct bell *bell)
{
    if (atomic_exchange(&bell->rung, 1) == 0) sem_post(&bell->calls);
}

bool bell_wait(struct bell *bell, double seconds)
{
    struct timespec until = clock_span(clock_wall() + seconds);
    if (sem_clockwait(&bell->calls, CLOCK_MONOTONIC, &until) != 0) return false;
    /* In this order: who rings behind it is heard next time. It reads what the last one has written who
     * did ring before, and so sees what he had done, though his call was not needed. */
    (void)atomic_exchange(&bell->rung, 0);
    return true;
}
