#include "worker/exact.h"

#include <string.h>

#include "common/whole.h"

/* Exponent of the accumulator's lowest bit. */
#define LOWEST_EXPONENT (-64 * EXACT_LIMBS_BELOW)

__extension__ typedef unsigned __int128 uint128;
__extension__ typedef __int128 int128;

/* A double as mantissa * 2^exponent, from its IEEE 754 bits. */
struct parts {
    uint64_t mantissa;
    int exponent;
    bool negative;
};

static inline struct parts parts_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    uint64_t mantissa = bits & ((UINT64_C(1) << 52) - 1);
    int exponent = (int)(bits >> 52 & 0x7ff);
    /* Subnormal numbers have the exponent of the least normal numbers, without the leading 1. */
    bool normal = exponent != 0;
    return (struct parts){mantissa | (uint64_t)normal << 52, exponent - 1074 - normal, bits >> 63};
}

/* Widens the window to include [low, high). */
static inline void accumulator_cover(struct accumulator *sum, unsigned low, unsigned high)
{
    bool empty = sum->low == sum->high;
    if (empty) sum->low = sum->high = low;
    uint64_t sign = !empty && sum->limb[sum->high - 1] >> 63 ? UINT64_MAX : 0;
    while (sum->high < high)
        sum->limb[sum->high++] = sign;
    while (sum->low > low)
        sum->limb[--sum->low] = 0;
}

/*
 * Adds or subtracts an integer of `count` limbs at `place`. The window ends at least one limb above every
 * term, so that it would take 2^63 terms to overflow into its sign.
 */
static inline void add_limbs(struct accumulator *sum, const uint64_t *limbs, unsigned count,
                             unsigned place, bool negative)
{
    if (place < sum->low || place + count >= sum->high)
        accumulator_cover(sum, place, place + count + 1);
    uint64_t *at = sum->limb + place, flip = negative ? UINT64_MAX : 0;
    uint128 carry = negative;
#pragma GCC unroll 4
    for (unsigned i = 0; i < count; i++) {
        carry += (uint128)at[i] + (limbs[i] ^ flip);
        at[i] = (uint64_t)carry;
        carry >>= 64;
    }
    for (unsigned i = count; place + i < sum->high && carry != negative; i++) {
        carry += (uint128)at[i] + flip;
        at[i] = (uint64_t)carry;
        carry >>= 64;
    }
}

/* Limbs of the product of EXACT_FACTORS mantissas of 53 bits, and one to shift into. */
#define PRODUCT_LIMBS ((53 * EXACT_FACTORS + 63) / 64 + 1)

static inline void multiply_by_limb(uint64_t *limbs, unsigned count, uint64_t factor)
{
    uint64_t carry = 0;
    for (unsigned i = 0; i < count; i++) {
        uint128 wide = (uint128)limbs[i] * factor + carry;
        limbs[i] = (uint64_t)wide;
        carry = (uint64_t)(wide >> 64);
    }
    limbs[count] = carry;
}

/* Adds an integer of `count` limbs, the last one 0, times 2^exponent. */
static inline void add_shifted(struct accumulator *sum, uint64_t *limbs, unsigned count,
                               int exponent, bool negative)
{
    unsigned shift = (unsigned)(exponent - LOWEST_EXPONENT), bits = shift % 64;
    for (unsigned i = count; bits > 0 && i-- > 0;)
        limbs[i] = limbs[i] << bits | (i > 0 ? limbs[i - 1] >> (64 - bits) : 0);
    add_limbs(sum, limbs, count, shift / 64, negative);
}

void accumulator_add(struct accumulator *sum, const double *factors, unsigned count, bool subtract)
{
    uint64_t limbs[PRODUCT_LIMBS] = {1};
    unsigned used = 1;
    int exponent = 0;
    bool negative = subtract;
    for (unsigned i = 0; i < count; i++) {
        struct parts factor = parts_of(factors[i]);
        if (factor.mantissa == 0) return;
        multiply_by_limb(limbs, used, factor.mantissa);
        used = divide_up(53 * (i + 1), 64);
        limbs[used] = 0;
        exponent += factor.exponent;
        negative ^= factor.negative;
    }
    add_shifted(sum, limbs, used + 1, exponent, negative);
}

/* sum += or -= a b c: accumulator_add() for the most frequent case. */
static void add_term(struct accumulator *sum, bool subtract, double a, double b, double c)
{
    struct parts p = parts_of(a), q = parts_of(b), r = parts_of(c);
    uint128 pq = (uint128)p.mantissa * q.mantissa;
    if (pq == 0 || r.mantissa == 0) return;
    uint128 low = (uint128)(uint64_t)pq * r.mantissa;
    uint128 high = (pq >> 64) * r.mantissa + (low >> 64);
    uint64_t first = (uint64_t)low, second = (uint64_t)high, third = (uint64_t)(high >> 64);
    unsigned shift = (unsigned)(p.exponent + q.exponent + r.exponent - LOWEST_EXPONENT);
    unsigned place = shift / 64, bits = shift % 64, rest = 63 - bits;
    const uint64_t limbs[4] = {first << bits, second << bits | first >> 1 >> rest,
                               third << bits | second >> 1 >> rest, third >> 1 >> rest};
    add_limbs(sum, limbs, 4, place, subtract ^ p.negative ^ q.negative ^ r.negative);
}

