/*
 * Lattices of pixels, each with half as many as the one before, all of which it shares with that: where
 * there is no time for every pixel, those of a coarse one are spread evenly, and the next finer one
 * takes only what lies between.
 *
 * Lattice 0 is all pixels. Lattice 2 k is every 2^k-th pixel of every 2^k-th row, lattice 2 k + 1 every
 * second one of these, as the fields of one colour on a chess-board (quincunx).
 */
#ifndef FARM_MASTER_LATTICE_H
#define FARM_MASTER_LATTICE_H

#include <stdint.h>

/* The coarsest one: every eighth pixel of every eighth row. Probes lie as close, or half as close
 * (queue_auto_probe_edge()), so that with fewer pixels the picture would show no more than they do. */
#define LATTICE_COARSEST 6u

/* Its rows lie so far apart, and the pixels in them. */
#define LATTICE_SPACING (1u << LATTICE_COARSEST / 2)

/* The rows of a lattice lie so far apart, from row 0 on. */
static inline uint32_t lattice_rows(uint32_t lattice)
{
    return UINT32_C(1) << lattice / 2;
}

/* In one of its rows: the first pixel that it has, and from there to the next one. */
static inline uint32_t lattice_first(uint32_t lattice, uint32_t y)
{
    return lattice % 2 ? y & lattice_rows(lattice) : 0;
}

static inline uint32_t lattice_step(uint32_t lattice)
{
    return lattice_rows(lattice) << lattice % 2;
}

/* The pixels that a lattice has and the next coarser one has not: the first of its rows that has any, every so many
 * rows from there on another one, and in such a row the first pixel, and from there to the next one. lattice <
 * LATTICE_COARSEST. */
static inline uint32_t lattice_between_row(uint32_t lattice)
{
    return lattice % 2 ? lattice_rows(lattice) : 0;
}

static inline uint32_t lattice_between_rows(uint32_t lattice)
{
    return lattice_rows(lattice) << lattice % 2;
}

static inline uint32_t lattice_between_first(uint32_t lattice, uint32_t y)
{
    uint32_t spacing = lattice_rows(lattice);
    return lattice % 2 || y / spacing % 2 == 0 ? spacing : 0;
}

static inline uint32_t lattice_between_step(uint32_t lattice)
{
    return 2 * lattice_rows(lattice);
}

#endif
