#include "master/vertex_normals.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "master/union_find.h"

/* An edge at a vertex, seen from it. Corner c is corner c % 3 of triangle c / 3. */
struct spoke {
    uint32_t neighbour; /* vertex at the other end of the edge */
    /* Index, among the present vertex's corners, of the one that the edge belongs to. */
    uint32_t local;
};

struct smoothing {
    struct builder *builder;
    const struct triangle *triangles;
    size_t count;
    /* Cosine of the largest angle between the normals at a smooth edge; below that of any angle if all are smooth. */
    double crease_cosine;
    struct vec3 *faces; /* unit normal of each triangle, 0 without area */
    uint32_t base;      /* lowest vertex that the triangles use */
    size_t vertices;    /* number of vertices from base to the highest one */
    uint64_t *first;    /* corners of vertex base + v: list[first[v]] .. list[first[v + 1] - 1] */
    uint64_t *list;
    struct vec3 *normals; /* of each corner that leads a group, not normalised; 0: none */
    uint64_t *leader; /* of each corner: the first corner of its group; a group shares a normal */
    /* Index in the builder of the normal of the group that the corner leads; NONE: not yet added. */
    uint32_t *indices;

    struct spoke *spokes; /* of the present vertex */
    uint32_t *groups;     /* union-find over the corners of the present vertex */
    size_t room;          /* corners that there is room for */
};

#define NONE UINT32_MAX

/* Degrees. An edge whose angle is larger than the crease by that much at most counts as having that angle: vertices are
 * rounded, mostly to six digits, and of the edges of a prism, which all have the same angle, all or none are smooth. */
#define CREASE_SLACK 0.01

static struct vec3 face_normal(const struct builder *builder, const struct triangle *triangle)
{
    struct vec3 a = builder_vertex(builder, triangle->vertex[0]);
    struct vec3 ab = vec_sub(builder_vertex(builder, triangle->vertex[1]), a);
    struct vec3 ac = vec_sub(builder_vertex(builder, triangle->vertex[2]), a);
    /* Scaled, so that the product neither overflows nor underflows. */
    double size = fmax(vec_length(ab), vec_length(ac));
    if (!(size > 0) || !isfinite(size)) return vec3(0, 0, 0);
    struct vec3 normal = vec_cross(vec_scale(ab, 1 / size), vec_scale(ac, 1 / size));
    if (vec_is_zero(normal) || !vec_is_finite(normal)) return vec3(0, 0, 0);
    return vec_normalize(normal);
}

/* The builder has the vertices of all meshes so far; this finds the range of those that the present one uses. */
static void find_vertices(struct smoothing *s)
{
    uint32_t low = UINT32_MAX, high = 0;
    for (size_t i = 0; i < s->count; i++)
        for (int k = 0; k < 3; k++) {
            uint32_t v = s->triangles[i].vertex[k];
            if (v < low) low = v;
            if (v > high) high = v;
        }
    s->base = low;
    s->vertices = s->count ? (size_t)(high - low) + 1 : 0;
}

/* The vertex that a corner is at, relative to base. */
static size_t vertex_of(const struct smoothing *s, size_t corner)
{
    return s->triangles[corner / 3].vertex[corner % 3] - s->base;
}

/* Sorts corners by their vertex, with a counting sort. */
static void list_corners(struct smoothing *s)
{
    s->first = allocate_zeroed(s->vertices + 2, sizeof *s->first);
    s->list = allocate(3 * s->count, sizeof *s->list);
    for (size_t c = 0; c < 3 * s->count; c++)
        s->first[vertex_of(s, c) + 2]++;
    for (size_t v = 2; v < s->vertices + 2; v++)
        s->first[v] += s->first[v - 1];
    for (size_t c = 0; c < 3 * s->count; c++)
        s->list[s->first[vertex_of(s, c) + 1]++] = c;
}

/* The angle of a triangle at one of its corners, radians. */
static double corner_angle(const struct smoothing *s, uint64_t corner)
{
    const uint32_t *v = s->triangles[corner / 3].vertex;
    struct vec3 p = builder_vertex(s->builder, v[corner % 3]);
    struct vec3 a = vec_sub(builder_vertex(s->builder, v[(corner + 1) % 3]), p);
    struct vec3 b = vec_sub(builder_vertex(s->builder, v[(corner + 2) % 3]), p);
    double size = fmax(vec_length(a), vec_length(b));
    if (!(size > 0)) return 0;
    a = vec_scale(a, 1 / size);
    b = vec_scale(b, 1 / size);
    return atan2(vec_length(vec_cross(a, b)), vec_dot(a, b));
}

