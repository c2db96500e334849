/* fmax() and fmin() of numbers, and like them the other one of a NaN: but those are calls into the library. */
#ifndef FARM_COMMON_EXTREMES_H
#define FARM_COMMON_EXTREMES_H

#include <math.h>

static inline double max_number(double a, double b)
{
    return a > b || isnan(b) ? a : b;
}

static inline double min_number(double a, double b)
{
    return a < b || isnan(b) ? a : b;
}

#endif
