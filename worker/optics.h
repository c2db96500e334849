/*
 * Optics of a surface: highlight, mirror and refraction as functions of their arguments alone, each in two
 * forms. The plain names avoid cancellation: they are accurate to the last bits for any exponent, at grazing
 * incidence, for nearly equal media and next to the critical angle. Those with naive_ are the paper's own
 * formulas, as in worker/naive.h, kept for comparison (render.formulas).
 *
 * Where a result must be accurate to the last bits, only + - * /, square roots and fma() are used, not exp()
 * and log() of the C library. Those may differ between processors and libraries (glibc chooses its
 * implementation by processor, and promises an error of 1 ulp, not the same bits), and the ranks of a job
 * need not run on equal machines.
 *
 * Conventions: `view` is the direction of the arriving ray, `normal` points to the side that it comes from.
 * Both have unit length up to rounding, and the functions correct for the rest. u = 2^-53.
 */
#ifndef FARM_WORKER_OPTICS_H
#define FARM_WORKER_OPTICS_H

#include <stdbool.h>

#include "common/vec.h"

/*
 * cos^n b, where b is the angle between the mirrored light and the eye; 0 if cos b <= 0 or the value is below
 * e^-700 = 1e-304. to_light may have any length but 0. For the vectors as given, the relative error is at
 * most (2 + 0.05 |ln value|) u, that is 3.4 u above 1e-12, for any 0 <= shininess <= SHININESS_MAX (1e15); it
 * does not grow with the exponent.
 */
double phong_lobe(struct vec3 view, struct vec3 normal, struct vec3 to_light, double shininess);

/* pow(cos b, n), at most 1; its relative error grows with n. All vectors, also to_light, have unit length. */
double naive_phong_lobe(struct vec3 view, struct vec3 normal, struct vec3 to_light,
                        double shininess);

/*
 * k = 1 - eta^2 (1 - cos_i^2), the squared cosine of the refracted angle, with eta = from / to, the indices
 * of refraction. There is total reflection exactly if k < 0: the sign is that of the true value, and the
 * relative error is at most 3 u. -infinity if eta is beyond 2^500. snell() decides by the same computation; only tests
 * ask for the value.
 */
double snell_k(double from, double to, double cos_i);

/* The same by the plain formula. */
double naive_snell_k(double eta, double cos_i);

/*
 * The refracted direction, each component correct to a little more than half an ulp; false: total reflection.
 * The indices differ (refract() of worker/shade.h takes care of equal ones).
 */
bool snell(struct vec3 view, struct vec3 normal, double from, double to, struct vec3 *direction);

/* The same by the paper's formulas; eta = from / to. */
bool naive_snell(struct vec3 view, struct vec3 normal, double eta, struct vec3 *direction);

/*
 * The mirror direction. Each component is accurate as above, its length is 1 within 2 u however long the
 * chain of mirrors, and it never points to the far side of normal if view comes from the near side.
 */
struct vec3 mirror(struct vec3 view, struct vec3 normal);

/* The same by the paper's formula, without corrections. */
struct vec3 naive_mirror(struct vec3 view, struct vec3 normal);

#endif
