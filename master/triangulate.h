/*
 * Polygons into triangles by ear clipping (G. H. Meisters, "Polygons Have Ears", American
 * Mathematical Monthly 82, 1975).
 */
#ifndef FARM_MASTER_TRIANGULATE_H
#define FARM_MASTER_TRIANGULATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/vec.h"

#define POLYGON_MAX_CORNERS 20000

/*
 * Ear clipping may look at every corner for each one, and at as many cells of the grid. For one corner of a
 * simple polygon of so many it looks at some hundred in a gear or a coast, at some thousands in a comb or a
 * spiral, and at up to 13,000 in combs that are not parallel to an axis; for one of random corners at
 * 20,000. A polygon that takes more than this for each of its corners is refused, so that a file takes time
 * in its size: a look takes some nanoseconds.
 */
#define POLYGON_LOOKS 16000

/* The result of the last polygon, and the memory that is used again for the next one. */
struct triangulation {
    uint32_t (*triangles)[3]; /* indices of corners, in the polygon's sense of rotation */
    size_t count;
    bool improper;       /* some triangles overlap or face the other way: no cut was a good one */
    struct vec3 *points; /* the polygon in a size of about 1 */
    struct corner *corners;
    struct grid *grid; /* of the corners that are not convex */
    uint64_t looks;    /* at corners and cells of the grid, while this polygon is cut */
    size_t capacity;   /* corners that there is room for */
};

/*
 * A simple polygon of 3 to POLYGON_MAX_CORNERS corners, concave or not, flat or nearly so (it is seen
 * along the axis in which it is largest). Corners may coincide, lie on a line, or touch each other where
 * a hole is joined to the outline. Of n corners come n - 2 triangles; from five corners on those without area
 * are left out. A polygon that crosses itself is improper.
 * Returns NULL, or a constant text that says what is wrong: it takes more than POLYGON_LOOKS.
 */
const char *triangulate(const struct vec3 *polygon, size_t count, struct triangulation *out);

/* A warning about a polygon whose triangulation is improper. */
#define IMPROPER_POLYGON                                                                           \
    "a polygon crosses itself or is bent so far that its triangles overlap, expected flat ones"

void triangulation_free(struct triangulation *triangulation);

#endif
