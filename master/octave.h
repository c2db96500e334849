/* Octaves of numbers that are not negative, read off their bits: when the probes are back, thousands of tiles
 * are sorted by them while all renderers wait. */
#ifndef FARM_MASTER_OCTAVE_H
#define FARM_MASTER_OCTAVE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define OCTAVE_MANTISSA 52
#define OCTAVE_MIDDLE   1023

/* The octave of 1 is 0, of 2 and 3 it is 1. Of 0 and subnormal numbers it is one below all others. */
static inline int octave_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (int)(bits >> OCTAVE_MANTISSA) - OCTAVE_MIDDLE;
}

/* The largest power of sqrt(2) that is not larger; 0 of 0 and subnormal numbers. */
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
