/*
 * The quantities of a line and a cone (worker/cone.h) in exact arithmetic: polynomials of the input, rounded once, for
 * worker/cone.c. Their signs are right, and they are 0 only if the exact value is; of what is smaller than 2^-900, only
 * the sign is right.
 */
#ifndef FARM_WORKER_CONE_EXACT_H
#define FARM_WORKER_CONE_EXACT_H

#include "worker/cone_line.h"
#include "worker/inlined.h"

/* A cone and a ray with lengths divided by 2^length and the direction by 2^speed, as for a sphere, unless they are
 * ordinary: six lengths or directions are multiplied. */
struct scaled_cone {
    struct cone cone;
    struct vec3 origin, direction;
    int length, speed;
};

/* a x - b y */
RARE struct dd cone_exact_minor(double a, struct dd x, double b, struct dd y);

/* A = (W |d x w|^2 - (r1 - r0)^2 (d.w)^2) / W, with the numerator rounded once. */
RARE struct dd cone_exact_A(const struct scaled_cone *it, const struct cone_line *line);

/*
 *   B^2 - A C = W |d x g|^2 - (W + (r1 - r0)^2) (f.(d x w))^2,   g = r0 w + (r1 - r0) f
 *
 * (write F.D = (f.d) W - (f.w)(d.w) and so on). It is the same wherever the line's parameter is counted from. For a
 * cylinder it is W (r^2 |d x w|^2 - (f.(d x w))^2), which compares the line's distance from the axis with the radius.
 */
RARE struct dd cone_exact_discriminant(const struct scaled_cone *it, const struct cone_line *line);

/*
 * C = (W F.F - (r0 W + (r1 - r0) f.w)^2) / W, with the parameter counted from the ray's origin and the numerator
 * rounded once.
 */
RARE struct dd cone_exact_C(const struct scaled_cone *it, const struct cone_line *line);

#endif
