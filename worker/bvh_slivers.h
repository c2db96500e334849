/*
 * Chooses which triangles (slivers) and which rods (worker/bvh_rods.h) are cut into pieces before their tree is built.
 *
 * The box of a long thin triangle that runs diagonally to the axes is mostly empty. Where there are many such
 * triangles, as in the facets of a pipe or a fan, they all have nearly the same box, and a ray that comes near is
 * tested with each. The boxes of n pieces together have an nth of the area. Spatial splits would cut such triangles,
 * too, but only as many splits are allowed as other meshes need. (M. Ernst and G. Greiner, "Early Split Clipping for
 * Bounding Volume Hierarchies", IEEE RT 2007.)
 */
#ifndef FARM_WORKER_BVH_SLIVERS_H
#define FARM_WORKER_BVH_SLIVERS_H

#include <stdint.h>

#include "common/crew.h"
#include "common/scene.h"
#include "worker/bvh_trees.h"

/* A primitive is halved repeatedly, into up to 2^HALVINGS_MAX = 32 pieces. With up to 16 pieces seven test scenes
 * take 2 % longer, with up to 64 the same time. */
#define HALVINGS_MAX 5

struct bvh_slivers {
    /* number of halvings of each bounded primitive, indexed as in bounded_id(); owned; NULL: none is cut */
    uint8_t *halvings;
};

/* Upper bounds on the number of pieces that are added to the primitives of a scene, and on how many of them are of
 * rods. */
uint64_t sliver_pieces_bound(const struct scene *scene);
uint64_t rod_pieces_bound(const struct scene *scene);

/* Chooses the halvings of all primitives. The result does not depend on the crew, which may be NULL. *slivers is to
 * be freed with bvh_slivers_free(). */
void bvh_slivers_find(const struct scene *scene, struct crew *crew, const struct bvh_trees *trees,
                      struct bvh_slivers *slivers);
void bvh_slivers_free(struct bvh_slivers *slivers);

#endif
