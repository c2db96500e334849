#include "worker/exact.h"

#include <string.h>

/* The place of the accumulator's lowest bit. */
#define LOWEST_EXPONENT (-1074 * EXACT_FACTORS)

/* Mantissas of 53 bits: the product of EXACT_FACTORS of them, and a limb to shift into. */
#define PRODUCT_LIMBS ((53 * EXACT_FACTORS + 63) / 64 + 1)

/* An integer times 2^exponent. */
struct product {
    uint64_t limb[PRODUCT_LIMBS];
    unsigned limbs;
    int exponent;
    bool negative;
};

void accumulator_clear(struct accumulator *sum)
{
    memset(sum, 0, sizeof *sum);
}

static void product_multiply(struct product *product, double factor)
{
    int exponent;
    double mantissa = frexp(fabs(factor), &exponent);
    uint64_t integer = (uint64_t)ldexp(mantissa, 53);
    uint64_t carry = 0;
    for (unsigned i = 0; i < product->limbs; i++) {
        __extension__ unsigned __int128 wide =
            (unsigned __int128)product->limb[i] * integer + carry;
        product->limb[i] = (uint64_t)wide;
        carry = (uint64_t)(wide >> 64);
    }
    if (carry) product->limb[product->limbs++] = carry;
    product->exponent += exponent - 53;
    product->negative ^= signbit(factor) != 0;
}

/* Limb i of the product shifted left by `bits` < 64. */
static uint64_t shifted_limb(const struct product *product, unsigned i, unsigned bits)
{
    uint64_t here = i < product->limbs ? product->limb[i] << bits : 0;
    uint64_t below = i > 0 && bits > 0 ? product->limb[i - 1] >> (64 - bits) : 0;
    return here | below;
}

/*
 * A mantissa's low zeros may lie below the lowest bit: a denormal 2^-1074 is 2^52 2^-1126. Only
 * zeros are there, the product itself being a multiple of 2^LOWEST_EXPONENT.
 */
static void product_drop_zeros(struct product *product)
{
    while (product->exponent < LOWEST_EXPONENT) {
        unsigned bits = (unsigned)(LOWEST_EXPONENT - product->exponent);
        if (bits >= 64) {
            memmove(product->limb, product->limb + 1,
                    (product->limbs - 1) * sizeof product->limb[0]);
            product->limbs--;
            product->exponent += 64;
            continue;
        }
        for (unsigned i = 0; i < product->limbs; i++) {
            uint64_t above = i + 1 < product->limbs ? product->limb[i + 1] << (64 - bits) : 0;
            product->limb[i] = product->limb[i] >> bits | above;
        }
        product->exponent = LOWEST_EXPONENT;
    }
}

static void add_limbs(struct accumulator *sum, const struct product *product, unsigned place,
                      unsigned bits)
{
    uint64_t carry = 0;
    for (unsigned i = place; i < EXACT_LIMBS; i++) {
        if (i - place > product->limbs && carry == 0) break;
        uint64_t limb = i - place <= product->limbs ? shifted_limb(product, i - place, bits) : 0;
        uint64_t before = sum->limb[i], with_carry = before + carry;
        sum->limb[i] = with_carry + limb;
        carry = (with_carry < before) | (sum->limb[i] < limb);
    }
}

static void subtract_limbs(struct accumulator *sum, const struct product *product, unsigned place,
                           unsigned bits)
{
    uint64_t borrow = 0;
    for (unsigned i = place; i < EXACT_LIMBS; i++) {
        if (i - place > product->limbs && borrow == 0) break;
        uint64_t limb = i - place <= product->limbs ? shifted_limb(product, i - place, bits) : 0;
        uint64_t before = sum->limb[i], with_borrow = before - borrow;
        sum->limb[i] = with_borrow - limb;
        borrow = (before < borrow) | (with_borrow < limb);
    }
}

void accumulator_add(struct accumulator *sum, const double *factors, unsigned count, bool subtract)
{
    struct product product = {.limb = {1}, .limbs = 1, .negative = subtract};
    for (unsigned i = 0; i < count; i++) {
        if (factors[i] == 0) return;
        product_multiply(&product, factors[i]);
    }
    product_drop_zeros(&product);
    unsigned shift = (unsigned)(product.exponent - LOWEST_EXPONENT);
    if (product.negative)
        subtract_limbs(sum, &product, shift / 64, shift % 64);
    else
        add_limbs(sum, &product, shift / 64, shift % 64);
}

