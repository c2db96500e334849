/*
 * The pending rays of one sample's Whitted tree: a small set from which the most important ray is
 * taken next, and which knows what all of it together can still add to the colour.
 */
#ifndef FARM_WORKER_TREE_H
#define FARM_WORKER_TREE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/protocol.h"
#include "worker/ray.h"

struct branch {
    struct ray ray;
    struct vec3 weight; /* share of what the ray brings that reaches the eye, per component */
    double bound;   /* largest component that it can add to the sample: >= 0, perhaps infinite */
    uint32_t depth; /* reflections and refractions on the way from the eye */
    uint32_t media; /* the stack that it is in: worker/medium.h */
    enum ray_kind kind;
    bool rough; /* the boxes of the scene may tell a lower bound: worker/radiance.h */
};

/* What the order of the branches follows from besides their bounds. */
struct tree_key {
    uint32_t depth, order; /* equal bounds go by when they came */
};

/*
 * Of TREE_BLOCK branches that lie beside each other: what they can add together, and which of them
 * comes first. So a branch is taken out of many without looking at all of them.
 */
#define TREE_BLOCK 16

struct tree_block {
    double sum;
    uint32_t first;
    bool known; /* nothing has changed since these were found */
};

struct tree {
    struct branch *pending;    /* owned, as all of these; so many as the capacity */
    double *bounds;            /* of the branches, beside each other; 0 behind the last one */
    struct tree_key *keys;     /* one for each branch */
    struct tree_block *blocks; /* one for every TREE_BLOCK of the capacity */
    uint32_t count, capacity;  /* the capacity is a multiple of TREE_BLOCK */
    uint32_t added;            /* so far; the next key's order */
    bool deepest_first;        /* how the known blocks were judged */
};

/*
 * Above this many pending rays the deepest one goes first instead of the most important: the set
 * then grows by one per level at most, so that memory stays bounded for any scene and any cutoff.
 * Far more than a tree holds when reflection + transmission <= 1.
 */
#define TREE_BEST_FIRST_MAX 256

/* Empties the tree for the next sample, keeping its memory. */
static inline void tree_clear(struct tree *tree)
{
    for (uint32_t i = 0; i < tree->count; i++)
        tree->bounds[i] = 0;
    tree->count = tree->added = 0;
}

void tree_free(struct tree *tree);

/* Adds a branch, to be filled in by the caller, all but its bound and depth. */
struct branch *tree_add(struct tree *tree, double bound, uint32_t depth);

/* Moves all branches of another tree to this one. */
void tree_take(struct tree *tree, struct tree *from);

/*
 * The next ray, until the tree is changed; NULL when there is none, or when all pending rays together
 * can change the sample by `cutoff` at most. Their sum is an upper bound: its rounding is on the safe
 * side.
 */
struct branch *tree_next(struct tree *tree, double cutoff);

/* Gives a pending ray another bound, which is told to be no longer rough. */
void tree_rate(struct tree *tree, struct branch *pending, double bound);

/* Takes out the ray that tree_next() has told. */
void tree_remove(struct tree *tree, const struct branch *pending, struct branch *branch);

/* What all pending rays can add together; an upper bound as well. */
double tree_sum(const struct tree *tree);

#endif
