#include "common/orphan.h"

#include <errno.h>
#include <stdbool.h>
#include <string.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/message.h"

/* Seconds between two looks for the parent. */
#define LOOK_EVERY 1.0

static pid_t parent; /* 0: not known */

void orphan_watch(void)
{
    parent = getppid();
}

void orphan_leave(double silence, double patience)
{
    if (silence <= patience || parent == 0 || getppid() == parent) return;
    fatal("nothing has come for %.0f s, and what had started this rank is gone", silence);
}

/* Takes the semaphore if it is posted within LOOK_EVERY, however often signals interrupt the waiting. */
static bool take_soon(sem_t *posted)
{
    struct timespec until = clock_span(clock_wall() + LOOK_EVERY);
    while (sem_clockwait(posted, CLOCK_MONOTONIC, &until) != 0) {
        if (errno == ETIMEDOUT) return false;
        if (errno != EINTR) fatal("cannot wait for another process: %s", strerror(errno));
    }
    return true;
}

/* Counts looks instead of reading the clock: while the process is suspended, nothing can come. */
void orphan_wait(sem_t *posted, double patience)
{
    double silence = 0;
    while (!take_soon(posted)) {
        silence += LOOK_EVERY;
        orphan_leave(silence, patience);
    }
}
