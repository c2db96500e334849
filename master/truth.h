/*
 * The true error of a picture: against a reference of the same size, such as one rendered with many
 * more samples.
 */
#ifndef FARM_MASTER_TRUTH_H
#define FARM_MASTER_TRUTH_H

#include <stdbool.h>

#include "master/canvas.h"

/*
 * Reads a colour picture in PFM ("PF", width, height, scale: negative for little-endian; rows from
 * the bottom) of this size. false, after saying why, when it is none or of another size; else
 * the caller frees it with canvas_free().
 */
bool truth_read(const char *path, uint32_t width, uint32_t height, struct canvas *canvas);

/* Root of the mean over pixels and components of the squared difference. */
double truth_rmse(const struct canvas *canvas, const struct canvas *reference);

struct truth {
    double rmse;
    double most; /* largest difference of a component */
    double p999; /* 99.9 % of the pixels differ by less in every component */
};
struct truth truth_of(const struct canvas *canvas, const struct canvas *reference);

#endif
