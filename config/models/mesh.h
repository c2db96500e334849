/*
 * A small library to make triangle meshes. Shapes are added to a mesh. The part that was added since a mark can then be
 * bent, roughened, refined, smoothed, painted or moved as a whole.
 *
 *   struct mesh mesh;
 *   mesh_init(&mesh);
 *   mesh_use(&mesh, "granite");
 *   struct mesh_mark part = mesh_mark(&mesh);
 *   mesh_box(&mesh, vec3(-1, 0, -1), vec3(1, 0.2, 1), 0.02);
 *   mesh_refine(&mesh, part, 0.05);
 *   mesh_roughen(&mesh, part, 0.01, 4, 1);
 *   mesh_smooth(&mesh, part, 40);
 *   bool good = mesh_write_obj(&mesh, "folder", "slab.obj");
 *   mesh_free(&mesh);
 *
 * y is up, lengths are metres, angles degrees. Triangles are counter-clockwise seen from outside.
 * Everything is deterministic. A lack of memory ends the program with a message.
 */
#ifndef FARM_CONFIG_MODELS_MESH_H
#define FARM_CONFIG_MODELS_MESH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/vec.h"

#define PI             3.14159265358979323846
#define MESH_FLAT      UINT32_MAX /* as normal[0]: the triangle has no normals and is flat */
#define MESH_NAME_SIZE 32         /* of a material, with the final zero; longer names are cut */

struct mesh_triangle {
    uint32_t vertex[3];
    uint32_t normal[3];
    uint32_t material;
};

struct mesh {
    struct vec3 *vertices;
    struct vec3 *normals; /* unit length */
    struct mesh_triangle *triangles;
    char (*materials)[MESH_NAME_SIZE];
    size_t vertex_count, vertex_capacity;
    size_t normal_count, normal_capacity;
    size_t triangle_count, triangle_capacity;
    size_t material_count, material_capacity;
    uint32_t material; /* of the triangles that are added next */
};

struct point2 {
    double x, y;
};

/* Zeroed memory for count elements, to be freed with free(). */
void *mesh_allocate(size_t count, size_t size);

void mesh_init(struct mesh *mesh);
void mesh_free(struct mesh *mesh);

/* The index of a material; it is added when it is new. */
uint32_t mesh_material(struct mesh *mesh, const char *name);

/* Sets the material of the triangles that are added from now on (the INI file's [material NAME]). */
void mesh_use(struct mesh *mesh, const char *material);

uint32_t mesh_vertex(struct mesh *mesh, struct vec3 position);
uint32_t mesh_normal(struct mesh *mesh, struct vec3 unit);
void mesh_triangle(struct mesh *mesh, uint32_t a, uint32_t b, uint32_t c);

/* Adds a quad as two triangles, divided along a-c. */
void mesh_quad(struct mesh *mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d);

/* ---- shapes: closed, outward, flat until mesh_smooth() ---- */

enum mesh_caps {
    MESH_OPEN = 0,
    MESH_CAP_FIRST = 1,
    MESH_CAP_LAST = 2,
    MESH_CAPPED = MESH_CAP_FIRST | MESH_CAP_LAST,
    MESH_RING = 4 /* the last ring is joined to the first one (a torus); no caps */
};

/*
 * Adds the surface through ring_count closed rings of ring_size points each: rings[ring * ring_size + point]. Seen from
 * outside, with the next ring above, the points of a ring run to the left. Caps are fans around a ring's mean point, so
 * a capped ring must be star-shaped about it. A ring whose points are all equal becomes one vertex and needs no cap.
 */
void mesh_loft(struct mesh *mesh, const struct vec3 *rings, size_t ring_count, size_t ring_size,
               enum mesh_caps caps);

/* The position on a surface at 0 <= u, v <= 1. */
typedef struct vec3 mesh_surface(const void *context, double u, double v);

/* Adds columns x rows quads of surface(u, v); dP/du x dP/dv points outward. */
void mesh_grid(struct mesh *mesh, size_t columns, size_t rows, mesh_surface *surface,
               const void *context);

/* A solid of revolution about y. profile: (radius, height) from the bottom, counter-clockwise with
 * the radius to the right; radius 0 at an end closes it in a point, otherwise there is a flat cap.
 */
void mesh_revolve(struct mesh *mesh, const struct point2 *profile, size_t profile_count,
                  size_t segments);

/* Like mesh_revolve(), but about an outline in (x, z) instead of the unit circle: the outline is
 * scaled by profile.x at height profile.y. The outline is star-shaped about the origin and
 * counter-clockwise with x to the right and z upwards. */
