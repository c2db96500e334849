/* Rotations, scales and shifts of included parts (struct placement of master/load.h). */
#ifndef FARM_MASTER_PLACEMENT_H
#define FARM_MASTER_PLACEMENT_H

#include <stdbool.h>

#include "master/load.h"

/* degrees: about x, then about y, then about z; multiples of 90 are exact. */
struct placement placement_make(struct vec3 degrees, double scale, struct vec3 translate);

/* First inner, then outer. */
struct placement placement_compose(const struct placement *outer, const struct placement *inner);

struct vec3 place_point(const struct placement *placement, struct vec3 point);
/* Turns only: normals, and directions without a length. */
struct vec3 place_direction(const struct placement *placement, struct vec3 direction);

/* Whether coordinate axes become coordinate axes, so that an axis-aligned box stays one. */
bool placement_keeps_axes(const struct placement *placement);

#endif
