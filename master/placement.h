/* Placements of included parts of a scene: rotation, uniform scale and translation. */
#ifndef FARM_MASTER_PLACEMENT_H
#define FARM_MASTER_PLACEMENT_H

#include <stdbool.h>

#include "common/vec.h"

/* Where an included part of a scene is put: p -> translate + scale * (rotation p). */
struct placement {
    double rotation[3][3]; /* orthonormal, right-handed */
    double scale;          /* > 0 */
    struct vec3 translate;
};

extern const struct placement placement_identity;

/* Rotates by `degrees` about x, then about y, then about z; multiples of 90 are exact. */
struct placement placement_make(struct vec3 degrees, double scale, struct vec3 translate);

/* The placement that applies inner first, then outer. */
struct placement placement_compose(const struct placement *outer, const struct placement *inner);

struct vec3 placement_point(const struct placement *placement, struct vec3 point);
/* Applies the rotation only: for normals, and directions whose length does not matter. */
struct vec3 placement_direction(const struct placement *placement, struct vec3 direction);

/* Whether coordinate axes become coordinate axes, so that an axis-aligned box stays one. */
bool placement_keeps_axes(const struct placement *placement);

#endif
