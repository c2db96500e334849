/* Traces a ray with both sets of formulas and compares both with the oracle. */
#ifndef FARM_BENCH_STABILITY_COMPARE_H
#define FARM_BENCH_STABILITY_COMPARE_H

#include "bench/oracle.h"
#include "bench/stability.h"

/* The nearest hits of ours and of the paper's, and one more sample: a wrong decision, or an error of t (by ulps() or
 * roundoffs()); without `expected`, nothing is met. */
void compare_both(const struct stage *stage, const struct ray *ray, bool expected, mpfr_t t,
                  double (*error)(double, mpfr_t), struct tally *tally, uint64_t sample);

#endif
