#include "common/hash.h"

#include <endian.h>
#include <string.h>

/* The five primes of the specification, section "Step 1". */
#define PRIME_1 UINT64_C(0x9e3779b185ebca87)
#define PRIME_2 UINT64_C(0xc2b2ae3d27d4eb4f)
#define PRIME_3 UINT64_C(0x165667b19e3779f9)
#define PRIME_4 UINT64_C(0x85ebca77c2b2ae63)
#define PRIME_5 UINT64_C(0x27d4eb2f165667c5)

#define STRIPE 32 /* bytes: four lanes of eight */

static uint64_t rotate(uint64_t x, int bits)
{
    return x << bits | x >> (64 - bits);
}

static uint64_t lane(const unsigned char *at)
{
    uint64_t x;
    memcpy(&x, at, sizeof x);
    return le64toh(x);
}

static uint64_t half_lane(const unsigned char *at)
{
    uint32_t x;
    memcpy(&x, at, sizeof x);
    return le32toh(x);
}

static uint64_t take_lane(uint64_t sum, uint64_t x)
{
    return rotate(sum + x * PRIME_2, 31) * PRIME_1;
}

static uint64_t merge(uint64_t hash, uint64_t sum)
{
    return (hash ^ take_lane(0, sum)) * PRIME_1 + PRIME_4;
}

/* Steps 1 to 3 of the specification, for 32 bytes or more; advances *at past the last whole stripe. */
static uint64_t hash_stripes(const unsigned char **at, const unsigned char *end, uint64_t seed)
{
    uint64_t a = seed + PRIME_1 + PRIME_2, b = seed + PRIME_2, c = seed, d = seed - PRIME_1;
    for (; end - *at >= STRIPE; *at += STRIPE) {
        a = take_lane(a, lane(*at));
        b = take_lane(b, lane(*at + 8));
        c = take_lane(c, lane(*at + 16));
        d = take_lane(d, lane(*at + 24));
    }
    uint64_t hash = rotate(a, 1) + rotate(b, 7) + rotate(c, 12) + rotate(d, 18);
    return merge(merge(merge(merge(hash, a), b), c), d);
}

/* Step 5: the bytes after the last whole stripe. */
static uint64_t hash_rest(const unsigned char *at, const unsigned char *end, uint64_t hash)
{
    for (; end - at >= 8; at += 8)
        hash = rotate(hash ^ take_lane(0, lane(at)), 27) * PRIME_1 + PRIME_4;
    if (end - at >= 4) {
        hash = rotate(hash ^ half_lane(at) * PRIME_1, 23) * PRIME_2 + PRIME_3;
        at += 4;
    }
    for (; at < end; at++)
        hash = rotate(hash ^ *at * PRIME_5, 11) * PRIME_1;
    return hash;
}

uint64_t hash64(const void *bytes, size_t count, uint64_t seed)
{
    const unsigned char *at = bytes, *end = at + count;
    uint64_t hash = count < STRIPE ? seed + PRIME_5 : hash_stripes(&at, end, seed);
    hash = hash_rest(at, end, hash + count);
    hash = (hash ^ hash >> 33) * PRIME_2;
    hash = (hash ^ hash >> 29) * PRIME_3;
    return hash ^ hash >> 32;
}
