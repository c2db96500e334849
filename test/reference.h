/*
 * A reference renderer: computes the same pictures as worker/ with numbers of 448 bits, in the simplest possible way.
 *
 * Every ray is tested with every primitive, the textbook formulas are evaluated in MPFR, the ray tree is traced by
 * recursion, and no code is shared with worker/. It takes one sample in the middle of a pixel, without pruning, as with
 * FORMULAS_EXACT. It is for tests: a few thousand pixels take seconds.
 */
#ifndef FARM_TEST_REFERENCE_H
#define FARM_TEST_REFERENCE_H

#include <stdint.h>

#include "common/scene.h"

/* Bits of the numbers, which are enough for a picture: if numbers as different as 1e30 and 1e-30, or 1e9 and 1e-12, are
 * squared twice and added, more than 100 bits are left. */
#define REFERENCE_BITS 448

/* Deeper ray trees are an error in the test. */
#define REFERENCE_MAX_DEPTH 40

struct reference;

struct reference_sample {
    double color[3];
    /* A hash of all decisions: which primitives were hit, lit and shaded, and where light was totally reflected. */
    uint64_t decisions;
};

/* The scene must outlive the result, which only one thread may use. Freed by reference_free(). */
struct reference *reference_create(const struct scene *scene, unsigned bits);
void reference_free(struct reference *reference);

/*
 * Computes the sample in the middle of a pixel of the whole picture. If displacement > 0, every direction, point and
 * normal is displaced at random (seed), as if by rounding, by up to this many unit roundoffs of the numbers from which
 * it is computed. If a decision changes under displacements as large as the kernel's error bounds, its predicate lies
 * within its error bound.
 */
void reference_render(struct reference *reference, uint32_t x, uint32_t y, double displacement,
                      uint64_t seed, struct reference_sample *sample);

/* The nearest primitive that the ray hits, or PRIMITIVE_NONE, and its part. The ray starts on no surface. */
uint32_t reference_nearest(struct reference *reference, struct vec3 origin, struct vec3 direction,
                           uint32_t *part);

/* The number of surfaces that the open segment from a to b crosses; displacement as for reference_render(). */
uint64_t reference_crossings(struct reference *reference, struct vec3 a, struct vec3 b,
                             double displacement, uint64_t seed);

#endif
