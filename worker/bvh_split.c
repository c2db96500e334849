#include "worker/bvh_split.h"

#include <math.h>
#include <string.h>

#include "worker/shape.h"

/* ---- four floats ---- */

#ifdef __SSE2__
#include <emmintrin.h>

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

/* ---- extents ---- */

static inline struct extent empty_extent(void)
{
    return (struct extent){all4(FLT_MAX), all4(-FLT_MAX)};
}

static inline struct extent item_extent(const struct item *item)
{
    struct extent extent;
    memcpy(&extent.min, item->min, sizeof extent.min);
    memcpy(&extent.max, &item->max, sizeof extent.max);
    return extent;
}

static inline void extend(struct extent *extent, const struct extent *more)
{
    extent->min = min4(extent->min, more->min);
    extent->max = max4(extent->max, more->max);
}

/* Half the centre, which does not overflow. The last lane would be an id: what that is as a float
 * may be slow. */
static inline float4 half_center(const struct extent *extent)
{
    const float4 quarter = {0.25f, 0.25f, 0.25f, 0};
    typedef uint32_t mask4 __attribute__((vector_size(16)));
    const mask4 xyz = {~0u, ~0u, ~0u, 0};
    float4 min = (float4)((mask4)extent->min & xyz), max = (float4)((mask4)extent->max & xyz);
    return min * quarter + max * quarter;
}

double extent_area(const struct extent *extent)
{
    double x = (double)extent->max[0] - (double)extent->min[0];
    double y = (double)extent->max[1] - (double)extent->min[1];
    double z = (double)extent->max[2] - (double)extent->min[2];
    return x < 0 ? 0 : x * y + y * z + z * x;
}

struct range range_empty(uint32_t first)
{
    return (struct range){first, 0, 0, empty_extent(), empty_extent()};
}

static inline void add(struct range *range, const struct item *item)
{
    struct extent extent = item_extent(item);
    float4 center = half_center(&extent);
    extend(&range->extent, &extent);
    range->centers.min = min4(range->centers.min, center);
    range->centers.max = max4(range->centers.max, center);
    range->count++;
    range->weight += item->weight;
}

void range_add(struct range *range, const struct item *item)
{
    add(range, item);
}

/* ---- bins ---- */

/* Bins per axis; a few items need, and are worth, fewer: 8 up to twice that many. */
#define BINS_MAX 16
#define BINS_FEW 8

struct binning {
    unsigned count; /* of bins in use */
    float4 low, scale;
    struct extent extent[3][BINS_MAX];
    uint32_t weight[3][BINS_MAX];
};

/* Place on the axis, in bins: 0 .. count, everywhere 0 on an axis on which all centres are the
 * same, or so close together that their distance has no inverse. */
static void place_bins(struct binning *binning, const struct range *range)
{
    binning->count = range->count <= 2 * BINS_FEW ? BINS_FEW : BINS_MAX;
    binning->low = range->centers.min;
    float4 width = range->centers.max - range->centers.min;
    for (unsigned axis = 0; axis < 3; axis++) {
        float scale = (float)binning->count / width[axis];
        binning->scale[axis] = scale <= FLT_MAX ? scale : 0;
        for (unsigned b = 0; b < binning->count; b++) {
            binning->extent[axis][b] = empty_extent();
            binning->weight[axis][b] = 0;
        }
    }
    binning->scale[3] = 0;
}

static void fill_bins(struct binning *binning, const struct item *items, uint32_t count)
{
    const float4 low = binning->low, scale = binning->scale;
    const float4 last = all4((float)(binning->count - 1));
    for (uint32_t i = 0; i < count; i++) {
        struct extent extent = item_extent(&items[i]);
        float4 place = min4((half_center(&extent) - low) * scale, last);
        for (unsigned axis = 0; axis < 3; axis++) {
            unsigned b = (unsigned)(int)place[axis];
            extend(&binning->extent[axis][b], &extent);
            binning->weight[axis][b] += items[i].weight;
        }
    }
}

/* Sweeps the bins of one axis from the right, then from the left; keeps the cheapest split. */
static void sweep_bins(const struct binning *binning, unsigned axis, struct split *best)
{
    const struct extent *extents = binning->extent[axis];
    const uint32_t *weights = binning->weight[axis];
    double right_cost[BINS_MAX];
    struct extent right = empty_extent(), left = empty_extent();
    uint32_t right_weight = 0, left_weight = 0;
    for (unsigned b = binning->count - 1; b > 0; b--) {
        extend(&right, &extents[b]);
        right_weight += weights[b];
        right_cost[b] = right_weight ? extent_area(&right) * cost_of(right_weight) : INFINITE;
    }
    for (unsigned b = 0; b + 1 < binning->count; b++) {
        extend(&left, &extents[b]);
        left_weight += weights[b];
        if (left_weight == 0) continue;
        double cost = extent_area(&left) * cost_of(left_weight) + right_cost[b + 1];
        if (cost < best->cost)
            *best = (struct split){axis, binning->low[axis], binning->scale[axis], (float)(b + 1),
                                   cost};
    }
}

struct split find_split(const struct item *items, const struct range *range)
{
    struct binning binning;
    struct split best = {.cost = INFINITE};
    place_bins(&binning, range);
    fill_bins(&binning, items + range->first, range->count);
    for (unsigned axis = 0; axis < 3; axis++)
        if (binning.scale[axis] > 0) sweep_bins(&binning, axis, &best);
    return best;
}

/* ---- dividing ---- */

void halve_range(const struct item *items, const struct range *range, struct range *left,
                 struct range *right)
{
    uint32_t middle = range->first + range->count / 2, end = range->first + range->count;
    *left = range_empty(range->first);
    for (uint32_t i = range->first; i < middle; i++)
        add(left, &items[i]);
    *right = range_empty(middle);
    for (uint32_t i = middle; i < end; i++)
        add(right, &items[i]);
}

static inline bool is_left(const struct item *item, const struct split *split)
{
    float center = item->min[split->axis] * 0.25f + item->max[split->axis] * 0.25f;
    return (center - split->low) * split->scale < split->end;
}

void split_range(struct item *items, const struct range *range, const struct split *split,
                 struct range *left, struct range *right)
{
    if (isinf(split->cost)) {
        halve_range(items, range, left, right);
        return;
    }
    uint32_t begin = range->first, end = range->first + range->count;
    struct range sides[2] = {range_empty(begin), range_empty(begin)};
    for (;;) {
        for (; begin < end && is_left(&items[begin], split); begin++)
            add(&sides[0], &items[begin]);
        for (; begin < end && !is_left(&items[end - 1], split); end--)
            add(&sides[1], &items[end - 1]);
        if (begin == end) break;
        struct item item = items[begin];
        items[begin] = items[end - 1];
        items[end - 1] = item;
    }
    *left = sides[0];
    *right = sides[1];
    right->first = begin;
}
