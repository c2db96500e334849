/* The scenes on which the kernel is compared with other programs: INI files, and OBJ files for meshes, the same
 * bytes on every run. */
#ifndef FARM_BENCH_KERNEL_SCENES_H
#define FARM_BENCH_KERNEL_SCENES_H

#include <stdbool.h>

/*
 * Writes FOLDER/NAME.ini and, if it needs one, NAME.obj; false when there is no scene of this name. scale
 * multiplies the number of primitives, approximately: fractals grow by whole levels.
 */
bool kernel_scene_write(const char *folder, const char *name, double scale);

#endif
