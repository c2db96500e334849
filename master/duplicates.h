/* Primitives that stand exactly where an earlier one does, and so are never seen. */
#ifndef FARM_MASTER_DUPLICATES_H
#define FARM_MASTER_DUPLICATES_H

#include "common/scene.h"

/*
 * Drops those of the `count` items of one kind that lie in the very place of an earlier one, bit by bit, where both are
 * opaque: of surfaces in one place the one with the lowest id is met, whichever side a ray comes from (worker/order.h).
 * The others keep their order. Returns how many are left.
 *
 * A face lies in the place of another if it has the same corners in any order: meshes often have one for each side.
 * Normals do not count, as those of the earlier one are shown. vertices and materials are what the items refer to.
 * Meanwhile it takes 16 to 32 bytes for each item, and 8 for each vertex.
 */
uint64_t drop_duplicates(enum primitive_kind kind, void *items, uint64_t count,
                         const struct vec3 *vertices, uint64_t vertex_count,
                         const struct material *materials);

#endif
