/*
 * Arithmetic with known errors, based on the fused multiply-add: sums and products with their rounding
 * errors, double-double numbers, and sums of products with an exact sign.
 */
#ifndef FARM_WORKER_EXACT_H
#define FARM_WORKER_EXACT_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "common/vec.h"

/* For functions that call many small ones: all calls are inlined, which compilers would not do by themselves. */
#define FLATTENED __attribute__((flatten))

/* 2^-53, half the spacing of doubles in [1, 2): the relative error of one rounded operation. */
#define UNIT_ROUNDOFF 0x1p-53

/*
 * a b - c d with a relative error of at most 2 u (W. Kahan; Jeannerod, Louvet and Muller, "Further analysis
 * of Kahan's algorithm for the accurate computation of 2x2 determinants", Math. Comp. 82, 2013), barring
 * underflow and overflow. The sign is exact, and the result is 0 only if the exact value is.
 */
static inline double difference_of_products(double a, double b, double c, double d)
{
    double cd = c * d;
    double error = fma(-c, d, cd);
    return fma(a, b, -cd) + error;
}

/*
 * A double-double: high + low with |low| <= u |high|, some 106 bits. The operations below are those of M.
 * Joldes, J.-M. Muller and V. Popescu, "Tight and rigorous error bounds for basic building blocks of
 * double-word arithmetic", ACM TOMS 44(2), 2017, and the root is that of V. Lefevre, N. Louvet, J.-M. Muller,
 * J. Picot and L. Rideau, "Accurate calculation of Euclidean norms using double-word arithmetic", ACM TOMS
 * 49(1), 2023. The relative error of each is at most DD_ROUNDOFF times the factor in its comment, as long as
 * no product of two high parts leaves [2^-900, 2^1000]. J.-M. Muller and L. Rideau, "Formalization of
 * double-word arithmetic, and comments on [the first]", ACM TOMS 48(1), 2022, prove 4 for products and 10 for
 * quotients; nothing here relies on these.
 */
struct dd {
    double high, low;
};

#define DD_ROUNDOFF 0x1p-106

static inline struct dd dd(double a)
{
    return (struct dd){a, 0};
}

/* a + b without error if |a| >= |b| or a = 0 (Dekker's Fast2Sum). */
static inline struct dd sum_of_ordered(double a, double b)
{
    double high = a + b;
    return (struct dd){high, b - (high - a)};
}

/* a + b without error (Knuth's TwoSum). */
static inline struct dd exact_sum(double a, double b)
{
    double high = a + b;
    double part = high - a;
    return (struct dd){high, (a - (high - part)) + (b - part)};
}

static inline struct dd exact_difference(double a, double b)
{
    return exact_sum(a, -b);
}

static inline struct dd exact_product(double a, double b)
{
    double high = a * b;
    return (struct dd){high, fma(a, b, -high)};
}

static inline struct dd dd_negate(struct dd a)
{
    return (struct dd){-a.high, -a.low};
}

/* Error factor 3 (1 + 2^-50). */
static inline struct dd dd_add(struct dd a, struct dd b)
{
    struct dd high = exact_sum(a.high, b.high);
    struct dd low = exact_sum(a.low, b.low);
    struct dd sum = sum_of_ordered(high.high, high.low + low.high);
    return sum_of_ordered(sum.high, low.low + sum.low);
}

static inline struct dd dd_sub(struct dd a, struct dd b)
{
    return dd_add(a, dd_negate(b));
}

/* Error factor 5. */
static inline struct dd dd_mul(struct dd a, struct dd b)
{
    struct dd product = exact_product(a.high, b.high);
    double cross = fma(a.low, b.high, a.low * b.low);
    return sum_of_ordered(product.high, product.low + fma(a.high, b.low, cross));
}

/* Error factor 2. */
static inline struct dd dd_scale(struct dd a, double b)
{
    struct dd product = exact_product(a.high, b);
    return sum_of_ordered(product.high, fma(a.low, b, product.low));
}

/*
 * Error factor 15, also with dd_scale() for the product: that contributes 2, the difference of the low parts
 * 2; the rest is 3 u of a, and its rounding contributes 3, its division 3, and dividing by b.high alone 3.
 */
static inline struct dd dd_div(struct dd a, struct dd b)
{
    double quotient = a.high / b.high;
    struct dd part = dd_scale(b, quotient);
    double rest = (a.high - part.high) + (a.low - part.low);
    return sum_of_ordered(quotient, rest / b.high);
}

/* Error factor 25/8; NaN for values that are not positive. */
static inline struct dd dd_root(struct dd a)
{
    double root = sqrt(a.high), rest = fma(-root, root, a.high) + a.low;
    return sum_of_ordered(root, rest / (2 * root));
}

