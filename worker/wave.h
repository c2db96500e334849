/*
 * Waves and lanes: the same arithmetic on many rays at once, in structures of arrays.
 *
 * The value in a lane depends on that lane alone. Code is written as for a single ray, with selections in
 * place of branches, and loops over lanes are compiled to SIMD instructions of whatever width the processor
 * has. Each lane does the same operations in the same order as the function for one ray, so the result is
 * bit-identical. A lane for which this fast path may not suffice is marked as not `sure`, and is computed
 * again by the function for one ray.
 */
#ifndef FARM_WORKER_WAVE_H
#define FARM_WORKER_WAVE_H

#include <stddef.h>
#include <stdint.h>

#include "worker/exact.h"

/*
 * Rays of a wave: enough for large batches, and few enough that the rays, hits, points and trees of its
 * samples (some 1250 bytes each, 320 KB in all) stay in a core's second-level cache.
 */
#define WAVE 256

/*
 * The lanes that IN_LANES() computes at a time: a whole register, as code for fewer lanes, once more for each narrower
 * register and for one lane, would take twice as long to compile.
 */
#if defined __AVX512F__
#define LANE_BLOCK 8
#elif defined __AVX2__
#define LANE_BLOCK 4
#else
#define LANE_BLOCK 2
#endif

/*
 * An array with one value per lane. The additional cache line keeps equal lanes of different rows, which are
 * used together, in different sets of the cache: at a distance of 2048 bytes they would share one. It is also for the
 * lanes behind the last one, in its block.
 */
#define LANE_ROW_END 8
typedef double lane_row[WAVE + LANE_ROW_END];

_Static_assert(LANE_BLOCK - 1 <= LANE_ROW_END, "a block may begin at the last lane");

struct rows3 {
    lane_row x, y, z;
};

static inline struct vec3 lane(const struct rows3 *lanes, size_t i)
{
    return vec3(lanes->x[i], lanes->y[i], lanes->z[i]);
}

static inline void set_lane(struct rows3 *lanes, size_t i, struct vec3 v)
{
    lanes->x[i] = v.x;
    lanes->y[i] = v.y;
    lanes->z[i] = v.z;
}

/* A boolean as it is stored in a lane. */
static inline double truth(bool value)
{
    return value ? 1.0 : 0.0;
}

/* Precedes a loop over lanes, whose iterations are independent of each other. */
#define OVER_LANES _Pragma("omp simd")

/*
 * Defines name(), which calls of_one() for each lane from begin to end - 1 of a struct of lanes, and for up to
 * LANE_BLOCK - 1 lanes from end on, whose results must not matter, for instance as they are computed later. Of an index
 * of 32 bits compilers fear that it wraps around, and do without SIMD.
 */
#define IN_LANES(name, type, of_one)                                                               \
    static FLATTENED void name(struct type *it, uint32_t begin, uint32_t end)                      \
    {                                                                                              \
        for (size_t block = begin; block < end; block += LANE_BLOCK) {                             \
            OVER_LANES                                                                             \
            for (size_t i = 0; i < LANE_BLOCK; i++)                                                \
                of_one(it, block + i);                                                             \
        }                                                                                          \
    }

/* Whether vec_normalize() needs no scaling for a vector of this squared length. */
static inline bool is_plain_square(double square)
{
    return (square > 0x1p-900) & (square < 0x1p1000);
}

/* vec_normalize() for vectors that need no scaling; clears *sure for others. */
static inline struct vec3 plain_unit(struct vec3 v, bool *sure)
{
    double square = vec_dot(v, v), length = sqrt(square);
    *sure &= is_plain_square(square);
    return vec3(v.x / length, v.y / length, v.z / length);
}

/* condition ? a : b, without a branch. */
static inline struct vec3 choose(bool condition, struct vec3 a, struct vec3 b)
{
    return vec3(condition ? a.x : b.x, condition ? a.y : b.y, condition ? a.z : b.z);
}

static inline struct dd3 choose_dd3(bool condition, struct dd3 a, struct dd3 b)
{
    return (struct dd3){{condition ? a.x.high : b.x.high, condition ? a.x.low : b.x.low},
                        {condition ? a.y.high : b.y.high, condition ? a.y.low : b.y.low},
                        {condition ? a.z.high : b.z.high, condition ? a.z.low : b.z.low}};
}

#endif
