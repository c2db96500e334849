/* A thread pool that shares out the rounds of a loop: for what is done while all the renderers of a node wait for
 * it. Between loops its threads sleep. */
#ifndef FARM_COMMON_CREW_H
#define FARM_COMMON_CREW_H

#include <stdint.h>

struct crew;

/*
 * Makes a crew of the given number of members, at least 1, one of which is the caller. There are fewer
 * members if the system grants fewer threads. The caller owns the crew and ends it with crew_dismiss().
 */
struct crew *crew_gather(unsigned members);
void crew_dismiss(struct crew *crew);

/* Number of members, the caller included. crew NULL: 1. */
unsigned crew_size(const struct crew *crew);

/* One iteration, called a round. Rounds of one loop must not depend on each other. */
typedef void crew_work(void *context, uint32_t round);

/*
 * Runs the rounds 0 .. count - 1 in any order and returns when all are done. crew NULL: the caller runs them
 * all. Must not be called from a round of the same crew.
 */
void crew_share(struct crew *crew, uint32_t count, crew_work *work, void *context);

/* CPU seconds that the other members have spent so far. crew NULL: 0. */
double crew_cpu_s(struct crew *crew);

#endif
