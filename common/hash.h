/*
 * The 64-bit hash XXH64 (Yann Collet, "xxHash fast digest algorithm", specification of version 0.1.1). It
 * tells whether two blocks of bytes are equal and whether one was damaged; it is no protection against
 * forgery.
 */
#ifndef FARM_COMMON_HASH_H
#define FARM_COMMON_HASH_H

#include <stddef.h>
#include <stdint.h>

/* Does not depend on the machine. To hash several blocks in sequence, pass the hash of one as the seed of the
 * next. */
uint64_t hash64(const void *bytes, size_t count, uint64_t seed);

#endif
