/* Threads that share out the rounds of a loop: for what is done while all the renderers of a node wait for
 * it. Between loops they sleep. */
#ifndef FARM_COMMON_CREW_H
#define FARM_COMMON_CREW_H

#include <stdint.h>

struct crew;

/* A crew of so many, at least one, of which the caller is one; fewer where the system grants no more
 * threads. Owned by the caller. */
struct crew *crew_gather(unsigned members);
void crew_dismiss(struct crew *crew);

/* How many they are. NULL: 1. */
unsigned crew_size(const struct crew *crew);

/* A round; those of one loop must not depend on each other. */
typedef void crew_work(void *context, uint32_t round);

/* The rounds 0 .. count - 1, in any order; returns when all are done. NULL: the caller alone does them.
 * Not to be called from a round with the same crew. */
void crew_share(struct crew *crew, uint32_t count, crew_work *work, void *context);

/* CPU seconds that the others have worked for the caller so far. NULL: 0. */
double crew_cpu_s(struct crew *crew);

#endif
