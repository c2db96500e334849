/*
 * Attributes for what the compiler cannot know of a function. INLINED: many of its arguments are constants in
 * each caller. NOINLINE: copies of its long arithmetic in each caller would only fill the instruction cache, and take
 * long to compile. RARE: it decides rare cases and should stay out of the code that runs for every ray.
 */
#ifndef FARM_WORKER_INLINED_H
#define FARM_WORKER_INLINED_H

#define INLINED  inline __attribute__((always_inline))
#define NOINLINE __attribute__((noinline))
#define RARE     __attribute__((cold, noinline))

#endif
