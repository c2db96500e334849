/*
 * Scales a scene up without changing its picture, for programs with tolerances in scene units: POV-Ray sees no
 * shadow within 1e-3 of a surface, Tachyon starts rays 5e-5 from one. A table setting of millimetres, modelled
 * in metres, they would render wrongly.
 */
#ifndef FARM_BENCH_ERROR_SCALE_H
#define FARM_BENCH_ERROR_SCALE_H

#include "common/scene.h"

/*
 * Enlarges the scene, with eye and lights, by the least power of two with which all spheres, discs, boxes,
 * cylinders and cones are at least 1 thick. Scenes of meshes alone are left as they are. As no light has
 * falloff, the picture stays the same.
 */
void scale_for_peers(struct scene *scene);

#endif
