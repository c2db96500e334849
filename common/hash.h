/*
 * XXH64 (Yann Collet, "xxHash fast digest algorithm", specification of version 0.1.1): tells whether
 * two blocks of bytes are the same and whether one was damaged. No protection against a forger.
 */
#ifndef FARM_COMMON_HASH_H
#define FARM_COMMON_HASH_H

#include <stddef.h>
#include <stdint.h>

/* The same on every machine. The hash of one block as the seed of the next hashes both in turn. */
uint64_t hash64(const void *bytes, size_t count, uint64_t seed);

#endif
