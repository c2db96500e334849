/* An arched bridge of lacquered wood over the inlet at the back left. */
#include "config/models/garden.h"
#include "config/models/scatter.h"

/* The bridge is modelled along x around the origin, then moved to its place. */
static const double half_span = 2.25, rise = 0.62, half_width = 0.52;

static double deck_height(double x)
{
    double t = x / half_span;
    return rise * (1 - t * t);
}

/* Adds a beam of this width and height that follows the arch at z, raised by `up`. */
static void add_arched_beam(struct mesh *mesh, double z, double up, double width, double height)
{
    enum { STEPS = 40 };
    struct vec3 rings[(STEPS + 1) * 4];
    for (int i = 0; i <= STEPS; i++) {
        double x = half_span * (2.0 * i / STEPS - 1), y = deck_height(x) + up;
        rings[i * 4 + 0] = vec3(x, y - height / 2, z - width / 2);
        rings[i * 4 + 1] = vec3(x, y + height / 2, z - width / 2);
        rings[i * 4 + 2] = vec3(x, y + height / 2, z + width / 2);
        rings[i * 4 + 3] = vec3(x, y - height / 2, z + width / 2);
    }
    mesh_loft(mesh, rings, STEPS + 1, 4, MESH_CAPPED);
}

static void add_planks(struct mesh *mesh)
{
    enum { PLANKS = 32 };
    mesh_use(mesh, "plank");
    for (int i = 0; i < PLANKS; i++) {
        double x = half_span * (2 * (i + 0.5) / PLANKS - 1), width = half_span / PLANKS - 0.006;
        struct mesh_mark part = mesh_mark(mesh);
        mesh_box(mesh, vec3(-width, -0.03, -half_width - 0.05),
                 vec3(width, 0.03, half_width + 0.05), 0.006);
        double slope = atan(-2 * rise * x / (half_span * half_span)) * 180 / PI;
        struct mesh_transform t = transform_turn(vec3(0, 0, 1), slope);
        t.origin = vec3(x, deck_height(x), 0);
        mesh_apply(mesh, part, &t);
    }
}

/* A post with a bronze cap (giboshi). */
static void add_post(struct mesh *mesh, double x, double z)
{
    double y = deck_height(x);
    struct vec3 path[] = {vec3(x, y - 0.25, z), vec3(x, y + 0.72, z)};
    double radii[] = {0.055, 0.055};
    mesh_use(mesh, "vermilion");
    mesh_tube(mesh, path, radii, 2, 16);
    static const struct point2 cap[] = {{0.060, 0},     {0.060, 0.05}, {0.045, 0.06},
                                        {0.040, 0.075}, {0.056, 0.10}, {0.058, 0.125},
                                        {0.045, 0.16},  {0.015, 0.19}, {0, 0.215}};
    struct mesh_mark part = mesh_mark(mesh);
    mesh_use(mesh, "bronze");
    mesh_revolve(mesh, cap, sizeof cap / sizeof cap[0], 16);
    struct mesh_transform t = transform_place(vec3(x, y + 0.72, z), 0, 1);
    mesh_apply(mesh, part, &t);
}

static void add_railing(struct mesh *mesh, double z)
{
    for (int i = 0; i < 5; i++)
        add_post(mesh, half_span * 0.97 * (i / 2.0 - 1), z);
    mesh_use(mesh, "vermilion");
    add_arched_beam(mesh, z, 0.62, 0.07, 0.06);
    add_arched_beam(mesh, z, 0.38, 0.04, 0.05);
    add_arched_beam(mesh, z, 0.14, 0.04, 0.05);
    add_arched_beam(mesh, z, -0.1, 0.09, 0.16);
}

/* Two pairs of piles that carry the arch. */
static void add_piles(struct mesh *mesh)
{
    mesh_use(mesh, "vermilion");
    for (int i = 0; i < 4; i++) {
        double x = i % 2 == 0 ? -0.85 : 0.85, z = i / 2 == 0 ? -half_width : half_width;
        struct vec3 path[] = {vec3(x, -1.2, z), vec3(x, deck_height(x) - 0.05, z)};
        double radii[] = {0.06, 0.06};
        mesh_tube(mesh, path, radii, 2, 16);
    }
}

void add_bridge(struct mesh *mesh)
{
    struct mesh_mark part = mesh_mark(mesh);
    add_planks(mesh);
    add_railing(mesh, -half_width);
    add_railing(mesh, half_width);
    add_piles(mesh);
    mesh_smooth(mesh, part, 40);
    struct mesh_transform t = transform_place(vec3(-4.05, 0.24, -4.3), 28, 1);
    mesh_apply(mesh, part, &t);
}
