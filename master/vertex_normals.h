/* Computes vertex normals for triangles that have none. */
#ifndef FARM_MASTER_VERTEX_NORMALS_H
#define FARM_MASTER_VERTEX_NORMALS_H

#include "master/builder.h"

/*
 * Adds count triangles, which refer to the builder's vertices, to the builder: as patches if they meet others at an
 * edge with an angle of at most crease degrees between the two normals, else flat. Around a vertex, triangles connected
 * by such edges share one normal, the sum of theirs weighted by their angles at the vertex (G. Thuermer, C. A.
 * Wuethrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3(1), 1998). Returns NULL or
 * what is wrong, like the builder.
 */
const char *add_smooth_triangles(struct builder *builder, const struct triangle *triangles,
                                 size_t count, double crease);

#endif
