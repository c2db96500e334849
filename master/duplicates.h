/* Primitives that stand exactly where an earlier one does: never seen, or where light passes, crossed in vain. */
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

/* What lets light through and lies in the very place of an earlier one that does. */
struct doubles {
    uint64_t count;
    uint32_t first, earlier; /* the first of them, and the one whose place it is */
};

/*
 * Light is split by each of them, so that they are met and not dropped. A face that looks the other way is none of
 * them: it may be the border of another medium that touches the first one's. Parameters and memory as above.
 */
struct doubles find_doubles(enum primitive_kind kind, const void *items, uint64_t count,
                            const struct vec3 *vertices, uint64_t vertex_count,
                            const struct material *materials);

#endif
