/* Closed meshes of the catalogue. */
#ifndef FARM_BENCH_STABILITY_SHAPES_H
#define FARM_BENCH_STABILITY_SHAPES_H

#include <math.h>
#include <stdint.h>

#include "common/vec.h"

struct mesh {
    struct vec3 *vertex;
    uint32_t (*triangle)[3];
    uint32_t vertices, triangles;
};

void mesh_free(struct mesh *mesh);

/* The surface of a cube of n^3 cells, vertices shared: 12 n^2 triangles; coordinates -n/2 .. n/2. */
struct mesh cube_mesh(uint32_t n);

/* A lumpy, rough ball around the origin, different for every seed. Coordinates are multiples of 2^-30, so that
 * differences of such points are exact and rays go exactly through vertices and the middles of edges. */
struct mesh ball_mesh(uint32_t n, uint64_t seed);

/* Two tips and a ring of n vertices between them: 2 n needles. The distances of vertices in the ring vary group by
 * group and go down to some 1e-12; they are normalised by their sum, a few hundred, so that the ring closes. */
struct mesh needle_mesh(uint32_t n);

void mesh_scale(struct mesh *mesh, struct vec3 factor);
void mesh_translate(struct mesh *mesh, struct vec3 by);

/* The nearest multiple of 2^-30. */
static inline double quantise(double x)
{
    return rint(x * 0x1p30) * 0x1p-30;
}

#endif
