/* Fills pixels that are not rendered with colours from their neighbours or from the preview, which only have to look
 * better than gaps. */
#ifndef FARM_MASTER_FILL_H
#define FARM_MASTER_FILL_H

#include <stdint.h>

#include "master/canvas.h"
#include "master/preview.h"

/*
 * Fills all unknown pixels. known: one byte per pixel of the canvas, rows from the top; 0: not rendered.
 *
 * The pixels of the coarsest lattice (master/lattice.h) are filled first: an unknown one gets the colour of the
 * preview there (preview_between()), or stays as it is if the preview is empty. Then, lattice by lattice, each unknown
 * pixel gets the mean of its nearest neighbours in the next coarser lattice: four of them, or fewer at the borders. It
 * gets the colour of the preview instead where the blocks of the preview are no larger than the distance to these
 * neighbours, or up to twice that if most of the neighbours are unknown. If all pixels are known the canvas does not
 * change. *preview is completed (preview_complete()).
 */
void fill_unknown(struct canvas *canvas, const uint8_t *known, struct preview *preview);

/*
 * Estimates the mean squared error, over pixels and components, of the pixels that fill_unknown() has filled. It is
 * measured on known pixels of the finest lattice that is known completely: those with unknown pixels beside them are
 * compared with the colours that would be guessed for them from the next coarser lattice. NaN: there is no estimate, as
 * no lattice finer than the coarsest is complete, or the picture is too small. To be called after fill_unknown(), with
 * the same preview.
 */
double fill_error(const struct canvas *canvas, const uint8_t *known, const struct preview *preview);

#endif
