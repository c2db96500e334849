/*
 * Nested lattices of pixels: each has half as many pixels as the one before, all of which belong to that one, too.
 * Where there is no time for every pixel, those of a coarse lattice are spread evenly over the picture, and the next
 * finer one only adds the pixels in between.
 *
 * Lattice 0 is all pixels. Lattice 2 k is every 2^k-th pixel of every 2^k-th row. Lattice 2 k + 1 is every second pixel
 * of that, like the fields of one colour on a chess-board (quincunx).
 */
#ifndef FARM_MASTER_LATTICE_H
#define FARM_MASTER_LATTICE_H

#include <stdint.h>

/* The coarsest lattice: every eighth pixel of every eighth row. Probes are as far apart, or half as far
 * (queue_auto_probe_edge()), so a picture of fewer pixels would show no more than they do. */
#define LATTICE_COARSEST 6u

/* The distance between its rows, and between the pixels of a row. */
#define LATTICE_SPACING (1u << LATTICE_COARSEST / 2)

/* The distance between the rows of a lattice; the first one is row 0. */
static inline uint32_t lattice_row_step(uint32_t lattice)
{
    return UINT32_C(1) << lattice / 2;
}

/* In a row y of the lattice: its first pixel, and the distance to the next one. */
static inline uint32_t lattice_first(uint32_t lattice, uint32_t y)
{
    return lattice % 2 ? y & lattice_row_step(lattice) : 0;
}

static inline uint32_t lattice_step(uint32_t lattice)
{
    return lattice_row_step(lattice) << lattice % 2;
}

/* The pixels that a lattice has but not the next coarser one, lattice < LATTICE_COARSEST: the first row that has any,
 * the first pixel in such a row y, and the distance to the next one. Such rows are lattice_step() apart. */
static inline uint32_t lattice_between_first_row(uint32_t lattice)
{
    return lattice % 2 ? lattice_row_step(lattice) : 0;
}

static inline uint32_t lattice_between_first(uint32_t lattice, uint32_t y)
{
    uint32_t spacing = lattice_row_step(lattice);
    return lattice % 2 || y / spacing % 2 == 0 ? spacing : 0;
}

static inline uint32_t lattice_between_step(uint32_t lattice)
{
    return 2 * lattice_row_step(lattice);
}

#endif
