/* The operations of mesh.h on a part of a mesh as a whole, pseudorandom numbers and noise. */
#include <stdlib.h>
#include <string.h>

#include "config/models/mesh.h"

/* The finaliser of MurmurHash3: every bit of the result depends on every bit of x. */
static uint64_t scramble(uint64_t x)
{
    x ^= x >> 33;
    x *= UINT64_C(0xff51afd7ed558ccd);
    x ^= x >> 33;
    x *= UINT64_C(0xc4ceb9fe1a85ec53);
    return x ^ x >> 33;
}

double chance(uint32_t seed, uint32_t index)
{
    return 0x1p-53 * (double)(scramble((uint64_t)(seed + 1u) << 32 | index) >> 11);
}

static double lattice(int64_t x, int64_t y, int64_t z, uint32_t seed)
{
    uint64_t h = scramble((uint64_t)x + seed);
    h = scramble(h ^ (uint64_t)y * UINT64_C(0x9e3779b97f4a7c15));
    h = scramble(h ^ (uint64_t)z * UINT64_C(0xd6e8feb86659fd93));
    return 0x1p-52 * (double)(h >> 11) - 1;
}

static double mix(double a, double b, double t)
{
    return a + (b - a) * t;
}

/* 3 t^2 - 2 t^3: no slope at 0 and 1, so the lattice does not show as creases. */
static double ease(double t)
{
    return t * t * (3 - 2 * t);
}

double noise(struct vec3 p, uint32_t seed)
{
    double fx = floor(p.x), fy = floor(p.y), fz = floor(p.z);
    int64_t x = (int64_t)fx, y = (int64_t)fy, z = (int64_t)fz;
    double u = ease(p.x - fx), v = ease(p.y - fy), w = ease(p.z - fz);
    double plane[2];
    for (int k = 0; k < 2; k++)
        plane[k] =
            mix(mix(lattice(x, y, z + k, seed), lattice(x + 1, y, z + k, seed), u),
                mix(lattice(x, y + 1, z + k, seed), lattice(x + 1, y + 1, z + k, seed), u), v);
    return mix(plane[0], plane[1], w);
}

double noise_fractal(struct vec3 p, unsigned octaves, uint32_t seed)
{
    double sum = 0, strength = 0.5;
    for (unsigned i = 0; i < octaves; i++) {
        sum += strength * noise(p, seed + i);
        p = vec_scale(p, 2.03); /* not 2, so that the lattices of the octaves do not coincide */
        strength /= 2;
    }
    return sum;
}

void mesh_bend(struct mesh *mesh, struct mesh_mark from, mesh_move *move, const void *context)
{
    for (size_t i = from.vertex; i < mesh->vertex_count; i++)
        mesh->vertices[i] = move(context, mesh->vertices[i]);
}

struct roughness {
    double amplitude, frequency;
    uint32_t seed;
};

static struct vec3 roughened(const void *context, struct vec3 p)
{
    const struct roughness *r = context;
    struct vec3 q = vec_scale(p, r->frequency);
    struct vec3 d = vec3(noise_fractal(q, 3, r->seed), noise_fractal(q, 3, r->seed + 101),
                         noise_fractal(q, 3, r->seed + 202));
    return vec_add_scaled(p, d, r->amplitude);
}

void mesh_roughen(struct mesh *mesh, struct mesh_mark from, double amplitude, double frequency,
                  uint32_t seed)
{
    struct roughness roughness = {amplitude, frequency, seed};
    mesh_bend(mesh, from, roughened, &roughness);
}

static struct vec3 area_vector(const struct mesh *mesh, const struct mesh_triangle *triangle)
{
    struct vec3 a = mesh->vertices[triangle->vertex[0]];
    return vec_cross(vec_sub(mesh->vertices[triangle->vertex[1]], a),
                     vec_sub(mesh->vertices[triangle->vertex[2]], a));
}

/* (0,0,0) for a triangle without area. */
static struct vec3 face_normal(const struct mesh *mesh, const struct mesh_triangle *triangle)
{
    struct vec3 area = area_vector(mesh, triangle);
    return vec_is_zero(area) ? area : vec_normalize(area);
}

