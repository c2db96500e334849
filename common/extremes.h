/* Of two numbers, in one instruction: fmax() and fmin() are calls into the library, for they think of NaN.
 * Here b wins if either is one. */
#ifndef FARM_COMMON_EXTREMES_H
#define FARM_COMMON_EXTREMES_H

static inline double larger_number(double a, double b)
{
    return a > b ? a : b;
}

static inline double smaller_number(double a, double b)
{
    return a < b ? a : b;
}

#endif
