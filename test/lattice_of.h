/* The definition of the lattices of master/lattice.h, applied to one pixel at a time. */
#ifndef FARM_TEST_LATTICE_OF_H
#define FARM_TEST_LATTICE_OF_H

#include "master/lattice.h"

/* The coarsest lattice that contains this pixel; all finer ones contain it, too. */
static inline uint32_t lattice_of(uint32_t x, uint32_t y)
{
    uint32_t k = 0;
    while (k < LATTICE_COARSEST / 2 && ((x | y) >> k & 1) == 0)
        k++;
    if (k == LATTICE_COARSEST / 2) return LATTICE_COARSEST;
    return 2 * k + (((x ^ y) >> k & 1) == 0);
}

#endif
