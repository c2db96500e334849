/* The mesh as a container: growing arrays, materials by name, marks, copies, transforms, and writing OBJ files. */
#include "config/models/mesh.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *mesh_allocate(size_t count, size_t size)
{
    void *memory = calloc(count > 0 ? count : 1, size);
    if (memory != NULL) return memory;
    fprintf(stderr, "models: out of memory\n");
    exit(EXIT_FAILURE);
}

void mesh_init(struct mesh *mesh)
{
    *mesh = (struct mesh){0};
}

void mesh_free(struct mesh *mesh)
{
    free(mesh->vertices);
    free(mesh->normals);
    free(mesh->triangles);
    free(mesh->materials);
    *mesh = (struct mesh){0};
}

/* Makes room for one more element; array may move. */
static void *grown(void *array, size_t count, size_t *capacity, size_t size)
{
    if (count < *capacity) return array;
    if (count >= UINT32_MAX / 2) {
        fprintf(stderr, "models: a mesh has more than %u elements\n", UINT32_MAX / 2);
        exit(EXIT_FAILURE);
    }
    *capacity = count < 64 ? 64 : 2 * count;
    array = realloc(array, *capacity * size);
    if (array == NULL) {
        fprintf(stderr, "models: out of memory for %zu elements of a mesh\n", *capacity);
        exit(EXIT_FAILURE);
    }
    return array;
}

uint32_t mesh_material(struct mesh *mesh, const char *name)
{
    char key[MESH_NAME_SIZE];
    snprintf(key, sizeof key, "%s", name);
    for (size_t i = 0; i < mesh->material_count; i++)
        if (strcmp(mesh->materials[i], key) == 0) return (uint32_t)i;
    mesh->materials = grown(mesh->materials, mesh->material_count, &mesh->material_capacity,
                            sizeof *mesh->materials);
    memcpy(mesh->materials[mesh->material_count], key, sizeof key);
    return (uint32_t)mesh->material_count++;
}

void mesh_use(struct mesh *mesh, const char *material)
{
    mesh->material = mesh_material(mesh, material);
}

uint32_t mesh_vertex(struct mesh *mesh, struct vec3 position)
{
    mesh->vertices =
        grown(mesh->vertices, mesh->vertex_count, &mesh->vertex_capacity, sizeof *mesh->vertices);
    mesh->vertices[mesh->vertex_count] = position;
    return (uint32_t)mesh->vertex_count++;
}

uint32_t mesh_normal(struct mesh *mesh, struct vec3 unit)
{
    mesh->normals =
        grown(mesh->normals, mesh->normal_count, &mesh->normal_capacity, sizeof *mesh->normals);
    mesh->normals[mesh->normal_count] = unit;
    return (uint32_t)mesh->normal_count++;
}

static void add_triangle(struct mesh *mesh, struct mesh_triangle triangle)
{
    mesh->triangles = grown(mesh->triangles, mesh->triangle_count, &mesh->triangle_capacity,
                            sizeof *mesh->triangles);
    mesh->triangles[mesh->triangle_count++] = triangle;
}

void mesh_triangle(struct mesh *mesh, uint32_t a, uint32_t b, uint32_t c)
{
    if (mesh->material_count == 0) mesh_use(mesh, "default");
    add_triangle(mesh, (struct mesh_triangle){
                           .vertex = {a, b, c},
                           .normal = {MESH_FLAT, MESH_FLAT, MESH_FLAT},
                           .material = mesh->material,
                       });
}

void mesh_quad(struct mesh *mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    mesh_triangle(mesh, a, b, c);
    mesh_triangle(mesh, a, c, d);
}

struct mesh_mark mesh_mark(const struct mesh *mesh)
{
    return (struct mesh_mark){mesh->vertex_count, mesh->normal_count, mesh->triangle_count};
}

/* ---- transforms ---- */

struct mesh_transform transform_identity(void)
{
    return (struct mesh_transform){vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1), vec3(0, 0, 0)};
}

struct mesh_transform transform_place(struct vec3 origin, double yaw, double scale)
{
    struct mesh_transform t = transform_turn(vec3(0, 1, 0), yaw);
    t.x = vec_scale(t.x, scale);
    t.y = vec_scale(t.y, scale);
    t.z = vec_scale(t.z, scale);
    t.origin = origin;
    return t;
}

