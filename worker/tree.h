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
    /* The bound is from radiance_coarse_bound(); radiance_bound() may lower it: worker/radiance.h. */
    bool coarse;
};

/* What determines the order of branches besides their bounds. */
struct tree_key {
    uint32_t depth, order; /* order: of insertion, for equal bounds */
};

/*
 * Summary of a block, which is TREE_BLOCK consecutive branches, or of a row, which is TREE_BLOCK consecutive
 * blocks: the sum of the bounds, and which branch comes first. With it the next branch is found without
 * examining all of them.
 */
#define TREE_BLOCK 16
#define TREE_ROW   256

/* Which branch comes first: the most important one, or the deepest one. A tree near TREE_BEST_FIRST_MAX goes
 * back and forth between the two, so summaries keep the first branch of each. */
enum tree_order { BEST_FIRST, DEEPEST_FIRST, TREE_ORDERS };

struct tree_block {
    double sum;
    uint32_t first[TREE_ORDERS];
    uint32_t known; /* bit 1 << order: sum and the first of this order are up to date */
};

struct tree {
    struct branch *pending;    /* [capacity]; owned, as are the following arrays */
    double *bounds;            /* [capacity]: bounds of the branches; 0 after the last one */
    struct tree_key *keys;     /* [capacity] */
    struct tree_block *blocks; /* [capacity / TREE_BLOCK] */
    struct tree_block *rows;   /* [capacity / TREE_ROW, rounded up] */
    uint32_t count, capacity;  /* the capacity is a multiple of TREE_BLOCK */
    uint32_t added;            /* number of branches added so far; the next key's order */
    enum tree_order order;     /* the present one */
};

/*
 * Above this many pending rays the deepest one is taken first, not the most important one. The set then grows
 * by at most one per level, so that memory stays bounded for any scene and any cutoff: with 20 levels by 2048
 * branches, a quarter of a megabyte, and for the trees of a wave by 64 MB. The price is ten times the rays and
 * more, as each ray that matters is followed by a dive to max_depth through rays that do not. So few scenes
 * should reach this limit: one glass box has 2 pending rays, two behind each other have 30 to 110, three 330 to
 * 1,700, and four 1,600.
 */
#define TREE_BEST_FIRST_MAX 2000

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

/* Gives a pending ray another bound, which is then no longer coarse. */
void tree_rate(struct tree *tree, struct branch *pending, double bound);

/* Removes the ray that tree_next() returned, and copies it to *branch. */
void tree_remove(struct tree *tree, const struct branch *pending, struct branch *branch);

/* Upper bound on what all pending rays can add together. */
double tree_sum(const struct tree *tree);

#endif