void mesh_paint(struct mesh *mesh, struct mesh_mark from, mesh_painter *paint, const void *context)
{
    for (size_t i = from.triangle; i < mesh->triangle_count; i++) {
        struct mesh_triangle *triangle = &mesh->triangles[i];
        struct vec3 sum = vec3(0, 0, 0);
        for (int k = 0; k < 3; k++)
            sum = vec_add(sum, mesh->vertices[triangle->vertex[k]]);
        triangle->material = paint(context, vec_scale(sum, 1.0 / 3), face_normal(mesh, triangle));
    }
}

/* ---- an open-addressing table from keys of three numbers to an index ---- */

struct table_entry {
    int64_t key[3];
    uint32_t value;
    bool used;
};

struct table {
    struct table_entry *entries;
    size_t mask;
};

/* Creates a table for up to count entries, which is then less than half full. */
static struct table table_new(size_t count)
{
    size_t size = 64;
    while (size < 2 * count)
        size *= 2;
    return (struct table){mesh_allocate(size, sizeof(struct table_entry)), size - 1};
}

/* The entry of a key, or the free one where it belongs. */
static struct table_entry *table_find(const struct table *table, const int64_t key[3])
{
    uint64_t h = scramble((uint64_t)key[0]);
    h = scramble(h ^ (uint64_t)key[1]);
    h = scramble(h ^ (uint64_t)key[2]);
    for (size_t i = (size_t)h & table->mask;; i = (i + 1) & table->mask) {
        struct table_entry *entry = &table->entries[i];
        if (!entry->used || memcmp(entry->key, key, sizeof entry->key) == 0) return entry;
    }
}

static void table_put(struct table_entry *entry, const int64_t key[3], uint32_t value)
{
    memcpy(entry->key, key, sizeof entry->key);
    entry->value = value;
    entry->used = true;
}

/* ---- welding ---- */

/* Positions closer than this are one: far below any detail, far above rounding (metres). */
#define WELD_DISTANCE 1e-7
#define WELD_CELL     1e-5

static int64_t cell_of(double x)
{
    return (int64_t)floor(x / WELD_CELL);
}

/* A vertex at p that is in the table, searched for in every cell within WELD_DISTANCE of p; UINT32_MAX: there
 * is none. */
static uint32_t vertex_near(const struct table *table, struct vec3 p)
{
    const double d = WELD_DISTANCE;
    for (int64_t x = cell_of(p.x - d); x <= cell_of(p.x + d); x++)
        for (int64_t y = cell_of(p.y - d); y <= cell_of(p.y + d); y++)
            for (int64_t z = cell_of(p.z - d); z <= cell_of(p.z + d); z++) {
                const struct table_entry *entry = table_find(table, (int64_t[3]){x, y, z});
                if (entry->used) return entry->value;
            }
    return UINT32_MAX;
}

/* Compacts the vertices; target[i - from]: the new index of vertex i. */
static void merge_vertices(struct mesh *mesh, size_t from, uint32_t *target)
{
    struct table table = table_new(mesh->vertex_count - from);
    size_t kept = from;
    for (size_t i = from; i < mesh->vertex_count; i++) {
        struct vec3 p = mesh->vertices[i];
        uint32_t found = vertex_near(&table, p);
        if (found == UINT32_MAX) {
            const int64_t key[3] = {cell_of(p.x), cell_of(p.y), cell_of(p.z)};
            found = (uint32_t)kept++;
            table_put(table_find(&table, key), key, found);
            mesh->vertices[found] = p;
        }
        target[i - from] = found;
    }
    mesh->vertex_count = kept;
    free(table.entries);
}

void mesh_weld(struct mesh *mesh, struct mesh_mark from)
{
    uint32_t *target = mesh_allocate(mesh->vertex_count - from.vertex, sizeof *target);
    merge_vertices(mesh, from.vertex, target);
    size_t kept = from.triangle;
    for (size_t i = from.triangle; i < mesh->triangle_count; i++) {
        struct mesh_triangle triangle = mesh->triangles[i];
        uint32_t *v = triangle.vertex;
        for (int k = 0; k < 3; k++)
            if (v[k] >= from.vertex) v[k] = target[v[k] - from.vertex];
        if (v[0] != v[1] && v[1] != v[2] && v[2] != v[0]) mesh->triangles[kept++] = triangle;
    }
    mesh->triangle_count = kept;
    free(target);
}