/* The same, but 0 for values that are not positive. */
static inline struct dd dd_sqrt(struct dd a)
{
    return a.high > 0 ? dd_root(a) : dd(0);
}

/*
 * f + t d, accurate even if the terms cancel. It is the sum of four doubles, without error except in its low
 * part, which is rounded twice, for numbers of u and 2 u of the sum. Error factor 3; the largest that has
 * been observed is some 1.4.
 */
static inline struct dd dd_advance(struct dd f, double t, double d)
{
    struct dd step = exact_product(t, d);
    struct dd high = exact_sum(f.high, step.high), low = exact_sum(f.low, step.low);
    struct dd sum = exact_sum(high.high, low.high);
    return sum_of_ordered(sum.high, sum.low + (high.low + low.low));
}

/* a 2^exponent, for any exponent: ldexp() of both parts. */
static inline struct dd dd_ldexp(struct dd a, int exponent)
{
    return (struct dd){ldexp(a.high, exponent), ldexp(a.low, exponent)};
}

/* 2^exponent, -1022 <= exponent <= 1023. */
static inline double power_of_two(int exponent)
{
    uint64_t bits = (uint64_t)(exponent + 1023) << 52;
    double power;
    memcpy(&power, &bits, sizeof power);
    return power;
}

/* A vector of double-doubles. */
struct dd3 {
    struct dd x, y, z;
};

/* a - b without error. */
static inline struct dd3 exact_difference3(struct vec3 a, struct vec3 b)
{
    return (struct dd3){exact_difference(a.x, b.x), exact_difference(a.y, b.y),
                        exact_difference(a.z, b.z)};
}

static inline struct dd3 dd3_of(struct vec3 a)
{
    return (struct dd3){dd(a.x), dd(a.y), dd(a.z)};
}

static inline struct dd dd3_component(const struct dd3 *a, unsigned i)
{
    return i == 0 ? a->x : i == 1 ? a->y : a->z;
}

/* a 2^exponent */
static inline struct dd3 dd3_ldexp(struct dd3 a, int exponent)
{
    return (struct dd3){dd_ldexp(a.x, exponent), dd_ldexp(a.y, exponent), dd_ldexp(a.z, exponent)};
}

/* The high parts, that is the vector rounded to double. */
static inline struct vec3 dd3_round(struct dd3 a)
{
    return vec3(a.x.high, a.y.high, a.z.high);
}

static inline struct dd3 dd3_add(struct dd3 a, struct dd3 b)
{
    return (struct dd3){dd_add(a.x, b.x), dd_add(a.y, b.y), dd_add(a.z, b.z)};
}

static inline struct dd3 dd3_sub(struct dd3 a, struct dd3 b)
{
    return (struct dd3){dd_sub(a.x, b.x), dd_sub(a.y, b.y), dd_sub(a.z, b.z)};
}

/* a s */
static inline struct dd3 dd3_scale(struct vec3 a, struct dd s)
{
    return (struct dd3){dd_scale(s, a.x), dd_scale(s, a.y), dd_scale(s, a.z)};
}

static inline struct dd3 dd3_multiply(struct dd3 a, struct dd s)
{
    return (struct dd3){dd_mul(a.x, s), dd_mul(a.y, s), dd_mul(a.z, s)};
}

static inline struct dd dd3_dot(struct dd3 a, struct dd3 b)
{
    return dd_add(dd_add(dd_mul(a.x, b.x), dd_mul(a.y, b.y)), dd_mul(a.z, b.z));
}

/* The same with a vector of doubles. */
static inline struct dd dd3_dot_vec(struct dd3 a, struct vec3 b)
{
    return dd_add(dd_add(dd_scale(a.x, b.x), dd_scale(a.y, b.y)), dd_scale(a.z, b.z));
}

/* a . b, each product without error. */
static inline struct dd exact_dot(struct vec3 a, struct vec3 b)
{
    return dd_add(dd_add(exact_product(a.x, b.x), exact_product(a.y, b.y)),
                  exact_product(a.z, b.z));
}

static inline struct dd3 dd3_cross(struct dd3 a, struct dd3 b)
{
    return (struct dd3){dd_sub(dd_mul(a.y, b.z), dd_mul(a.z, b.y)),
                        dd_sub(dd_mul(a.z, b.x), dd_mul(a.x, b.z)),
                        dd_sub(dd_mul(a.x, b.y), dd_mul(a.y, b.x))};
}

/* |x| + |y| + |z|, an upper bound on the length. */
static inline double sum_of_sizes(struct vec3 v)
{
    return fabs(v.x) + fabs(v.y) + fabs(v.z);
}

