/*
 * A renderer to be compared with: the same pictures in 448 bits, as plainly as they can be written.
 *
 * Every primitive is looked at for every ray, rays go from the formula's textbook form straight to
 * MPFR, recursion follows the ray tree, and nothing is shared with worker/. One sample in the
 * middle of a pixel, no pruning, FORMULAS_EXACT. For tests: a few thousand pixels take seconds.
 */
#ifndef FARM_TEST_REFERENCE_H
#define FARM_TEST_REFERENCE_H

#include <stdint.h>

#include "common/scene.h"

/* Enough for a picture: differences of the sizes that meet in it, 1e30 and 1e-30, or 1e9 and 1e-12,
 * squared twice, still leave more than 100 bits. */
#define REFERENCE_BITS 448

/* Deeper trees than this are a mistake of the test. */
#define REFERENCE_MAX_DEPTH 40

struct reference;

struct reference_sample {
    double color[3];
    /* All that was decided on the way: which primitives were met, lit and shaded, and where light
     * was totally reflected. */
    uint64_t decisions;
};

/* The scene must outlive it; one per thread. Freed by reference_free(). */
struct reference *reference_create(const struct scene *scene, unsigned bits);
void reference_free(struct reference *reference);

/*
 * The sample in the middle of a pixel of the whole picture. With displacement > 0 every direction,
 * point and normal is displaced at random (seed) by up to so many unit roundoffs of the numbers it
 * is made of, as if it had been rounded: a decision that changes under roundings of the size that
 * the kernel's bounds allow is one whose predicate lies inside its bound.
 */
void reference_render(struct reference *reference, uint32_t x, uint32_t y, double displacement,
                      uint64_t seed, struct reference_sample *sample);

/* The nearest primitive, or PRIMITIVE_NONE, and its part, of a ray that starts on no surface. */
uint32_t reference_nearest(struct reference *reference, struct vec3 origin, struct vec3 direction,
                           uint32_t *part);

/* How many surfaces the open segment from a to b crosses; the same displacements. */
uint64_t reference_crossings(struct reference *reference, struct vec3 a, struct vec3 b,
                             double displacement, uint64_t seed);

#endif