/* ---- refining ---- */

static bool longer(const struct mesh *mesh, uint32_t a, uint32_t b, double longest)
{
    return vec_length(vec_sub(mesh->vertices[a], mesh->vertices[b])) > longest;
}

/* The vertex in the middle of an edge, the same one for both of its triangles. */
static uint32_t edge_middle(struct mesh *mesh, const struct table *table, uint32_t a, uint32_t b)
{
    const int64_t key[3] = {a < b ? a : b, a < b ? b : a, 0};
    struct table_entry *entry = table_find(table, key);
    if (!entry->used) {
        struct vec3 sum = vec_add(mesh->vertices[a], mesh->vertices[b]);
        table_put(entry, key, mesh_vertex(mesh, vec_scale(sum, 0.5)));
    }
    return entry->value;
}

/* Divides triangle i by the middles of its edges (UINT32_MAX: not divided); edge k runs from corner
 * k to the next one. The pieces keep its material. */
static void divide(struct mesh *mesh, size_t i, const uint32_t *middle)
{
    struct mesh_triangle whole = mesh->triangles[i];
    int first = 0, count = 0;
    for (int k = 0; k < 3; k++)
        count += middle[k] != UINT32_MAX;
    /* the triangle is rotated so that a single middle is on edge 0, and two are on edges 0 and 1 */
    while (first < 2 &&
           (middle[first] == UINT32_MAX || (count == 2 && middle[(first + 1) % 3] == UINT32_MAX)))
        first++;
    uint32_t a = whole.vertex[first], b = whole.vertex[(first + 1) % 3];
    uint32_t c = whole.vertex[(first + 2) % 3];
    uint32_t ab = middle[first], bc = middle[(first + 1) % 3], ca = middle[(first + 2) % 3];
    mesh->material = whole.material;
    mesh_triangle(mesh, ab, b, count == 1 ? c : bc);
    mesh->triangles[i] = mesh->triangles[--mesh->triangle_count]; /* the first piece in its place */
    if (count == 1) {
        mesh_triangle(mesh, a, ab, c);
    } else if (count == 2) {
        mesh_quad(mesh, ab, bc, c, a);
    } else {
        mesh_triangle(mesh, a, ab, ca);
        mesh_triangle(mesh, ca, bc, c);
        mesh_triangle(mesh, ab, bc, ca);
    }
}

/* Halves long edges once; returns whether there were any. */
static bool refine_once(struct mesh *mesh, struct mesh_mark from, double longest)
{
    size_t count = mesh->triangle_count;
    struct table table = table_new(3 * (count - from.triangle));
    bool any = false;
    for (size_t i = from.triangle; i < count; i++) {
        uint32_t middle[3] = {UINT32_MAX, UINT32_MAX, UINT32_MAX};
        bool long_edges = false;
        for (int k = 0; k < 3; k++) {
            uint32_t a = mesh->triangles[i].vertex[k], b = mesh->triangles[i].vertex[(k + 1) % 3];
            if (!longer(mesh, a, b, longest)) continue;
            middle[k] = edge_middle(mesh, &table, a, b);
            long_edges = true;
        }
        if (long_edges) divide(mesh, i, middle);
        any = any || long_edges;
    }
    free(table.entries);
    return any;
}

void mesh_refine(struct mesh *mesh, struct mesh_mark from, double longest)
{
    uint32_t material = mesh->material;
    while (refine_once(mesh, from, longest)) {
    }
    mesh->material = material;
}

/* ---- smoothing ---- */

/* The corners of triangles at every vertex: corners[start[v] .. start[v + 1] - 1], each 3 triangle
 * + corner, both counted from the mark. */
struct corners {
    uint32_t *start, *corner;
};

