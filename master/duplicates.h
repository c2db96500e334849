/* Finds primitives that coincide exactly with an earlier one: those are never hit or, where they transmit light, only
 * cost time. */
#ifndef FARM_MASTER_DUPLICATES_H
#define FARM_MASTER_DUPLICATES_H

#include "common/scene.h"

/* All primitives of one kind, and what they refer to. */
struct primitives {
    enum primitive_kind kind;
    void *items;
    uint64_t count;
    const struct vec3 *vertices;
    uint64_t vertex_count;
    const struct material *materials;
};

/*
 * Drops those of the items that coincide bit by bit with an earlier one, where both are opaque: where surfaces
 * coincide, the one with the lowest id is hit, whichever side a ray comes from (worker/order.h). The other items keep
 * their order. Returns how many are left.
 *
 * Faces coincide if they have the same corners in any order: meshes often have one for each side. Normals do not count,
 * as those of the earlier face are shown. Temporarily needs 16 to 32 bytes for each item, and 8 for each vertex.
 */
uint64_t drop_duplicates(const struct primitives *primitives);

/* Calls note(context, id) for each item that drop_duplicates() would drop, in their order. */
void note_duplicates(const struct primitives *primitives, void (*note)(void *context, uint32_t id),
                     void *context);

/* Items that transmit light and coincide with an earlier one that does. */
struct coincidences {
    uint64_t count;
    uint32_t first, earlier; /* index of the first of them, and of the one that it coincides with */
};

/*
 * Finds coincident items that transmit light. They are not dropped, as each of them is hit and splits the light. A face
 * that looks the other way does not count: it may be the border of another medium that touches the first one's.
 * Memory as above.
 */
struct coincidences find_coincidences(const struct primitives *primitives);

#endif
