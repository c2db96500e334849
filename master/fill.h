/* Fills pixels that are not rendered with colours from their neighbours. This is only meant to look better than
 * gaps. */
#ifndef FARM_MASTER_FILL_H
#define FARM_MASTER_FILL_H

#include <stdint.h>

#include "master/canvas.h"
#include "master/preview.h"

/*
 * Fills all unknown pixels. known: one per pixel of the canvas, rows from the top; 0: not rendered. An unknown
 * pixel of the coarsest lattice (master/lattice.h) gets the colour that the preview has there (preview_between()), or
 * stays as it is if the preview is empty. From there on, lattice by lattice, each unknown pixel gets the mean of its
 * nearest neighbours in the coarser lattice, four or at the borders fewer; or the colour of the preview where its
 * blocks are as small as that. If all pixels are known nothing changes.
 */
void fill_unknown(struct canvas *canvas, const uint8_t *known, struct preview *preview);

/*
 * Estimates the mean squared error, over pixels and components, of the pixels that fill_unknown() has filled. It is
 * measured with known pixels: those of the finest lattice that is known completely, where there are unknown pixels
 * beside them, are compared with what they would be if they were guessed from the next coarser lattice. NaN: unknown,
 * as no lattice finer than the coarsest is complete, or the picture is too small. To be called after fill_unknown(),
 * with the same preview.
 */
double fill_error(const struct canvas *canvas, const uint8_t *known, const struct preview *preview);

#endif
