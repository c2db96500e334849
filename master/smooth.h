/* Normals for triangles that come without. */
#ifndef FARM_MASTER_SMOOTH_H
#define FARM_MASTER_SMOOTH_H

#include "master/builder.h"

/*
 * Adds count triangles to the builder, whose vertices they refer to: as patches where they meet
 * others at an edge with an angle of at most crease degrees between their normals, else flat.
 * Around a vertex, triangles connected by such edges share one normal, the sum of theirs weighted
 * by their angles at the vertex (G. Thuermer, C. A. Wuethrich, "Computing Vertex Normals from
 * Polygonal Facets", Journal of Graphics Tools 3(1), 1998). Returns NULL or what is wrong, like the
 * builder.
 */
const char *add_smooth_triangles(struct builder *builder, const struct triangle *triangles,
                                 size_t count, double crease);

#endif
