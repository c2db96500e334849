/* A camera and lights for scenes that come without. */
#ifndef FARM_MASTER_FRAMING_H
#define FARM_MASTER_FRAMING_H

#include "common/settings.h"
#include "master/builder.h"

/*
 * Chooses eye, unless it is set: seen from the front, somewhat from the right and above, as near as all bounded
 * primitives are in the picture; and look_at, unless it is set: so that they are in the middle of it, or the centre of
 * their box where eye is set. up and fov are used as they are.
 */
void frame_scene(const struct builder *builder, struct settings *settings, bool has_eye,
                 bool has_look_at);

/* A key light over the right shoulder and a weaker one from the left, for the camera in settings.
 */
void shoulder_lights(const struct settings *settings, struct light lights[2]);

#endif
