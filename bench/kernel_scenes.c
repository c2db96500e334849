/*
 * Several scenes are in the manner of E. Haines' Standard Procedural Databases ("A Proposal for
 * Standard Graphics Environments", IEEE CG&A 7(11), 1987), made by rules of our own.
 */
#include "bench/kernel_scenes.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "bench/outside.h"
#include "common/vec.h"

#define PI 3.14159265358979324

/* ---- what the scenes are written with ---- */

struct scene_place {
    const char *folder, *name;
};

static void write_vec(FILE *out, const char *key, struct vec3 v)
{
    fprintf(out, "%s = %.9g %.9g %.9g\n", key, v.x, v.y, v.z);
}

static FILE *begin_scene(const struct scene_place *place, struct vec3 eye, struct vec3 look_at,
                         struct vec3 up)
{
    FILE *out = open_to_write("%s/%s.ini", place->folder, place->name);
    fputs("[camera]\nfov = 45\n", out);
    write_vec(out, "eye", eye);
    write_vec(out, "look_at", look_at);
    write_vec(out, "up", up);
    fputs("[background]\ncolor = 0.078 0.361 0.753\n", out);
    return out;
}

/* count lights that together are as bright as one or two. */
static void write_lights(FILE *out, const struct vec3 *positions, unsigned count)
{
    double strength = 1 / sqrt(count);
    for (unsigned i = 0; i < count; i++) {
        fprintf(out, "[light l%u]\ncolor = %.9g %.9g %.9g\n", i, strength, strength, strength);
        write_vec(out, "position", positions[i]);
    }
}

struct finish {
    const char *name;
    struct vec3 color;
    double diffuse, specular, shininess, reflection, transmission, ior;
};

static void write_material(FILE *out, const struct finish *finish)
{
    fprintf(out, "[material %s]\nambient = 0.05\ndiffuse = %g\nspecular = %g\nshininess = %g\n",
            finish->name, finish->diffuse, finish->specular, finish->shininess);
    fprintf(out, "reflection = %g\ntransmission = %g\nior = %g\n", finish->reflection,
            finish->transmission, finish->ior);
    write_vec(out, "color", finish->color);
}

static void write_sphere(FILE *out, struct vec3 center, double radius, const char *material)
{
    fprintf(out, "[sphere]\nradius = %.9g\nmaterial = %s\n", radius, material);
    write_vec(out, "center", center);
}

static void write_cone(FILE *out, struct vec3 base, struct vec3 apex, double base_radius,
                       double apex_radius, const char *material)
{
    fprintf(out, "[cone]\nbase_radius = %.9g\napex_radius = %.9g\nmaterial = %s\n", base_radius,
            apex_radius, material);
    write_vec(out, "base", base);
    write_vec(out, "apex", apex);
}

static void write_cylinder(FILE *out, struct vec3 base, struct vec3 apex, double radius,
                           const char *material)
{
    fprintf(out, "[cylinder]\nradius = %.9g\nmaterial = %s\n", radius, material);
    write_vec(out, "base", base);
    write_vec(out, "apex", apex);
}

static void write_triangle(FILE *out, struct vec3 a, struct vec3 b, struct vec3 c,
                           const char *material)
{
    fprintf(out, "[triangle]\nmaterial = %s\n", material);
    write_vec(out, "a", a);
    write_vec(out, "b", b);
    write_vec(out, "c", c);
}

/* A square in z = height, seen from above. */
static void write_ground(FILE *out, double half, double height, const char *material)
{
    struct vec3 a = vec3(-half, -half, height), b = vec3(half, -half, height);
    struct vec3 c = vec3(half, half, height), d = vec3(-half, half, height);
    write_triangle(out, a, b, c, material);
    write_triangle(out, a, c, d, material);
}

static void write_mesh(FILE *out, const struct scene_place *place, const char *material)
{
    fprintf(out, "[mesh]\nfile = %s.obj\nmaterial = %s\n", place->name, material);
}

static void write_vertex(FILE *obj, struct vec3 v)
{
    fprintf(obj, "v %.9g %.9g %.9g\n", v.x, v.y, v.z);
}

/* Two unit vectors that make a right-handed frame with a unit vector. */
static void frame_around(struct vec3 axis, struct vec3 *u, struct vec3 *v)
{
    struct vec3 other = fabs(axis.x) < 0.5 ? vec3(1, 0, 0) : vec3(0, 1, 0);
    *u = vec_normalize(vec_cross(other, axis));
    *v = vec_cross(axis, *u);
}

