/*
 * Chooses which triangles (slivers) and rods (worker/bvh_rods.h) are cut into pieces before their tree is built.
 *
 * A long thin triangle that runs diagonally to the axes leaves most of its box empty. Where there are many, as the
 * facets of a pipe or a fan, they all have nearly the same box, and a ray that comes near is tested with each. The
 * boxes of n pieces together have an nth of the area. Spatial splits cut such triangles, too, but are limited to what
 * other meshes need. (M. Ernst and G. Greiner, "Early Split Clipping for Bounding Volume Hierarchies", IEEE RT 2007.)
 */
#ifndef FARM_WORKER_BVH_SLIVERS_H
#define FARM_WORKER_BVH_SLIVERS_H

#include <stdint.h>

#include "common/scene.h"
#include "common/thread_pool.h"
#include "worker/bvh_trees.h"

/* Repeated halving yields up to 32 pieces. With 16 seven scenes take 2 % longer, with 64 the same. */
#define HALVINGS_MAX 5

/* Upper bounds on the number of pieces that are added to the primitives of a scene, and on how many of them are of
 * rods. */
uint64_t sliver_pieces_bound(const struct scene *scene);
uint64_t rod_pieces_bound(const struct scene *scene);

/* How often each bounded primitive (bounded_id()) is to be halved; the caller frees the array. NULL: none is. The
 * result does not depend on the pool, which may be NULL. */
uint8_t *bvh_slivers_find(const struct scene *scene, struct thread_pool *pool,
                          const struct bvh_trees *trees);

#endif