static int compare_spokes(const void *a, const void *b)
{
    const struct spoke *x = a, *y = b;
    if (x->neighbour != y->neighbour) return x->neighbour < y->neighbour ? -1 : 1;
    return (x->local > y->local) - (x->local < y->local);
}

/* Insertion sort for the few edges that most vertices have. */
static void sort_spokes(struct spoke *spokes, size_t count)
{
    if (count > 64) {
        qsort(spokes, count, sizeof *spokes, compare_spokes);
        return;
    }
    for (size_t i = 1; i < count; i++) {
        struct spoke spoke = spokes[i];
        size_t j = i;
        for (; j > 0 && compare_spokes(&spokes[j - 1], &spoke) > 0; j--)
            spokes[j] = spokes[j - 1];
        spokes[j] = spoke;
    }
}

static void make_room(struct smoothing *s, size_t corners)
{
    if (corners <= s->room) return;
    s->room = 2 * corners;
    s->spokes = reallocate(s->spokes, 2 * s->room, sizeof *s->spokes);
    s->groups = reallocate(s->groups, s->room, sizeof *s->groups);
}

static bool is_smooth_edge(const struct smoothing *s, uint64_t corner, uint64_t other)
{
    struct vec3 a = s->faces[corner / 3], b = s->faces[other / 3];
    return !vec_is_zero(a) && !vec_is_zero(b) && vec_dot(a, b) >= s->crease_cosine;
}

/* The context of compare_faces(): an edge at a vertex. */
struct edge {
    const struct smoothing *smoothing;
    const uint64_t *corners; /* corners of that vertex */
};

static int compare_faces(const void *a, const void *b, void *context)
{
    const struct edge *edge = context;
    const struct vec3 *faces = edge->smoothing->faces;
    struct vec3 x = faces[edge->corners[((const struct spoke *)a)->local] / 3];
    struct vec3 y = faces[edge->corners[((const struct spoke *)b)->local] / 3];
    if (x.x != y.x) return x.x < y.x ? -1 : 1;
    if (x.y != y.y) return x.y < y.y ? -1 : 1;
    return (x.z > y.z) - (x.z < y.z);
}

/* The most other faces at an edge that a face is compared with. No meaningful edge has more, and the time stays in
 * proportion to the number of faces. */
#define EDGE_FACES 16

/*
 * Joins the corners of faces that meet smoothly at one edge: mostly of two faces, of four where a mesh has two sides.
 * The result does not depend on the order of the faces: where not all are compared with each other, they are sorted for
 * that.
 */
static void join_at_edge(struct smoothing *s, const uint64_t *corners, struct spoke *spokes,
                         size_t count)
{
    struct edge edge = {s, corners};
    if (count > EDGE_FACES) qsort_r(spokes, count, sizeof *spokes, compare_faces, &edge);
    for (size_t i = 1; i < count; i++)
        for (size_t k = i > EDGE_FACES ? i - EDGE_FACES : 0; k < i; k++)
            if (is_smooth_edge(s, corners[spokes[k].local], corners[spokes[i].local]))
                union_find_join(s->groups, spokes[k].local, spokes[i].local);
}

/* Groups the corners of one vertex by the smooth edges between their triangles. */
static void group_corners(struct smoothing *s, const uint64_t *corners, size_t count)
{
    make_room(s, count);
    union_find_init(s->groups, (uint32_t)count);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t *v = s->triangles[corners[i] / 3].vertex;
        struct spoke *spokes = s->spokes + 2 * (size_t)i;
        spokes[0] = (struct spoke){v[(corners[i] + 1) % 3], i};
        spokes[1] = (struct spoke){v[(corners[i] + 2) % 3], i};
    }
    sort_spokes(s->spokes, 2 * count);
    for (size_t first = 0, end; first < 2 * count; first = end) {
        struct spoke *spokes = s->spokes + first;
        for (end = first + 1; end < 2 * count && s->spokes[end].neighbour == spokes->neighbour;)
            end++;
        join_at_edge(s, corners, spokes, end - first);
    }
}

