/* What a pixel's colour differs from its neighbours' by. */
#ifndef FARM_MASTER_CONTRAST_H
#define FARM_MASTER_CONTRAST_H

#include <stdint.h>

#include "master/canvas.h"

/* Squares of differences between colours, as means of the components. */
struct contrast {
    double largest; /* C^2 of master/adaptive.h */
    double across;  /* P */
};

/* Of pixel x, y of a canvas to its at most 8 neighbours; those that are not finite do not count. */
struct contrast contrast_of(const struct canvas *canvas, uint32_t x, uint32_t y);

#endif
