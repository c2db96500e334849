/* Random numbers and directions, curves, limbs, needles and leaves for the plants of the garden. */
#ifndef FARM_CONFIG_MODELS_SCATTER_H
#define FARM_CONFIG_MODELS_SCATTER_H

#include "config/models/mesh.h"

#define PI 3.14159265358979323846

/* A stream of pseudorandom numbers that is the same on every run. */
struct dice {
    uint32_t seed, next;
};

/* A number low <= x < high. */
double dice_between(struct dice *dice, double low, double high);

/* A whole number from 0 to count - 1. */
uint32_t dice_pick(struct dice *dice, uint32_t count);

/* A unit vector, uniformly distributed over the sphere. */
struct vec3 dice_direction(struct dice *dice);

/* A unit vector at most degrees away from the unit vector axis. */
struct vec3 dice_cone(struct dice *dice, struct vec3 axis, double degrees);

/* Two unit vectors that make a right-handed frame with the unit vector axis. */
void frame_about(struct vec3 axis, struct vec3 *right, struct vec3 *up);

/* 0 for x <= low, 1 for x >= high, smooth in between. */
double ramp(double low, double high, double x);

struct vec3 vec_mix(struct vec3 a, struct vec3 b, double t);

/* The point at 0 <= t <= 1 of the smooth (Catmull-Rom) curve through count >= 2 points. */
struct vec3 curve_at(const struct vec3 *points, size_t count, double t);

/* A tapering round limb along the curve through the points: radius first at its foot and last at
 * its tip; closed at both ends. */
struct limb {
    const struct vec3 *points;
    size_t count;
    double first, last;
    size_t steps; /* along the limb; at most LIMB_MAX_STEPS */
    size_t sides;
};

#define LIMB_MAX_STEPS 96

void add_limb(struct mesh *mesh, const struct limb *limb);

/* A slim three-sided cone without a base: a needle. */
void add_needle(struct mesh *mesh, struct vec3 base, struct vec3 direction, double length,
                double radius);

/* A leaf: two triangles, folded along the midrib. across: from the midrib to the side, unit. */
void add_leaf(struct mesh *mesh, struct vec3 base, struct vec3 along, struct vec3 across,
              double length, double width);

#endif
