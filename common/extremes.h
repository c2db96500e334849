/*
 * Minimum and maximum of two numbers in one instruction. fmax() and fmin() are library calls because of their
 * treatment of NaN; here the result is b if either argument is NaN.
 */
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
