/*
 * The same picture of a larger scene, for programs with tolerances in scene units: POV-Ray sees no
 * shadow within 1e-3 of a surface, Tachyon starts rays 5e-5 from one. Of a table setting of
 * millimetres in metres they render another picture.
 */
#ifndef FARM_BENCH_ERROR_SCALE_H
#define FARM_BENCH_ERROR_SCALE_H

#include "common/scene.h"

/*
 * Enlarges the scene, with eye and lights, by the least power of two that makes all spheres, discs,
 * boxes, cylinders and cones at least 1 thick. Meshes alone are left as they are. No light has falloff,
 * so the picture stays the same.
 */
void scale_for_peers(struct scene *scene);

#endif
