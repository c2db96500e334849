/*
 * Four doubles at once: one register of AVX2, or a loop. Like worker/lanes.h, for points of three coordinates and for
 * half of a row of lanes.
 */
#ifndef FARM_WORKER_QUAD_H
#define FARM_WORKER_QUAD_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "worker/inlined.h"
#include "worker/wide.h"

#define QUAD 4

/*
 * Functions whose names do not say all. An order is a permutation of three components.
 *
 * quad_sub_mul()    a - b c, rounded once or twice
 * quad_point()      the three components of a point in the given order, then 0
 * quad_floats()     the first three of four floats in the given order, then the fourth
 * quad_transpose()  for four points of three doubles, in the given order: their first components, their second ones,
 *                   their third ones; reads nothing beyond the three doubles
 * quad_of_rows()    for four rows of four doubles: their first elements, their second ones, ...
 * quad_same()       the set of lanes in which both have the same bits
 */

#if defined(__AVX2__) && defined(__FMA__)

#include <immintrin.h>

struct quad {
    __m256d v;
};

REGISTER_2(quad, quad_sub, _mm256_sub_pd)
REGISTER_2(quad, quad_mul, _mm256_mul_pd)

static inline struct quad quad_row(double a, double b, double c, double d)
{
    return (struct quad){_mm256_setr_pd(a, b, c, d)};
}

static inline void quad_store(double *to, struct quad a)
{
    _mm256_storeu_pd(to, a.v);
}

static inline struct quad quad_sub_mul(struct quad a, struct quad b, struct quad c)
{
    return (struct quad){_mm256_fnmadd_pd(b.v, c.v, a.v)};
}

static inline struct quad quad_third(struct quad a)
{
    return (struct quad){_mm256_permute4x64_pd(a.v, 0xaa)};
}

static inline struct quad quad_fourth(struct quad a)
{
    return (struct quad){_mm256_permute4x64_pd(a.v, 0xff)};
}

static inline struct quad quad_abs(struct quad a)
{
    return (struct quad){_mm256_andnot_pd(_mm256_set1_pd(-0.0), a.v)};
}

static inline lane_set quad_less(struct quad a, struct quad b)
{
    return (lane_set)_mm256_movemask_pd(_mm256_cmp_pd(a.v, b.v, _CMP_LT_OQ));
}

static inline lane_set quad_same(const double *a, const double *b)
{
    __m256i four = _mm256_castpd_si256(_mm256_loadu_pd(a));
    __m256i same = _mm256_cmpeq_epi64(four, _mm256_castpd_si256(_mm256_loadu_pd(b)));
    return (lane_set)_mm256_movemask_pd(_mm256_castsi256_pd(same));
}

static INLINED void quad_of_rows(const double *const at[QUAD], struct quad out[4])
{
    __m256d p0 = _mm256_loadu_pd(at[0]), p1 = _mm256_loadu_pd(at[1]);
    __m256d p2 = _mm256_loadu_pd(at[2]), p3 = _mm256_loadu_pd(at[3]);
    __m256d xz01 = _mm256_unpacklo_pd(p0, p1), xz23 = _mm256_unpacklo_pd(p2, p3);
    __m256d yw01 = _mm256_unpackhi_pd(p0, p1), yw23 = _mm256_unpackhi_pd(p2, p3);
    out[0].v = _mm256_permute2f128_pd(xz01, xz23, 0x20);
    out[1].v = _mm256_permute2f128_pd(yw01, yw23, 0x20);
    out[2].v = _mm256_permute2f128_pd(xz01, xz23, 0x31);
    out[3].v = _mm256_permute2f128_pd(yw01, yw23, 0x31);
}

struct quad_order {
    __m256i floats; /* a double is two of them */
};

static inline struct quad_order quad_order(unsigned first, unsigned second, unsigned third)
{
    __m256i doubles = _mm256_setr_epi64x(first, second, third, 3);
    doubles = _mm256_add_epi64(doubles, doubles);
    __m256i both = _mm256_or_si256(doubles, _mm256_slli_epi64(doubles, 32));
    return (struct quad_order){_mm256_add_epi32(both, _mm256_set1_epi64x(INT64_C(1) << 32))};
}

