/* The shapes of mesh.h, nearly all of which are lofts or grids. */
#include <stdlib.h>

#include "config/models/mesh.h"

static bool same_point(struct vec3 a, struct vec3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

/* Adds the vertices of a ring and stores their indices, which are all the same if the ring is a point. */
static void add_ring(struct mesh *mesh, const struct vec3 *ring, size_t size, uint32_t *index)
{
    bool point = true;
    for (size_t i = 1; i < size; i++)
        point = point && same_point(ring[i], ring[0]);
    for (size_t i = 0; i < size; i++)
        index[i] = point && i > 0 ? index[0] : mesh_vertex(mesh, ring[i]);
}

static void add_triangle_unless_flat(struct mesh *mesh, uint32_t a, uint32_t b, uint32_t c)
{
    if (a != b && b != c && c != a) mesh_triangle(mesh, a, b, c);
}

static void join_rings(struct mesh *mesh, const uint32_t *lower, const uint32_t *upper, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        size_t next = (i + 1) % size;
        add_triangle_unless_flat(mesh, lower[i], upper[i], upper[next]);
        add_triangle_unless_flat(mesh, lower[i], upper[next], lower[next]);
    }
}

static void add_cap(struct mesh *mesh, const uint32_t *ring, size_t size, bool last)
{
    if (ring[0] == ring[1]) return;
    struct vec3 sum = vec3(0, 0, 0);
    for (size_t i = 0; i < size; i++)
        sum = vec_add(sum, mesh->vertices[ring[i]]);
    uint32_t middle = mesh_vertex(mesh, vec_scale(sum, 1 / (double)size));
    for (size_t i = 0; i < size; i++) {
        uint32_t a = ring[i], b = ring[(i + 1) % size];
        mesh_triangle(mesh, middle, last ? b : a, last ? a : b);
    }
}

void mesh_loft(struct mesh *mesh, const struct vec3 *rings, size_t ring_count, size_t ring_size,
               enum mesh_caps caps)
{
    uint32_t *index = mesh_allocate(ring_count * ring_size, sizeof *index);
    for (size_t r = 0; r < ring_count; r++)
        add_ring(mesh, rings + r * ring_size, ring_size, index + r * ring_size);
    for (size_t r = 0; r + 1 < ring_count; r++)
        join_rings(mesh, index + r * ring_size, index + (r + 1) * ring_size, ring_size);
    const uint32_t *last = index + (ring_count - 1) * ring_size;
    if (caps & MESH_RING) join_rings(mesh, last, index, ring_size);
    if (caps & MESH_CAP_FIRST) add_cap(mesh, index, ring_size, false);
    if (caps & MESH_CAP_LAST) add_cap(mesh, last, ring_size, true);
    free(index);
}

void mesh_grid(struct mesh *mesh, size_t columns, size_t rows, mesh_surface *surface,
               const void *context)
{
    size_t across = columns + 1, first = mesh->vertex_count;
    for (size_t j = 0; j <= rows; j++)
        for (size_t i = 0; i <= columns; i++)
            mesh_vertex(mesh,
                        surface(context, (double)i / (double)columns, (double)j / (double)rows));
    for (size_t j = 0; j < rows; j++)
        for (size_t i = 0; i < columns; i++) {
            size_t low = first + j * across + i, high = low + across;
            mesh_quad(mesh, (uint32_t)low, (uint32_t)(low + 1), (uint32_t)(high + 1),
                      (uint32_t)high);
        }
}

void mesh_revolve(struct mesh *mesh, const struct point2 *profile, size_t profile_count,
                  size_t segments)
{
    struct point2 *circle = mesh_allocate(segments, sizeof *circle);
    for (size_t i = 0; i < segments; i++) {
        double angle = 2 * PI * (double)i / (double)segments;
        circle[i] = (struct point2){cos(angle), sin(angle)};
    }
    mesh_prism(mesh, circle, segments, profile, profile_count);
    free(circle);
}

void mesh_prism(struct mesh *mesh, const struct point2 *outline, size_t outline_count,
                const struct point2 *profile, size_t profile_count)
{
    struct vec3 *rings = mesh_allocate(profile_count * outline_count, sizeof *rings);
    struct vec3 *ring = rings;
    for (size_t p = 0; p < profile_count; p++)
        for (size_t i = 0; i < outline_count; i++)
            *ring++ = vec3(outline[i].x * profile[p].x, profile[p].y, outline[i].y * profile[p].x);
    mesh_loft(mesh, rings, profile_count, outline_count, MESH_CAPPED);
    free(rings);
}

/* The vector by which a corner of a counter-clockwise outline moves when both its edges move inward
 * by 1 (its mitre). */
static struct point2 mitre(struct point2 before, struct point2 corner, struct point2 after)
{
    double ax = corner.x - before.x, ay = corner.y - before.y;
    double bx = after.x - corner.x, by = after.y - corner.y;
    double a = sqrt(ax * ax + ay * ay), b = sqrt(bx * bx + by * by);
    double nx = -ay / a - by / b, ny = ax / a + bx / b;
    double scale = 2 / (nx * nx + ny * ny);
    return (struct point2){nx * scale, ny * scale};
}

