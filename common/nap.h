/*
 * Waiting without spinning. MPICH's blocking calls burn a core while they wait; a rank that naps
 * between polls leaves it to those who have work.
 */
#ifndef FARM_COMMON_NAP_H
#define FARM_COMMON_NAP_H

#include <sched.h>
#include <stdbool.h>

#include "common/clock.h"

/*
 * Seconds. The first nap is shorter than the 20 us or so by which a wake-up is late in any case. Naps
 * double up to NAP_LONGEST, which bounds the delay of an answer that a tile in reserve at the renderer
 * hides, and after a while on to NAP_SELDOM: never more than NAP_PART of what has been waited, so that the
 * delay does not count beside that. One who is woken when there is something sleeps for NAP_SELDOM at once.
 * A wake-up with its look for messages takes about 20 us: 0.2 % of a core in a long wait.
 */
#define NAP_SHORTEST 5e-6
#define NAP_LONGEST  1e-3
#define NAP_SELDOM   10e-3
#define NAP_PART     (1.0 / 32)

/* What takes longer gives time enough if somebody who sleeps NAP_SELDOM at a time looks after half of it: twice
 * as much as needed, for predictions are what they are. */
#define NAP_CALL (4 * NAP_SELDOM)

/* One that has napped so long, in naps of which the last one took so many seconds, naps so long next. */
static inline double nap_after(double waited, double last)
{
    double most = waited * NAP_PART < NAP_LONGEST ? NAP_LONGEST : waited * NAP_PART;
    if (most > NAP_SELDOM) most = NAP_SELDOM;
    return 2 * last < most ? 2 * last : most;
}

/* One who expects nothing for so many seconds sleeps for this part of them at once: in time still for who
 * takes a quarter of what was predicted. */
#define NAP_CALM_PART (1.0 / 4)

static inline double nap_calm(double seconds)
{
    double part = NAP_CALM_PART * seconds;
    return part < NAP_SELDOM ? part : NAP_SELDOM;
}

struct nap {
    double seconds;  /* of the next one */
    double waited;   /* in those before it */
    double heard;    /* see nap_heard(): when that was last */
    double interval; /* and how long from time to time */
    double begun;    /* see nap_spins(): when the wait began; 0: it has not */
    bool rung;       /* see nap_woken(): it has been, and nothing has happened since */
};

/*
 * Lets the naps of this thread, and of those that it starts, end when they should. Linux lets a sleep
 * last up to 50 us longer (timerslack in prctl(2)), more than the shortest naps.
 */
void nap_sharpen(void);

/* Something happened: the next nap is short again. */
static inline void nap_reset(struct nap *nap)
{
    nap->seconds = NAP_SHORTEST;
    nap->waited = 0;
    nap->begun = 0;
    nap->rung = false;
}

/* How fast the estimate of intervals follows, and the first nap as part of one: naps that grew from the
 * shortest one would be as long by then, after many more wake-ups. */
#define NAP_INTERVAL_NEW  (1.0 / 8)
#define NAP_INTERVAL_PART (1.0 / 2)

/* The same for one to whom something happens time and again, and has now; seconds, of any clock. */
static inline void nap_heard(struct nap *nap, double now)
{
    nap_reset(nap);
    nap->interval += NAP_INTERVAL_NEW * (now - nap->heard - nap->interval);
    nap->heard = now;
    double first = nap->interval * NAP_INTERVAL_PART;
    if (first > NAP_SHORTEST) nap->seconds = first < NAP_LONGEST ? first : NAP_LONGEST;
}

/* Seconds of the next nap, which the caller takes. */
static inline double nap_next(struct nap *nap)
{
    double seconds = nap->seconds < NAP_SHORTEST ? NAP_SHORTEST : nap->seconds;
    nap->waited += seconds;
    nap->seconds = nap_after(nap->waited, seconds);
    return seconds;
}

/* The same for one who expects nothing for so many seconds. */
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
 * Seconds for which one who is to hear something soon looks without sleeping: what the first naps and their
 * wake-ups take, so that it costs him at most twice what he would have spent had he known (A. Karlin et
 * al., Competitive snoopy caching, Algorithmica 3, 1988).
 */
#define NAP_SPIN 50e-6

/* Whether one who is to hear something soon looks once more without sleeping: for NAP_SPIN. Others who wait for
 * this processor get it meanwhile. */
static inline bool nap_spins(struct nap *nap)
{
    double now = clock_wall();
    if (nap->begun == 0) nap->begun = now;
    if (now >= nap->begun + NAP_SPIN) return false;
    sched_yield();
    return true;
}

/*
 * Seconds for which one whom a bell wakes (common/bell.h) looks with naps like others' for what was rung
 * for and is not there, at most: where MPI moves it in pieces, it takes several looks, many times shorter
 * than that, and nobody rings again. The call may have been for what he has seen already.
 */
#define NAP_RUNG 2e-3

/* The bell has woken him. */
static inline void nap_woken(struct nap *nap)
{
    nap_reset(nap);
    nap->rung = true;
}

/* Whether what was rung for may still be on its way. */
static inline bool nap_is_rung(struct nap *nap)
{
    if (nap->waited > NAP_RUNG) nap->rung = false;
    return nap->rung;
}

#endif
