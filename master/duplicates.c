#include "master/duplicates.h"

#include <stdlib.h>
#include <string.h>

#include "common/hash.h"
#include "common/message.h"
#include "common/scene_check.h"

struct kind {
    const struct primitives *all;
    size_t size, material_offset;
    const uint64_t *vertex_hashes;
    bool one_way; /* faces that look the other way do not coincide */
};

static const unsigned char *item_at(const struct kind *kind, uint64_t index)
{
    return (const unsigned char *)kind->all->items + index * kind->size;
}

/* The corners of a triangle or patch; NULL for other kinds. */
static const uint32_t *corners_of(const struct kind *kind, const void *item)
{
    if (kind->all->kind == PRIMITIVE_TRIANGLE) return ((const struct triangle *)item)->vertex;
    if (kind->all->kind == PRIMITIVE_PATCH) return ((const struct patch *)item)->vertex;
    return NULL;
}

static bool is_opaque(const struct kind *kind, const unsigned char *item)
{
    uint32_t material;
    memcpy(&material, item + kind->material_offset, sizeof material);
    return !(kind->all->materials[material].transmission > 0);
}

/* ---- places ---- */

/* Equal for all primitives of a kind that coincide. */
static uint64_t hash_of(const struct kind *kind, const unsigned char *item)
{
    const uint32_t *corner = corners_of(kind, item);
    const uint64_t *hashes = kind->vertex_hashes;
    if (corner) return hashes[corner[0]] + hashes[corner[1]] + hashes[corner[2]];
    size_t behind = kind->material_offset + sizeof(uint32_t);
    uint64_t hash = hash64(item, kind->material_offset, 0);
    return hash64(item + behind, kind->size - behind, hash);
}

/* Whether both have the same corners, in any order. */
static bool has_same_corners(const struct kind *kind, const uint32_t *a, const uint32_t *b)
{
    bool met[3] = {false, false, false};
    for (int i = 0; i < 3; i++) {
        int k = 0;
        while (k < 3 &&
               (met[k] || !vec_is_same(kind->all->vertices[a[i]], kind->all->vertices[b[k]])))
            k++;
        if (k == 3) return false;
        met[k] = true;
    }
    return true;
}

/* Whether both have the same corners in the same cyclic order. */
static bool looks_the_same_way(const struct kind *kind, const uint32_t *a, const uint32_t *b)
{
    for (int turn = 0; turn < 3; turn++) {
        int i = 0;
        while (i < 3 &&
               vec_is_same(kind->all->vertices[a[i]], kind->all->vertices[b[(i + turn) % 3]]))
            i++;
        if (i == 3) return true;
    }
    return false;
}

static bool are_in_one_place(const struct kind *kind, const unsigned char *a,
                             const unsigned char *b)
{
    const uint32_t *corners = corners_of(kind, a);
    if (corners && kind->one_way) return looks_the_same_way(kind, corners, corners_of(kind, b));
    if (corners) return has_same_corners(kind, corners, corners_of(kind, b));
    size_t behind = kind->material_offset + sizeof(uint32_t);
    return memcmp(a, b, kind->material_offset) == 0 &&
           memcmp(a + behind, b + behind, kind->size - behind) == 0;
}

/* ---- which of them are taken ---- */

/* A slot of a hash table of places. Owing to the tag, hardly any primitive with another hash is compared. */
struct slot {
    uint32_t tag;   /* bits of the hash */
    uint32_t taken; /* 1 + number of the item that has the place; 0: free */
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
    return (struct table){allocate_prefaulted(slots, sizeof(struct slot)), slots - 1};
}

/* Items that are hashed ahead, so that their slots, which are all over the memory, are in the cache when their turn
 * comes. Twice as many make no difference. */
#define AHEAD 8

static void expect_place(const struct table *table, const struct kind *kind, uint64_t index)
{
    if (index >= kind->all->count) return;
    uint64_t hash = hash_of(kind, item_at(kind, index));
    __builtin_prefetch(&table->slots[hash & table->mask], 1);
}

