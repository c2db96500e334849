/* Warns of lights that are inside of an opaque solid. */
#ifndef FARM_MASTER_ENCLOSED_H
#define FARM_MASTER_ENCLOSED_H

#include "common/scene.h"

/*
 * Warns, once for the file, of lights inside of opaque spheres, boxes, cylinders and cones while the eye is outside:
 * nothing that is seen gets their light. Meshes are not examined, nor are scenes without shadows, or with so many
 * lights and solids that the test would take long.
 */
void warn_of_enclosed_lights(const struct scene *scene, const char *config);

#endif
