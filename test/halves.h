/* What a renderer tells of a pixel's samples (worker/task.h), from values that need no rays. */
#ifndef FARM_TEST_HALVES_H
#define FARM_TEST_HALVES_H

#include <math.h>
#include <stdint.h>

#include "common/protocol.h"

/* Of the samples so far: by whether their number is even, and all. */
struct halves {
    double sum[2], squares;
};

/* value: grey. */
static inline void halves_add(struct halves *halves, uint32_t sample, double value)
{
    halves->sum[sample % 2] += value;
    halves->squares += value * value;
}

/* The samples, an even number, as those of pixel i of a part; each of them was a ray. */
static inline void halves_tell(const struct halves *halves, uint32_t samples, uint32_t i,
                               const struct pixel_floats *to)
{
    double half = samples / 2.0, even = halves->sum[0] / half, odd = halves->sum[1] / half;
    double within = halves->squares - half * (even * even + odd * odd);
    for (uint32_t c = 0; c < 3; c++) {
        to->mean[3 * i + c] = (float)((even + odd) / 2);
        to->difference[3 * i + c] = (float)(even - odd);
    }
    to->spread[i] = (float)sqrt(fmax(0, within / samples));
    to->rays[i] = 1;
}

#endif
