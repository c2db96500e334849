/*
 * Waiting without spinning: how long to sleep ("nap") between polls. MPICH's blocking calls spin and occupy a
 * core while they wait; a rank that sleeps between polls leaves its core to those who have work.
 */
#ifndef FARM_COMMON_NAP_H
#define FARM_COMMON_NAP_H

#include <sched.h>
#include <stdbool.h>

#include "common/clock.h"

/*
 * Lengths of naps, in seconds. NAP_SHORTEST is less than the 20 us or so by which any wake-up is late. Naps
 * then double, up to NAP_LONGEST, which bounds the delay of an answer; the tile that a renderer has in
 * reserve hides that delay. After a longer wait they grow on to NAP_SELDOM, but never beyond NAP_PART of the
 * time waited so far, so that the delay is small beside the wait. A waiter that will be woken sleeps for
 * NAP_SELDOM at once. A wake-up with its poll takes about 20 us, so one per NAP_SELDOM takes 0.2 % of a core
 * in a long wait.
 */
#define NAP_SHORTEST 5e-6
#define NAP_LONGEST  1e-3
#define NAP_SELDOM   10e-3
#define NAP_PART     (1.0 / 32)

/*
 * If a task takes longer than this, a waiter that sleeps for NAP_SELDOM at a time notices in time that half of
 * it is done. It is twice as long as needed because durations are only predicted.
 */
#define NAP_CALL (4 * NAP_SELDOM)

/* The length of the next nap, after waiting for `waited` seconds in naps of which the last took `last`
 * seconds. */
static inline double nap_after(double waited, double last)
{
    double most = waited * NAP_PART < NAP_LONGEST ? NAP_LONGEST : waited * NAP_PART;
    if (most > NAP_SELDOM) most = NAP_SELDOM;
    return 2 * last < most ? 2 * last : most;
}

/*
 * A waiter that expects nothing for some predicted time sleeps for this part of it at once; it is then still
 * in time for what takes a quarter of the prediction.
 */
#define NAP_CALM_PART (1.0 / 4)

static inline double nap_calm(double seconds)
{
    double part = NAP_CALM_PART * seconds;
    return part < NAP_SELDOM ? part : NAP_SELDOM;
}

struct nap {
    double seconds;  /* length of the next nap */
    double waited;   /* total of the naps before it */
    double heard;    /* time of the last nap_heard() */
    double interval; /* estimated interval between calls of nap_heard(), seconds */
    double begun;    /* start of the wait, see nap_spins(); 0: not begun */
    bool rung;       /* woken by the bell, and nothing has happened since: see nap_woken() */
};

/*
 * Makes naps of the calling thread, and of threads that it starts, end on time. By default Linux may extend a
 * sleep by 50 us (timerslack, prctl(2)), which is more than the shortest naps.
 */
void nap_sharpen(void);

/* Something happened, so the next nap is short again. */
static inline void nap_reset(struct nap *nap)
{
    nap->seconds = NAP_SHORTEST;
    nap->waited = 0;
    nap->begun = 0;
    nap->rung = false;
}

/*
 * The weight of a new interval in the running mean of intervals, and the first nap as a part of that mean.
 * Naps that start from the shortest one would have grown to this length by then, after many more wake-ups.
 */
#define NAP_INTERVAL_NEW  (1.0 / 8)
#define NAP_INTERVAL_PART (1.0 / 2)

/* Like nap_reset(), for a waiter to whom something happens regularly. now: seconds of any one clock. */
static inline void nap_heard(struct nap *nap, double now)
{
    nap_reset(nap);
    nap->interval += NAP_INTERVAL_NEW * (now - nap->heard - nap->interval);
    nap->heard = now;
    double first = nap->interval * NAP_INTERVAL_PART;
    if (first > NAP_SHORTEST) nap->seconds = first < NAP_LONGEST ? first : NAP_LONGEST;
}

/* Returns the length of the next nap in seconds. The caller sleeps that long. */
static inline double nap_next(struct nap *nap)
{
    double seconds = nap->seconds < NAP_SHORTEST ? NAP_SHORTEST : nap->seconds;
    nap->waited += seconds;
    nap->seconds = nap_after(nap->waited, seconds);
    return seconds;
}

/* Like nap_next(), for a waiter that expects nothing for `calm` seconds. */
static inline double nap_next_calm(struct nap *nap, double calm)
{
    double part = nap_calm(calm);
    return part > nap->seconds ? part : nap_next(nap);
}

static inline void nap_take(struct nap *nap)
{
    clock_sleep(nap_next(nap));
}

/*
 * Seconds for which a waiter that expects something soon polls without sleeping: as long as the first naps
 * and their wake-ups take. Its cost is then at most twice that of the best choice with hindsight (A. Karlin
 * et al., Competitive snoopy caching, Algorithmica 3, 1988).
 */
#define NAP_SPIN 50e-6

/*
 * Whether to poll once more without sleeping: true during the first NAP_SPIN of a wait. Yields the processor
 * to others meanwhile.
 */
static inline bool nap_spins(struct nap *nap)
{
    double now = clock_wall();
    if (nap->begun == 0) nap->begun = now;
    if (now >= nap->begun + NAP_SPIN) return false;
    sched_yield();
    return true;
}

/*
 * Seconds for which a waiter woken by a bell (common/bell.h) polls with ordinary short naps if it does not
 * find what the bell was rung for. A message that MPI moves in pieces takes several polls, in all many times
 * shorter than this, and the bell is not rung again for them. The bell may also have been rung for something
 * already received.
 */
#define NAP_RUNG 2e-3

/* The bell has woken this waiter. */
static inline void nap_woken(struct nap *nap)
{
    nap_reset(nap);
    nap->rung = true;
}

/* Whether what the bell was rung for may still be on its way. */
static inline bool nap_is_rung(struct nap *nap)
{
    if (nap->waited > NAP_RUNG) nap->rung = false;
    return nap->rung;
}

#endif
