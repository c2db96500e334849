/*
 * Eight doubles at once: one register of AVX-512, two of AVX2, or a loop, depending on the level of
 * processor. Each lane holds the result of the scalar operation, bit for bit; only operations whose names say
 * so are fused.
 */
#ifndef FARM_WORKER_LANES_H
#define FARM_WORKER_LANES_H

#include <math.h>
#include <stdint.h>

#include "worker/inlined.h"
#include "worker/quad.h"
#include "worker/wide.h"

/* Precedes a short loop over an array that is to be kept in registers. */
#define UNROLLED _Pragma("GCC unroll 8")

#define ALL_LANES ((lane_set)0xff)

/* The lowest lane of a non-empty set. */
static inline unsigned lowest_lane(lane_set set)
{
    return (unsigned)__builtin_ctz(set);
}

static inline lane_set without_lowest(lane_set set)
{
    return set & (set - 1);
}

/* The first n lanes. */
static inline lane_set first_lanes(uint32_t n)
{
    return n < LANES ? (UINT32_C(1) << n) - 1 : ALL_LANES;
}

/*
 * The rank of a lane within a set when sorted by distance, and by lane where distances are equal. smaller,
 * no_larger: the lanes with a smaller and with no larger distance.
 */
static inline unsigned lanes_before(lane_set set, unsigned lane, lane_set smaller,
                                    lane_set no_larger)
{
    lane_set before = smaller | (no_larger & first_lanes(lane));
    return (unsigned)__builtin_popcount(before & set);
}

/*
 * Functions of each level below whose names do not say all. An order is a permutation of three components.
 *
 * lanes_lowest()     the least value of all lanes, none of which is NaN
 * lanes_highest()    the greatest value of all lanes, none of which is NaN
 * lanes_sum()        the sum of all lanes, added up in the same order on every level
 * lanes_choose()     a in the lanes of the set, b in the others
 * equal_ids()        the set of lanes that have this id
 * put_ids()          stores the id in the lanes of the set
 * lanes_larger()     a > b ? a : b, so that the result is b if a is NaN
 * lanes_smaller()    a < b ? a : b, so that the result is b if a is NaN
 * lanes_transpose()  for eight points of three doubles, in the given order: their first components, their second ones,
 *                    their third ones; reads nothing beyond the three doubles
 * lanes_of_rows()    for eight rows of four doubles: their first elements, their second ones, ...
 */

#if defined(__AVX512F__) && defined(__AVX512VL__) && defined(__AVX512DQ__)

#define LANES_IN_SIMD         1
#define LANES_IN_ONE_REGISTER 1

#include <immintrin.h>

struct lanes {
    __m512d v;
};

REGISTER_2(lanes, lanes_add, _mm512_add_pd)
REGISTER_2(lanes, lanes_sub, _mm512_sub_pd)
REGISTER_2(lanes, lanes_mul, _mm512_mul_pd)
REGISTER_2(lanes, lanes_div, _mm512_div_pd)
REGISTER_2(lanes, lanes_larger, _mm512_max_pd)
REGISTER_2(lanes, lanes_smaller, _mm512_min_pd)

static inline struct lanes lanes_abs(struct lanes a)
{
    return (struct lanes){_mm512_abs_pd(a.v)};
}

static inline struct lanes lanes_sqrt(struct lanes a)
{
    return (struct lanes){_mm512_sqrt_pd(a.v)};
}

static inline struct lanes lanes_of(double a)
{
    return (struct lanes){_mm512_set1_pd(a)};
}

static inline struct lanes lanes_load(const double *a)
{
    return (struct lanes){_mm512_loadu_pd(a)};
}

static inline struct lanes lanes_load_floats(const float *a)
{
    return (struct lanes){_mm512_cvtps_pd(_mm256_loadu_ps(a))};
}

static inline void lanes_store(double *to, struct lanes a)
{
    _mm512_storeu_pd(to, a.v);
}

static inline struct lanes lanes_fma(struct lanes a, struct lanes b, struct lanes c)
{
    return (struct lanes){_mm512_fmadd_pd(a.v, b.v, c.v)};
}

static inline __m512d two_points(const double *low, const double *high)
{
    const double *four_before = (const void *)((uintptr_t)high - 4 * sizeof(double));
    return _mm512_mask_loadu_pd(_mm512_maskz_loadu_pd(0x07, low), 0x70, four_before);
}

struct axis_order {
    __m512i first_two, third; /* permutations for two pairs of points */
};

