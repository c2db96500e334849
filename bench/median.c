#include "bench/median.h"

#include <stdlib.h>

static int ascending(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

void sort_values(double *values, size_t count)
{
    qsort(values, count, sizeof *values, ascending);
}

double median_of(double *values, unsigned count)
{
    sort_values(values, count);
    return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}
