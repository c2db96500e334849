/*
 * Pixels that nobody has rendered, filled in from those that are there: better to look at than gaps, and
 * nothing else.
 */
#ifndef FARM_MASTER_FILL_H
#define FARM_MASTER_FILL_H

#include <stdint.h>

#include "master/canvas.h"
#include "master/preview.h"

/*
 * known: one per pixel of the canvas, rows from the top; 0: nobody has rendered it. Such a pixel of the coarsest
 * lattice (master/lattice.h) gets the colour of its block in the preview, or stays as it is where that knows
 * nothing at all; from there on, lattice by lattice, each gets the mean of the nearest ones of the coarser lattice,
 * four or at the borders fewer, or the colour of its block where blocks are as small as that. Of a picture all
 * of which is known nothing changes.
 */
void fill_unknown(struct canvas *canvas, const uint8_t *known, struct preview *preview);

/*
 * About what a pixel is off by that fill_unknown() guesses: squared, mean of the components. It is told by those of the
 * finest lattice that is known as a whole, where there is something to guess beside them: by what they would be off by
 * if they were guessed from the next coarser lattice. NaN: nobody knows, as no two lattices are there or the picture
 * is too small for them. Behind fill_unknown(), with the same preview.
 */
double fill_error(const struct canvas *canvas, const uint8_t *known, const struct preview *preview);

#endif