static inline struct axis_order axis_order(unsigned first, unsigned second, unsigned third)
{
    long long x = first, y = second, z = third;
    return (struct axis_order){_mm512_setr_epi64(x, 8 + x, y, 8 + y, 4 + x, 12 + x, 4 + y, 12 + y),
                               _mm512_setr_epi64(z, 8 + z, 0, 0, 4 + z, 12 + z, 0, 0)};
}

static INLINED void lanes_transpose(const double *const at[LANES], const struct axis_order *order,
                                    struct lanes out[3])
{
    const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
    const __m512i high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
    __m512d p04 = two_points(at[0], at[4]), p15 = two_points(at[1], at[5]);
    __m512d p26 = two_points(at[2], at[6]), p37 = two_points(at[3], at[7]);
    __m512d xy01 = _mm512_permutex2var_pd(p04, order->first_two, p15);
    __m512d xy23 = _mm512_permutex2var_pd(p26, order->first_two, p37);
    __m512d z01 = _mm512_permutex2var_pd(p04, order->third, p15);
    __m512d z23 = _mm512_permutex2var_pd(p26, order->third, p37);
    out[0].v = _mm512_permutex2var_pd(xy01, low, xy23);
    out[1].v = _mm512_permutex2var_pd(xy01, high, xy23);
    out[2].v = _mm512_permutex2var_pd(z01, low, z23);
}

static INLINED __m512d two_rows(const double *low, const double *high)
{
    __m512d row = _mm512_castpd256_pd512(_mm256_loadu_pd(low));
    return _mm512_insertf64x4(row, _mm256_loadu_pd(high), 1);
}

static INLINED void lanes_of_rows(const double *const at[LANES], struct lanes out[4])
{
    const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
    const __m512i high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
    __m512d p04 = two_rows(at[0], at[4]), p15 = two_rows(at[1], at[5]);
    __m512d p26 = two_rows(at[2], at[6]), p37 = two_rows(at[3], at[7]);
    __m512d xz01 = _mm512_unpacklo_pd(p04, p15), xz23 = _mm512_unpacklo_pd(p26, p37);
    __m512d yw01 = _mm512_unpackhi_pd(p04, p15), yw23 = _mm512_unpackhi_pd(p26, p37);
    out[0].v = _mm512_permutex2var_pd(xz01, low, xz23);
    out[1].v = _mm512_permutex2var_pd(yw01, low, yw23);
    out[2].v = _mm512_permutex2var_pd(xz01, high, xz23);
    out[3].v = _mm512_permutex2var_pd(yw01, high, yw23);
}

static inline double lanes_lowest(struct lanes a)
{
    return _mm512_reduce_min_pd(a.v);
}

static inline double lanes_highest(struct lanes a)
{
    return _mm512_reduce_max_pd(a.v);
}

static inline double lanes_sum(struct lanes a)
{
    __m256d four = _mm256_add_pd(_mm512_castpd512_pd256(a.v), _mm512_extractf64x4_pd(a.v, 1));
    __m128d two = _mm_add_pd(_mm256_castpd256_pd128(four), _mm256_extractf128_pd(four, 1));
    return _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)));
}

static inline struct lanes lanes_choose(lane_set set, struct lanes a, struct lanes b)
{
    return (struct lanes){_mm512_mask_blend_pd((__mmask8)set, b.v, a.v)};
}

static inline lane_set equal_ids(const uint32_t ids[LANES], uint32_t id)
{
    return _mm256_cmpeq_epi32_mask(_mm256_loadu_si256((const void *)ids),
                                   _mm256_set1_epi32((int)id));
}

static inline void put_ids(uint32_t ids[LANES], lane_set set, uint32_t id)
{
    _mm256_mask_storeu_epi32(ids, (__mmask8)set, _mm256_set1_epi32((int)id));
}

static inline lane_set lanes_less(struct lanes a, struct lanes b)
{
    return _mm512_cmp_pd_mask(a.v, b.v, _CMP_LT_OQ);
}

static inline lane_set lanes_at_most(struct lanes a, struct lanes b)
{
    return _mm512_cmp_pd_mask(a.v, b.v, _CMP_LE_OQ);
}

#elif defined(__AVX2__) && defined(__FMA__)

#define LANES_IN_SIMD 1

#include <immintrin.h>

struct lanes {
    __m256d low, high;
};

#define LANES_1(name, operation)                                                                   \
    static inline struct lanes name(struct lanes a)                                                \
    {                                                                                              \
        return (struct lanes){operation(a.low), operation(a.high)};                                \
    }

#define LANES_2(name, operation)                                                                   \
    static inline struct lanes name(struct lanes a, struct lanes b)                                \
    {                                                                                              \
        return (struct lanes){operation(a.low, b.low), operation(a.high, b.high)};                 \
    }

