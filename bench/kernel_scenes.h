/*
 * The scenes on which the kernel is measured beside its peers: INI files, and OBJ files for what is
 * a mesh, the same bytes on every run.
 */
#ifndef FARM_BENCH_KERNEL_SCENES_H
#define FARM_BENCH_KERNEL_SCENES_H

#include <stdbool.h>

/*
 * Writes FOLDER/NAME.ini and, if it needs one, NAME.obj; false when there is no scene of this name.
 * scale multiplies how many primitives there are, about: fractals grow by whole levels.
 */
bool kernel_scene_write(const char *folder, const char *name, double scale);

#endif