static struct corners find_corners(const struct mesh *mesh, struct mesh_mark from)
{
    size_t vertices = mesh->vertex_count, triangles = mesh->triangle_count - from.triangle;
    struct corners corners = {mesh_allocate(vertices + 2, sizeof(uint32_t)),
                              mesh_allocate(3 * triangles, sizeof(uint32_t))};
    uint32_t *next = corners.start + 1;
    for (size_t i = 0; i < 3 * triangles; i++)
        next[mesh->triangles[from.triangle + i / 3].vertex[i % 3] + 1]++;
    for (size_t v = 0; v < vertices; v++)
        next[v + 1] += next[v];
    for (size_t i = 0; i < 3 * triangles; i++)
        corners.corner[next[mesh->triangles[from.triangle + i / 3].vertex[i % 3]]++] = (uint32_t)i;
    return corners;
}

static double corner_angle(const struct mesh *mesh, const struct mesh_triangle *triangle, int k)
{
    struct vec3 p = mesh->vertices[triangle->vertex[k]];
    struct vec3 a = vec_sub(mesh->vertices[triangle->vertex[(k + 1) % 3]], p);
    struct vec3 b = vec_sub(mesh->vertices[triangle->vertex[(k + 2) % 3]], p);
    return atan2(vec_length(vec_cross(a, b)), vec_dot(a, b));
}

/* Of a corner: the direction of its triangle, and the same weighted by the angle of the corner. */
struct corner_direction {
    struct vec3 face, weighted;
};

static struct vec3 smooth_normal(const struct corner_direction *direction, const uint32_t *corner,
                                 size_t count, struct vec3 face, double crease_cosine)
{
    struct vec3 sum = vec3(0, 0, 0);
    for (size_t i = 0; i < count; i++)
        if (vec_dot(direction[corner[i]].face, face) >= crease_cosine)
            sum = vec_add(sum, direction[corner[i]].weighted);
    /* directions of faces that are folded back on each other may cancel */
    if (vec_length(sum) < 1e-9) sum = vec_is_zero(face) ? vec3(0, 1, 0) : face;
    return vec_normalize(sum);
}

/* The normals at one vertex; equal ones are stored once. */
static void smooth_vertex(struct mesh *mesh, struct mesh_mark from, const uint32_t *corner,
                          size_t count, const struct corner_direction *direction,
                          double crease_cosine)
{
    size_t first = mesh->normal_count;
    for (size_t i = 0; i < count; i++) {
        struct vec3 n =
            smooth_normal(direction, corner, count, direction[corner[i]].face, crease_cosine);
        size_t at = first;
        while (at < mesh->normal_count &&
               !(mesh->normals[at].x == n.x && mesh->normals[at].y == n.y &&
                 mesh->normals[at].z == n.z))
            at++;
        if (at == mesh->normal_count) mesh_normal(mesh, n);
        mesh->triangles[from.triangle + corner[i] / 3].normal[corner[i] % 3] = (uint32_t)at;
    }
}

void mesh_smooth(struct mesh *mesh, struct mesh_mark from, double crease)
{
    size_t count = 3 * (mesh->triangle_count - from.triangle);
    struct corner_direction *direction = mesh_allocate(count, sizeof *direction);
    for (size_t i = 0; i < count; i++) {
        const struct mesh_triangle *triangle = &mesh->triangles[from.triangle + i / 3];
        struct vec3 face = face_normal(mesh, triangle);
        direction[i].face = face;
        direction[i].weighted = vec_scale(face, corner_angle(mesh, triangle, (int)(i % 3)));
    }
    struct corners corners = find_corners(mesh, from);
    /* a little wider, so that a crease of exactly this angle is smooth on every machine */
    double crease_cosine = cos(crease * (PI / 180)) - 1e-9;
    mesh->normal_count = from.normal;
    for (size_t v = 0; v < mesh->vertex_count; v++)
        smooth_vertex(mesh, from, corners.corner + corners.start[v],
                      corners.start[v + 1] - corners.start[v], direction, crease_cosine);
    free(corners.start);
    free(corners.corner);
    free(direction);
}
