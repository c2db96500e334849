#include "master/duplicates.h"

#include <stdlib.h>
#include <string.h>

#include "common/hash.h"
#include "common/message.h"
#include "common/scene_check.h"

struct kind {
    enum primitive_kind kind;
    size_t size, material_offset;
    const struct vec3 *vertices;
    const uint64_t *vertex_hashes;
    const struct material *materials;
};

/* The corners of a triangle or patch; NULL for what has none. */
static const uint32_t *corners_of(const struct kind *kind, const void *item)
{
    if (kind->kind == PRIMITIVE_TRIANGLE) return ((const struct triangle *)item)->vertex;
    if (kind->kind == PRIMITIVE_PATCH) return ((const struct patch *)item)->vertex;
    return NULL;
}

static bool is_opaque(const struct kind *kind, const unsigned char *item)
{
    uint32_t material;
    memcpy(&material, item + kind->material_offset, sizeof material);
    return !(kind->materials[material].transmission > 0);
}

/* ---- places ---- */

/* The same for all primitives of a kind in one place. */
static uint64_t hash_of(const struct kind *kind, const unsigned char *item)
{
    const uint32_t *corner = corners_of(kind, item);
    const uint64_t *hashes = kind->vertex_hashes;
    if (corner) return hashes[corner[0]] + hashes[corner[1]] + hashes[corner[2]];
    size_t behind = kind->material_offset + sizeof(uint32_t);
    uint64_t hash = hash64(item, kind->material_offset, 0);
    return hash64(item + behind, kind->size - behind, hash);
}

/* Each corner of the one is one of the other, which has not more of them. */
static bool has_same_corners(const struct kind *kind, const uint32_t *a, const uint32_t *b)
{
    bool met[3] = {false, false, false};
    for (int i = 0; i < 3; i++) {
        int k = 0;
        while (k < 3 && (met[k] || !vec_is_same(kind->vertices[a[i]], kind->vertices[b[k]])))
            k++;
        if (k == 3) return false;
        met[k] = true;
    }
    return true;
}

static bool are_in_one_place(const struct kind *kind, const unsigned char *a,
                             const unsigned char *b)
{
    const uint32_t *corners = corners_of(kind, a);
    if (corners) return has_same_corners(kind, corners, corners_of(kind, b));
    size_t behind = kind->material_offset + sizeof(uint32_t);
    return memcmp(a, b, kind->material_offset) == 0 &&
           memcmp(a + behind, b + behind, kind->size - behind) == 0;
}

/* ---- which of them are taken ---- */

/* Hardly a primitive is looked at that has another hash. */
struct slot {
    uint32_t tag;   /* bits of the hash */
    uint32_t taken; /* by the item in front of this one; 0: by none */
};

struct table {
    struct slot *slots; /* [mask + 1], at most half of them taken */
    uint64_t mask;
};

static struct table table_for(uint64_t count)
{
    uint64_t slots = 2;
    while (slots < 2 * count)
        slots *= 2;
    return (struct table){allocate_there(slots, sizeof(struct slot)), slots - 1};
}

/* Item number `index` takes its place; false: an earlier one of all has it. */
static bool take_place(const struct table *table, const struct kind *kind, const unsigned char *all,
                       const unsigned char *item, uint32_t index)
{
    uint64_t hash = hash_of(kind, item), at = hash & table->mask;
    uint32_t tag = (uint32_t)(hash >> 32);
    for (; table->slots[at].taken > 0; at = (at + 1) & table->mask) {
        size_t earlier = table->slots[at].taken - 1;
        if (table->slots[at].tag == tag && are_in_one_place(kind, item, all + earlier * kind->size))
            return false;
    }
    table->slots[at] = (struct slot){tag, index + 1};
    return true;
}

static uint64_t *hash_vertices(const struct vec3 *vertices, uint64_t count)
{
    uint64_t *hashes = allocate(count, sizeof *hashes);
    for (uint64_t i = 0; i < count; i++)
        hashes[i] = hash64(&vertices[i], sizeof vertices[i], 0);
    return hashes;
}

uint64_t drop_duplicates(enum primitive_kind kind, void *items, uint64_t count,
                         const struct vec3 *vertices, uint64_t vertex_count,
                         const struct material *materials)
{
    if (count < 2) return count;
    bool has_corners = kind == PRIMITIVE_TRIANGLE || kind == PRIMITIVE_PATCH;
    uint64_t *hashes = has_corners ? hash_vertices(vertices, vertex_count) : NULL;
    struct kind own = {
        kind, primitive_size(kind), primitive_material_offset(kind), vertices, hashes, materials};
    struct table table = table_for(count);
    unsigned char *all = items;
    uint32_t kept = 0;
    for (uint64_t i = 0; i < count; i++) {
        unsigned char *item = all + i * own.size;
        if (is_opaque(&own, item) && !take_place(&table, &own, all, item, kept)) continue;
        if (kept < i) memcpy(all + kept * own.size, item, own.size);
        kept++;
    }
    free(table.slots);
    free(hashes);
    return kept;
}
