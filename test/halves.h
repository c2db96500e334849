/* Computes what a renderer sends of a pixel's samples (worker/task.h) from given values, without tracing rays. */
#ifndef FARM_TEST_HALVES_H
#define FARM_TEST_HALVES_H

#include <math.h>
#include <stdint.h>

#include "common/protocol.h"

/* Sums over the samples so far: over those of even and of odd number, and over all. */
struct halves {
    double sum[2], squares;
};

/* Adds a sample whose colour is the grey `value`. */
static inline void halves_add(struct halves *halves, uint32_t sample, double value)
{
    halves->sum[sample % 2] += value;
    halves->squares += value * value;
}

/* Stores the results for pixel i of a part. samples: their number, even; each of them took one ray. */
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
