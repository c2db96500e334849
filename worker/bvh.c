#include "worker/bvh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/whole.h"
#include "worker/bvh_bounded.h"
#include "worker/bvh_cut.h"
#include "worker/bvh_leaf.h"
#include "worker/bvh_nodes.h"
#include "worker/bvh_slivers.h"
#include "worker/bvh_trees.h"
#include "worker/cone.h"
#include "worker/inlined.h"
#include "worker/primitive.h"

/* Spatial splits may add one piece for this many triangles. */
#define PIECES_SHARE 4

/* Bytes after the last leaf: a load of a row of places always loads eight. */
#define ROW_END (BVH_WIDTH * sizeof(uint16_t))

/* ---- memory ---- */

/* Upper bound on the pieces added by spatial splits and by the cutting of slivers. */
static uint64_t room_for_pieces(const struct scene *scene)
{
    uint64_t triangles = scene_triangle_count(scene);
    return triangles / PIECES_SHARE + sliver_pieces_bound(scene);
}

static uint64_t leaf_bound(const struct scene *scene)
{
    return bounded_count(scene) + room_for_pieces(scene);
}

/* The weight of one primitive, in units of 1 / PACK: PACK triangles count as one test. */
static uint32_t weight_of(enum primitive_kind kind)
{
    return kind_is_triangle(kind) ? 1 : PACK;
}

static uint64_t weight_bound(const struct scene *scene)
{
    uint64_t weight =
        room_for_pieces(scene) + rod_pieces_bound(scene) * (weight_of(PRIMITIVE_CONE) - 1);
    for (enum primitive_kind kind = 0; kind < PRIMITIVE_PLANE; kind++)
        weight += scene->primitives[kind].count * weight_of(kind);
    return weight;
}

static uint64_t node_bound(const struct scene *scene)
{
    return bvh_nodes_bound(weight_bound(scene));
}

/* The most bytes are needed if each primitive has a leaf of its own. */
static size_t leaf_bytes_bound(const struct scene *scene)
{
    uint64_t triangles = scene_triangle_count(scene) + room_for_pieces(scene);
    return (size_t)(leaf_bound(scene) + triangles * corner_entries(1)) * sizeof(struct bvh_leaf);
}

/* What a tree takes besides its nodes and leaves: a header, one node more as bounds on nodes are rounded down,
 * ROW_END and alignment. */
#define TREE_OVERHEAD (2 * BVH_ALIGNMENT + sizeof(struct bvh_node) + 2 * BVH_ALIGNMENT)
_Static_assert(sizeof(struct bvh) <= 2 * BVH_ALIGNMENT && ROW_END <= BVH_ALIGNMENT,
               "TREE_OVERHEAD");

/* The size of bvh_boxes(). */
#define BOXES_BYTES (2 * BVH_ALIGNMENT + TREES_MAX / BVH_WIDTH * sizeof(struct bvh_node))
_Static_assert(TREES_MAX % BVH_WIDTH == 0, "BOXES_BYTES");

size_t bvh_bytes_bound(const struct scene *scene)
{
    return (size_t)node_bound(scene) * sizeof(struct bvh_node) +
           round_up_to(leaf_bytes_bound(scene), BVH_ALIGNMENT) + TREES_MAX * TREE_OVERHEAD +
           BOXES_BYTES;
}

/* ---- primitives ---- */

/* Up to CHUNK_ITEMS primitives, which one thread processes. */
struct part {
    uint32_t count; /* items of those in the tree */
    uint32_t uncut; /* triangles in the tree that are not cut yet */
    uint32_t first; /* index of its first item */
    struct range range;
};

/* The primitives of one of the trees. */
struct collection {
    const struct bvh_input *input;
    const struct bvh_trees *trees;
    const uint8_t *halvings; /* bvh_slivers_find() */
    uint32_t tree;
    struct part *parts;
};

/* Calls a function for each primitive of a part that is in the tree. */
typedef void visit_member(const struct collection *all, struct part *part, uint64_t index,
                          uint32_t id);

static INLINED void visit_members(const struct collection *all, uint32_t iteration,
                                  visit_member *visit)
{
    const struct scene *scene = all->input->scene;
    uint64_t first = (uint64_t)iteration * CHUNK_ITEMS, end = bounded_count(scene);
    if (end - first > CHUNK_ITEMS) end = first + CHUNK_ITEMS;
    /* Most parts have no primitive in most trees. */
    const uint8_t *tree_of = all->trees->tree_of;
    if (tree_of && !memchr(tree_of + first, (int)all->tree, end - first)) return;
    uint32_t id = bounded_id(scene, first);
    for (uint64_t index = first; index < end; index++) {
        if (index > first) id = bounded_id_after(scene, id);
        if (tree_of_bounded(all->trees, index) == all->tree)
            visit(all, &all->parts[iteration], index, id);
    }
}