int accumulator_sign(const struct accumulator *sum)
{
    if (sum->limb[EXACT_LIMBS - 1] >> 63) return -1;
    for (unsigned i = 0; i < EXACT_LIMBS; i++)
        if (sum->limb[i]) return 1;
    return 0;
}

struct dd accumulator_round(const struct accumulator *sum, int *exponent)
{
    struct accumulator size = *sum;
    int sign = accumulator_sign(sum);
    *exponent = 0;
    if (sign == 0) return dd(0);
    uint64_t carry = 1;
    for (unsigned i = 0; sign < 0 && i < EXACT_LIMBS; i++) {
        size.limb[i] = ~size.limb[i] + carry;
        carry = carry && size.limb[i] == 0;
    }
    unsigned top = EXACT_LIMBS - 1;
    while (size.limb[top] == 0)
        top--;
    /* Halves of limbs are doubles; those of three limbs hold at least 129 bits. */
    struct dd value = dd(0);
    for (unsigned i = top < 2 ? 0 : top - 2; i <= top; i++) {
        int place = 64 * ((int)i - (int)top);
        value = dd_add(value, dd(ldexp((double)(size.limb[i] & UINT32_MAX), place)));
        value = dd_add(value, dd(ldexp((double)(size.limb[i] >> 32), place + 32)));
    }
    *exponent = 64 * (int)top + LOWEST_EXPONENT;
    return sign < 0 ? dd_negate(value) : value;
}

double accumulator_value(const struct accumulator *sum, int *exponent)
{
    return accumulator_round(sum, exponent).high;
}

static void add_term(struct polynomial *p, double a, double b, double c)
{
    if (a == 0 || b == 0 || c == 0) return;
    double *factor = p->factor[p->terms++];
    factor[0] = a;
    factor[1] = b;
    factor[2] = c;
}

void polynomial_add(struct polynomial *p, int sign, struct dd a, struct dd b, struct dd c)
{
    const double as[2] = {sign * a.high, sign * a.low};
    const double bs[2] = {p->degree > 1 ? b.high : 1, p->degree > 1 ? b.low : 0};
    const double cs[2] = {p->degree > 2 ? c.high : 1, p->degree > 2 ? c.low : 0};
    for (unsigned i = 0; i < 8; i++)
        add_term(p, as[i & 1], bs[i >> 1 & 1], cs[i >> 2]);
}

void accumulator_add_product(struct accumulator *sum, const struct polynomial *p,
                             const struct polynomial *q, const struct polynomial *r, bool subtract)
{
    static const struct polynomial one = {.terms = 1};
    if (!q) q = &one;
    if (!r) r = &one;
    double factor[EXACT_FACTORS];
    unsigned count = p->degree + q->degree + r->degree;
    for (unsigned i = 0; i < p->terms; i++) {
        memcpy(factor, p->factor[i], p->degree * sizeof *factor);
        for (unsigned j = 0; j < q->terms; j++) {
            memcpy(factor + p->degree, q->factor[j], q->degree * sizeof *factor);
            for (unsigned k = 0; k < r->terms; k++) {
                memcpy(factor + p->degree + q->degree, r->factor[k], r->degree * sizeof *factor);
                accumulator_add(sum, factor, count, subtract);
            }
        }
    }
}

static struct dd accumulated_dot(const struct dd3 *a, const struct dd3 *b, int *exponent)
{
    struct accumulator sum;
    struct polynomial dot = {.degree = 2};
    accumulator_clear(&sum);
    polynomial_add(&dot, 1, a->x, b->x, dd(1));
    polynomial_add(&dot, 1, a->y, b->y, dd(1));
    polynomial_add(&dot, 1, a->z, b->z, dd(1));
    accumulator_add_product(&sum, &dot, NULL, NULL, false);
    return accumulator_round(&sum, exponent);
}

struct dd exact_dot3(struct dd3 a, struct dd3 b, int *exponent)
{
    struct dd dot = dd3_dot(a, b);
    double size = fabs(a.x.high * b.x.high) + fabs(a.y.high * b.y.high) + fabs(a.z.high * b.z.high);
    *exponent = 0;
    /* 20 u^2 of the size is the error of dd3_dot(); below 2^-400 its small parts underflow. */
    if (fabs(dot.high) > 0x1p-44 * size && size > 0x1p-400 && size < 0x1p400) return dot;
    return accumulated_dot(&a, &b, exponent);
}