static inline double dd3_size(struct dd3 a)
{
    return sum_of_sizes(dd3_round(a));
}

/*
 * An accumulator for sums of products of up to EXACT_FACTORS doubles each, without rounding, underflow or
 * overflow: a fixed-point number wide enough for all of them (U. Kulisch's long accumulator). It is for the
 * few predicates that double-double cannot decide. Only the limbs between the lowest and the highest bit of
 * what has been added are stored, so that numbers of similar magnitude cost little: some 15 ns per product of
 * three.
 */
#define EXACT_FACTORS 8

/*
 * A product of n doubles is a multiple of 2^(-1074 n) and less than 2^(1024 n). The lowest limb may have up
 * to 63 more bits below, in each of up to three numbers that are multiplied: EXACT_LIMBS_BELOW limbs hold the
 * bits below 1. Above, there is one limb as a guard, and one for the few bits by which a sum exceeds its
 * terms.
 */
#define EXACT_LIMBS_BELOW ((1074 * EXACT_FACTORS + 3 * 63 + 63) / 64)
#define EXACT_LIMBS       (EXACT_LIMBS_BELOW + 1024 * EXACT_FACTORS / 64 + 3)

/* Limbs below the window [low, high) are 0; those above are copies of its sign bit. */
struct accumulator {
    unsigned low, high;
    uint64_t limb[EXACT_LIMBS]; /* two's complement, lowest first; defined only within the window */
};

static inline void accumulator_clear(struct accumulator *sum)
{
    sum->low = sum->high = 0;
}

/* sum += factors[0] * ... * factors[count - 1], or -= if subtract. The factors must be finite. */
void accumulator_add(struct accumulator *sum, const double *factors, unsigned count, bool subtract);

/* sum += sign a b c, sign = 1 or -1. */
void accumulator_add_dd(struct accumulator *sum, int sign, struct dd a, struct dd b, struct dd c);

/* sum += (p x q).r */
void accumulator_add_triple(struct accumulator *sum, const struct dd3 *p, const struct dd3 *q,
                            const struct dd3 *r);

/*
 * sum += or -= the product of up to three others (NULL: 1). Each is a sum of products of at least one double,
 * with at most EXACT_FACTORS in all.
 */
void accumulator_add_product(struct accumulator *sum, const struct accumulator *p,
                             const struct accumulator *q, const struct accumulator *r,
                             bool subtract);

/* The sign: -1, 0 or 1. */
int accumulator_sign(const struct accumulator *sum);

/* The value with a relative error of 2^-105, as a number v times 2^*exponent; v is 0 or 1 <= |v| <= 2. */
struct dd accumulator_round(const struct accumulator *sum, int *exponent);

/* The same, rounded to double. */
double accumulator_value(const struct accumulator *sum, int *exponent);

/*
 * a . b in double-double. Clears *sure if more than 44 bits cancel, or if the sizes are not in range: the
 * error of dd3_dot() is 20 u^2 of the sizes, and below 2^-400 its low parts underflow.
 */
static inline struct dd plain_dot3(struct dd3 a, struct dd3 b, bool *sure)
{
    struct dd dot = dd3_dot(a, b);
    double size = fabs(a.x.high * b.x.high) + fabs(a.y.high * b.y.high) + fabs(a.z.high * b.z.high);
    *sure &= (fabs(dot.high) > 0x1p-44 * size) & (size > 0x1p-400) & (size < 0x1p400);
    return dot;
}

/*
 * a . b with a relative error of 2^-57 and an exact sign, whatever cancels: a number whose square is in
 * range, times 2^*exponent. Double-double suffices unless more than 44 bits cancel.
 */
struct dd exact_dot3(struct dd3 a, struct dd3 b, int *exponent);

/* d . (p x q), rounded only once, to double-double: a number as from accumulator_round(), times 2^*exponent. */
struct dd exact_triple(const struct dd3 *p, const struct dd3 *q, struct vec3 d, int *exponent);

/* A vector whose components are integers times 2^exponent. */
struct integers {
    int64_t at[3]; /* magnitude less than 2^61 + 2^8 */
    int exponent;
};

/*
 * Converts a vector; false if its components do not fit, that is if the lowest bit of one is less than 2^-61
 * of the largest. Components of similar magnitude fit, and so do differences of two such vectors.
 */
bool exact_integers(const struct dd3 *v, struct integers *integers);

/* exact_triple() of such vectors, in 192-bit integers: ten times as fast. */
struct dd integers_triple(const struct integers *p, const struct integers *q,
                          const struct integers *d, int *exponent);

#endif
