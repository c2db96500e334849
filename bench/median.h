/* The median of repeated measurements. */
#ifndef FARM_BENCH_MEDIAN_H
#define FARM_BENCH_MEDIAN_H

/* The median of at least one value; sorts the values. */
double median_of(double *values, unsigned count);

#endif
