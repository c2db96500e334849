/* Reads, compares and joins the pictures that the programs have made. */
#ifndef FARM_BENCH_KERNEL_PICTURE_H
#define FARM_BENCH_KERNEL_PICTURE_H

#include <stdbool.h>

#include "master/canvas.h"

/* Reads a PFM file, or a PPM file of 8 or 16 bit (binary, linear); false, after saying why, when it
 * cannot. The caller frees it with canvas_free(). */
bool picture_read(const char *path, struct canvas *picture);

/* The difference of two pictures of the same size, with values clamped to 0..1 as in a PNG. */
struct picture_difference {
    double rmse;
    double differing; /* share of pixels with a component that differs by more than 16/255 */
};

struct picture_difference picture_compare(const struct canvas *a, const struct canvas *b);

/* Writes pictures at half their size in a grid, with `columns` per row; those without pixels stay black. */
bool picture_montage(const char *path, const struct canvas *pictures, unsigned count,
                     unsigned columns);

#endif
