/*
 * Eight floats at once, for tests that need not be exact: which boxes and triangles a ray may meet, with
 * bounds on the errors. A register of AVX, or a loop. Operations are rounded like scalar ones, except for
 * fused ones; what is derived from them does not affect pictures.
 */
#ifndef FARM_WORKER_FLOATS_H
#define FARM_WORKER_FLOATS_H

#include "worker/lanes.h"

/*
 * Functions whose names do not say all:
 *
 * floats_of_lanes()  the lanes, rounded to nearest
 * floats_choose()    a in the lanes of the set, b in the others
 * floats_flip()      -a where b is negative, else a
 * floats_mul_add()   a b + c, rounded once or twice, as are the next two
 * floats_mul_sub()   a b - c
 * floats_sub_mul()   a - b c
 * same_31()          the set of those of eight numbers whose lower 31 bits are those of b
 * floats_larger()    a > b ? a : b, so that the result is b if a is NaN
 * floats_smaller()   a < b ? a : b, so that the result is b if a is NaN
 */

#if LANES_IN_SIMD

struct floats {
    __m256 v;
};

REGISTER_2(floats, floats_add, _mm256_add_ps)
REGISTER_2(floats, floats_sub, _mm256_sub_ps)
REGISTER_2(floats, floats_mul, _mm256_mul_ps)
REGISTER_2(floats, floats_div, _mm256_div_ps)
REGISTER_2(floats, floats_larger, _mm256_max_ps)
REGISTER_2(floats, floats_smaller, _mm256_min_ps)

static inline struct floats floats_of(float a)
{
    return (struct floats){_mm256_set1_ps(a)};
}

/* The first and the second value of a quad, each in all lanes. */
static inline void floats_of_two(struct quad a, struct floats *first, struct floats *second)
{
    __m128 rounded = _mm256_cvtpd_ps(a.v);
    first->v = _mm256_broadcastss_ps(rounded);
    second->v = _mm256_broadcastss_ps(_mm_movehdup_ps(rounded));
}

static inline struct floats floats_load(const float *a)
{
    return (struct floats){_mm256_loadu_ps(a)};
}

static inline struct floats floats_load_shorts(const uint16_t *a)
{
    __m128i shorts = _mm_loadu_si128((const void *)a);
    return (struct floats){_mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(shorts))};
}

static inline void floats_store(float *to, struct floats a)
{
    _mm256_storeu_ps(to, a.v);
}

static inline lane_set same_31(const uint32_t *a, uint32_t b)
{
    __m256i found = _mm256_slli_epi32(_mm256_loadu_si256((const void *)a), 1);
    __m256i same = _mm256_cmpeq_epi32(found, _mm256_set1_epi32((int)(b << 1)));
    return (lane_set)_mm256_movemask_ps(_mm256_castsi256_ps(same));
}

static inline struct floats floats_abs(struct floats a)
{
    return (struct floats){_mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.v)};
}

static inline struct floats floats_flip(struct floats a, struct floats b)
{
    return (struct floats){_mm256_xor_ps(a.v, _mm256_and_ps(_mm256_set1_ps(-0.0f), b.v))};
}

static inline struct floats floats_mul_add(struct floats a, struct floats b, struct floats c)
{
    return (struct floats){_mm256_fmadd_ps(a.v, b.v, c.v)};
}

static inline struct floats floats_mul_sub(struct floats a, struct floats b, struct floats c)
{
    return (struct floats){_mm256_fmsub_ps(a.v, b.v, c.v)};
}

static inline struct floats floats_sub_mul(struct floats a, struct floats b, struct floats c)
{
    return (struct floats){_mm256_fnmadd_ps(b.v, c.v, a.v)};
}

#ifdef __AVX512VL__

static inline struct floats floats_of_lanes(struct lanes a)
{
    return (struct floats){_mm512_cvtpd_ps(a.v)};
}

static inline struct lanes lanes_of_floats(struct floats a)
{
    return (struct lanes){_mm512_cvtps_pd(a.v)};
}

