/* Octaves (binary exponents) of nonnegative numbers. They are read from the bits of the number, as speed matters: when
 * the probes are back, thousands of tiles are sorted by them while all renderers wait. */
#ifndef FARM_MASTER_OCTAVE_H
#define FARM_MASTER_OCTAVE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define OCTAVE_MANTISSA 52
#define OCTAVE_MIDDLE   1023

/* The octave of 1 is 0, that of 2 and 3 is 1. That of 0 and of subnormal numbers is one below all others. */
static inline int octave_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (int)(bits >> OCTAVE_MANTISSA) - OCTAVE_MIDDLE;
}

/* The largest power of sqrt(2) that is not larger than value; 0 for 0 and subnormal numbers. */
static inline double half_octave_below(double value)
{
    uint64_t bits;
    double whole;
    memcpy(&bits, &value, sizeof bits);
    bits = bits >> OCTAVE_MANTISSA << OCTAVE_MANTISSA;
    memcpy(&whole, &bits, sizeof whole);
    return value >= whole * M_SQRT2 ? whole * M_SQRT2 : whole;
}

#endif
