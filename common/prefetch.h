/*
 * Asking for memory some time before it is accessed, so that its cache lines arrive while other things are done, and
 * many at a time. Stores that miss all caches are completed nearly one after the other. The master needs this: between
 * two answers its data are evicted from the caches.
 */
#ifndef FARM_COMMON_PREFETCH_H
#define FARM_COMMON_PREFETCH_H

#include <stddef.h>
#include <stdint.h>

/* Bytes of a cache line on x86-64, and on AArch64 as a rule. With longer ones some are asked for twice. */
#define CACHE_LINE ((size_t)64)

/* GCC 12 takes a function that does nothing but prefetch for one without effect, and drops the calls of it and of those
 * that call it. */
#define PREFETCH_STAYS() __asm__ volatile("")

/* Asks for all lines of the block, which need not be aligned. Whether it is to be written makes a difference only where
 * the compiler's target has an instruction for that: x86-64 as such has none. */
static inline void prefetch_to_read(const void *block, size_t bytes)
{
    const char *end = (const char *)block + bytes;
    PREFETCH_STAYS();
    for (const char *line = (const char *)block - (uintptr_t)block % CACHE_LINE; line < end;
         line += CACHE_LINE)
        __builtin_prefetch(line, 0);
}

static inline void prefetch_to_write(const void *block, size_t bytes)
{
    const char *end = (const char *)block + bytes;
    PREFETCH_STAYS();
    for (const char *line = (const char *)block - (uintptr_t)block % CACHE_LINE; line < end;
         line += CACHE_LINE)
        __builtin_prefetch(line, 1);
}

#endif
