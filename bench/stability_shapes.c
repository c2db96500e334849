#include "bench/stability_shapes.h"

#include <stdlib.h>
#include <string.h>

#include "bench/stability.h"
#include "common/message.h"

void mesh_free(struct mesh *mesh)
{
    free(mesh->vertex);
    free(mesh->triangle);
}

/* ---- the surface of a cube of n^3 cells, vertices shared ---- */

#define UNSEEN UINT32_MAX

struct lattice {
    struct mesh *mesh;
    uint32_t *index; /* of the vertex at (x, y, z), 0 .. n each */
    uint32_t n;
};

static uint32_t lattice_vertex(struct lattice *lattice, const uint32_t at[3])
{
    uint32_t n = lattice->n;
    uint32_t *index = &lattice->index[(at[0] * (n + 1) + at[1]) * (n + 1) + at[2]];
    struct mesh *mesh = lattice->mesh;
    if (*index == UNSEEN) {
        double half = 0.5 * n;
        mesh->vertex[mesh->vertices] = vec3(at[0] - half, at[1] - half, at[2] - half);
        *index = mesh->vertices++;
    }
    return *index;
}

/* Adds the cell (i, j) of the face at 0 or n along `axis`, as two triangles that face outward. The diagonals of
 * neighbouring cells alternate. */
static void add_cell(struct lattice *lattice, unsigned axis, bool far, uint32_t i, uint32_t j)
{
    unsigned u = (axis + 1) % 3, v = (axis + 2) % 3;
    uint32_t corner[4];
    for (unsigned k = 0; k < 4; k++) {
        uint32_t at[3];
        at[axis] = far ? lattice->n : 0;
        at[u] = i + (k == 1 || k == 2);
        at[v] = j + (k >= 2);
        corner[far ? k : 3 - k] = lattice_vertex(lattice, at);
    }
    struct mesh *mesh = lattice->mesh;
    unsigned s = (i + j) % 2;
    for (unsigned k = 0; k < 2; k++) {
        uint32_t *triangle = mesh->triangle[mesh->triangles++];
        triangle[0] = corner[s];
        triangle[1] = corner[(s + 1 + k) % 4];
        triangle[2] = corner[(s + 2 + k) % 4];
    }
}

struct mesh cube_mesh(uint32_t n)
{
    struct mesh mesh = {.vertices = 0};
    mesh.vertex = allocate((size_t)6 * (n + 1) * (n + 1), sizeof *mesh.vertex);
    mesh.triangle = allocate((size_t)12 * n * n, sizeof *mesh.triangle);
    size_t points = (size_t)(n + 1) * (n + 1) * (n + 1);
    struct lattice lattice = {&mesh, allocate(points, sizeof *lattice.index), n};
    memset(lattice.index, 0xff, points * sizeof *lattice.index);
    for (unsigned side = 0; side < 6; side++) {
        for (uint32_t i = 0; i < n; i++)
            for (uint32_t j = 0; j < n; j++)
                add_cell(&lattice, side / 2, side % 2, i, j);
    }
    free(lattice.index);
    return mesh;
}

struct mesh ball_mesh(uint32_t n, uint64_t seed)
{
    struct mesh mesh = cube_mesh(n);
    struct random random = random_seeded(17, seed);
    double roughness = 0.15 / n;
    for (uint32_t i = 0; i < mesh.vertices; i++) {
        struct vec3 p = vec_normalize(mesh.vertex[i]);
        double radius = 1 + 0.05 * sin(5 * p.x + 1) * sin(4 * p.y) * cos(6 * p.z);
        radius += random_between(&random, -roughness, roughness);
        mesh.vertex[i] =
            vec3(quantise(p.x * radius), quantise(p.y * radius), quantise(p.z * radius));
    }
    return mesh;
}

struct mesh needle_mesh(uint32_t n)
{
    struct mesh mesh = {.vertices = n + 2, .triangles = 2 * n};
    mesh.vertex = allocate(mesh.vertices, sizeof *mesh.vertex);
    mesh.triangle = allocate(mesh.triangles, sizeof *mesh.triangle);
    struct random random = random_seeded(20, 0);
    double *step = allocate(n, sizeof *step), sum = 0, angle = 0;
    for (uint32_t i = 0; i < n; i++)
        sum += step[i] = i % 64 == 0 ? 1 : random_log(&random, 1e-9, 0.1);
    for (uint32_t i = 0; i < n; i++) {
        mesh.vertex[i] = vec3(cos(angle), sin(angle), 0);
        angle += step[i] / sum * 2 * acos(-1);
    }
    mesh.vertex[n] = vec3(0, 0, 1);
    mesh.vertex[n + 1] = vec3(0, 0, -1);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t next = (i + 1) % n;
        memcpy(mesh.triangle[2 * i], (uint32_t[3]){i, next, n}, sizeof *mesh.triangle);
        memcpy(mesh.triangle[2 * i + 1], (uint32_t[3]){next, i, n + 1}, sizeof *mesh.triangle);
    }
    free(step);
    return mesh;
}

void mesh_scale(struct mesh *mesh, struct vec3 factor)
{
    for (uint32_t i = 0; i < mesh->vertices; i++)
        mesh->vertex[i] = vec_mul(mesh->vertex[i], factor);
}

void mesh_translate(struct mesh *mesh, struct vec3 by)
{
    for (uint32_t i = 0; i < mesh->vertices; i++)
        mesh->vertex[i] = vec_add(mesh->vertex[i], by);
}
