/*
 * Divides polygons into triangles by ear clipping (G. H. Meisters, "Polygons Have Ears", American Mathematical Monthly
 * 82, 1975).
 */
#ifndef FARM_MASTER_TRIANGULATE_H
#define FARM_MASTER_TRIANGULATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/vec.h"

#define POLYGON_MAX_CORNERS 20000

/*
 * A limit to the time that a polygon may take. In the worst case ear clipping looks, for each corner, at all others and
 * at as many cells of the grid. Per corner of a simple polygon with POLYGON_MAX_CORNERS corners it looks at some
 * hundred in a gear or a coast, at some thousands in a comb or a spiral, and at up to 13,000 in combs that are not
 * parallel to an axis; with thousands of slits, each of which takes a look at all corners, at 14,000; in a polygon of
 * random corners at 20,000. A polygon that takes more than POLYGON_LOOKS for each of its corners is refused, so that
 * the time for a file is in proportion to its size: a look takes some nanoseconds.
 */
#define POLYGON_LOOKS 16000

/* The triangles of the last polygon, and memory that is reused for the next one. */
struct triangulation {
    uint32_t (*triangles)[3]; /* indices of corners; orientation as of the polygon */
    size_t count;
    bool improper; /* some triangles overlap or face the other way: no good division was found */
    struct vec3 *points; /* the polygon, scaled to a size of about 1 */
    struct corner *corners;
    struct grid *grid; /* the corners that are not convex */
    uint64_t looks;    /* number of corners and cells looked at for this polygon */
    size_t capacity;   /* corners that there is room for */
};

/*
 * Divides a simple polygon of 3 to POLYGON_MAX_CORNERS corners, convex or not, planar or nearly so (it is projected
 * along the dominant axis of its normal). Corners may coincide, be collinear, or touch each other where lobes meet or a
 * hole is joined to the outline, and edges may go out and come back: which side of an edge a corner is on is decided
 * exactly. n corners give n - 2 triangles; from five corners on, triangles without area are left out. A polygon that
 * crosses itself is improper. Returns NULL, or a constant text that says what is wrong: it takes more than
 * POLYGON_LOOKS.
 */
const char *triangulate(const struct vec3 *polygon, size_t count, struct triangulation *out);

/* Frees what it owns; it may be used again. */
void triangulation_free(struct triangulation *triangulation);

#endif
