/* The pictures that the programs leave, side by side. */
#ifndef FARM_BENCH_KERNEL_PICTURE_H
#define FARM_BENCH_KERNEL_PICTURE_H

#include <stdbool.h>

#include "master/canvas.h"

/* Reads a PFM file, or a PPM file of 8 or 16 bit (binary, linear); false, after saying why, when it
 * cannot. The caller frees it with canvas_free(). */
bool picture_read(const char *path, struct canvas *picture);

/* Of two pictures of the same size, values clamped to 0..1 as a PNG would have them. */
struct picture_difference {
    double rmse;
    double off; /* share of pixels with a component that differs by more than 16/255 */
};

struct picture_difference picture_compare(const struct canvas *a, const struct canvas *b);

/* Pictures at half their size in a grid, `columns` a row; those without pixels stay black. */
bool picture_montage(const char *path, const struct canvas *pictures, unsigned count,
                     unsigned columns);

#endif
