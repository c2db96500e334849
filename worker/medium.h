/*
 * The media that a ray is in: a stack from the outermost to the one entered last, whose index of refraction
 * applies.
 *
 * A ray that enters an object pushes its medium; one that leaves it removes the medium, wherever it is in the
 * stack. So nested objects refract from glass to water and back, and where objects overlap the one entered
 * last wins. A sphere, box or capped cone is an object of its own. Surfaces of meshes, planes, discs and open
 * cones do not belong to an identified object: a medium entered through one of them is left through any other
 * with the same index of refraction, be it another part of a closed mesh or another piece of a water surface.
 * So a plane bounds a half-space, and an open sheet of water bounds everything below it: a ray that enters through its
 * front stays in the medium until it comes back through such a surface.
 *
 * Leaving a medium that was not entered (an open surface hit from behind, an eye within something that is not
 * closed) is treated as leaving that object's medium for the one on top of the stack, and is counted.
 *
 * Stacks are represented by numbers: equal stacks have equal numbers, so that a branch of the ray tree
 * carries four bytes, however deep its stack is. There is no limit to the depth.
 */
#ifndef FARM_WORKER_MEDIUM_H
#define FARM_WORKER_MEDIUM_H

#include <stdbool.h>

#include "common/scene.h"
#include "worker/exact.h"

/* All stacks that have occurred so far; for one thread. */
struct media;

/* The empty stack: the world outside, of index 1. */
#define MEDIUM_OUTSIDE 0u

/* For rays in this scene, which must outlive it. Freed by media_destroy(). */
struct media *media_create(const struct scene *scene);
void media_destroy(struct media *media);

const struct scene *media_scene(const struct media *media);

/* Forgets all stacks but MEDIUM_OUTSIDE: bounds the memory when no ray is under way. */
void media_clear(struct media *media);

/* Stacks that are remembered, MEDIUM_OUTSIDE included. */
uint32_t media_count(const struct media *media);

/* The indices of refraction on both sides when a ray crosses the surface of a primitive. */
struct crossing_media {
    double from, to; /* indices of refraction */
    uint32_t stack;  /* the stack on the far side of the surface */
    /* It left a medium that it had not entered, or entered a solid that it is in. */
    bool unmatched;
};

/* For a ray in the medium of a stack that enters or leaves the object behind the surface of a primitive. */
struct crossing_media media_cross(struct media *media, uint32_t stack, uint32_t primitive,
                                  bool entering);

/* Whether what is behind the surfaces of two primitives is the same medium: one may be entered, the other one left. */
bool is_same_medium(const struct scene *scene, uint32_t a, uint32_t b);

/* The same from the side alone, as if nothing were around the object, as in the paper. */
struct crossing_media media_by_side(const struct scene *scene, uint32_t primitive, bool entering);

/*
 * Whether a ray at this cosine with the normal of a round solid only touches it. A line that does enters and leaves it
 * at one point, where the cosine is 0 but for rounding: on a solid's surface no more than a few unit roundoffs.
 */
static inline bool is_grazing(double cosine)
{
    return fabs(cosine) <= 16 * UNIT_ROUNDOFF;
}

#endif
