/* Sums and products with a known error, from the fused multiply-add. */
#ifndef FARM_WORKER_EXACT_H
#define FARM_WORKER_EXACT_H

#include <math.h>

/*
 * a b - c d with a relative error of at most 2 u (W. Kahan; Jeannerod, Louvet and Muller, "Further
 * analysis of Kahan's algorithm for the accurate computation of 2x2 determinants", Math. Comp. 82,
 * 2013), barring underflow and overflow: the sign is exact, and the result is 0 only when it
 * should.
 */
static inline double difference_of_products(double a, double b, double c, double d)
{
    double cd = c * d;
    double error = fma(-c, d, cd);
    return fma(a, b, -cd) + error;
}

/* A value and what rounding took from it: high + low. */
struct compensated {
    double high, low;
};

/* a - b without any error (Knuth's TwoSum). */
static inline struct compensated exact_difference(double a, double b)
{
    double high = a - b;
    double minus_b = high - a;
    return (struct compensated){high, (a - (high - minus_b)) - (b + minus_b)};
}

/* sum + a b as if computed in twice the precision and rounded (Ogita, Rump and Oishi, "Accurate sum
 * and dot product", SIAM J. Sci. Comput. 26, 2005). */
static inline struct compensated add_product(struct compensated sum, double a, double b)
{
    double product = a * b;
    double product_error = fma(a, b, -product);
    double high = sum.high + product;
    double part = high - sum.high;
    double sum_error = (sum.high - (high - part)) + (product - part);
    return (struct compensated){high, sum.low + (sum_error + product_error)};
}

#endif
