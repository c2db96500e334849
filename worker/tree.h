/*
 * The pending rays of one sample's Whitted tree: a priority queue from which the most important ray is taken
 * next, and which knows how much all of them together can still add to the colour.
 */
#ifndef FARM_WORKER_TREE_H
#define FARM_WORKER_TREE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/protocol.h"
#include "worker/ray.h"

struct branch {
    struct ray ray;
    struct vec3 weight; /* share of the ray's light that reaches the eye, per component */
    double bound;       /* largest component that it can add to the sample: >= 0, may be infinite */
    uint32_t depth;     /* number of reflections and refractions before it */
    uint32_t media;     /* its stack of media: worker/medium.h */
    enum ray_kind kind;
    /* The bound is from radiance_roughly(); radiance_of() may lower it: worker/radiance.h. */
    bool rough;
};

/* What determines the order of branches besides their bounds. */
struct tree_key {
    uint32_t depth, order; /* order: of insertion, for equal bounds */
};

/*
 * Summary of TREE_BLOCK consecutive branches: the sum of their bounds, and which of them comes first. With it
 * the next branch is found without examining all of them.
 */
#define TREE_BLOCK 16

struct tree_block {
    double sum;
    uint32_t first;
    bool known; /* sum and first are up to date */
};

struct tree {
    struct branch *pending;    /* [capacity]; owned, as are the following arrays */
    double *bounds;            /* [capacity]: bounds of the branches; 0 after the last one */
    struct tree_key *keys;     /* [capacity] */
    struct tree_block *blocks; /* [capacity / TREE_BLOCK] */
    uint32_t count, capacity;  /* the capacity is a multiple of TREE_BLOCK */
    uint32_t added;            /* number of branches added so far; the next key's order */
    bool deepest_first;        /* the order that the known blocks were computed for */
};

/*
 * Above this many pending rays the deepest one is taken first, not the most important one. The set then grows
 * by at most one per level, so that memory stays bounded for any scene and any cutoff. A tree with reflection
 * + transmission <= 1 holds far fewer.
 */
#define TREE_BEST_FIRST_MAX 256

/* Empties the tree for the next sample and keeps its memory. */
static inline void tree_clear(struct tree *tree)
{
    for (uint32_t i = 0; i < tree->count; i++)
        tree->bounds[i] = 0;
    tree->count = tree->added = 0;
}

void tree_free(struct tree *tree);

/* Adds a branch. The caller fills it in, except for its bound and depth. */
struct branch *tree_add(struct tree *tree, double bound, uint32_t depth);

/* Moves all branches of another tree into this one. */
void tree_take(struct tree *tree, struct tree *from);

/*
 * The next ray, valid until the tree is changed. NULL if there is none, or if all pending rays together can
 * change the sample by at most `cutoff`. Their sum is rounded up.
 */
struct branch *tree_next(struct tree *tree, double cutoff);

/* Gives a pending ray another bound, which is then no longer rough. */
void tree_rate(struct tree *tree, struct branch *pending, double bound);

/* Removes the ray that tree_next() returned, and copies it to *branch. */
void tree_remove(struct tree *tree, const struct branch *pending, struct branch *branch);

/* Upper bound on what all pending rays can add together. */
double tree_sum(const struct tree *tree);

#endif
