#include "config/models/stonework.h"

#include <assert.h>

/* ---- profiles ---- */

void profile_start(struct profile *profile, double radius, double height, double step)
{
    profile->points[0] = (struct point2){radius, height};
    profile->count = 1;
    profile->step = step;
}

static void profile_add(struct profile *profile, double x, double y)
{
    assert(profile->count < STONEWORK_POINTS);
    profile->points[profile->count++] = (struct point2){x, y};
}

void profile_curve(struct profile *profile, double cx, double cy, double x, double y)
{
    struct point2 a = profile->points[profile->count - 1];
    double length = hypot(cx - a.x, cy - a.y) + hypot(x - cx, y - cy);
    int pieces = (int)ceil(length / profile->step);
    for (int i = 1; i <= pieces; i++) {
        double t = (double)i / pieces, s = 1 - t;
        profile_add(profile, s * s * a.x + 2 * s * t * cx + t * t * x,
                    s * s * a.y + 2 * s * t * cy + t * t * y);
    }
}

void profile_line(struct profile *profile, double x, double y)
{
    struct point2 a = profile->points[profile->count - 1];
    profile_curve(profile, (a.x + x) / 2, (a.y + y) / 2, x, y);
}

void profile_turn(struct mesh *mesh, const struct profile *profile, size_t segments)
{
    mesh_revolve(mesh, profile->points, profile->count, segments);
}

#define CORNER_POINTS 5

size_t hexagon_outline(struct point2 *outline, double rounding, size_t side_points)
{
    const size_t most = STONEWORK_POINTS / STONEWORK_SIDES - CORNER_POINTS;
    if (side_points > most) side_points = most;
    return mesh_polygon(outline, STONEWORK_SIDES, rounding, CORNER_POINTS, side_points);
}

void profile_cut(struct mesh *mesh, const struct profile *profile, double rounding,
                 size_t side_points)
{
    struct point2 outline[STONEWORK_POINTS];
    size_t count = hexagon_outline(outline, rounding, side_points);
    mesh_prism(mesh, outline, count, profile->points, profile->count);
}

/* ---- lotus petals ---- */

/* Half the width of a petal at v from root to tip, 1 where it meets its neighbour: an ogee arch. */
static double petal_width(double v)
{
    if (v < 0 || v > 1) return 0;
    if (v < 0.4) return 0.90 + 0.06 * v / 0.4;
    double s = (v - 0.4) / 0.6;
    return 0.96 * (0.75 * sqrt(1 - s * s) + 0.25 * (1 - s) * (1 - s));
}

/* The height of a petal at s (-1 .. 1 across) and v: two low swellings within a raised rim, lifted
 * towards its tip. */
static double petal_height(double s, double v)
{
    double width = petal_width(v), across = fabs(s);
    if (across >= width) return 0;
    double edge = fmin((width - across) * 3, (1 - v) * 5);
    double rise = edge < 1 ? edge * (2 - edge) : 1;
    double rim = exp(-pow((edge - 0.8) * 1.6, 2)) * 0.30;
    double lobes = sin(PI * fmin(across / (0.8 * width), 1)) * sin(PI * v);
    return rise * (0.35 + 0.35 * v + 0.25 * lobes + rim);
}

struct vec3 petals_carve(const void *context, struct vec3 p)
{
    const struct petals *petals = context;
    double radius = hypot(p.x, p.z);
    double v = (p.y - petals->root) / (petals->tip - petals->root);
    if (radius < petals->inner || v < 0 || v > 1) return p;
    double turn = atan2(p.z, p.x) / (2 * PI) * petals->count;
    double front = petal_height(2 * (turn - floor(turn + 0.5)), v);
    /* the tips of a second row are visible between those of the first */
    double behind = 0.55 * petal_height(2 * (turn + 0.5 - floor(turn + 1)), v);
    double height = petals->relief * fmax(front, behind);
    double out = 1 + height * petals->direction.x / radius;
    return vec3(p.x * out, p.y + height * petals->direction.y, p.z * out);
}

/* ---- the surface ---- */

struct palette {
    uint32_t plain, light, dark, moss;
    const struct stone *stone;
};

/* The material at a point: granite is a mixture of grains; moss grows in patches where rain stays. */
static uint32_t grain_material(const void *context, struct vec3 p, struct vec3 normal)
{
    const struct palette *palette = context;
    const uint32_t seed = palette->stone->seed;
    double patches = noise_fractal(vec_scale(p, 6), 4, seed + 40);
    double wet = normal.y * 0.5 + patches + 0.22 * noise(vec_scale(p, 120), seed + 60);
    if (palette->stone->moss > 0 && wet > 1.05 - 0.65 * palette->stone->moss) return palette->moss;
    double grain = noise(vec_scale(p, 95), seed + 50);
    if (grain > 0.36) return palette->light;
    return grain < -0.36 ? palette->dark : palette->plain;
}

void stone_finish(struct mesh *mesh, struct mesh_mark from, const struct stone *stone,
                  double crease)
{
    const struct palette palette = {
        .plain = mesh_material(mesh, "granite"),
        .light = mesh_material(mesh, "granite_light"),
        .dark = mesh_material(mesh, "granite_dark"),
        .moss = mesh_material(mesh, "moss"),
        .stone = stone,
    };
    mesh_weld(mesh, from);
    mesh_roughen(mesh, from, 0.006, 9, stone->seed + 10);   /* the chisel */
    mesh_roughen(mesh, from, 0.0022, 55, stone->seed + 20); /* the grain */
    mesh_smooth(mesh, from, crease);
    mesh_paint(mesh, from, grain_material, &palette);
}
