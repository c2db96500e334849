#include "config/models/scatter.h"

#include <assert.h>

double dice_between(struct dice *dice, double low, double high)
{
    return low + (high - low) * chance(dice->seed, dice->next++);
}

uint32_t dice_pick(struct dice *dice, uint32_t count)
{
    return (uint32_t)(chance(dice->seed, dice->next++) * count);
}

struct vec3 dice_direction(struct dice *dice)
{
    double y = dice_between(dice, -1, 1);
    double angle = dice_between(dice, 0, 2 * PI);
    double r = sqrt(fmax(0, 1 - y * y));
    return vec3(r * cos(angle), y, r * sin(angle));
}

struct vec3 dice_cone(struct dice *dice, struct vec3 axis, double degrees)
{
    struct vec3 right, up;
    frame_about(axis, &right, &up);
    double along = dice_between(dice, cos(degrees * PI / 180), 1);
    double angle = dice_between(dice, 0, 2 * PI);
    double r = sqrt(fmax(0, 1 - along * along));
    struct vec3 d = vec_scale(axis, along);
    d = vec_add_scaled(d, right, r * cos(angle));
    return vec_normalize(vec_add_scaled(d, up, r * sin(angle)));
}

void frame_about(struct vec3 axis, struct vec3 *right, struct vec3 *up)
{
    struct vec3 other = fabs(axis.y) < 0.9 ? vec3(0, 1, 0) : vec3(1, 0, 0);
    *right = vec_normalize(vec_cross(other, axis));
    *up = vec_cross(axis, *right);
}

double ramp(double low, double high, double x)
{
    double t = fmin(1, fmax(0, (x - low) / (high - low)));
    return t * t * (3 - 2 * t);
}

struct vec3 vec_mix(struct vec3 a, struct vec3 b, double t)
{
    return vec_add(vec_scale(a, 1 - t), vec_scale(b, t));
}

struct vec3 curve_at(const struct vec3 *points, size_t count, double t)
{
    double s = t * (double)(count - 1);
    size_t i = s >= (double)(count - 1) ? count - 2 : (size_t)s;
    double f = s - (double)i;
    struct vec3 b = points[i], c = points[i + 1];
    /* The points beyond the ends are extrapolated linearly. */
    struct vec3 a = i > 0 ? points[i - 1] : vec_sub(vec_scale(b, 2), c);
    struct vec3 d = i + 2 < count ? points[i + 2] : vec_sub(vec_scale(c, 2), b);
    struct vec3 sum = vec_scale(a, -f * (1 - f) * (1 - f) / 2);
    sum = vec_add_scaled(sum, b, 1 + f * f * (1.5 * f - 2.5));
    sum = vec_add_scaled(sum, c, f * (0.5 + f * (2 - 1.5 * f)));
    return vec_add_scaled(sum, d, f * f * (f - 1) / 2);
}

void add_limb(struct mesh *mesh, const struct limb *limb)
{
    assert(limb->count >= 2 && limb->steps >= 1 && limb->steps <= LIMB_MAX_STEPS);
    struct vec3 path[LIMB_MAX_STEPS + 1];
    double radii[LIMB_MAX_STEPS + 1];
    for (size_t i = 0; i <= limb->steps; i++) {
        double t = (double)i / (double)limb->steps;
        path[i] = curve_at(limb->points, limb->count, t);
        radii[i] = limb->first + (limb->last - limb->first) * t;
    }
    mesh_tube(mesh, path, radii, limb->steps + 1, limb->sides);
}

void add_needle(struct mesh *mesh, struct vec3 base, struct vec3 direction, double length,
                double radius)
{
    struct vec3 right, up;
    frame_about(direction, &right, &up);
    uint32_t corner[3];
    for (int i = 0; i < 3; i++) {
        double angle = 2 * PI / 3 * i;
        struct vec3 p = vec_add_scaled(base, right, radius * cos(angle));
        corner[i] = mesh_vertex(mesh, vec_add_scaled(p, up, radius * sin(angle)));
    }
    uint32_t tip = mesh_vertex(mesh, vec_add_scaled(base, direction, length));
    for (int i = 0; i < 3; i++)
        mesh_triangle(mesh, corner[i], corner[(i + 1) % 3], tip);
}

void add_leaf(struct mesh *mesh, struct vec3 base, struct vec3 along, struct vec3 across,
              double length, double width)
{
    struct vec3 normal = vec_cross(across, along);
    struct vec3 middle = vec_add_scaled(base, along, length * 0.45);
    middle = vec_add_scaled(middle, normal, width * 0.25);
    uint32_t a = mesh_vertex(mesh, base);
    uint32_t b = mesh_vertex(mesh, vec_add_scaled(middle, across, width / 2));
    uint32_t c = mesh_vertex(mesh, vec_add_scaled(base, along, length));
    uint32_t d = mesh_vertex(mesh, vec_add_scaled(middle, across, -width / 2));
    mesh_triangle(mesh, a, b, c);
    mesh_triangle(mesh, a, c, d);
}
