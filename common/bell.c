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
    /*
     * The flag is cleared after the semaphore has been taken, so that a ring after this exchange posts it
     * again. The exchange reads the value of the last bell_ring(), also of one that did not post, and so
     * acquires what was written before it.
     */
    (void)atomic_exchange(&bell->rung, 0);
    return true;
}
