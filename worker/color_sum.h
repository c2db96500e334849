/* A compensated sum of colours: small terms are not lost beside large ones. */
#ifndef FARM_WORKER_COLOR_SUM_H
#define FARM_WORKER_COLOR_SUM_H

#include "common/vec.h"
#include "worker/exact.h"

/*
 * A. Neumaier's improvement of Kahan's summation ("Rundungsfehleranalyse einiger Verfahren zur Summation
 * endlicher Summen", ZAMM 54, 1974). The relative error of the sum of n nonnegative colours is at most u +
 * n^2 u^2 / 2, however different their sizes are. `plain` alone is the ordinary sum.
 */
struct color_sum {
    struct vec3 plain, lost;
};

static inline void lost_add(double *plain, double *lost, double value)
{
    struct dd sum = exact_sum(*plain, value);
    *plain = sum.high;
    *lost += sum.low;
}

static inline void color_sum_add(struct color_sum *sum, struct vec3 color)
{
    lost_add(&sum->plain.x, &sum->lost.x, color.x);
    lost_add(&sum->plain.y, &sum->lost.y, color.y);
    lost_add(&sum->plain.z, &sum->lost.z, color.z);
}

/* If the sum is infinite, `lost` is NaN and is left out. */
static inline struct vec3 color_sum_value(const struct color_sum *sum)
{
    if (!vec_is_finite(sum->plain)) return sum->plain;
    return vec_add(sum->plain, sum->lost);
}

#endif
