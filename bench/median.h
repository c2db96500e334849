/* Measurements in ascending order, and their median. */
#ifndef FARM_BENCH_MEDIAN_H
#define FARM_BENCH_MEDIAN_H

#include <stddef.h>

void sort_values(double *values, size_t count);

/* The median of at least one value; sorts the values. */
double median_of(double *values, unsigned count);

#endif
