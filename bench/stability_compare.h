/* Traces a ray with both sets of formulas and compares both with the oracle. */
#ifndef FARM_BENCH_STABILITY_COMPARE_H
#define FARM_BENCH_STABILITY_COMPARE_H

#include "bench/oracle.h"
#include "bench/stability.h"

/* Scores the nearest hits of our formulas and of the paper's, each as a wrong decision or as an error of t (by ulps()
 * or roundoffs()), and counts one more sample. expected: whether the ray hits anything. */
void compare_both(const struct stage *stage, const struct ray *ray, bool expected, mpfr_t t,
                  double (*error)(double, mpfr_t), struct tally *tally, uint64_t sample);

#endif
