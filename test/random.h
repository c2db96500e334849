/* Random numbers that are the same in every run, so that a failure repeats. */
#ifndef FARM_TEST_RANDOM_H
#define FARM_TEST_RANDOM_H

#include <stdint.h>

/* xorshift64 (G. Marsaglia, 2003); the state must not be 0. */
static inline uint64_t random_bits(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    return *state ^= *state << 17;
}

static inline double random_between(uint64_t *state, double low, double high)
{
    return low + (high - low) * ((double)(random_bits(state) >> 11) * 0x1p-53);
}

static inline uint32_t random_below(uint64_t *state, uint32_t count)
{
    return (uint32_t)random_between(state, 0, count);
}

static inline int random_exponent(uint64_t *state, int low, int high)
{
    return low + (int)random_below(state, (uint32_t)(high - low + 1));
}

#endif
