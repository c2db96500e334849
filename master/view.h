/* What the scene block says of the camera and of how the picture is rendered. */
#ifndef FARM_MASTER_VIEW_H
#define FARM_MASTER_VIEW_H

#include "common/scene.h"
#include "master/settings.h"

/* Half the height of the picture at a distance of 1 from the eye; fov in degrees. */
double view_half_height(double fov);

/* The view for the scene block; settings as checked by load_job(). */
struct view settings_view(const struct settings *settings);

#endif
