/* A lattice of small blocks of a picture: enough pixels to estimate its error, but few enough that each can get
 * very many samples. */
#ifndef FARM_BENCH_ERROR_LATTICE_H
#define FARM_BENCH_ERROR_LATTICE_H

#include "common/scene.h"
#include "common/tile.h"
#include "master/canvas.h"

/* Size of a block in pixels, which are rendered together, as neighbours in a picture are. */
#define LATTICE_BLOCK_W 4u
#define LATTICE_BLOCK_H 2u
#define LATTICE_PIXELS  (LATTICE_BLOCK_W * LATTICE_BLOCK_H)

struct lattice {
    struct tile *blocks; /* owned */
    uint32_t count;
};

/* Creates a lattice of blocks of the view's region, equally spaced along both axes, of about so many pixels (at
 * least 1) together. Freed by lattice_free(). */
struct lattice lattice_create(const struct view *view, uint32_t pixels);
void lattice_free(struct lattice *lattice);

/* Makes the view the same part of a picture that is wider by its region on either side: the same pixels with
 * other random numbers, different ones at each call. */
void lattice_renumber(struct view *view);

/* The error of a picture. */
struct lattice_error {
    double rmse;      /* at the lattice's pixels; linear, not clamped */
    double deviation; /* standard deviation of rmse over the choice of the lattice */
    double reference; /* RMSE of the reference, estimated from its halves */
};

/*
 * Compares pictures of the view's region with a reference of so many samples (even) for each of about so many of
 * its pixels. The reference shares no sample with any picture of this view. Changes the scene's view.
 */
void lattice_compare(struct scene *scene, uint32_t pixels, uint32_t samples,
                     const struct canvas *pictures, uint32_t count, struct lattice_error *errors);

#endif
