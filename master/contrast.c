#include "master/contrast.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#include "common/extremes.h"
#include "common/vec.h"

/* Pixels that are processed together: their data stays in the first-level cache. */
#define CHUNK 128u

/* Vectorised: the iterations, one for each pixel, are independent. That takes loops without branches. So there are
 * selections in their place, differences are computed anew in each loop rather than stored, and what depends on a
 * result selected before is in a loop of its own. */
#define OVER_PIXELS _Pragma("omp simd")

/* NaN in place of a colour of which any component is not finite: so all differences to it are NaN, which no comparison
 * below selects; nor do smaller_number() and larger_number(), as it is their first argument. */
void color_row_take(const struct color_row *row, const struct canvas *canvas, int64_t y)
{
    uint32_t width = canvas->width;
    bool inside = y >= 0 && y < canvas->height;
    const float *rgb = canvas->rgb + (inside ? 3 * (size_t)width * (size_t)y : 0);
    for (unsigned c = 0; c < 3; c++)
        row->plane[c][0] = row->plane[c][width + 1] = (double)NAN;
    for (uint32_t x = 0; x < width; x++) {
        const float *color = rgb + 3 * (size_t)x;
        bool counts = inside && isfinite(color[0]) && isfinite(color[1]) && isfinite(color[2]);
        for (unsigned c = 0; c < 3; c++)
            row->plane[c][x + 1] = counts ? (double)color[c] : (double)NAN;
    }
}

#define NEIGHBOURS 8

/* Applies DO(k) to each neighbour's number. A loop would keep the loop around it from being vectorised. */
#define FOR_NEIGHBOURS(DO) DO(0) DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7)

/* The planes of a chunk's pixels and of their neighbours: [i] belongs to the chunk's pixel i. */
struct planes {
    const double *here[3], *there[NEIGHBOURS][3];
};

static struct planes planes_of(const struct color_row rows[3], uint32_t first)
{
    struct planes planes;
    for (unsigned c = 0; c < 3; c++) {
        planes.here[c] = rows[1].plane[c] + first + 1;
        for (unsigned k = 0; k < NEIGHBOURS; k++) {
            unsigned place = k < 4 ? k : k + 1; /* of 3 x 3, row by row; 4 is the pixel itself */
            planes.there[k][c] = rows[place / 3].plane[c] + first + place % 3;
        }
    }
    return planes;
}

/* The difference between the colours of a neighbour and of a pixel. */
static inline struct vec3 difference_to(const struct planes *planes, unsigned k, uint32_t i)
{
    return vec3(planes->there[k][0][i] - planes->here[0][i],
                planes->there[k][1][i] - planes->here[1][i],
                planes->there[k][2][i] - planes->here[2][i]);
}

/* For each pixel of a chunk: the largest difference and its square; 0 where no neighbour counts. */
struct farthest {
    double x[CHUNK], y[CHUNK], z[CHUNK], square[CHUNK];
};

static inline void take_farther(struct vec3 to, struct vec3 *far, double *square)
{
    double now = vec_dot(to, to);
    bool farther = now > *square;
    far->x = farther ? to.x : far->x;
    far->y = farther ? to.y : far->y;
    far->z = farther ? to.z : far->z;
    *square = farther ? now : *square;
}

static void find_farthest(const struct planes *it, uint32_t count, struct farthest *farthest)
{
    const struct planes planes = *it;
    OVER_PIXELS
    for (uint32_t i = 0; i < count; i++) {
        struct vec3 far = vec3(0, 0, 0);
        double square = 0;
#define TAKE(k) take_farther(difference_to(&planes, k, i), &far, &square);
        FOR_NEIGHBOURS(TAKE)
#undef TAKE
        farthest->x[i] = far.x;
        farthest->y[i] = far.y;
        farthest->z[i] = far.z;
        farthest->square[i] = square;
    }
}

/* The product with the most opposite difference; 0 where there is none. */
static void find_opposite(const struct planes *it, uint32_t count, const struct farthest *farthest,
                          double opposite[CHUNK])
{
    const struct planes planes = *it;
    OVER_PIXELS
    for (uint32_t i = 0; i < count; i++) {
        struct vec3 far = {farthest->x[i], farthest->y[i], farthest->z[i]};
        double least = 0;
#define TAKE(k) least = smaller_number(vec_dot(far, difference_to(&planes, k, i)), least);
        FOR_NEIGHBOURS(TAKE)
#undef TAKE
        opposite[i] = least;
    }
}

/* The range of one component over the neighbours' colours; not above 0 where no neighbour counts. */
static void find_range(const struct planes *it, unsigned c, uint32_t count, double range[CHUNK])
{
    const struct planes planes = *it;
    OVER_PIXELS
    for (uint32_t i = 0; i < count; i++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
#define TAKE(k)                                                                                    \
    low = smaller_number(planes.there[k][c][i], low);                                              \
    high = larger_number(planes.there[k][c][i], high);
        FOR_NEIGHBOURS(TAKE)
#undef TAKE
        range[i] = high - low;
    }
}

/* The largest variance of a random value in such a range. */
static double range_variance(double range)
{
    return range > 0 ? range * range / 4 : 0;
}

static void contrast_of_chunk(const struct planes *planes, uint32_t count,
                              const struct contrasts *contrasts)
{
    struct farthest farthest;
    double opposite[CHUNK], range[3][CHUNK];
    find_farthest(planes, count, &farthest);
    find_opposite(planes, count, &farthest, opposite);
    for (unsigned c = 0; c < 3; c++)
        find_range(planes, c, count, range[c]);
    for (uint32_t i = 0; i < count; i++) {
        double sum =
            range_variance(range[0][i]) + range_variance(range[1][i]) + range_variance(range[2][i]);
        contrasts->largest[i] = farthest.square[i] / 3;
        contrasts->edge_variance[i] = (0 - opposite[i]) / 3;
        contrasts->range_variance[i] = isnan(planes->here[0][i]) ? 0 : sum / 3;
    }
}

void contrast_of_row(const struct color_row rows[3], uint32_t width,
                     const struct contrasts *contrasts)
{
    for (uint32_t first = 0; first < width; first += CHUNK) {
        struct planes planes = planes_of(rows, first);
        struct contrasts part = {contrasts->largest + first, contrasts->edge_variance + first,
                                 contrasts->range_variance + first};
        contrast_of_chunk(&planes, width - first < CHUNK ? width - first : CHUNK, &part);
    }
}
