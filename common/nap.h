/*
 * Waiting without spinning. MPICH's blocking calls burn a core while they wait; a rank that naps
 * between polls leaves it to those who have work.
 */
#ifndef FARM_COMMON_NAP_H
#define FARM_COMMON_NAP_H

#include "common/clock.h"

/* The first nap is about what a wake-up costs; the last bounds both the polling (under 1 % of a
 * core at about 5 us a poll) and the delay, which a tile waiting at the renderer hides. */
#define NAP_SHORTEST 20e-6
#define NAP_LONGEST  1e-3

struct nap {
    double seconds; /* of the next one */
};

/*
 * Lets the naps of this thread, and of those that it starts, end when they should. Linux lets a sleep
 * last up to 50 us longer (timerslack in prctl(2)), more than the shortest naps. Elsewhere: nothing.
 */
void nap_sharpen(void);

/* Something happened: the next nap is short again. */
static inline void nap_reset(struct nap *nap)
{
    nap->seconds = NAP_SHORTEST;
}

static inline void nap_take(struct nap *nap)
{
    if (nap->seconds < NAP_SHORTEST) nap->seconds = NAP_SHORTEST;
    clock_sleep(nap->seconds);
    nap->seconds = nap->seconds * 2 < NAP_LONGEST ? nap->seconds * 2 : NAP_LONGEST;
}

#endif