#define ABS_4(a) _mm256_andnot_pd(_mm256_set1_pd(-0.0), a)
LANES_1(lanes_abs, ABS_4)
LANES_1(lanes_sqrt, _mm256_sqrt_pd)
LANES_2(lanes_add, _mm256_add_pd)
LANES_2(lanes_sub, _mm256_sub_pd)
LANES_2(lanes_mul, _mm256_mul_pd)
LANES_2(lanes_div, _mm256_div_pd)
LANES_2(lanes_larger, _mm256_max_pd)
LANES_2(lanes_smaller, _mm256_min_pd)

static inline struct lanes lanes_of(double a)
{
    return (struct lanes){_mm256_set1_pd(a), _mm256_set1_pd(a)};
}

static inline struct lanes lanes_load(const double *a)
{
    return (struct lanes){_mm256_loadu_pd(a), _mm256_loadu_pd(a + 4)};
}

static inline struct lanes lanes_load_floats(const float *a)
{
    return (struct lanes){_mm256_cvtps_pd(_mm_loadu_ps(a)), _mm256_cvtps_pd(_mm_loadu_ps(a + 4))};
}

static inline void lanes_store(double *to, struct lanes a)
{
    _mm256_storeu_pd(to, a.low);
    _mm256_storeu_pd(to + 4, a.high);
}

static inline struct lanes lanes_fma(struct lanes a, struct lanes b, struct lanes c)
{
    return (struct lanes){_mm256_fmadd_pd(a.low, b.low, c.low),
                          _mm256_fmadd_pd(a.high, b.high, c.high)};
}

static inline struct lanes lanes_of_quads(struct quad low, struct quad high)
{
    return (struct lanes){low.v, high.v};
}

static inline double lanes_lowest(struct lanes a)
{
    __m256d four = _mm256_min_pd(a.low, a.high);
    __m128d two = _mm_min_pd(_mm256_castpd256_pd128(four), _mm256_extractf128_pd(four, 1));
    return _mm_cvtsd_f64(_mm_min_sd(two, _mm_unpackhi_pd(two, two)));
}

static inline double lanes_highest(struct lanes a)
{
    __m256d four = _mm256_max_pd(a.low, a.high);
    __m128d two = _mm_max_pd(_mm256_castpd256_pd128(four), _mm256_extractf128_pd(four, 1));
    return _mm_cvtsd_f64(_mm_max_sd(two, _mm_unpackhi_pd(two, two)));
}

static inline double lanes_sum(struct lanes a)
{
    __m256d four = _mm256_add_pd(a.low, a.high);
    __m128d two = _mm_add_pd(_mm256_castpd256_pd128(four), _mm256_extractf128_pd(four, 1));
    return _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)));
}

/* All bits of the eight numbers that are in the set. */
static inline __m256i mask_8(lane_set set)
{
    const __m256i bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    return _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32((int)set), bits), bits);
}

static inline __m256d mask_4(lane_set set)
{
    const __m256i bits = _mm256_setr_epi64x(1, 2, 4, 8);
    __m256i chosen = _mm256_and_si256(_mm256_set1_epi64x((long long)set), bits);
    return _mm256_castsi256_pd(_mm256_cmpeq_epi64(chosen, bits));
}

static inline struct lanes lanes_choose(lane_set set, struct lanes a, struct lanes b)
{
    return (struct lanes){_mm256_blendv_pd(b.low, a.low, mask_4(set)),
                          _mm256_blendv_pd(b.high, a.high, mask_4(set >> 4))};
}

static inline lane_set lane_set_of(__m256d low, __m256d high)
{
    return (lane_set)_mm256_movemask_pd(low) | (lane_set)_mm256_movemask_pd(high) << 4;
}

static inline lane_set equal_ids(const uint32_t ids[LANES], uint32_t id)
{
    __m256i eight = _mm256_loadu_si256((const void *)ids);
    __m256i equal = _mm256_cmpeq_epi32(eight, _mm256_set1_epi32((int)id));
    return (lane_set)_mm256_movemask_ps(_mm256_castsi256_ps(equal));
}

static inline void put_ids(uint32_t ids[LANES], lane_set set, uint32_t id)
{
    __m256i old = _mm256_loadu_si256((const void *)ids);
    __m256i put = _mm256_blendv_epi8(old, _mm256_set1_epi32((int)id), mask_8(set));
    _mm256_storeu_si256((void *)ids, put);
}

static inline lane_set lanes_less(struct lanes a, struct lanes b)
{
    return lane_set_of(_mm256_cmp_pd(a.low, b.low, _CMP_LT_OQ),
                       _mm256_cmp_pd(a.high, b.high, _CMP_LT_OQ));
}