static INLINED struct item item_in(const struct bvh_input *input, uint32_t id, struct bounds bounds)
{
    struct item item = {.id = id, .weight = weight_of(primitive_kind(id))};
    for (unsigned axis = 0; axis < 3; axis++) {
        item.min[axis] = round_down(bounds.min[axis] - input->center[axis]);
        item.max[axis] = round_up(bounds.max[axis] - input->center[axis]);
    }
    return item;
}

static INLINED struct item item_of(const struct bvh_input *input, uint32_t id)
{
    return item_in(input, id, primitive_bounds(input->scene, id));
}

static uint32_t cut_rod(const struct bvh_input *input, struct item *item, unsigned halvings)
{
    uint32_t id = item->id, count = UINT32_C(1) << halvings;
    const struct cone *cone = &scene_cones(input->scene)[primitive_index(id)];
    for (uint32_t i = 0; i < count; i++)
        item[i] = item_in(input, id, cone_piece_bounds(cone, i, count));
    return count;
}

/* Replaces an item by its pieces, for which there must be room; returns their number. */
static uint32_t cut(const struct bvh_input *input, struct item *item, unsigned halvings)
{
    return is_triangle(item->id) ? halve_triangle(input, item, halvings)
                                 : cut_rod(input, item, halvings);
}

static INLINED unsigned halvings_of(const struct collection *all, uint64_t index)
{
    return all->halvings ? all->halvings[index] : 0;
}

/* Cuts triangles only to count their pieces: where the next part's items begin must be known before any are stored. */
static INLINED void count_member(const struct collection *all, struct part *part, uint64_t index,
                                 uint32_t id)
{
    unsigned halvings = halvings_of(all, index);
    part->uncut += is_triangle(id) && halvings == 0;
    part->count++;
    if (halvings == 0) return;
    if (!is_triangle(id)) {
        part->count += (UINT32_C(1) << halvings) - 1;
        return;
    }
    struct item pieces[1 << HALVINGS_MAX] = {item_of(all->input, id)};
    part->count += halve_triangle(all->input, pieces, halvings) - 1;
}

static void count_part(void *context, uint32_t iteration)
{
    const struct collection *all = context;
    all->parts[iteration].count = all->parts[iteration].uncut = 0;
    visit_members(all, iteration, count_member);
}

static INLINED void collect_member(const struct collection *all, struct part *part, uint64_t index,
                                   uint32_t id)
{
    unsigned halvings = halvings_of(all, index);
    struct item *item = &all->input->items[part->first + part->range.count];
    uint32_t count = 1;
    *item = item_of(all->input, id);
    if (halvings > 0) count = cut(all->input, item, halvings);
    for (uint32_t i = 0; i < count; i++)
        range_add(&part->range, &item[i]);
}

static void collect_part(void *context, uint32_t iteration)
{
    const struct collection *all = context;
    all->parts[iteration].range = range_empty(all->parts[iteration].first);
    visit_members(all, iteration, collect_member);
}

static struct range collect_items(const struct bvh_input *input, const struct bvh_trees *trees,
                                  const uint8_t *halvings, uint32_t tree)
{
    uint32_t parts = divide_up((uint32_t)bounded_count(input->scene), CHUNK_ITEMS), uncut = 0;
    struct collection all = {input, trees, halvings, tree, allocate(parts, sizeof *all.parts)};
    struct range range = range_empty(0);
    thread_pool_for(input->pool, parts, count_part, &all);
    for (uint32_t i = 0, first = 0; i < parts; i++) {
        all.parts[i].first = first;
        first += all.parts[i].count;
        uncut += all.parts[i].uncut;
    }
    thread_pool_for(input->pool, parts, collect_part, &all);
    for (uint32_t i = 0; i < parts; i++)
        range_append(&range, &all.parts[i].range);
    range.room = uncut / PIECES_SHARE;
    free(all.parts);
    return range;
}

/* ---- the tree ---- */

static void write_bounds(struct bvh *bvh, const struct extent *extent)
{
    double center = 0;
    for (unsigned axis = 0; axis < 3; axis++) {
        bvh->min[axis] = open_below(extent->min[axis]);
        bvh->max[axis] = open_above(extent->max[axis]);
        double far = larger_number(fabs((double)bvh->min[axis]), fabs((double)bvh->max[axis]));
        bvh->reach = larger_number(bvh->reach, far);
        center = larger_number(center, fabs(bvh->center[axis]));
    }
    bvh->size = bvh->reach + center;
}

/* An empty tree: the initial state, and the final one if nothing is bounded. */
static struct bvh *empty_tree(const struct scene *scene, void *memory)
{
    struct bvh *bvh = memory;
    memset(memory, 0, round_up_to(sizeof *bvh, BVH_ALIGNMENT));
    bvh->nodes_offset = bvh->leaves_offset = bvh->bytes = round_up_to(sizeof *bvh, BVH_ALIGNMENT);
    bvh->transparent = (scene_features(scene) & FEATURE_REFRACTION) != 0;
    return bvh;
}

