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

/*
 * Asks for all lines of the block, which need not be aligned, to be read or written.
 *
 * GCC 12 takes a function that does nothing but prefetch for one without effect, and drops the calls of it and of those
 * that call it: the empty statement prevents that.
 */
static inline void prefetch_block(const void *block, size_t bytes)
{
    const char *end = (const char *)block + bytes;
    __asm__ volatile("");
    for (const char *line = (const char *)block - (uintptr_t)block % CACHE_LINE; line < end;
         line += CACHE_LINE)
        __builtin_prefetch(line);
}

#endif
