/* Crossings of rays and primitives in the reference renderer. */
#ifndef FARM_TEST_REFERENCE_CROSSINGS_H
#define FARM_TEST_REFERENCE_CROSSINGS_H

#include <stdbool.h>

#include "test/reference_numbers.h"

enum { CONE_SIDE_PART, CONE_BASE_PART, CONE_APEX_PART }; /* a box's parts are its faces */

struct ray {
    struct point origin, direction;
    uint32_t from, from_part;
    double o[3], d[3]; /* the same, rounded to double */
};

struct ray make_ray(struct point origin, struct point direction, uint32_t from, uint32_t part);

/* A crossing of a ray's line and a primitive. A primitive has at most 6: one for each face of a box. */
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

/* A sphere around a primitive, in double: lines that clearly miss it need no exact test. */
struct reach {
    double center[3], radius;
};

void primitive_reach(const struct scene *scene, uint32_t id, struct reach *reach);

/* Whether the line misses the sphere by more than any rounding error. */
bool clearly_past(const struct reach *reach, const struct ray *ray);

/* The axis of a cone as its unit of height: w = apex - base, W = w.w, and p is at height s = p.w / W. */
struct axis {
    struct point base, w;
    real W;
};

struct axis cone_axis(ref r, const struct cone *cone);

/* The vertex indices of a triangle or patch. */
const uint32_t *triangle_corners(const struct scene *scene, uint32_t id);

#endif