/* Builds a tree; returns the offset from its start at which the next one may begin. */
static size_t build_tree(const struct bvh_input *input, const struct bvh_trees *trees,
                         const uint8_t *halvings, uint32_t tree, struct bvh *bvh)
{
    struct range all = collect_items(input, trees, halvings, tree);
    write_bounds(bvh, &all.extent);
    struct bvh_node *nodes = (void *)((char *)bvh + bvh->nodes_offset);
    uint32_t node_count = bvh_build_nodes(input, &all, nodes);
    bvh->node_count = node_count;
    bvh->leaves_offset += node_count * sizeof *nodes;
    struct bvh_leaf *leaves = (void *)((char *)bvh + bvh->leaves_offset);
    struct leaf_room room = bvh_write_leaves(input, nodes, node_count, leaves);
    size_t leaf_bytes = (size_t)room.room * sizeof *leaves;
    bvh->leaf_count = room.entries;
    size_t end = bvh->leaves_offset + round_up_to(leaf_bytes + ROW_END, BVH_ALIGNMENT);
    /* Gaps, too: the same scene gives the same bytes. */
    memset((char *)leaves + leaf_bytes, 0, end - bvh->leaves_offset - leaf_bytes);
    return end;
}

/* The box of a tree, relative to the centre of `boxes`. */
static struct extent box_of(const struct bvh *boxes, const struct bvh *tree)
{
    struct extent box = empty_extent();
    for (unsigned axis = 0; axis < 3; axis++) {
        double aside = tree->center[axis] - boxes->center[axis];
        box.min[axis] = round_down((double)tree->min[axis] + aside);
        box.max[axis] = round_up((double)tree->max[axis] + aside);
    }
    return box;
}

/* Writes bvh_boxes() after the trees, of which there are several. Returns the offset of its end. */
static size_t write_boxes(const struct scene *scene, struct bvh *first, size_t offset)
{
    struct bvh *boxes = empty_tree(scene, (char *)first + offset);
    struct bvh_node *nodes = (void *)((char *)boxes + boxes->nodes_offset);
    struct extent all = empty_extent();
    first->boxes_offset = offset;
    memcpy(boxes->center, first->center, sizeof boxes->center);
    for (const struct bvh *tree = first; tree; tree = bvh_next(tree)) {
        unsigned slot = boxes->leaf_count++ % BVH_WIDTH;
        if (slot == 0) bvh_empty_node(&nodes[boxes->node_count++]);
        struct bvh_node *node = &nodes[boxes->node_count - 1];
        size_t bytes = (size_t)((const char *)tree - (const char *)first);
        struct extent box = box_of(boxes, tree);
        extend(&all, &box);
        bvh_fill_slot(node, slot, &box);
        node->child[slot] = (uint32_t)(bytes / BVH_ALIGNMENT);
        node->count[slot] = 1;
    }
    write_bounds(boxes, &all);
    return offset + boxes->nodes_offset + boxes->node_count * sizeof *nodes;
}

static void build_trees(struct bvh_input *input, const struct bvh_trees *trees,
                        const uint8_t *halvings, struct bvh *first)
{
    struct bvh *bvh = first;
    size_t bytes = 0;
    for (uint32_t tree = 0; tree < trees->count; tree++) {
        if (tree > 0) bvh = empty_tree(input->scene, (char *)first + bytes);
        memcpy(bvh->center, trees->center[tree], sizeof bvh->center);
        input->center = bvh->center;
        size_t end = build_tree(input, trees, halvings, tree, bvh);
        bytes += end;
        if (tree + 1 < trees->count) bvh->next_offset = end;
    }
    if (trees->count > 1) bytes = write_boxes(input->scene, first, bytes);
    first->bytes = bytes;
}

struct bvh *bvh_build(const struct scene *scene, void *memory, unsigned threads)
{
    struct bvh *bvh = empty_tree(scene, memory);
    if (bounded_count(scene) == 0) return bvh;
    /* the limit of a range: struct range */
    if (weight_bound(scene) > UINT32_MAX) fatal("the scene has too many primitives for a tree");
    if (bounded_count(scene) <= SUBTREE_ITEMS) threads = 1; /* there is nothing to share out */
    struct bvh_trees trees;
    struct bvh_input input = {.scene = scene,
                              .items =
                                  allocate_large((size_t)leaf_bound(scene) * sizeof *input.items),
                              .pool = threads > 1 ? thread_pool_create(threads) : NULL};
    bvh_trees_find(scene, input.pool, &trees);
    uint8_t *halvings = bvh_slivers_find(scene, input.pool, &trees);
    build_trees(&input, &trees, halvings, bvh);
    free(halvings);
    bvh_trees_free(&trees);
    if (input.pool) thread_pool_destroy(input.pool);
    free(input.items);
    return bvh;
}
