/*
 * Arithmetic for the oracles: MPFR with a fixed, generous precision, and the few vector operations that the
 * cases need. Nothing here is shared with the kernel.
 *
 * 2048 bits hold every sum and product of the cases' inputs without any rounding (signs of polynomials of degree
 * 8 in doubles whose exponents span 200 binary orders); oracle_exact_begin() and oracle_exact_end() prove it for
 * each use with MPFR's inexact flag.
 */
#ifndef FARM_BENCH_ORACLE_H
#define FARM_BENCH_ORACLE_H

#include <mpfr.h>

#include "common/vec.h"

#define ORACLE_BITS 2048

/* From here to oracle_exact_end() every operation has to be exact; the program ends if one is not.
 */
void oracle_exact_begin(void);
void oracle_exact_end(void);

/* All numbers of an oracle are in one array, so that they are initialised and freed together. */
void reals_init(mpfr_t *reals, unsigned count);
void reals_clear(mpfr_t *reals, unsigned count);

void real_difference(mpfr_t out[3], struct vec3 a, struct vec3 b);
void real_set(mpfr_t out[3], struct vec3 a);
/* out must not be among the inputs. */
void real_dot(mpfr_t out, mpfr_t a[3], mpfr_t b[3]);
void real_cross(mpfr_t out[3], mpfr_t a[3], mpfr_t b[3]);

/* |value - truth| in units of the last place of truth rounded to double (at least the smallest
 * denormal); truth 0 and value 0: 0; infinite when only one of them is 0. */
double ulps(double value, mpfr_t truth);

/* |value - truth| / (u |truth|), u = 2^-53. */
double roundoffs(double value, mpfr_t truth);

#endif
