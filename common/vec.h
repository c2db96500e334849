/* Three-component vectors of double: points, directions, colours (linear RGB). */
#ifndef FARM_COMMON_VEC_H
#define FARM_COMMON_VEC_H

#include <math.h>

#include "common/extremes.h"

struct vec3 {
    double x, y, z;
};

static inline struct vec3 vec3(double x, double y, double z)
{
    return (struct vec3){x, y, z};
}

static inline struct vec3 vec_add(struct vec3 a, struct vec3 b)
{
    return vec3(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline struct vec3 vec_sub(struct vec3 a, struct vec3 b)
{
    return vec3(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline struct vec3 vec_scale(struct vec3 a, double s)
{
    return vec3(a.x * s, a.y * s, a.z * s);
}

/* Component-wise product: light of colour a after a filter of colour b. */
static inline struct vec3 vec_mul(struct vec3 a, struct vec3 b)
{
    return vec3(a.x * b.x, a.y * b.y, a.z * b.z);
}

/* a + b s */
static inline struct vec3 vec_add_scaled(struct vec3 a, struct vec3 b, double s)
{
    return vec3(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}

static inline struct vec3 vec_neg(struct vec3 a)
{
    return vec3(-a.x, -a.y, -a.z);
}

static inline double vec_dot(struct vec3 a, struct vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct vec3 vec_cross(struct vec3 a, struct vec3 b)
{
    return vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

/* Like fmax(), the other argument if one is NaN, but not a library call. */
static inline double max_number(double a, double b)
{
    return a > b || isnan(b) ? a : b;
}

static inline double vec_max(struct vec3 a)
{
    return max_number(a.x, max_number(a.y, a.z));
}

/* The largest absolute value of a component; the vector must be finite. */
static inline double vec_largest(struct vec3 a)
{
    return larger_number(fabs(a.x), larger_number(fabs(a.y), fabs(a.z)));
}

/* The exponent e with 2^(e - 1) <= largest component < 2^e; 0 for the zero vector. */
static inline int vec_exponent(struct vec3 a)
{
    int exponent;
    (void)frexp(vec_largest(a), &exponent);
    return exponent;
}

/* a 2^exponent, exact unless the result is subnormal or overflows. */
static inline struct vec3 vec_scale_exactly(struct vec3 a, int exponent)
{
    return vec3(ldexp(a.x, exponent), ldexp(a.y, exponent), ldexp(a.z, exponent));
}

/*
 * |a| without intermediate overflow or underflow, for any finite a. Where the squares would leave the range
 * of double, the components are scaled by a power of two first. That scaling is exact, so a scene scaled by
 * 2^k gives the length scaled by 2^k, bit for bit, on either path.
 */
static inline double vec_length(struct vec3 a)
{
    double square = vec_dot(a, a);
    /* Above 2^-900 the squares that matter are normal numbers with full precision. */
    if (square > 0x1p-900 && square < 0x1p1000) return sqrt(square);
    double largest = vec_largest(a);
    if (!(largest > 0) || isinf(largest)) return largest;
    int exponent = vec_exponent(a);
    struct vec3 s = vec_scale_exactly(a, -exponent);
    return ldexp(sqrt(vec_dot(s, s)), exponent);
}

/*
 * a / |a| for any finite a but zero. Near the ends of the range of double, |a| may be infinite, or subnormal
 * with few significant bits; there the vector is scaled before it is divided.
 */
static inline struct vec3 vec_normalize(struct vec3 a)
{
    double square = vec_dot(a, a);
    if (!(square > 0x1p-900 && square < 0x1p1000)) {
        a = vec_scale_exactly(a, -vec_exponent(a));
        square = vec_dot(a, a);
    }
    double length = sqrt(square);
    return vec3(a.x / length, a.y / length, a.z / length);
}

static inline int vec_is_finite(struct vec3 a)
{
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

static inline int vec_is_same(struct vec3 a, struct vec3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

static inline int vec_is_zero(struct vec3 a)
{
    return a.x == 0 && a.y == 0 && a.z == 0;
}

_Static_assert(sizeof(struct vec3) == 3 * sizeof(double), "vec_component() steps over doubles");

/* x, y or z for axis 0, 1 or 2. */
static inline double vec_component(const struct vec3 *v, unsigned axis)
{
    return *(const double *)(const void *)((const char *)v + axis * sizeof(double));
}

#endif
