/*
 * A lattice of small blocks of a picture: pixels enough to tell its error, of so few that each can get
 * very many samples.
 */
#ifndef FARM_BENCH_ERROR_LATTICE_H
#define FARM_BENCH_ERROR_LATTICE_H

#include "common/tile.h"
#include "master/canvas.h"
#include "worker/bvh.h"

/* Pixels of a block, which are rendered together: neighbours, as in a picture. */
#define LATTICE_BLOCK_W 4u
#define LATTICE_BLOCK_H 2u
#define LATTICE_PIXELS  (LATTICE_BLOCK_W * LATTICE_BLOCK_H)

struct lattice {
    struct tile *blocks; /* owned */
    uint32_t count;
};

/* Blocks of the view's region, equally far from each other along both axes, of about so many pixels (at
 * least 1) together. Freed by lattice_free(). */
struct lattice lattice_create(const struct view *view, uint32_t pixels);
void lattice_free(struct lattice *lattice);

/* The scene's tree, in one block of memory that the caller frees. */
struct bvh *lattice_tree(const struct scene *scene);

/*
 * Makes the view the same part of a picture that is wider by its region on either side: the same
 * pixels of other random numbers, different ones each time.
 */
void lattice_renumber(struct view *view);

/* What a picture is wrong by. */
struct lattice_error {
    double rmse;      /* at the lattice's pixels; linear, not clamped */
    double deviation; /* of that, standard: another lattice would give another figure */
    double reference; /* RMSE of what it is compared with, as its halves tell it */
};

/*
 * Compares pictures of the view's region with so many samples (even) of each of about so many pixels of it,
 * none of which a picture of this view has. The scene's view is changed.
 */
void lattice_compare(struct scene *scene, uint32_t pixels, uint32_t samples,
                     const struct canvas *pictures, uint32_t count, struct lattice_error *errors);

#endif