static inline struct floats floats_choose(lane_set set, struct floats a, struct floats b)
{
    return (struct floats){_mm256_mask_mov_ps(b.v, (__mmask8)set, a.v)};
}

static inline lane_set floats_less(struct floats a, struct floats b)
{
    return _mm256_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ);
}

static inline lane_set floats_at_most(struct floats a, struct floats b)
{
    return _mm256_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ);
}

#else

static inline struct floats floats_of_lanes(struct lanes a)
{
    return (struct floats){_mm256_set_m128(_mm256_cvtpd_ps(a.high), _mm256_cvtpd_ps(a.low))};
}

static inline struct lanes lanes_of_floats(struct floats a)
{
    return (struct lanes){_mm256_cvtps_pd(_mm256_castps256_ps128(a.v)),
                          _mm256_cvtps_pd(_mm256_extractf128_ps(a.v, 1))};
}

static inline struct floats floats_choose(lane_set set, struct floats a, struct floats b)
{
    return (struct floats){_mm256_blendv_ps(b.v, a.v, _mm256_castsi256_ps(mask_8(set)))};
}

static inline lane_set floats_less(struct floats a, struct floats b)
{
    return (lane_set)_mm256_movemask_ps(_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ));
}

static inline lane_set floats_at_most(struct floats a, struct floats b)
{
    return (lane_set)_mm256_movemask_ps(_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ));
}

#endif

#else

struct floats {
    float at[LANES];
};

LOOP_2(floats, floats_add, a.at[i] + b.at[i])
LOOP_2(floats, floats_sub, a.at[i] - b.at[i])
LOOP_2(floats, floats_mul, a.at[i] * b.at[i])
LOOP_2(floats, floats_div, a.at[i] / b.at[i])
LOOP_2(floats, floats_flip, signbit(b.at[i]) ? -a.at[i] : a.at[i])
LOOP_2(floats, floats_larger, a.at[i] > b.at[i] ? a.at[i] : b.at[i])
LOOP_2(floats, floats_smaller, a.at[i] < b.at[i] ? a.at[i] : b.at[i])
LOOP_1(floats, floats_abs, fabsf)
LOOP_COMPARE(floats, floats_less, <)
LOOP_COMPARE(floats, floats_at_most, <=)

static inline struct floats floats_of(float a)
{
    return (struct floats){{a, a, a, a, a, a, a, a}};
}

static inline void floats_of_two(struct quad a, struct floats *first, struct floats *second)
{
    *first = floats_of((float)a.at[0]);
    *second = floats_of((float)a.at[1]);
}

static inline struct floats floats_load(const float *a)
{
    return (struct floats){{a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]}};
}

static inline struct floats floats_load_shorts(const uint16_t *a)
{
    return (struct floats){{a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]}};
}

static inline struct floats floats_mul_add(struct floats a, struct floats b, struct floats c)
{
    return floats_add(floats_mul(a, b), c);
}

static inline struct floats floats_mul_sub(struct floats a, struct floats b, struct floats c)
{
    return floats_sub(floats_mul(a, b), c);
}

static inline struct floats floats_sub_mul(struct floats a, struct floats b, struct floats c)
{
    return floats_sub(a, floats_mul(b, c));
}

static inline struct floats floats_of_lanes(struct lanes a)
{
    struct floats floats;
    for (unsigned i = 0; i < LANES; i++)
        floats.at[i] = (float)a.at[i];
    return floats;
}

static inline struct floats floats_choose(lane_set set, struct floats a, struct floats b)
{
    for (unsigned i = 0; i < LANES; i++)
        a.at[i] = set >> i & 1 ? a.at[i] : b.at[i];
    return a;
}

static inline lane_set same_31(const uint32_t *a, uint32_t b)
{
    lane_set set = 0;
    for (unsigned i = 0; i < LANES; i++)
        set |= (lane_set)(a[i] << 1 == b << 1) << i;
    return set;
}

static inline struct lanes lanes_of_floats(struct floats a)
{
    return lanes_load_floats(a.at);
}

static inline void floats_store(float *to, struct floats a)
{
    for (unsigned i = 0; i < LANES; i++)
        to[i] = a.at[i];
}

#endif

#endif