void accumulator_add_dd(struct accumulator *sum, int sign, struct dd a, struct dd b, struct dd c)
{
    add_term(sum, sign < 0, a.high, b.high, c.high);
    if (a.low == 0 && b.low == 0 && c.low == 0) return;
    add_term(sum, sign < 0, a.low, b.high, c.high);
    add_term(sum, sign < 0, a.high, b.low, c.high);
    add_term(sum, sign < 0, a.low, b.low, c.high);
    if (c.low == 0) return;
    add_term(sum, sign < 0, a.high, b.high, c.low);
    add_term(sum, sign < 0, a.low, b.high, c.low);
    add_term(sum, sign < 0, a.high, b.low, c.low);
    add_term(sum, sign < 0, a.low, b.low, c.low);
}

void accumulator_add_triple(struct accumulator *sum, const struct dd3 *p, const struct dd3 *q,
                            const struct dd3 *r)
{
    const struct dd ps[3] = {p->x, p->y, p->z}, qs[3] = {q->x, q->y, q->z};
    const struct dd rs[3] = {r->x, r->y, r->z};
    for (unsigned x = 0; x < 3; x++) {
        unsigned y = (x + 1) % 3, z = (x + 2) % 3;
        accumulator_add_dd(sum, 1, ps[y], qs[z], rs[x]);
        accumulator_add_dd(sum, -1, ps[z], qs[y], rs[x]);
    }
}

int accumulator_sign(const struct accumulator *sum)
{
    if (sum->low == sum->high) return 0;
    if (sum->limb[sum->high - 1] >> 63) return -1;
    for (unsigned i = sum->high; i-- > sum->low;)
        if (sum->limb[i]) return 1;
    return 0;
}

/* Sign and magnitude: an integer of `count` limbs at `place`; its first and last limb are not 0. */
struct magnitude {
    unsigned place, count;
    bool negative;
    uint64_t limb[EXACT_LIMBS];
};

static void magnitude_trim(struct magnitude *it)
{
    while (it->count > 0 && it->limb[it->count - 1] == 0)
        it->count--;
}

static void magnitude_of(struct magnitude *it, const struct accumulator *sum)
{
    unsigned low = sum->low;
    while (low < sum->high && sum->limb[low] == 0)
        low++;
    it->place = low;
    it->count = sum->high - low;
    it->negative = it->count > 0 && sum->limb[sum->high - 1] >> 63;
    /* To negate, the lowest nonzero limb is negated and those above are complemented. */
    uint64_t flip = it->negative ? UINT64_MAX : 0;
    for (unsigned i = 0; i < it->count; i++)
        it->limb[i] = (sum->limb[low + i] ^ flip) + (it->negative && i == 0);
    magnitude_trim(it);
}

/* a *= b */
static void magnitude_multiply(struct magnitude *a, const struct magnitude *b)
{
    uint64_t product[EXACT_LIMBS];
    unsigned count = a->count + b->count;
    memset(product, 0, count * sizeof *product);
    for (unsigned i = 0; i < a->count; i++) {
        uint64_t carry = 0;
        for (unsigned j = 0; j < b->count; j++) {
            uint128 wide = (uint128)a->limb[i] * b->limb[j] + product[i + j] + carry;
            product[i + j] = (uint64_t)wide;
            carry = (uint64_t)(wide >> 64);
        }
        product[i + b->count] = carry;
    }
    memcpy(a->limb, product, count * sizeof *product);
    a->count = count;
    a->place += b->place - EXACT_LIMBS_BELOW;
    a->negative ^= b->negative;
    magnitude_trim(a);
}

void accumulator_add_product(struct accumulator *sum, const struct accumulator *p,
                             const struct accumulator *q, const struct accumulator *r,
                             bool subtract)
{
    struct magnitude product, factor;
    magnitude_of(&product, p);
    const struct accumulator *factors[2] = {q, r};
    for (unsigned i = 0; i < 2 && product.count > 0; i++) {
        if (!factors[i]) continue;
        if (i == 0 || r != q) magnitude_of(&factor, factors[i]);
        magnitude_multiply(&product, &factor);
    }
    if (product.count == 0) return;
    add_limbs(sum, product.limb, product.count, product.place, subtract != product.negative);
}

/*
 * An integer of limbs, lowest first, the last one not 0, as a number from 1 to 2 times 2^*exponent. Bits
 * after the first 106 are dropped: 2^-105 of the value.
 */