/* Rodrigues' rotation formula. */
static struct vec3 turned(struct vec3 p, struct vec3 unit, double s, double c)
{
    struct vec3 along = vec_scale(unit, vec_dot(unit, p) * (1 - c));
    return vec_add(vec_add(vec_scale(p, c), vec_scale(vec_cross(unit, p), s)), along);
}

struct mesh_transform transform_turn(struct vec3 axis, double degrees)
{
    struct vec3 unit = vec_normalize(axis);
    double radians = degrees * (PI / 180), s = sin(radians), c = cos(radians);
    return (struct mesh_transform){
        .x = turned(vec3(1, 0, 0), unit, s, c),
        .y = turned(vec3(0, 1, 0), unit, s, c),
        .z = turned(vec3(0, 0, 1), unit, s, c),
        .origin = vec3(0, 0, 0),
    };
}

static struct vec3 transform_direction(const struct mesh_transform *t, struct vec3 d)
{
    return vec_add_scaled(vec_add_scaled(vec_scale(t->x, d.x), t->y, d.y), t->z, d.z);
}

static struct vec3 transform_point(const struct mesh_transform *t, struct vec3 p)
{
    return vec_add(transform_direction(t, p), t->origin);
}

void mesh_apply(struct mesh *mesh, struct mesh_mark from, const struct mesh_transform *t)
{
    for (size_t i = from.vertex; i < mesh->vertex_count; i++)
        mesh->vertices[i] = transform_point(t, mesh->vertices[i]);
    for (size_t i = from.normal; i < mesh->normal_count; i++)
        mesh->normals[i] = vec_normalize(transform_direction(t, mesh->normals[i]));
}

/* ---- the OBJ file ---- */

static void write_triangle(FILE *file, const struct mesh_triangle *triangle)
{
    /* OBJ counts from 1 */
    const uint32_t *v = triangle->vertex, *n = triangle->normal;
    if (n[0] == MESH_FLAT)
        fprintf(file, "f %u %u %u\n", v[0] + 1, v[1] + 1, v[2] + 1);
    else
        fprintf(file, "f %u//%u %u//%u %u//%u\n", v[0] + 1, n[0] + 1, v[1] + 1, n[1] + 1, v[2] + 1,
                n[2] + 1);
}

/* Writes the triangles, one material after the other. */
static void write_triangles(FILE *file, const struct mesh *mesh)
{
    for (size_t material = 0; material < mesh->material_count; material++) {
        bool named = false;
        for (size_t i = 0; i < mesh->triangle_count; i++) {
            if (mesh->triangles[i].material != material) continue;
            if (!named) fprintf(file, "usemtl %s\n", mesh->materials[material]);
            named = true;
            write_triangle(file, &mesh->triangles[i]);
        }
    }
}

static void write_mesh(FILE *file, const struct mesh *mesh)
{
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        struct vec3 p = mesh->vertices[i];
        fprintf(file, "v %.6f %.6f %.6f\n", p.x, p.y, p.z);
    }
    for (size_t i = 0; i < mesh->normal_count; i++) {
        struct vec3 n = mesh->normals[i];
        fprintf(file, "vn %.5f %.5f %.5f\n", n.x, n.y, n.z);
    }
    write_triangles(file, mesh);
}

bool mesh_write_obj(const struct mesh *mesh, const char *folder, const char *name)
{
    char path[4096];
    int length = snprintf(path, sizeof path, "%s/%s", folder, name);
    if (length < 0 || (size_t)length >= sizeof path) {
        fprintf(stderr, "models: %s/%s: the path is too long\n", folder, name);
        return false;
    }
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        fprintf(stderr, "models: %s: %s\n", path, strerror(errno));
        return false;
    }
    /* 80 MB in stdio's blocks of 4 KiB take 20,000 system calls, which are expensive in some containers. */
    static char buffer[1 << 20];
    setvbuf(file, buffer, _IOFBF, sizeof buffer);
    errno = 0;
    write_mesh(file, mesh);
    bool good = !ferror(file);
    if (fclose(file) != 0) good = false;
    if (!good) fprintf(stderr, "models: %s: could not be written: %s\n", path, strerror(errno));
    return good;
}
