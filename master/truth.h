/*
 * The true error of a picture: its difference from a reference of the same size, such as one rendered with many more
 * samples.
 */
#ifndef FARM_MASTER_TRUTH_H
#define FARM_MASTER_TRUTH_H

#include <stdbool.h>

#include "master/canvas.h"

/*
 * Reads a colour picture in PFM format ("PF", width, height, scale: negative for little-endian; rows from the bottom)
 * that must be of this size. Returns true, and the caller frees the canvas with canvas_free(); or false after reporting
 * why not.
 */
bool truth_read(const char *path, uint32_t width, uint32_t height, struct canvas *canvas);

/* RMSE: root of the mean, over pixels and components, of the squared difference. */
double truth_rmse(const struct canvas *canvas, const struct canvas *reference);

struct truth {
    double rmse;
    double most; /* largest difference of a component */
    double p999; /* 99.9 % of the pixels differ by less in every component */
};

/* The two pictures have the same size, of one pixel at least. A component that is not finite differs infinitely from
 * the reference, which is finite. */
struct truth truth_of(const struct canvas *canvas, const struct canvas *reference);

#endif