static struct vec3 on_circle(struct vec3 u, struct vec3 v, double angle)
{
    return vec_add(vec_scale(u, cos(angle)), vec_scale(v, sin(angle)));
}

/* 0 .. 1 from a place in a lattice: the finaliser of SplitMix64. */
static double hash_unit(uint64_t x, uint64_t y)
{
    uint64_t bits = x * UINT64_C(0x9e3779b97f4a7c15) + y * UINT64_C(0xd1b54a32d192ed03);
    bits = (bits ^ bits >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    bits = (bits ^ bits >> 27) * UINT64_C(0x94d049bb133111eb);
    return (double)((bits ^ bits >> 31) >> 11) * 0x1p-53;
}

static double smooth_noise(double x, double y)
{
    double i = floor(x), j = floor(y), s = x - i, t = y - j;
    uint64_t a = (uint64_t)(int64_t)i, b = (uint64_t)(int64_t)j;
    s *= s * (3 - 2 * s);
    t *= t * (3 - 2 * t);
    double low = hash_unit(a, b) * (1 - s) + hash_unit(a + 1, b) * s;
    double high = hash_unit(a, b + 1) * (1 - s) + hash_unit(a + 1, b + 1) * s;
    return low * (1 - t) + high * t;
}

/* -1 .. 1, with detail down to 2^-octaves. */
static double fractal_noise(double x, double y, int octaves)
{
    double sum = 0, weight = 1;
    for (int i = 0; i < octaves; i++, weight /= 2)
        sum += weight * (smooth_noise(ldexp(x, i), ldexp(y, i)) - 0.5);
    return sum;
}

/* The depth at which a fractal, each part of which is followed by `ratio` others, has at most count of
 * them; at least 1. */
static int depth_for(double count, double ratio)
{
    int depth = 0;
    double sum = 1, level = 1;
    while (sum * (1 + 1e-9) < count) {
        level *= ratio;
        sum += level;
        if (sum <= count * (1 + 1e-9)) depth++;
    }
    return depth < 1 ? 1 : depth;
}

/* ---- balls: a flake of mirrors ---- */

static void flake(FILE *out, struct vec3 center, struct vec3 axis, double radius, int depth)
{
    write_sphere(out, center, radius, "ball");
    if (depth == 0) return;
    struct vec3 u, v;
    frame_around(axis, &u, &v);
    for (int i = 0; i < 9; i++) {
        double polar = i < 6 ? PI / 2 : acos(sqrt(2.0 / 3));
        double turn = i < 6 ? i * PI / 3 : PI / 6 + i * 2 * PI / 3;
        struct vec3 direction =
            vec_add_scaled(vec_scale(axis, cos(polar)), on_circle(u, v, turn), sin(polar));
        direction = vec_normalize(direction);
        flake(out, vec_add_scaled(center, direction, radius * 4 / 3), direction, radius / 3,
              depth - 1);
    }
}

static void write_balls(const struct scene_place *place, double scale)
{
    FILE *out = begin_scene(place, vec3(2.1, 1.3, 1.7), vec3(0, 0, 0), vec3(0, 0, 1));
    const struct vec3 lights[] = {{4, 3, 2}, {1, -4, 4}, {-3, 1, 5}};
    write_lights(out, lights, 3);
    write_material(out, &(struct finish){"ground", {1, 0.75, 0.33}, 0.8, 0, 1, 0, 0, 1});
    write_material(out, &(struct finish){"ball", {1, 0.9, 0.7}, 0.5, 0.5, 20, 0.5, 0, 1});
    write_ground(out, 12, -0.5, "ground");
    flake(out, vec3(0, 0, 0), vec3(0, 0, 1), 0.5, depth_for(7381 * scale, 9));
    close_written(out);
}

/* ---- tetra: a tetrahedron of tetrahedra ---- */

static void tetrahedra(FILE *obj, const struct vec3 corner[4], int depth)
{
    if (depth == 0) {
        for (int i = 0; i < 4; i++)
            write_vertex(obj, corner[i]);
        fputs("f -4 -3 -2\nf -4 -1 -3\nf -4 -2 -1\nf -3 -1 -2\n", obj);
        return;
    }
    for (int i = 0; i < 4; i++) {
        struct vec3 part[4];
        for (int j = 0; j < 4; j++)
            part[j] = vec_scale(vec_add(corner[i], corner[j]), 0.5);
        tetrahedra(obj, part, depth - 1);
    }
}

static void write_tetra(const struct scene_place *place, double scale)
{
    FILE *out = begin_scene(place, vec3(1.9, -2.2, 1.6), vec3(0, 0, -0.1), vec3(0, 0, 1));
    const struct vec3 lights[] = {{6, -18, 12}};
    write_lights(out, lights, 1);
    write_material(out, &(struct finish){"red", {1, 0.2, 0.2}, 0.95, 0, 1, 0, 0, 1});
    write_mesh(out, place, "red");
    close_written(out);
    FILE *obj = open_to_write("%s/%s.obj", place->folder, place->name);
    /* Every level has four times as many, the last one counts. */
    int depth = 0;
    while (4 * pow(4, depth + 1) <= 4096 * scale * (1 + 1e-9))
        depth++;
    const struct vec3 corner[4] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    tetrahedra(obj, corner, depth);
    close_written(obj);
}

/* ---- mount: foil over glass balls ---- */

/* Writes the scene's mesh: (edge + 1)^2 vertices from -1 to 1 and 2 edge^2 triangles. */
static void height_field(const struct scene_place *place, unsigned edge, double height, int octaves)
{
    FILE *obj = open_to_write("%s/%s.obj", place->folder, place->name);
    for (unsigned j = 0; j <= edge; j++)
        for (unsigned i = 0; i <= edge; i++) {
            double x = 2.0 * i / edge - 1, y = 2.0 * j / edge - 1;
            double hill = exp(-3 * (x * x + y * y));
            double z = height * (hill + 0.6 * fractal_noise(3 * x + 17, 3 * y + 5, octaves));
            write_vertex(obj, vec3(x, y, z));
        }
    for (unsigned j = 0; j < edge; j++)
        for (unsigned i = 0; i < edge; i++) {
            unsigned a = j * (edge + 1) + i + 1, b = a + 1, c = b + edge + 1, d = a + edge + 1;
            fprintf(obj, "f %u %u %u\nf %u %u %u\n", a, b, c, a, c, d);
        }
    close_written(obj);
}

static void write_mount(const struct scene_place *place, double scale)
{
    FILE *out = begin_scene(place, vec3(-1.6, 1.6, 1.7), vec3(0, 0, 0.1), vec3(0, 0, 1));
    const struct vec3 lights[] = {{-100, -100, 100}};
    write_lights(out, lights, 1);
    write_material(out, &(struct finish){"foil", {0.8, 0.72, 0.56}, 0.6, 0.1, 20, 0, 0.4, 1});
    write_material(out, &(struct finish){"glass", {1, 1, 1}, 0.1, 0.1, 100, 0.1, 0.8, 1.5});
    write_mesh(out, place, "foil");
    for (int i = 0; i < 4; i++) {
        double turn = i * PI / 2 + 0.4;
        write_sphere(out, vec3(0.55 * cos(turn), 0.55 * sin(turn), 0.75), 0.22, "glass");
    }
    close_written(out);
    height_field(place, (unsigned)ceil(64 * sqrt(scale)), 0.6, 6);
}

/* ---- rings: chains of rings, tessellated and of cylinders and cones ---- */

struct ring {
    struct vec3 center, u, v; /* it lies in the plane of u and v */
};

#define RING_RADIUS 0.62
#define RING_WIRE   0.10

/* A wall of edge x edge x 2 rings that go through each other. */
static struct ring ring_of(unsigned edge, unsigned i, unsigned j, unsigned k)
{
    double middle = 0.5 * (edge - 1);
    struct vec3 center = vec3(i - middle + 0.5 * k, 0.35 * k, j - middle);
    struct vec3 u = vec3(0.96, 0.28, 0), v = vec3(0, 0, 1);
    if (k) u = vec3(0.96, -0.28, 0), v = vec3(0.27, 0.94, 0.2);
    struct ring ring = {center, vec_normalize(u), vec3(0, 0, 0)};
    ring.v = vec_normalize(vec_add_scaled(v, ring.u, -vec_dot(v, ring.u)));
    return ring;
}

static void torus(FILE *obj, const struct ring *ring, unsigned around, unsigned across,
                  uint64_t first)
{
    struct vec3 axis = vec_cross(ring->u, ring->v);
    for (unsigned i = 0; i < around; i++)
        for (unsigned j = 0; j < across; j++) {
            struct vec3 out = on_circle(ring->u, ring->v, 2 * PI * i / around);
            struct vec3 normal = on_circle(out, axis, 2 * PI * j / across);
            struct vec3 p = vec_add_scaled(ring->center, out, RING_RADIUS);
            write_vertex(obj, vec_add_scaled(p, normal, RING_WIRE));
            fprintf(obj, "vn %.9g %.9g %.9g\n", normal.x, normal.y, normal.z);
        }
    for (unsigned i = 0; i < around; i++)
        for (unsigned j = 0; j < across; j++) {
            unsigned next = (i + 1) % around, side = (j + 1) % across;
            unsigned long long a = first + i * across + j, b = first + next * across + j;
            unsigned long long c = first + next * across + side, d = first + i * across + side;
            fprintf(obj, "f %llu//%llu %llu//%llu %llu//%llu\n", a, a, b, b, c, c);
            fprintf(obj, "f %llu//%llu %llu//%llu %llu//%llu\n", a, a, c, c, d, d);
        }
}

static FILE *begin_rings(const struct scene_place *place, unsigned edge)
{
    double half = 0.5 * edge;
    FILE *out = begin_scene(place, vec3(0.9 * half, -3.3 * half, 1.1 * half),
                            vec3(0.2, 0, -0.1 * half), vec3(0, 0, 1));
    const struct vec3 lights[] = {{2 * half, -4 * half, 4 * half},
                                  {-3 * half, -3 * half, 2 * half},
                                  {0, -2 * half, 0.5 * half}};
    write_lights(out, lights, 3);
    write_material(out, &(struct finish){"floor", {0.8, 0.8, 0.75}, 0.6, 0, 1, 0.2, 0, 1});
    write_material(out, &(struct finish){"gold", {1, 0.75, 0.3}, 0.45, 0.5, 30, 0.4, 0, 1});
    write_material(out, &(struct finish){"steel", {0.7, 0.75, 0.8}, 0.4, 0.6, 60, 0.45, 0, 1});
    write_ground(out, 6 * half, -1.2 * half, "floor");
    return out;
}

static void write_rings_mesh(const struct scene_place *place, double scale)
{
    const unsigned edge = 6, around = (unsigned)ceil(48 * sqrt(scale)) + 3, across = around / 3 + 2;
    FILE *out = begin_rings(place, edge);
    write_mesh(out, place, "gold");
    close_written(out);
    FILE *obj = open_to_write("%s/%s.obj", place->folder, place->name);
    for (unsigned i = 0; i < edge * edge * 2; i++) {
        struct ring ring = ring_of(edge, i / 2 % edge, i / 2 / edge, i % 2);
        torus(obj, &ring, around, across, (uint64_t)i * around * across + 1);
    }
    close_written(obj);
}

/* A polygon of cylinders with balls at its corners, a cone on every second one. */
static void wire_ring(FILE *out, const struct ring *ring, unsigned corners)
{
    for (unsigned i = 0; i < corners; i++) {
        struct vec3 from = on_circle(ring->u, ring->v, 2 * PI * i / corners);
        struct vec3 to = on_circle(ring->u, ring->v, 2 * PI * (i + 1) / corners);
        struct vec3 a = vec_add_scaled(ring->center, from, RING_RADIUS);
        struct vec3 b = vec_add_scaled(ring->center, to, RING_RADIUS);
        write_cylinder(out, a, b, RING_WIRE, "gold");
        write_sphere(out, a, 1.2 * RING_WIRE, "steel");
        if (i % 2) continue;
        struct vec3 tip = vec_add_scaled(a, from, 3 * RING_WIRE);
        write_cone(out, a, tip, RING_WIRE, 0, "steel");
    }
}

static void write_rings(const struct scene_place *place, double scale)
{
    const unsigned edge = 6, corners = 2 * (unsigned)ceil(6 * scale);
    FILE *out = begin_rings(place, edge);
    for (unsigned i = 0; i < edge * edge * 2; i++) {
        struct ring ring = ring_of(edge, i / 2 % edge, i / 2 / edge, i % 2);
        wire_ring(out, &ring, corners);
    }
    close_written(out);
}

/* ---- tree: cones and balls ---- */

static void branch(FILE *out, struct vec3 foot, struct vec3 direction, double length, int depth,
                   uint64_t number)
{
    struct vec3 tip = vec_add_scaled(foot, direction, length), u, v;
    const char *material = depth < 3 ? "leaf" : "bark";
    write_cone(out, foot, tip, 0.09 * length, 0.065 * length, material);
    write_sphere(out, tip, 0.075 * length, material);
    if (depth == 0) return;
    frame_around(direction, &u, &v);
    for (unsigned i = 0; i < 2; i++) {
        double turn = PI * i + 2 * PI * hash_unit(number, 1);
        double lean = 0.35 + 0.3 * hash_unit(number, 2 + i);
        struct vec3 next =
            vec_add_scaled(vec_scale(direction, cos(lean)), on_circle(u, v, turn), sin(lean));
        branch(out, tip, vec_normalize(next), length * (0.72 + 0.1 * hash_unit(number, 4 + i)),
               depth - 1, 2 * number + i);
    }
}

static void write_tree(const struct scene_place *place, double scale)
{
    FILE *out = begin_scene(place, vec3(3.3, -4.4, 2.6), vec3(0, 0, 1.75), vec3(0, 0, 1));
    const struct vec3 lights[] = {{9, -6, 12}, {-8, -9, 6}, {2, -10, 3}, {-4, 7, 9},
                                  {8, 6, 4},   {0, 0, 14},  {-12, 2, 5}};
    write_lights(out, lights, 7);
    write_material(out, &(struct finish){"ground", {0.6, 0.7, 0.4}, 0.8, 0, 1, 0, 0, 1});
    write_material(out, &(struct finish){"bark", {0.55, 0.4, 0.25}, 0.8, 0.1, 10, 0, 0, 1});
    write_material(out, &(struct finish){"leaf", {0.3, 0.65, 0.25}, 0.7, 0.2, 15, 0, 0, 1});
    write_ground(out, 20, 0, "ground");
    branch(out, vec3(0, 0, 0), vec3(0, 0, 1), 1, depth_for(4095 * scale, 2), 1);
    close_written(out);
}

/* ---- lattice: glass balls between mirror bars ---- */

static void write_lattice(const struct scene_place *place, double scale)
{
    static const struct vec3 axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const unsigned edge = (unsigned)fmax(2, rint(8 * cbrt(scale)));
    const double reach = edge - 1;
    FILE *out = begin_scene(place, vec3(1.8 * reach, -1.9 * reach, 1.6 * reach),
                            vec3(0.5 * reach, 0.5 * reach, 0.42 * reach), vec3(0, 0, 1));
    const struct vec3 lights[] = {{3 * reach, -reach, 3 * reach}, {-reach, -3 * reach, 2 * reach}};
    write_lights(out, lights, 2);
    write_material(out, &(struct finish){"bar", {0.9, 0.55, 0.3}, 0.6, 0.3, 40, 0.25, 0, 1});
    write_material(out, &(struct finish){"glass", {0.9, 0.97, 1}, 0.1, 0.3, 80, 0.12, 0.75, 1.5});
    for (unsigned i = 0; i < edge * edge * edge; i++) {
        struct vec3 p = vec3(i % edge, i / edge % edge, i / edge / edge);
        write_sphere(out, p, 0.17, "glass");
        for (unsigned k = 0; k < 3; k++)
            if (vec_component(&p, k) < reach)
                write_cylinder(out, vec_add_scaled(p, axes[k], 0.2),
                               vec_add_scaled(p, axes[k], 0.8), 0.06, "bar");
    }
    close_written(out);
}

/* ---- million: one mesh of a million triangles ---- */

static void write_million(const struct scene_place *place, double scale)
{
    FILE *out = begin_scene(place, vec3(-1.5, -1.9, 1.4), vec3(0, 0, 0.05), vec3(0, 0, 1));
    const struct vec3 lights[] = {{-4, 1, 3}, {3, -5, 4}};
    write_lights(out, lights, 2);
    write_material(out, &(struct finish){"rock", {0.75, 0.68, 0.6}, 0.8, 0.15, 12, 0, 0, 1});
    write_mesh(out, place, "rock");
    close_written(out);
    height_field(place, (unsigned)ceil(708 * sqrt(scale)), 0.5, 10);
}

/* ---- planet: a mesh on a ball as large as the earth, with balls above it ---- */

#define PLANET_RADIUS 6.37e6

static void write_planet(const struct scene_place *place, double scale)
{
    FILE *out = begin_scene(place, vec3(-1.4, -1.7, 1.1), vec3(0, 0, 0.05), vec3(0, 0, 1));
    const struct vec3 lights[] = {{-4, 1, 3}, {3, -5, 4}};
    write_lights(out, lights, 2);
    write_material(out, &(struct finish){"rock", {0.75, 0.68, 0.6}, 0.8, 0.15, 12, 0, 0, 1});
    write_material(out, &(struct finish){"ground", {0.5, 0.6, 0.4}, 0.8, 0, 1, 0, 0, 1});
    write_material(out, &(struct finish){"ball", {0.9, 0.9, 1}, 0.4, 0.5, 40, 0.5, 0, 1});
    write_sphere(out, vec3(0, 0, -PLANET_RADIUS), PLANET_RADIUS, "ground");
    for (int i = 0; i < 4; i++) {
        double turn = i * PI / 2 + 0.4;
        write_sphere(out, vec3(0.6 * cos(turn), 0.6 * sin(turn), 0.5), 0.15, "ball");
    }
    write_mesh(out, place, "rock");
    close_written(out);
    height_field(place, (unsigned)ceil(300 * sqrt(scale)), 0.4, 9);
}

/* ---- pipes: long narrow facets in all directions ---- */

#define PIPES       40
#define PIPE_LENGTH 9
#define PIPE_RADIUS 0.2

/* A ring of vertices at each end. */
static void write_pipe(FILE *obj, struct vec3 middle, struct vec3 axis, unsigned facets,
                       uint64_t first)
{
    struct vec3 u, v;
    frame_around(axis, &u, &v);
    for (unsigned i = 0; i < 2 * facets; i++) {
        double end = i < facets ? -0.5 : 0.5;
        struct vec3 normal = on_circle(u, v, 2 * PI * i / facets);
        struct vec3 p = vec_add_scaled(middle, axis, end * PIPE_LENGTH);
        write_vertex(obj, vec_add_scaled(p, normal, PIPE_RADIUS));
        fprintf(obj, "vn %.9g %.9g %.9g\n", normal.x, normal.y, normal.z);
    }
    for (unsigned i = 0; i < facets; i++) {
        unsigned long long a = first + i, b = first + (i + 1) % facets;
        unsigned long long c = b + facets, d = a + facets;
        fprintf(obj, "f %llu//%llu %llu//%llu %llu//%llu\n", a, a, b, b, c, c);
        fprintf(obj, "f %llu//%llu %llu//%llu %llu//%llu\n", a, a, c, c, d, d);
    }
}

/* Axes spread over all directions by multiples of the golden ratio, middles over a cube. */
static void write_pipes(const struct scene_place *place, double scale)
{
    const unsigned facets = (unsigned)ceil(200 * scale);
    FILE *out = begin_scene(place, vec3(-7, -9, 6), vec3(0, 0, 0), vec3(0, 0, 1));
    const struct vec3 lights[] = {{-9, 2, 9}, {6, -12, 8}};
    write_lights(out, lights, 2);
    write_material(out, &(struct finish){"metal", {0.8, 0.7, 0.55}, 0.5, 0.5, 40, 0.3, 0, 1});
    write_material(out, &(struct finish){"floor", {0.6, 0.65, 0.6}, 0.8, 0, 1, 0, 0, 1});
    write_ground(out, 40, -6, "floor");
    write_mesh(out, place, "metal");
    close_written(out);
    FILE *obj = open_to_write("%s/%s.obj", place->folder, place->name);
    for (unsigned i = 0; i < PIPES; i++) {
        double height = 1 - (2 * i + 1.0) / PIPES, across = sqrt(1 - height * height);
        double turn = 2 * PI * 0.6180339887 * i;
        struct vec3 axis = vec3(across * cos(turn), across * sin(turn), height);
        struct vec3 middle = vec3(i % 4 - 1.5, i / 4 % 4 - 1.5, i % 3 - 1.0);
        write_pipe(obj, middle, axis, facets, (uint64_t)i * 2 * facets + 1);
    }
    close_written(obj);
}

/* ---- all of them ---- */

static const struct {
    const char *name;
    void (*write)(const struct scene_place *place, double scale);
} scenes[] = {
    {"balls", write_balls},           {"tetra", write_tetra},     {"mount", write_mount},
    {"rings_mesh", write_rings_mesh}, {"rings", write_rings},     {"tree", write_tree},
    {"lattice", write_lattice},       {"million", write_million}, {"planet", write_planet},
    {"pipes", write_pipes},
};

bool kernel_scene_write(const char *folder, const char *name, double scale)
{
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++)
        if (!strcmp(scenes[i].name, name)) {
            scenes[i].write(&(struct scene_place){folder, name}, scale);
            return true;
        }
    return false;
}
