/*
 * The first view of the picture: the colours of the probes (TILE_PROBE in common/tile.h), one per
 * block. It stands in for tiles that an interrupted run has not finished.
 */
#ifndef FARM_MASTER_PREVIEW_H
#define FARM_MASTER_PREVIEW_H

#include "master/canvas.h"
#include "master/coverage.h"

/* All zero: nothing is known. */
struct preview {
    uint32_t edge;          /* of a block, pixels; 0: no probe is back */
    uint32_t columns, rows; /* blocks */
    float *rgb;             /* 3 per block; NaN: not known */
};

void preview_free(struct preview *preview);

/* Takes in a valid probe tile of a picture of this size: 3 floats per pixel. */
void preview_put(struct preview *preview, uint32_t width, uint32_t height, const struct tile *probe,
                 const float *rgb);

/* Gives blocks that are not known the colour of the nearest one that is (counted in steps to the side
 * and up or down). */
void preview_complete(struct preview *preview);

/* Fills the pixels of a tile with the colours of their blocks; those without one stay as they are, and
 * those that are there already (NULL: none is). */
void preview_fill(const struct preview *preview, struct canvas *canvas, const struct tile *tile,
                  const struct coverage *there);

#endif
