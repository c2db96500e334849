/*
 * A scene of the farm's in the formats of other programs, as near as they can come. What differs:
 *
 * Tachyon (.dat): transparency does not bend rays and has no colour; no cones, which become
 * cylinders of their mean radius, as its own reader of NFF makes them; nothing is pruned but by
 * depth.
 * POV-Ray (.pov): rays are pruned one by one (adc_bailout: the farm's cutoff) instead of all of
 * a pixel's together.
 */
#ifndef FARM_BENCH_KERNEL_EXPORT_H
#define FARM_BENCH_KERNEL_EXPORT_H

#include "common/scene.h"

/* The files end the program when they cannot be written. */
void export_tachyon(const char *path, const struct scene *scene);
void export_povray(const char *path, const struct scene *scene);

#endif