/* A sum of normals that is so small a share of all weights at the vertex is what rounding has left of normals that
 * cancel out. */
#define CANCELLED 1e-12

static void average_vertex(struct smoothing *s, const uint64_t *corners, size_t count)
{
    double weights = 0;
    group_corners(s, corners, count);
    for (uint32_t i = 0; i < count; i++) {
        uint64_t leader = corners[union_find_root(s->groups, i)];
        double weight = corner_angle(s, corners[i]);
        s->leader[corners[i]] = leader;
        s->normals[leader] = vec_add_scaled(s->normals[leader], s->faces[corners[i] / 3], weight);
        weights += weight;
    }
    for (size_t i = 0; i < count; i++) {
        struct vec3 *sum = &s->normals[s->leader[corners[i]]];
        if (vec_largest(*sum) <= CANCELLED * weights) *sum = vec3(0, 0, 0);
    }
}

/* Whether the normal of the corner's group equals the face's own up to rounding, so that the face is flat there. */
static bool is_face_normal(const struct smoothing *s, uint64_t corner)
{
    struct vec3 sum = s->normals[s->leader[corner]], face = s->faces[corner / 3];
    if (vec_is_zero(sum)) return true;
    return vec_largest(vec_sub(vec_normalize(sum), face)) <= 16 * DBL_EPSILON;
}

static const char *corner_normal(struct smoothing *s, uint64_t corner, uint32_t *index)
{
    uint64_t leader = s->leader[corner];
    struct vec3 normal = s->normals[leader];
    /* Where normals cancel out, the corner gets that of its face. */
    if (vec_is_zero(normal)) return builder_add_normal(s->builder, s->faces[corner / 3], index);
    if (s->indices[leader] == NONE) {
        const char *why = builder_add_normal(s->builder, normal, &s->indices[leader]);
        if (why) return why;
    }
    *index = s->indices[leader];
    return NULL;
}

static const char *add_triangle(struct smoothing *s, size_t i)
{
    const struct triangle *triangle = &s->triangles[i];
    bool flat =
        is_face_normal(s, 3 * i) && is_face_normal(s, 3 * i + 1) && is_face_normal(s, 3 * i + 2);
    if (flat || vec_is_zero(s->faces[i])) return builder_add_triangle(s->builder, triangle);
    struct patch patch = {.material = triangle->material};
    memcpy(patch.vertex, triangle->vertex, sizeof patch.vertex);
    for (size_t k = 0; k < 3; k++) {
        const char *why = corner_normal(s, 3 * i + k, &patch.normal[k]);
        if (why) return why;
    }
    return builder_add_patch(s->builder, &patch);
}

static void prepare(struct smoothing *s)
{
    s->faces = allocate(s->count, sizeof *s->faces);
    for (size_t i = 0; i < s->count; i++)
        s->faces[i] = face_normal(s->builder, &s->triangles[i]);
    find_vertices(s);
    list_corners(s);
    s->normals = allocate_zeroed(3 * s->count, sizeof *s->normals);
    s->leader = allocate(3 * s->count, sizeof *s->leader);
    s->indices = allocate(3 * s->count, sizeof *s->indices);
    memset(s->indices, 0xff, 3 * s->count * sizeof *s->indices);
    for (size_t v = 0; v < s->vertices; v++)
        average_vertex(s, s->list + s->first[v], s->first[v + 1] - s->first[v]);
}

const char *add_smooth_triangles(struct builder *builder, const struct triangle *triangles,
                                 size_t count, double crease)
{
    double largest = crease + CREASE_SLACK;
    struct smoothing s = {.builder = builder,
                          .triangles = triangles,
                          .count = count,
                          .crease_cosine = largest < 180 ? cos(largest * (M_PI / 180)) : -2};
    const char *why = NULL;
    bool rounds = crease > 0;
    if (rounds) prepare(&s);
    for (size_t i = 0; i < count && !why; i++)
        why = rounds ? add_triangle(&s, i) : builder_add_triangle(builder, &triangles[i]);
    free(s.faces);
    free(s.first);
    free(s.list);
    free(s.normals);
    free(s.leader);
    free(s.indices);
    free(s.spokes);
    free(s.groups);
    return why;
}
