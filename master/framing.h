/* Default camera and lights for scenes that have none. */
#ifndef FARM_MASTER_FRAMING_H
#define FARM_MASTER_FRAMING_H

#include "master/builder.h"
#include "master/settings.h"

/*
 * Chooses eye and look_at, unless they are set. The eye is in front of the scene, somewhat to the right and
 * above, as near as all bounded primitives are still in the picture. look_at is chosen so that they are in the
 * middle of the picture, or, where eye is set, as the centre of their bounding box. up and fov are used as they
 * are.
 */
void frame_scene(const struct builder *builder, struct settings *settings, bool has_eye,
                 bool has_look_at);

/* Two lights for the camera in settings: a key light over the right shoulder and a weaker one from the left. */
void shoulder_lights(const struct settings *settings, struct light lights[2]);

#endif
