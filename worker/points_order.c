#include <stdbool.h>

#include "worker/inlined.h"
#include "worker/lanes.h"
#include "worker/points.h"

/*
 * 2^CELL_BITS cells along the longest edge of the box around the points. Twice as many were not faster, and
 * would give more digits to sort by.
 */
#define CELL_BITS 4
#define CELLS     (1u << CELL_BITS)

#define KEY_BITS   (3 * CELL_BITS)
#define DIGIT_BITS 6
#define DIGITS     (1u << DIGIT_BITS)

_Static_assert(KEY_BITS <= 2 * DIGIT_BITS && WAVE <= 1u << 16, "what a key and its point take");

struct limits {
    double low, high;
};

/* The range of at least LANES numbers. */
static INLINED struct limits limits_of(const double *row, uint32_t count)
{
    /* The last LANES numbers; some of them are read again in the loop. */
    struct lanes low = lanes_load(row + count - LANES), high = low;
    for (uint32_t i = 0; i + LANES <= count; i += LANES) {
        struct lanes next = lanes_load(row + i);
        low = lanes_smaller(low, next);
        high = lanes_larger(high, next);
    }
    return (struct limits){lanes_lowest(low), lanes_highest(high)};
}

/* Puts two zeros between any two bits of a cell's number. */
static inline uint32_t spread(uint32_t cell)
{
    cell = (cell | cell << 4) & 0x0c30c3u;
    return (cell | cell << 2) & 0x249249u;
}

/* The cell of a coordinate. If it is not finite, or the box is not finite or is degenerate, any cell will do. */
static inline uint32_t cell_of(double at)
{
    bool inside = (at > 0) & (at < CELLS);
    return (uint32_t)(int32_t)(inside ? at : 0);
}

/* Keys: the Morton code of each point's cell in the upper half, the point's number in the lower. */
static FLATTENED void find_keys(const struct points *points, uint32_t keys[WAVE])
{
    const double *x = points->point.x, *y = points->point.y, *z = points->point.z;
    uint32_t count = points->count;
    struct limits in_x = limits_of(x, count), in_y = limits_of(y, count),
                  in_z = limits_of(z, count);
    double edge = larger_number(in_x.high - in_x.low,
                                larger_number(in_y.high - in_y.low, in_z.high - in_z.low));
    /* Scaled so that the farthest point lies within the last cell. */
    double cells = edge > 0 ? (1 - 0x1p-20) * CELLS / edge : 0;
    OVER_LANES
    for (uint32_t i = 0; i < count; i++) {
        uint32_t a = cell_of((x[i] - in_x.low) * cells), b = cell_of((y[i] - in_y.low) * cells);
        uint32_t c = cell_of((z[i] - in_z.low) * cells);
        keys[i] = (spread(a) | spread(b) << 1 | spread(c) << 2) << 16 | i;
    }
}

/* Counting sort by one digit, stable. */
static void sort_by_digit(const uint32_t *keys, uint32_t count, unsigned shift, uint32_t *sorted)
{
    uint32_t next[DIGITS] = {0}, sum = 0;
    for (uint32_t i = 0; i < count; i++)
        next[keys[i] >> shift & (DIGITS - 1)]++;
    for (unsigned digit = 0; digit < DIGITS; digit++) {
        uint32_t of_digit = next[digit];
        next[digit] = sum;
        sum += of_digit;
    }
    for (uint32_t i = 0; i < count; i++)
        sorted[next[keys[i] >> shift & (DIGITS - 1)]++] = keys[i];
}

void points_order(const struct points *points, bool dense, uint32_t order[WAVE])
{
    uint32_t keys[WAVE], count = points->count;
    if (!LANES_IN_SIMD || !dense || count <= LANES) {
        for (uint32_t i = 0; i < count; i++)
            order[i] = i;
        return;
    }
    find_keys(points, keys);
    sort_by_digit(keys, count, 16, order);
    sort_by_digit(order, count, 16 + DIGIT_BITS, keys);
    for (uint32_t i = 0; i < count; i++)
        order[i] = keys[i] & 0xffff;
}