static inline __m256d in_order(__m256d p, const struct quad_order *order)
{
    return _mm256_castps_pd(_mm256_permutevar8x32_ps(_mm256_castpd_ps(p), order->floats));
}

static inline __m256d point_in_order(const double *at, const struct quad_order *order)
{
    return in_order(_mm256_maskload_pd(at, _mm256_setr_epi64x(-1, -1, -1, 0)), order);
}

static inline struct quad quad_point(const double *at, const struct quad_order *order)
{
    return (struct quad){point_in_order(at, order)};
}

static inline struct quad quad_floats(const float *at, const struct quad_order *order)
{
    return (struct quad){in_order(_mm256_cvtps_pd(_mm_loadu_ps(at)), order)};
}

static INLINED void quad_transpose(const double *const at[QUAD], const struct quad_order *order,
                                   struct quad out[3])
{
    __m256d p0 = point_in_order(at[0], order), p1 = point_in_order(at[1], order);
    __m256d p2 = point_in_order(at[2], order), p3 = point_in_order(at[3], order);
    __m256d xz01 = _mm256_unpacklo_pd(p0, p1), xz23 = _mm256_unpacklo_pd(p2, p3);
    __m256d y01 = _mm256_unpackhi_pd(p0, p1), y23 = _mm256_unpackhi_pd(p2, p3);
    out[0].v = _mm256_permute2f128_pd(xz01, xz23, 0x20);
    out[1].v = _mm256_permute2f128_pd(y01, y23, 0x20);
    out[2].v = _mm256_permute2f128_pd(xz01, xz23, 0x31);
}

#else

struct quad {
    double at[QUAD];
};

LOOP_1(quad, quad_abs, fabs)
LOOP_2(quad, quad_sub, a.at[i] - b.at[i])
LOOP_2(quad, quad_mul, a.at[i] * b.at[i])
LOOP_COMPARE(quad, quad_less, <)

static inline struct quad quad_row(double a, double b, double c, double d)
{
    return (struct quad){{a, b, c, d}};
}

static inline struct quad quad_of(double a)
{
    return quad_row(a, a, a, a);
}

static inline void quad_store(double *to, struct quad a)
{
    for (unsigned i = 0; i < QUAD; i++)
        to[i] = a.at[i];
}

static inline struct quad quad_sub_mul(struct quad a, struct quad b, struct quad c)
{
    return quad_sub(a, quad_mul(b, c));
}

static inline struct quad quad_third(struct quad a)
{
    return quad_of(a.at[2]);
}

static inline struct quad quad_fourth(struct quad a)
{
    return quad_of(a.at[3]);
}

static inline lane_set quad_same(const double *a, const double *b)
{
    uint64_t left[QUAD], right[QUAD];
    lane_set set = 0;
    memcpy(left, a, sizeof left);
    memcpy(right, b, sizeof right);
    for (unsigned i = 0; i < QUAD; i++)
        set |= (lane_set)(left[i] == right[i]) << i;
    return set;
}

static inline void quad_of_rows(const double *const at[QUAD], struct quad out[4])
{
    for (unsigned i = 0; i < QUAD; i++)
        for (unsigned k = 0; k < 4; k++)
            out[k].at[i] = at[i][k];
}

struct quad_order {
    unsigned axis[3];
};

static inline struct quad_order quad_order(unsigned first, unsigned second, unsigned third)
{
    return (struct quad_order){{first, second, third}};
}

static inline struct quad quad_point(const double *at, const struct quad_order *order)
{
    const unsigned *axis = order->axis;
    return quad_row(at[axis[0]], at[axis[1]], at[axis[2]], 0);
}

static inline struct quad quad_floats(const float *at, const struct quad_order *order)
{
    const unsigned *axis = order->axis;
    return quad_row((double)at[axis[0]], (double)at[axis[1]], (double)at[axis[2]], (double)at[3]);
}

static inline void quad_transpose(const double *const at[QUAD], const struct quad_order *order,
                                  struct quad out[3])
{
    for (unsigned i = 0; i < QUAD; i++)
        for (unsigned k = 0; k < 3; k++)
            out[k].at[i] = at[i][order->axis[k]];
}

#endif

#endif