static struct dd limbs_round(const uint64_t *limbs, unsigned count, int *exponent)
{
    uint64_t top[3] = {0};
    for (unsigned i = 0; i < 3 && i < count; i++)
        top[i] = limbs[count - 1 - i];
    unsigned bits = (unsigned)__builtin_clzll(top[0]);
    if (bits > 0) {
        top[0] = top[0] << bits | top[1] >> (64 - bits);
        top[1] = top[1] << bits | top[2] >> (64 - bits);
    }
    *exponent = 64 * (int)count - 1 - (int)bits;
    double high = (double)(top[0] >> 11) * 0x1p-52;
    double low = (double)((top[0] & 0x7ff) << 42 | top[1] >> 22) * 0x1p-105;
    return sum_of_ordered(high, low);
}

struct dd accumulator_round(const struct accumulator *sum, int *exponent)
{
    struct magnitude size;
    magnitude_of(&size, sum);
    *exponent = 0;
    if (size.count == 0) return dd(0);
    struct dd value = limbs_round(size.limb, size.count, exponent);
    *exponent += 64 * (int)size.place + LOWEST_EXPONENT;
    return size.negative ? dd_negate(value) : value;
}

double accumulator_value(const struct accumulator *sum, int *exponent)
{
    return accumulator_round(sum, exponent).high;
}

static struct dd accumulated_dot(const struct dd3 *a, const struct dd3 *b, int *exponent)
{
    struct accumulator sum;
    accumulator_clear(&sum);
    accumulator_add_dd(&sum, 1, a->x, b->x, dd(1));
    accumulator_add_dd(&sum, 1, a->y, b->y, dd(1));
    accumulator_add_dd(&sum, 1, a->z, b->z, dd(1));
    return accumulator_round(&sum, exponent);
}

struct dd exact_dot3(struct dd3 a, struct dd3 b, int *exponent)
{
    bool sure = true;
    struct dd dot = plain_dot3(a, b, &sure);
    *exponent = 0;
    return sure ? dot : accumulated_dot(&a, &b, exponent);
}

/* Converts value to an integer multiple of 1 / scale, a power of two; false if it is none or the integer is
 * 2^62 or more. */
static inline bool integer_of(double value, double scale, double inverse, int64_t *integer)
{
    *integer = (int64_t)(value * scale);
    return (double)*integer * inverse == value; /* also false after an underflow */
}

bool exact_integers(const struct dd3 *v, struct integers *integers)
{
    double largest = vec_largest(dd3_round(*v));
    if (!(largest > 0x1p-900 && largest < 0x1p900)) return false;
    int exponent = parts_of(largest).exponent + 53 - 61; /* largest < 2^(exponent + 61) */
    double scale = power_of_two(-exponent), inverse = power_of_two(exponent);
    const struct dd *parts[3] = {&v->x, &v->y, &v->z};
    integers->exponent = exponent;
    for (unsigned i = 0; i < 3; i++) {
        int64_t low;
        if (!integer_of(parts[i]->high, scale, inverse, &integers->at[i])) return false;
        if (!integer_of(parts[i]->low, scale, inverse, &low)) return false;
        integers->at[i] += low;
    }
    return true;
}

/* Ranges: a component of p x q is less than 2^124; its lower half times d, added three times, is less than
 * 2^127. */
struct dd integers_triple(const struct integers *p, const struct integers *q,
                          const struct integers *d, int *exponent)
{
    int128 low = 0, high = 0;
    for (unsigned x = 0; x < 3; x++) {
        unsigned y = (x + 1) % 3, z = (x + 2) % 3;
        int128 cross = (int128)p->at[y] * q->at[z] - (int128)p->at[z] * q->at[y];
        low += (int128)(uint64_t)cross * d->at[x];
        high += (cross >> 64) * d->at[x];
    }
    high += low >> 64;
    bool negative = high < 0;
    uint64_t limbs[3] = {(uint64_t)low, (uint64_t)high, (uint64_t)(high >> 64)};
    *exponent = 0;
    if ((limbs[0] | limbs[1] | limbs[2]) == 0) return dd(0);
    uint64_t flip = negative ? UINT64_MAX : 0, carry = negative;
    for (unsigned i = 0; i < 3; i++) {
        limbs[i] = (limbs[i] ^ flip) + carry;
        carry = carry && limbs[i] == 0;
    }
    unsigned count = limbs[2] ? 3 : limbs[1] ? 2 : 1;
    struct dd value = limbs_round(limbs, count, exponent);
    *exponent += p->exponent + q->exponent + d->exponent;
    return negative ? dd_negate(value) : value;
}

struct dd exact_triple(const struct dd3 *p, const struct dd3 *q, struct vec3 d, int *exponent)
{
    struct accumulator sum;
    const struct dd3 r = dd3_of(d);
    accumulator_clear(&sum);
    accumulator_add_triple(&sum, p, q, &r);
    return accumulator_round(&sum, exponent);
}