static inline lane_set lanes_at_most(struct lanes a, struct lanes b)
{
    return lane_set_of(_mm256_cmp_pd(a.low, b.low, _CMP_LE_OQ),
                       _mm256_cmp_pd(a.high, b.high, _CMP_LE_OQ));
}

#else

#define LANES_IN_SIMD 0

struct lanes {
    double at[LANES];
};

LOOP_1(lanes, lanes_abs, fabs)
LOOP_1(lanes, lanes_sqrt, sqrt)
LOOP_2(lanes, lanes_add, a.at[i] + b.at[i])
LOOP_2(lanes, lanes_sub, a.at[i] - b.at[i])
LOOP_2(lanes, lanes_mul, a.at[i] * b.at[i])
LOOP_2(lanes, lanes_div, a.at[i] / b.at[i])
LOOP_2(lanes, lanes_larger, a.at[i] > b.at[i] ? a.at[i] : b.at[i])
LOOP_2(lanes, lanes_smaller, a.at[i] < b.at[i] ? a.at[i] : b.at[i])
LOOP_COMPARE(lanes, lanes_less, <)
LOOP_COMPARE(lanes, lanes_at_most, <=)

static inline struct lanes lanes_of(double a)
{
    return (struct lanes){{a, a, a, a, a, a, a, a}};
}

static inline struct lanes lanes_load(const double *a)
{
    return (struct lanes){{a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]}};
}

static inline struct lanes lanes_load_floats(const float *a)
{
    struct lanes lanes;
    for (unsigned i = 0; i < LANES; i++)
        lanes.at[i] = (double)a[i];
    return lanes;
}

static inline void lanes_store(double *to, struct lanes a)
{
    for (unsigned i = 0; i < LANES; i++)
        to[i] = a.at[i];
}

static inline struct lanes lanes_fma(struct lanes a, struct lanes b, struct lanes c)
{
    for (unsigned i = 0; i < LANES; i++)
        a.at[i] = fma(a.at[i], b.at[i], c.at[i]);
    return a;
}

static inline lane_set equal_ids(const uint32_t ids[LANES], uint32_t id)
{
    lane_set set = 0;
    for (unsigned i = 0; i < LANES; i++)
        set |= (lane_set)(ids[i] == id) << i;
    return set;
}

static inline void put_ids(uint32_t ids[LANES], lane_set set, uint32_t id)
{
    for (unsigned i = 0; i < LANES; i++)
        ids[i] = set >> i & 1 ? id : ids[i];
}

static inline struct lanes lanes_of_quads(struct quad low, struct quad high)
{
    struct lanes lanes;
    for (unsigned i = 0; i < QUAD; i++) {
        lanes.at[i] = low.at[i];
        lanes.at[QUAD + i] = high.at[i];
    }
    return lanes;
}

static inline double lanes_lowest(struct lanes a)
{
    double low = a.at[0];
    for (unsigned i = 1; i < LANES; i++)
        low = a.at[i] < low ? a.at[i] : low;
    return low;
}

static inline double lanes_highest(struct lanes a)
{
    double high = a.at[0];
    for (unsigned i = 1; i < LANES; i++)
        high = a.at[i] > high ? a.at[i] : high;
    return high;
}

static inline double lanes_sum(struct lanes a)
{
    const double *at = a.at;
    return ((at[0] + at[4]) + (at[2] + at[6])) + ((at[1] + at[5]) + (at[3] + at[7]));
}

static inline struct lanes lanes_choose(lane_set set, struct lanes a, struct lanes b)
{
    for (unsigned i = 0; i < LANES; i++)
        if (set >> i & 1) b.at[i] = a.at[i];
    return b;
}

#endif

#ifndef LANES_IN_ONE_REGISTER

struct axis_order {
    struct quad_order quads;
};

static inline struct axis_order axis_order(unsigned first, unsigned second, unsigned third)
{
    return (struct axis_order){quad_order(first, second, third)};
}

static INLINED void lanes_transpose(const double *const at[LANES], const struct axis_order *order,
                                    struct lanes out[3])
{
    struct quad low[3], high[3];
    quad_transpose(at, &order->quads, low);
    quad_transpose(at + QUAD, &order->quads, high);
    for (unsigned k = 0; k < 3; k++)
        out[k] = lanes_of_quads(low[k], high[k]);
}

static INLINED void lanes_of_rows(const double *const at[LANES], struct lanes out[4])
{
    struct quad low[4], high[4];
    quad_of_rows(at, low);
    quad_of_rows(at + QUAD, high);
    for (unsigned k = 0; k < 4; k++)
        out[k] = lanes_of_quads(low[k], high[k]);
}

#endif

#endif
