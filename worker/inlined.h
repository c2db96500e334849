/* What the compiler cannot know of a function: that much is constant in each of its callers; that a
 * copy in each would only fill the cache with long arithmetic; that it decides what is hardly ever in
 * doubt and is in the way of what is done for every ray. */
#ifndef FARM_WORKER_INLINED_H
#define FARM_WORKER_INLINED_H

#define INLINED inline __attribute__((always_inline))
#define SHARED  __attribute__((noinline))
#define RARE    __attribute__((cold, noinline))

#endif
