/*
 * Which triangles, and which rods (worker/bvh_rods.h), are cut into pieces before their tree is built.
 *
 * A long thin triangle that runs across the axes leaves most of its box empty. Where there are many, the facets of a
 * pipe or a fan, they all have nearly the same box, and a ray that comes near is tested with each. The boxes of n
 * pieces have an nth of the area. Spatial splits cut them, too, but are as few as other meshes need. (M. Ernst and G.
 * Greiner, "Early Split Clipping for Bounding Volume Hierarchies", IEEE RT 2007.)
 */
#ifndef FARM_WORKER_BVH_SLIVERS_H
#define FARM_WORKER_BVH_SLIVERS_H

#include <stdint.h>

#include "common/crew.h"
#include "common/scene.h"
#include "worker/bvh_trees.h"

/* Pieces are halves of halves: up to 32. With 16 seven scenes take 2 % longer, with 64 the same. */
#define HALVINGS_MAX 5

struct bvh_slivers {
    uint8_t *halvings; /* of each bounded primitive, see bounded_id(); owned; NULL: none is cut */
};

/* Pieces that are added to a scene's primitives, at most, and how many of these may be of rods. */
uint64_t sliver_pieces_bound(const struct scene *scene);
uint64_t rod_pieces_bound(const struct scene *scene);

/* The same for any crew, which may be NULL. */
void bvh_slivers_find(const struct scene *scene, struct crew *crew, const struct bvh_trees *trees,
                      struct bvh_slivers *slivers);
void bvh_slivers_free(struct bvh_slivers *slivers);

#endif
