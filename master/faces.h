/* The faces of a mesh in a file: how many there are, and warnings of those that are not as they should be. */
#ifndef FARM_MASTER_FACES_H
#define FARM_MASTER_FACES_H

#include <stdbool.h>
#include <stdint.h>

#include "common/vec.h"
#include "master/triangulate.h"

/* Counted while a file is read; begins as all zero. */
struct faces {
    uint64_t count, flat; /* faces; faces without an area */
    long first_flat;      /* line of the first face without an area */
    bool told_improper;   /* an improper polygon has been warned of */
};

/* Whether a triangle with these corners, which are finite, has an area. */
bool corners_have_area(struct vec3 a, struct vec3 b, struct vec3 c);

/* Counts a face that is a triangle. */
void faces_note_triangle(struct faces *faces, const struct vec3 corners[3], long line);

/* Counts a face that was triangulated. Warns of the first one whose triangulation is improper; path is for messages. */
void faces_note_polygon(struct faces *faces, const struct vec3 *corners,
                        const struct triangulation *triangles, const char *path, long line);

/* Warns of faces without an area, if there are any. They are no error, as many meshes have some, but are never seen. */
void faces_warn_of_flat(const struct faces *faces, const char *path);

#endif
