/* Where the reference's rays meet primitives. */
#ifndef FARM_TEST_REFERENCE_CROSSINGS_H
#define FARM_TEST_REFERENCE_CROSSINGS_H

#include <stdbool.h>

#include "test/reference_numbers.h"

enum { CONE_SIDE_PART, CONE_BASE_PART, CONE_APEX_PART }; /* a box's parts are its faces */

struct ray {
    struct point origin, direction;
    uint32_t from, from_part;
    double o[3], d[3]; /* the same, rounded */
};

struct ray make_ray(struct point origin, struct point direction, uint32_t from, uint32_t part);

/* Where a ray's line meets one primitive: 6 faces at most. */
struct crossing {
    real t, u, v;
    uint32_t part;
};

struct crossings {
    unsigned count;
    struct crossing at[6];
};

/* All crossings of the ray's line and the primitive; the one that the ray starts from is left out. */
void cross_primitive(ref r, uint32_t id, const struct ray *ray, struct crossings *found);

/* A sphere around a primitive, in double: what is clearly past it need not be looked at closer. */
struct reach {
    double center[3], radius;
};

void primitive_reach(const struct scene *scene, uint32_t id, struct reach *reach);

/* Whether the line passes the primitive at a distance that no rounding explains. */
bool clearly_past(const struct reach *reach, const struct ray *ray);

/* The axis as the cone's own measure: w = apex - base, W = w.w, height s = p.w / W. */
struct axis {
    struct point base, w;
    real W;
};

struct axis cone_axis(ref r, const struct cone *cone);

/* The indices of a triangle's or patch's corners. */
const uint32_t *triangle_corners(const struct scene *scene, uint32_t id);

#endif
