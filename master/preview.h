/* A coarse first view of the picture: blocks of one colour each, which is that of a probe (TILE_PROBE in
 * common/tile.h). It stands in for pixels that are not rendered (master/fill.h). */
#ifndef FARM_MASTER_PREVIEW_H
#define FARM_MASTER_PREVIEW_H

#include "common/tile.h"

/* A preview that is all zero is empty. */
struct preview {
    uint32_t edge;          /* edge of a block, pixels; 0: no probe has arrived */
    uint32_t columns, rows; /* blocks */
    float *rgb;             /* 3 per block; NaN: unknown */
};

void preview_free(struct preview *preview);

/* Stores the colours of a valid probe tile, 3 floats per pixel, of a picture of this size. */
void preview_put(struct preview *preview, uint32_t width, uint32_t height, const struct tile *probe,
                 const float *rgb);

/* Gives each unknown block the colour of the nearest known one (in Manhattan distance). */
void preview_complete(struct preview *preview);

/* Stores the colour at this pixel of a complete preview. Each block has the colour of the probe in its middle;
 * between these middles it is interpolated bilinearly, and beyond the outermost ones it is constant. If the
 * preview is empty, color stays as it is. */
void preview_between(const struct preview *preview, uint32_t x, uint32_t y, float color[3]);

#endif
