/*
 * The first view of the picture: the colours of the probes (TILE_PROBE in common/tile.h), one per
 * block. It stands in for pixels that nobody has rendered (master/fill.h).
 */
#ifndef FARM_MASTER_PREVIEW_H
#define FARM_MASTER_PREVIEW_H

#include "common/tile.h"

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

/* The colour of the block that this pixel lies in, as long as nothing is put in or completed; NULL: it is not
 * known. */
const float *preview_color(const struct preview *preview, uint32_t x, uint32_t y);

#endif
