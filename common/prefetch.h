/*
 * Asking for memory some time before it is accessed, so that its cache lines arrive while other things are done, and
 * many at a time. Stores to lines that no cache holds wait for these nearly one by one. The master needs it: between
 * two answers its data are evicted from the caches.
 */
#ifndef FARM_COMMON_PREFETCH_H
#define FARM_COMMON_PREFETCH_H

#include <stddef.h>

/* Bytes on x86-64, and on AArch64 as a rule. With longer ones some lines are asked for twice. */
#define CACHE_LINE ((size_t)64)

/* GCC 12 takes a function that does nothing but prefetch for one without effect, and drops the calls of it and of those
 * that call it. */
#define PREFETCH_STAYS() __asm__ volatile("")

/* The block need not be aligned, nor exist: nothing is accessed. */
static inline void prefetch_to_read(const void *block, size_t bytes)
{
    PREFETCH_STAYS();
    for (size_t i = 0; i < bytes; i += CACHE_LINE)
        __builtin_prefetch((const char *)block + i, 0);
}

static inline void prefetch_to_write(const void *block, size_t bytes)
{
    PREFETCH_STAYS();
    for (size_t i = 0; i < bytes; i += CACHE_LINE)
        __builtin_prefetch((const char *)block + i, 1);
}

#endif