void mesh_extrude(struct mesh *mesh, const struct point2 *outline, size_t outline_count, double y0,
                  double y1, double bevel)
{
    const double inset[4] = {bevel, 0, 0, bevel};
    const double height[4] = {y0, y0 + bevel, y1 - bevel, y1};
    size_t first = bevel > 0 ? 0 : 1, count = bevel > 0 ? 4 : 2;
    struct vec3 *rings = mesh_allocate(count * outline_count, sizeof *rings);
    for (size_t i = 0; i < outline_count; i++) {
        struct point2 p = outline[i];
        struct point2 m = mitre(outline[(i + outline_count - 1) % outline_count], p,
                                outline[(i + 1) % outline_count]);
        for (size_t r = 0; r < count; r++)
            rings[r * outline_count + i] =
                vec3(p.x + m.x * inset[first + r], height[first + r], p.y + m.y * inset[first + r]);
    }
    mesh_loft(mesh, rings, count, outline_count, MESH_CAPPED);
    free(rings);
}

static struct point2 corner_point(size_t corner, size_t sides, double radius, double turn)
{
    double step = PI / (double)sides;
    double angle = 2 * step * (double)corner;
    double distance = 1 - radius / cos(step); /* of the middle of the rounding */
    return (struct point2){distance * cos(angle) + radius * cos(angle + turn * step),
                           distance * sin(angle) + radius * sin(angle + turn * step)};
}

size_t mesh_polygon(struct point2 *outline, size_t sides, double radius, size_t arc_points,
                    size_t side_points)
{
    size_t count = 0;
    for (size_t corner = 0; corner < sides; corner++) {
        double end = arc_points > 1 ? 1 : 0;
        for (size_t i = 0; i < arc_points; i++) {
            double turn = arc_points > 1 ? 2 * (double)i / (double)(arc_points - 1) - 1 : 0;
            outline[count++] = corner_point(corner, sides, radius, turn);
        }
        struct point2 a = corner_point(corner, sides, radius, end);
        struct point2 b = corner_point(corner + 1, sides, radius, -end);
        for (size_t i = 1; i <= side_points; i++) {
            double t = (double)i / (double)(side_points + 1);
            outline[count++] = (struct point2){a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t};
        }
    }
    return count;
}

static struct vec3 path_tangent(const struct vec3 *path, size_t count, size_t i)
{
    size_t before = i > 0 ? i - 1 : 0, after = i + 1 < count ? i + 1 : i;
    return vec_normalize(vec_sub(path[after], path[before]));
}

/* A unit vector across direction. */
static struct vec3 any_normal(struct vec3 direction)
{
    struct vec3 axis = fabs(direction.y) < 0.9 ? vec3(0, 1, 0) : vec3(1, 0, 0);
    return vec_normalize(vec_cross(axis, direction));
}

void mesh_tube(struct mesh *mesh, const struct vec3 *path, const double *radii, size_t count,
               size_t segments)
{
    struct vec3 *rings = mesh_allocate(count * segments, sizeof *rings);
    struct vec3 normal = any_normal(path_tangent(path, count, 0));
    for (size_t r = 0; r < count; r++) {
        struct vec3 tangent = path_tangent(path, count, r);
        /* the frame is transported along the path with the least rotation */
        normal = vec_normalize(vec_add_scaled(normal, tangent, -vec_dot(normal, tangent)));
        struct vec3 binormal = vec_cross(normal, tangent);
        for (size_t i = 0; i < segments; i++) {
            double angle = 2 * PI * (double)i / (double)segments;
            struct vec3 out = vec_add_scaled(vec_scale(normal, cos(angle)), binormal, sin(angle));
            rings[r * segments + i] = vec_add_scaled(path[r], out, radii[r]);
        }
    }
    mesh_loft(mesh, rings, count, segments, MESH_CAPPED);
    free(rings);
}

void mesh_box(struct mesh *mesh, struct vec3 min, struct vec3 max, double bevel)
{
    double b = bevel;
    if (b > 0) {
        struct point2 cut[8] = {{min.x + b, min.z}, {max.x - b, min.z}, {max.x, min.z + b},
                                {max.x, max.z - b}, {max.x - b, max.z}, {min.x + b, max.z},
                                {min.x, max.z - b}, {min.x, min.z + b}};
        mesh_extrude(mesh, cut, 8, min.y, max.y, b);
    } else {
        struct point2 sharp[4] = {{min.x, min.z}, {max.x, min.z}, {max.x, max.z}, {min.x, max.z}};
        mesh_extrude(mesh, sharp, 4, min.y, max.y, 0);
    }
}

struct ball_face {
    struct vec3 center, radii;
    struct vec3 right, up, out;
};

static struct vec3 ball_point(const void *context, double u, double v)
{
    const struct ball_face *face = context;
    /* equal angles instead of equal lengths: the outer quads do not shrink as much */
    double a = tan((u - 0.5) * (PI / 2)), b = tan((v - 0.5) * (PI / 2));
    struct vec3 p = vec_add_scaled(vec_add_scaled(face->out, face->right, a), face->up, b);
    return vec_add(face->center, vec_mul(vec_normalize(p), face->radii));
}

void mesh_ball(struct mesh *mesh, struct vec3 center, struct vec3 radii, size_t detail)
{
    const struct vec3 x = vec3(1, 0, 0), y = vec3(0, 1, 0), z = vec3(0, 0, 1);
    const struct ball_face faces[6] = {
        {center, radii, y, z, x}, {center, radii, z, y, vec_neg(x)},
        {center, radii, z, x, y}, {center, radii, x, z, vec_neg(y)},
        {center, radii, x, y, z}, {center, radii, y, x, vec_neg(z)},
    };
    struct mesh_mark from = mesh_mark(mesh);
    for (int i = 0; i < 6; i++)
        mesh_grid(mesh, detail, detail, ball_point, &faces[i]);
    mesh_weld(mesh, from);
}
