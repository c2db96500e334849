/* Arithmetic of unsigned integers. */
#ifndef FARM_COMMON_WHOLE_H
#define FARM_COMMON_WHOLE_H

#include <stddef.h>
#include <stdint.h>

static inline uint32_t smaller(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static inline uint32_t larger(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

/* a / b, rounded up. */
static inline uint32_t divide_up(uint32_t a, uint32_t b)
{
    return (uint32_t)(((uint64_t)a + b - 1) / b);
}

/* bytes, rounded up to a multiple of unit. */
static inline size_t round_up_to(size_t bytes, size_t unit)
{
    return (bytes + unit - 1) / unit * unit;
}

#endif
