/* Lights that stand inside of something. */
#ifndef FARM_MASTER_ENCLOSED_H
#define FARM_MASTER_ENCLOSED_H

#include "common/scene.h"

/*
 * Warns, once for the file, of lights inside of opaque spheres, boxes, cylinders and cones that the eye is outside of:
 * nothing that is seen gets their light. Scenes with so many lights and solids that looking would take long are not
 * looked at, and meshes never.
 */
void warn_of_enclosed_lights(const struct scene *scene, const char *config);

#endif
