/*
 * What light does at a surface: highlight, mirror and refraction as functions of nothing but their
 * arguments, each in two forms. The plain names do not cancel: they hold to the last bits at any
 * exponent, at grazing incidence, for nearly equal media and next to the critical angle. The names
 * that end in _paper are the paper's own formulas, kept to be compared with (render.formulas).
 *
 * Only + - * /, square roots and fma() are used where a result is needed to the last bits, no exp()
 * and log() of the C library: those are allowed to differ from one processor and one library to the
 * next (glibc chooses them by processor, and promises an error of 1 ulp, not the same bits), and
 * the ranks of a job need not run on equal machines.
 *
 * Conventions: `view` is the direction of the ray that arrives, `normal` points to the side that it
 * comes from; both have unit length up to rounding, and what they lack is corrected for. u = 2^-53.
 */
#ifndef FARM_WORKER_OPTICS_H
#define FARM_WORKER_OPTICS_H

#include <stdbool.h>

#include "common/vec.h"

/*
 * cos^n b, b the angle between the mirrored light and the eye; 0 when cos b <= 0, and below
 * e^-700 = 1e-304. to_light may have any length but 0. For these vectors as they are the relative
 * error is at most (2 + 0.05 |ln value|) u, 3.4 u above 1e-12, for any 0 <= shininess <=
 * SHININESS_MAX (1e15): it does not grow with the exponent.
 */
double phong_lobe(struct vec3 view, struct vec3 normal, struct vec3 to_light, double shininess);

/* pow(cos b, n): the relative error grows with n. All vectors unit, to_light as well. */
double phong_lobe_paper(struct vec3 view, struct vec3 normal, struct vec3 to_light,
                        double shininess);

/*
 * k = 1 - eta^2 (1 - cos_i^2), the squared cosine of the refracted angle; eta = from / to, indices
 * of refraction. Total reflection exactly where k < 0: the sign is that of the true value, the
 * relative error at most 3 u. -infinity where eta is beyond 2^500.
 */
double snell_k(double from, double to, double cos_i);
double snell_k_paper(double eta, double cos_i);

/* The refracted direction, each component correct to a little more than half an ulp; false: total
 * reflection. Equal media pass the direction on as it is. */
bool snell(struct vec3 view, struct vec3 normal, double from, double to, struct vec3 *direction);
bool snell_paper(struct vec3 view, struct vec3 normal, double eta, struct vec3 *direction);

/*
 * The mirror direction: each component as exact, length 1 within 2 u however long the chain of
 * mirrors, and never on the far side of normal when view comes from the near one.
 */
struct vec3 mirror(struct vec3 view, struct vec3 normal);
struct vec3 mirror_paper(struct vec3 view, struct vec3 normal);

#endif
