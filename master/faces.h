/* The faces of a mesh in a file. Those without an area are no mistake, as many a mesh has some, but they are never
 * seen. */
#ifndef FARM_MASTER_FACES_H
#define FARM_MASTER_FACES_H

#include <stdbool.h>
#include <stdint.h>

#include "common/vec.h"
#include "master/triangulate.h"

/* Counted while a file is read. */
struct faces {
    uint64_t count, flat;
    long first_flat; /* its line */
};

bool corners_have_area(struct vec3 a, struct vec3 b, struct vec3 c);
/* Of a polygon, whether any of its triangles has one. */
bool triangles_have_area(const struct vec3 *corners, const struct triangulation *triangles);

void note_face(struct faces *faces, bool has_area, long line);
void warn_of_flat_faces(const struct faces *faces, const char *path);

#endif
