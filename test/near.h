/* Assertions about numbers. */
#ifndef FARM_TEST_NEAR_H
#define FARM_TEST_NEAR_H

#include <math.h>

#include "test/unit.h"

static inline void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.17g is not within %g of %.17g", value, tolerance, expected);
}

/* tolerance: a share of what is expected. */
static inline void assert_close(double value, double expected, double share)
{
    assert_near(value, expected, share * fabs(expected));
}

static inline void assert_same(double value, double expected)
{
    if (!(value == expected)) fail_msg("%.17g is not %.17g", value, expected);
}

#endif
