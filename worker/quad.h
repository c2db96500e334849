/*
 * Four doubles at once: one register of AVX2, or a loop. Like worker/lanes.h, for what mostly comes
 * by fours: the triangles of a leaf.
 */
#ifndef FARM_WORKER_QUAD_H
#define FARM_WORKER_QUAD_H

#include <math.h>

#include "worker/inlined.h"
#include "worker/wide.h"

#define QUAD 4

#if defined(__AVX2__) && defined(__FMA__)

#include <immintrin.h>

struct quad {
    __m256d v;
};

REGISTER_2(quad, quad_add, _mm256_add_pd)
REGISTER_2(quad, quad_sub, _mm256_sub_pd)
REGISTER_2(quad, quad_mul, _mm256_mul_pd)
REGISTER_2(quad, quad_larger, _mm256_max_pd)
REGISTER_2(quad, quad_smaller, _mm256_min_pd)

static inline struct quad quad_of(double a)
{
    return (struct quad){_mm256_set1_pd(a)};
}

static inline struct quad quad_abs(struct quad a)
{
    return (struct quad){_mm256_andnot_pd(_mm256_set1_pd(-0.0), a.v)};
}

static inline lane_set quad_less(struct quad a, struct quad b)
{
    return (lane_set)_mm256_movemask_pd(_mm256_cmp_pd(a.v, b.v, _CMP_LT_OQ));
}

struct quad_order {
    __m256i floats; /* a double is two of them */
};

static inline struct quad_order quad_order(unsigned first, unsigned second, unsigned third)
{
    int x = 2 * (int)first, y = 2 * (int)second, z = 2 * (int)third;
    return (struct quad_order){_mm256_setr_epi32(x, x + 1, y, y + 1, z, z + 1, 6, 7)};
}

static inline __m256d point_in_order(const double *at, const struct quad_order *order)
{
    __m256d p = _mm256_maskload_pd(at, _mm256_setr_epi64x(-1, -1, -1, 0));
    return _mm256_castps_pd(_mm256_permutevar8x32_ps(_mm256_castpd_ps(p), order->floats));
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
LOOP_2(quad, quad_add, a.at[i] + b.at[i])
LOOP_2(quad, quad_sub, a.at[i] - b.at[i])
LOOP_2(quad, quad_mul, a.at[i] * b.at[i])
LOOP_2(quad, quad_larger, a.at[i] > b.at[i] ? a.at[i] : b.at[i])
LOOP_2(quad, quad_smaller, a.at[i] < b.at[i] ? a.at[i] : b.at[i])
LOOP_COMPARE(quad, quad_less, <)

static inline struct quad quad_of(double a)
{
    return (struct quad){{a, a, a, a}};
}

struct quad_order {
    unsigned axis[3];
};

static inline struct quad_order quad_order(unsigned first, unsigned second, unsigned third)
{
    return (struct quad_order){{first, second, third}};
}

static inline void quad_transpose(const double *const at[QUAD], const struct quad_order *order,
                                  struct quad out[3])
{
    for (unsigned i = 0; i < QUAD; i++)
        for (unsigned k = 0; k < 3; k++)
            out[k].at[i] = at[i][order->axis[k]];
}

#endif

/* quad_larger(), quad_smaller(): a > b ? a : b, a < b ? a : b, so that a NaN in a loses.
 * quad_transpose(): of three doubles for each of four points those that the order names first,
 * second and third; what lies behind them is not touched. */

#endif
