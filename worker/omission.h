/*
 * What max_depth and cutoff leave out of one sample: the rays that are not traced to be shown, and a
 * bound of what they could have added.
 *
 * Each ray's bound alone (worker/radiance.h) says little where surfaces lose little light. So the
 * most important of them are traced all the same, without shadows and not shown, and what they find
 * is added up, until what is left hardly matters.
 */
#ifndef FARM_WORKER_OMISSION_H
#define FARM_WORKER_OMISSION_H

#include "worker/radiance.h"
#include "worker/shade.h"
#include "worker/tree.h"

struct omission {
    struct tree pending; /* not traced: what lies below max_depth, and in the end all */
    struct vec3 found;   /* what the traced ones have met, at most, but for rounding */
    uint32_t terms;      /* of that sum */
    uint32_t rays;       /* traced for it */
    double folded;       /* what the least important ones can add, which are kept no more */
};

/*
 * So many rays are pending at most, and a tree's. Where no light is lost there are more below
 * max_depth than fit into memory: 2^max_depth. When they are so many, the OMISSION_KEPT most
 * important ones stay, of which omission_next() looks at far fewer, and the sum of the others.
 */
#define OMISSION_MAX  1024
#define OMISSION_KEPT 256

/* Empties it for the next sample, keeping its memory; the owner frees it. */
void omission_clear(struct omission *omission);
void omission_free(struct omission *omission);

/* Keeps the OMISSION_KEPT most important ones of OMISSION_MAX rays or more. */
void omission_fold(struct omission *omission, const struct radiance *radiance);

/* A ray that is not to be shown, to be filled in by the caller as after tree_add(); its bound is one
 * of a picture of any depth. */
static inline struct branch *omission_add(struct omission *omission,
                                          const struct radiance *radiance, double bound,
                                          uint32_t depth)
{
    if (omission->pending.count >= OMISSION_MAX) omission_fold(omission, radiance);
    return tree_add(&omission->pending, bound, depth);
}

/* Takes over all that is left in the tree of what is shown, with all that it could bring. */
void omission_take(struct omission *omission, const struct radiance *radiance, struct tree *tree);

/* The next ray to look at; false: what is left hardly matters, or so many have been looked at. */
bool omission_next(struct omission *omission, const struct radiance *radiance,
                   struct branch *branch);

/* A ray of some weight has met something that shines. */
void omission_found(struct omission *omission, struct vec3 weight, struct vec3 color);

/* The ambient of a point that it has met, and all light that faces it, with no shadow. */
void omission_found_point(struct omission *omission, const struct radiance *radiance,
                          struct vec3 weight, const struct shading_point *at);

/* The most that any component of the sample can be wrong by, rounded up; may be infinite. */
double omission_bound(const struct omission *omission);

#endif
