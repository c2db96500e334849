/*
 * Which media a ray is in: a stack from the outermost to the one it entered last, whose index of
 * refraction is the one that counts.
 *
 * A ray that enters an object puts its medium on top; one that leaves it takes it out, wherever it
 * stands. So nested objects refract from glass to water and back, and where objects overlap the one
 * entered last wins. A sphere, box or capped cone is its own object; the surfaces of meshes,
 * planes, discs and open cones carry no object's name, and a medium that was entered through one of
 * them is left through any other with the same index of refraction: through another part of a
 * closed mesh, through another stretch of a sheet of water. A plane is a half-space, a sheet of
 * water the lid of a pond; who passes below the front of one and never comes back stays in it.
 *
 * Leaving what was not entered (an open surface met from behind, an eye within something that is
 * not closed) is taken for leaving that object's medium for the one on top, and is counted.
 *
 * Stacks are numbers here: equal stacks have equal numbers, and a branch of the ray tree carries
 * four bytes, however deep it is. There is no limit to the depth.
 */
#ifndef FARM_WORKER_MEDIUM_H
#define FARM_WORKER_MEDIUM_H

#include <stdbool.h>

#include "worker/nearest.h"

/* All stacks that were met so far; one of a thread. */
struct media;

/* In none: the world outside, of index 1. */
#define MEDIUM_OUTSIDE 0u

struct media *media_create(const struct scene *scene);
void media_destroy(struct media *media);

/* Forgets all stacks but MEDIUM_OUTSIDE: bounds the memory when no ray is under way. */
void media_clear(struct media *media);
uint32_t media_count(const struct media *media);

/* What a ray passes from and to when it crosses the surface of a primitive. */
struct crossing_media {
    double from, to; /* indices of refraction */
    uint32_t stack;  /* behind the surface */
    bool unmatched;  /* it left what it had not entered, or entered a solid that it is in */
};

struct crossing_media media_cross(struct media *media, uint32_t stack, uint32_t primitive,
                                  bool entering);

/* The same from the side alone, as if nothing were around the object: the paper's rule. */
struct crossing_media media_by_side(const struct scene *scene, uint32_t primitive, bool entering);

/*
 * The stack at a point where no ray has come from, such as the eye. It lies within what a ray from
 * it leaves without having entered it; of open surfaces, which are left on one side only, all of
 * four rays in different directions have to say so. Behind a plane is within it. No more than 64
 * objects around the point are found; those farther out come out as unmatched later.
 */
uint32_t media_at(struct media *media, const struct bvh *bvh, struct vec3 point);

#endif
