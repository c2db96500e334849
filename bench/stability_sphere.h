/* Shared by the rows about spheres: the oracle, and the run of a row. */
#ifndef FARM_BENCH_STABILITY_SPHERE_H
#define FARM_BENCH_STABILITY_SPHERE_H

#include "bench/oracle.h"
#include "bench/stability.h"

enum { F, D = F + 3, A = D + 3, B, C, DISC, ROOT, T0, T1, PART, SPHERE_REALS };

/* The first crossing at t > 0 of the exact line through the exact sphere. */
struct sphere_truth {
    mpfr_t real[SPHERE_REALS];
    int first; /* 0 or 1: the root T0 or T1; -1: none */
};

/* A, B, C and the discriminant without rounding, so that their signs are those of the inputs. */
void solve_exactly(mpfr_t *real, const struct sphere *sphere, const struct ray *ray);

/* Solves for a ray that names no surface as the one that it starts on (struct ray). */
void solve_sphere(struct sphere_truth *truth, const struct sphere *sphere, const struct ray *ray);

/* compare_both() with a truth that was solved. */
void compare_to_truth(const struct stage *stage, const struct ray *ray, struct sphere_truth *truth,
                      double (*error)(double, mpfr_t), struct tally *tally, uint64_t sample);

struct stage sphere_stage(const struct sphere *sphere);

/* A random sphere of ordinary size and position. */
struct sphere any_sphere(struct random *random);

/* A row of the catalogue: random spheres, and rays that are aimed at them. */
struct sphere_row {
    struct sphere (*draw)(struct random *random);
    struct ray (*aim)(struct random *random, const struct sphere *sphere);
    double (*error)(double value, mpfr_t truth);
};

/* Traces the row's rays with the kernel and compares them with the oracle. row: a struct sphere_row. */
void sphere_block(struct block *block, const void *row);

#endif