void mesh_prism(struct mesh *mesh, const struct point2 *outline, size_t outline_count,
                const struct point2 *profile, size_t profile_count);

/* Adds a plate from y0 to y1 with bevelled edges, whose outline is a polygon in (x, z) as for mesh_prism(). */
void mesh_extrude(struct mesh *mesh, const struct point2 *outline, size_t outline_count, double y0,
                  double y1, double bevel);

/*
 * The outline of a regular polygon of circumradius 1 with rounded corners: corner k at the angle
 * k 360 / sides (0: along x, 90: along z). Each corner has arc_points points, each
 * straight edge side_points more between them. radius: of the rounding, 0 with arc_points 1: sharp.
 * Returns the number of points, sides * (arc_points + side_points), which outline must hold.
 */
size_t mesh_polygon(struct point2 *outline, size_t sides, double radius, size_t arc_points,
                    size_t side_points);

/* A round tube along a path, with a radius for every point of the path and flat ends. */
void mesh_tube(struct mesh *mesh, const struct vec3 *path, const double *radii, size_t count,
               size_t segments);

/* A cuboid; bevel is the width that is cut off the edges, 0 for sharp ones. */
void mesh_box(struct mesh *mesh, struct vec3 min, struct vec3 max, double bevel);

/* An ellipsoid, made from a cube of detail x detail quads per face: triangles of similar size, and no poles. */
void mesh_ball(struct mesh *mesh, struct vec3 center, struct vec3 radii, size_t detail);

/* ---- work on everything that was added since a mark ---- */

struct mesh_mark {
    size_t vertex, normal, triangle;
};

struct mesh_mark mesh_mark(const struct mesh *mesh);

/* p -> x p.x + y p.y + z p.z + origin */
struct mesh_transform {
    struct vec3 x, y, z, origin;
};

struct mesh_transform transform_identity(void);
/* Scaled, then turned about y by yaw degrees (counter-clockwise seen from above), then moved. */
struct mesh_transform transform_place(struct vec3 origin, double yaw, double scale);
/* Turned about an axis through the origin by an angle in degrees (right-hand rule). */
struct mesh_transform transform_turn(struct vec3 axis, double degrees);

/* Transforms positions and normals. t must not reflect, as the orientation of triangles does not change. After a
 * non-uniform scale, call mesh_smooth() again. */
void mesh_apply(struct mesh *mesh, struct mesh_mark from, const struct mesh_transform *t);

/* Moves every vertex to move(context, position). */
typedef struct vec3 mesh_move(const void *context, struct vec3 position);
void mesh_bend(struct mesh *mesh, struct mesh_mark from, mesh_move *move, const void *context);

/* Halves edges longer than `longest` until there are none; a closed mesh stays closed. */
void mesh_refine(struct mesh *mesh, struct mesh_mark from, double longest);

/* Moves every vertex by up to about amplitude, by noise with features 1 / frequency wide. Equal
 * positions move alike. */
void mesh_roughen(struct mesh *mesh, struct mesh_mark from, double amplitude, double frequency,
                  uint32_t seed);

/* Merges vertices at equal positions, and drops triangles that have no area then. */
void mesh_weld(struct mesh *mesh, struct mesh_mark from);

/* Computes vertex normals. A triangle's normal at a vertex is the mean, weighted by angle, of the normals of those
 * triangles at the vertex that differ from its own by at most crease degrees. 180: all smooth; 0: flat. */
void mesh_smooth(struct mesh *mesh, struct mesh_mark from, double crease);

/* Gives every triangle the material of index paint(context, its middle, its unit normal). */
typedef uint32_t mesh_painter(const void *context, struct vec3 middle, struct vec3 normal);
void mesh_paint(struct mesh *mesh, struct mesh_mark from, mesh_painter *paint, const void *context);

/* ---- pseudorandom numbers, the same on every run ---- */

/* A number 0 <= x < 1 that depends on the arguments alone. */
double chance(uint32_t seed, uint32_t index);

/* Smooth noise in -1 .. 1 with features about 1 wide; mean 0. */
double noise(struct vec3 p, uint32_t seed);

/* The sum of octaves of noise, each half as strong and twice as fine; about -1 .. 1. */
double noise_fractal(struct vec3 p, unsigned octaves, uint32_t seed);

/* ---- result ---- */

/* Writes folder/name as OBJ with usemtl and, for smoothed triangles, normals. */
bool mesh_write_obj(const struct mesh *mesh, const char *folder, const char *name);

#endif
