/* A small generator of our own (D. Knuth, TAOCP 2, 3.3.4, MMIX), so that a failure repeats. */
#ifndef FARM_TEST_CHANCE_H
#define FARM_TEST_CHANCE_H

#include <stdint.h>

static inline uint64_t chance_next(uint64_t *state)
{
    return *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
}

/* From 0 to below 1. */
static inline double chance(uint64_t *state)
{
    return (double)(chance_next(state) >> 11) * 0x1p-53;
}

#endif
