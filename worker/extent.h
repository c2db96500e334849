/* Boxes in float for the construction of the BVH, in four lanes of which the last is unused. */
#ifndef FARM_WORKER_EXTENT_H
#define FARM_WORKER_EXTENT_H

#include <float.h>
#include <stdbool.h>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

typedef float float4 __attribute__((vector_size(16)));

#ifdef __SSE2__
static inline float4 min4(float4 a, float4 b)
{
    return _mm_min_ps(a, b);
}

static inline float4 max4(float4 a, float4 b)
{
    return _mm_max_ps(a, b);
}
#else
static inline float4 min4(float4 a, float4 b)
{
    for (int i = 0; i < 4; i++)
        a[i] = a[i] < b[i] ? a[i] : b[i];
    return a;
}

static inline float4 max4(float4 a, float4 b)
{
    for (int i = 0; i < 4; i++)
        a[i] = a[i] > b[i] ? a[i] : b[i];
    return a;
}
#endif

static inline float4 all4(float x)
{
    return (float4){x, x, x, x};
}

struct extent {
    float4 min, max; /* finite; an empty one has min > max */
};

static inline struct extent empty_extent(void)
{
    return (struct extent){all4(FLT_MAX), all4(-FLT_MAX)};
}

static inline void extend(struct extent *extent, const struct extent *more)
{
    extent->min = min4(extent->min, more->min);
    extent->max = max4(extent->max, more->max);
}

static inline struct extent intersection(const struct extent *a, const struct extent *b)
{
    return (struct extent){max4(a->min, b->min), min4(a->max, b->max)};
}

static inline bool extent_is_proper(const struct extent *extent)
{
    return extent->min[0] <= extent->max[0] && extent->min[1] <= extent->max[1] &&
           extent->min[2] <= extent->max[2];
}

static inline unsigned longest_axis(const struct extent *extent)
{
    unsigned longest = 0;
    for (unsigned axis = 1; axis < 3; axis++)
        if (extent->max[axis] - extent->min[axis] > extent->max[longest] - extent->min[longest])
            longest = axis;
    return longest;
}

/* Half the surface; 0 for an empty extent. In double, whose range holds the squares of floats. */
static inline double extent_half_area(const struct extent *extent)
{
    double x = (double)extent->max[0] - (double)extent->min[0];
    double y = (double)extent->max[1] - (double)extent->min[1];
    double z = (double)extent->max[2] - (double)extent->min[2];
    return extent_is_proper(extent) ? x * y + y * z + z * x : 0;
}

#endif
