#include "master/contrast.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* Pixels that are processed together: their data stays in the first-level cache. */
#define CHUNK 128u

/* Vectorised: the iterations, one for each pixel, are independent. */
#define OVER_PIXELS _Pragma("omp simd")

void color_row_take(const struct color_row *row, const struct canvas *canvas, int64_t y)
{
    uint32_t width = canvas->width;
    bool inside = y >= 0 && y < canvas->height;
    const float *rgb = canvas->rgb + (inside ? 3 * (size_t)width * (size_t)y : 0);
    for (unsigned c = 0; c < 3; c++) {
        float *plane = row->plane[c];
        plane[0] = plane[width + 1] = NAN;
        for (uint32_t x = 0; x < width; x++)
            plane[x + 1] = inside ? rgb[3 * (size_t)x + c] : NAN;
    }
}

/* Differences between the colours of a neighbour and of each pixel of a chunk, and their squared lengths. For
 * neighbours that are ignored the differences are NaN and the square is 0. */
struct differences {
    double x[CHUNK], y[CHUNK], z[CHUNK], square[CHUNK];
};

/* From each pixel to the k-th of its 3 x 3 neighbours, numbered row by row. */
static void find_differences(const struct color_row rows[3], uint32_t first, uint32_t count,
                             unsigned k, struct differences *to)
{
    const float *here[3], *there[3];
    for (unsigned c = 0; c < 3; c++) {
        here[c] = rows[1].plane[c] + first + 1;
        there[c] = rows[k / 3].plane[c] + first + k % 3;
    }
    OVER_PIXELS
    for (uint32_t i = 0; i < count; i++) {
        double x = (double)there[0][i] - (double)here[0][i];
        double y = (double)there[1][i] - (double)here[1][i];
        double z = (double)there[2][i] - (double)here[2][i];
        double square = x * x + y * y + z * z;
        bool counts = square < HUGE_VAL;
        to->x[i] = counts ? x : (double)NAN;
        to->y[i] = counts ? y : (double)NAN;
        to->z[i] = counts ? z : (double)NAN;
        to->square[i] = counts ? square : 0;
    }
}

/* Whole chunks, with a single selection per loop, so that the compiler makes no branch of it. */
static void select_farther(const double *restrict square, const double *restrict farthest,
                           const double *restrict from, double *restrict to)
{
    OVER_PIXELS
    for (uint32_t i = 0; i < CHUNK; i++) {
        double now = from[i], before = to[i];
        to[i] = square[i] > farthest[i] ? now : before;
    }
}

static void take_farther(const struct differences *to, struct differences *farthest)
{
    select_farther(to->square, farthest->square, to->x, farthest->x);
    select_farther(to->square, farthest->square, to->y, farthest->y);
    select_farther(to->square, farthest->square, to->z, farthest->z);
    OVER_PIXELS
    for (uint32_t i = 0; i < CHUNK; i++) {
        double square = to->square[i], before = farthest->square[i];
        farthest->square[i] = square > before ? square : before;
    }
}

/* Of neighbours that are ignored the product is NaN, which is not more than anything. */
static void take_opposite(const struct differences *restrict to,
                          const struct differences *restrict farthest,
                          double *restrict most_opposite)
{
    OVER_PIXELS
    for (uint32_t i = 0; i < CHUNK; i++) {
        double product = farthest->x[i] * to->x[i] + farthest->y[i] * to->y[i];
        double opposite = -(product + farthest->z[i] * to->z[i]);
        most_opposite[i] = opposite > most_opposite[i] ? opposite : most_opposite[i];
    }
}

/* Extremes of one component of the neighbours' colours. */
struct extremes {
    double low[CHUNK], high[CHUNK];
};

static void take_extremes(const double *restrict value, struct extremes *restrict so_far)
{
    OVER_PIXELS
    for (uint32_t i = 0; i < CHUNK; i++) {
        double now = value[i], low = so_far->low[i], high = so_far->high[i];
        so_far->low[i] = now < low ? now : low;
        so_far->high[i] = now > high ? now : high;
    }
}

/* The largest variance of a random value between the two extremes. */
static double range_variance(const struct extremes *extremes, uint32_t i)
{
    double range = extremes->high[i] - extremes->low[i];
    return range > 0 ? range * range / 4 : 0;
}

static void extremes_init(struct extremes *extremes)
{
    for (uint32_t i = 0; i < CHUNK; i++) {
        extremes->low[i] = HUGE_VAL;
        extremes->high[i] = -HUGE_VAL;
    }
}

#define HERE 4 /* index of the pixel itself among the 3 x 3 */

static void contrast_of_chunk(const struct color_row rows[3], uint32_t first, uint32_t count,
                              const struct contrasts *contrasts)
{
    struct differences to = {0}, farthest = {0};
    struct extremes extremes[3];
    double opposite[CHUNK] = {0};
    for (unsigned c = 0; c < 3; c++)
        extremes_init(&extremes[c]);
    for (unsigned k = 0; k < 9; k++) {
        if (k == HERE) continue;
        find_differences(rows, first, count, k, &to);
        take_farther(&to, &farthest);
        take_extremes(to.x, &extremes[0]);
        take_extremes(to.y, &extremes[1]);
        take_extremes(to.z, &extremes[2]);
    }
    for (unsigned k = 0; k < 9; k++) {
        if (k == HERE) continue;
        find_differences(rows, first, count, k, &to);
        take_opposite(&to, &farthest, opposite);
    }
    for (uint32_t i = 0; i < count; i++) {
        contrasts->largest[first + i] = farthest.square[i] / 3;
        contrasts->edge_variance[first + i] = opposite[i] / 3;
        contrasts->range_variance[first + i] =
            (range_variance(&extremes[0], i) + range_variance(&extremes[1], i) +
             range_variance(&extremes[2], i)) /
            3;
    }
}

void contrast_of_row(const struct color_row rows[3], uint32_t width,
                     const struct contrasts *contrasts)
{
    for (uint32_t first = 0; first < width; first += CHUNK)
        contrast_of_chunk(rows, first, width - first < CHUNK ? width - first : CHUNK, contrasts);
}
