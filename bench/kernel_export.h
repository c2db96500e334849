/*
 * Writes the farm's scenes in the formats of other programs, as closely as they allow. The differences:
 *
 * Tachyon (.dat): transparency does not refract rays and has no colour; there are no cones, which become
 * cylinders of their mean radius, as Tachyon's own NFF reader makes them; only depth limits rays.
 *
 * POV-Ray (.pov): rays are pruned one by one (adc_bailout: the farm's cutoff) instead of all rays of a pixel
 * together.
 */
#ifndef FARM_BENCH_KERNEL_EXPORT_H
#define FARM_BENCH_KERNEL_EXPORT_H

#include "common/scene.h"

/* These end the program when the file cannot be written. */
void export_tachyon(const char *path, const struct scene *scene);
void export_povray(const char *path, const struct scene *scene);

#endif