/* Enters an item as number `index`, unless one that was entered before coincides with it. Returns the number of the
 * item that has the place. */
static uint32_t take_place(const struct table *table, const struct kind *kind,
                           const unsigned char *item, uint32_t index)
{
    uint64_t hash = hash_of(kind, item), at = hash & table->mask;
    uint32_t tag = (uint32_t)(hash >> 32);
    for (; table->slots[at].taken > 0; at = (at + 1) & table->mask) {
        uint32_t earlier = table->slots[at].taken - 1;
        if (table->slots[at].tag == tag && are_in_one_place(kind, item, item_at(kind, earlier)))
            return earlier;
    }
    table->slots[at] = (struct slot){tag, index + 1};
    return index;
}

/* Owned by the caller; NULL for a kind without vertices. */
static uint64_t *hash_vertices(const struct primitives *primitives)
{
    if (!kind_is_triangle(primitives->kind)) return NULL;
    const struct vec3 *vertices = primitives->vertices;
    uint64_t *hashes = allocate(primitives->vertex_count, sizeof *hashes);
    for (uint64_t i = 0; i < primitives->vertex_count; i++)
        hashes[i] = hash64(&vertices[i], sizeof vertices[i], 0);
    return hashes;
}

/* The caller sets vertex_hashes before places are compared. */
static struct kind kind_of(const struct primitives *primitives)
{
    return (struct kind){.all = primitives,
                         .size = primitive_size(primitives->kind),
                         .material_offset = primitive_material_offset(primitives->kind)};
}

uint64_t drop_duplicates(const struct primitives *primitives)
{
    if (primitives->count < 2) return primitives->count;
    struct kind kind = kind_of(primitives);
    uint64_t *hashes = hash_vertices(primitives);
    kind.vertex_hashes = hashes;
    struct table table = table_for(primitives->count);
    unsigned char *items = primitives->items;
    uint32_t kept = 0;
    for (uint64_t i = 0; i < primitives->count; i++) {
        const unsigned char *item = item_at(&kind, i);
        expect_place(&table, &kind, i + AHEAD);
        if (is_opaque(&kind, item) && take_place(&table, &kind, item, kept) != kept) continue;
        if (kept < i) memcpy(items + kept * kind.size, item, kind.size);
        kept++;
    }
    free(table.slots);
    free(hashes);
    return kept;
}

void note_duplicates(const struct primitives *primitives, void (*note)(void *context, uint32_t id),
                     void *context)
{
    struct kind kind = kind_of(primitives);
    uint64_t *hashes = hash_vertices(primitives);
    kind.vertex_hashes = hashes;
    struct table table = table_for(primitives->count);
    for (uint32_t i = 0; i < primitives->count; i++) {
        const unsigned char *item = item_at(&kind, i);
        if (is_opaque(&kind, item) && take_place(&table, &kind, item, i) != i)
            note(context, primitive_id(primitives->kind, i));
    }
    free(table.slots);
    free(hashes);
}

struct coincidences find_coincidences(const struct primitives *primitives)
{
    struct coincidences found = {0};
    struct kind kind = kind_of(primitives);
    kind.one_way = true;
    uint64_t clear = 0;
    for (uint64_t i = 0; i < primitives->count; i++)
        clear += !is_opaque(&kind, item_at(&kind, i));
    if (clear < 2) return found;
    uint64_t *hashes = hash_vertices(primitives);
    kind.vertex_hashes = hashes;
    struct table table = table_for(clear);
    for (uint32_t i = 0; i < primitives->count; i++) {
        const unsigned char *item = item_at(&kind, i);
        uint32_t holder = is_opaque(&kind, item) ? i : take_place(&table, &kind, item, i);
        if (holder != i && found.count++ == 0) {
            found.earlier = holder;
            found.first = i;
        }
    }
    free(table.slots);
    free(hashes);
    return found;
}
