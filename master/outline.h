/* How far a scene reaches in any direction, planes excluded. */
#ifndef FARM_MASTER_OUTLINE_H
#define FARM_MASTER_OUTLINE_H

#include <stdbool.h>

#include "common/vec.h"
#include "master/builder.h"

/* The outline of what the builder has; valid until more is added to it. The caller destroys it. */
struct outline *outline_create(const struct builder *builder);

void outline_destroy(struct outline *outline);

/*
 * The support function of all primitives but planes, relative to origin: for each of `count` directions the maximum of
 * (point - origin) . direction, into support. false when there are none. Infinite where a primitive is as large as
 * doubles go.
 */
bool outline_support(const struct outline *outline, struct vec3 origin, unsigned count,
                     const struct vec3 *directions, double *support);

/*
 * The axis-aligned box around all primitives but planes; false when there are none. Corners may be infinite where a
 * primitive is as large as doubles go.
 */
bool outline_bounds(const struct outline *outline, struct vec3 *min, struct vec3 *max);

#endif
