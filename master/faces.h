/* Counts the faces of a mesh in a file, and those without an area. These are no error, as many meshes have some, but
 * they are never seen and so are warned of. */
#ifndef FARM_MASTER_FACES_H
#define FARM_MASTER_FACES_H

#include <stdbool.h>
#include <stdint.h>

#include "common/vec.h"
#include "master/triangulate.h"

/* Counted while a file is read. */
struct faces {
    uint64_t count, flat; /* faces; faces without an area */
    long first_flat;      /* line of the first face without an area */
};

bool corners_have_area(struct vec3 a, struct vec3 b, struct vec3 c);
/* Whether any triangle of a polygon has an area. */
bool triangles_have_area(const struct vec3 *corners, const struct triangulation *triangles);

void note_face(struct faces *faces, bool has_area, long line);
void warn_of_flat_faces(const struct faces *faces, const char *path);

#endif
