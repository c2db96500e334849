/*
 * A bound on what max_depth and cutoff leave out of one sample: what the rays that are not traced for the
 * picture could have added.
 *
 * Where surfaces lose little light, the bound of each ray alone (worker/radiance.h) says little. So the most
 * important of these rays are traced all the same, without shadows and not for the picture. What they find is
 * added up, until what remains hardly matters.
 */
#ifndef FARM_WORKER_OMISSION_H
#define FARM_WORKER_OMISSION_H

#include "worker/radiance.h"
#include "worker/shade.h"
#include "worker/tree.h"

struct omission {
    /* Rays not traced: those below max_depth and, in the end, all that are left. */
    struct tree pending;
    struct vec3 found; /* upper bound on what the traced ones have found, except for rounding */
    uint32_t terms;    /* terms of the sum `found` */
    uint32_t rays;     /* rays traced for it */
    /* Sum of the bounds of the least important rays, which are no longer kept. */
    double folded;
};

/*
 * The most pending rays, not counting those taken over from a tree. Where no light is lost there are more of
 * them below max_depth than fit into memory: 2^max_depth. If there are too many, the OMISSION_KEPT most
 * important ones are kept, of which omission_next() examines far fewer, and of the others only the sum of
 * their bounds.
 */
#define OMISSION_MAX  1024
#define OMISSION_KEPT 256

/* Empties it for the next sample and keeps its memory; the owner frees it. */
void omission_clear(struct omission *omission);
void omission_free(struct omission *omission);

/* Keeps the OMISSION_KEPT most important of OMISSION_MAX rays or more. */
void omission_fold(struct omission *omission, const struct radiance *radiance);

/*
 * Adds a ray that is not traced for the picture. The caller fills it in as after tree_add(). Its bound is one
 * for a picture of any depth.
 */
static inline struct branch *omission_add(struct omission *omission,
                                          const struct radiance *radiance, double bound,
                                          uint32_t depth)
{
    if (omission->pending.count >= OMISSION_MAX) omission_fold(omission, radiance);
    return tree_add(&omission->pending, bound, depth);
}

/* Takes over all rays left in the tree of the picture; their bounds become those of a picture of any depth. */
void omission_take(struct omission *omission, const struct radiance *radiance, struct tree *tree);

/* Takes the next ray to trace. false: what remains hardly matters, or enough rays have been traced. */
bool omission_next(struct omission *omission, const struct radiance *radiance,
                   struct branch *branch);

/* Adds the colour that a ray of this weight has found. */
void omission_found(struct omission *omission, struct vec3 weight, struct vec3 color);

/* Adds what a ray of this weight has found at a point: its ambient, and all lights that face it, without
 * shadows. */
void omission_found_point(struct omission *omission, const struct radiance *radiance,
                          struct vec3 weight, const struct shading_point *at);

/* Upper bound on the error of any component of the sample, rounded up; may be infinite. */
double omission_bound(const struct omission *omission);

#endif
