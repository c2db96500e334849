/* The median of what was measured several times. */
#ifndef FARM_BENCH_MEDIAN_H
#define FARM_BENCH_MEDIAN_H

/* Of at least one value; sorts them. */
double median_of(double *values, unsigned count);

#endif
