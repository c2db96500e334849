#include "worker/bvh.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "worker/bvh_split.h"
#include "worker/primitive.h"

/* Of a step to a node, with tests of its eight boxes; see LEAF_COST. */
#define STEP_COST 1.0

/*
 * A spatial split, which takes longer to find, is tried where the two sides of the best other one
 * have a large part of the range's area in common, and one of the root's that rays will notice. At
 * most one piece is added for so many triangles.
 */
#define OVERLAP         0.1
#define OVERLAP_OF_ROOT 1e-3
#define PIECES_SHARE    4

/* A leaf of more weight is always split, whatever the heuristic says. */
#define LEAF_WEIGHT_MAX (2 * PACK)
_Static_assert(LEAF_WEIGHT_MAX >= BVH_WIDTH, "node_bound()");

#define ALIGNMENT 64

/* Behind the last leaf: who loads a row of places loads eight of them. */
#define ROW_END (BVH_WIDTH * sizeof(uint16_t))

struct build {
    struct whole whole;
    struct bvh_node *nodes;
    uint32_t node_count;
    double area; /* of the root */
};

static size_t align_up(size_t bytes)
{
    return (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

/* ---- memory ---- */

static uint64_t bounded_count(const struct scene *scene)
{
    return scene_primitive_count(scene) - scene->primitives[PRIMITIVE_PLANE].count;
}

/* Pieces that spatial splits may add. */
static uint64_t room_for_pieces(const struct scene *scene)
{
    return (scene->primitives[PRIMITIVE_TRIANGLE].count +
            scene->primitives[PRIMITIVE_PATCH].count) /
           PIECES_SHARE;
}

static uint64_t leaf_bound(const struct scene *scene)
{
    return bounded_count(scene) + room_for_pieces(scene);
}

/* Of the test of one primitive; PACK triangles are one test. */
static uint32_t weight_of(enum primitive_kind kind)
{
    return kind <= PRIMITIVE_PATCH ? 1 : PACK;
}

/*
 * A node either has eight children, or all of them are leaves and it holds more than
 * LEAF_WEIGHT_MAX in weight. With n nodes of the one sort and m of the other, n has 8 n = n + m - 1
 * + leaves, and the weight is at least leaves + 9 m, as LEAF_WEIGHT_MAX is no less than 8: n + m is
 * largest for m = 0, a seventh of it.
 */
static uint64_t node_bound(const struct scene *scene)
{
    uint64_t weight = room_for_pieces(scene);
    for (enum primitive_kind kind = 0; kind < PRIMITIVE_PLANE; kind++)
        weight += scene->primitives[kind].count * weight_of(kind);
    return weight == 0 ? 0 : weight / (BVH_WIDTH - 1) + 1;
}

/* As if each primitive had a leaf to itself. */
static size_t leaf_bytes_bound(const struct scene *scene)
{
    uint64_t triangles = scene->primitives[PRIMITIVE_TRIANGLE].count +
                         scene->primitives[PRIMITIVE_PATCH].count + room_for_pieces(scene);
    return (size_t)(leaf_bound(scene) + triangles * corner_entries(1)) * sizeof(struct bvh_leaf);
}

size_t bvh_bytes_bound(const struct scene *scene)
{
    return align_up(sizeof(struct bvh)) + (size_t)node_bound(scene) * sizeof(struct bvh_node) +
           align_up(leaf_bytes_bound(scene) + ROW_END);
}

/* ---- primitives ---- */

/* The bounds of everything, in double. */
static struct bounds scene_bounds(const struct scene *scene)
{
    struct bounds all = {{INFINITE, INFINITE, INFINITE}, {-INFINITE, -INFINITE, -INFINITE}};
    for (enum primitive_kind kind = 0; kind < PRIMITIVE_PLANE; kind++) {
        for (uint32_t index = 0; index < scene->primitives[kind].count; index++) {
            struct bounds bounds = primitive_bounds(scene, primitive_id(kind, index));
            for (unsigned axis = 0; axis < 3; axis++) {
                all.min[axis] = smaller(all.min[axis], bounds.min[axis]);
                all.max[axis] = larger(all.max[axis], bounds.max[axis]);
            }
        }
    }
    return all;
}

/* The middle, on axes where that is further from the origin than the scene is wide. */
static void place_center(const struct scene *scene, double center[3])
{
    struct bounds all = scene_bounds(scene);
    for (unsigned axis = 0; axis < 3; axis++) {
        double middle = all.min[axis] / 2 + all.max[axis] / 2;
        bool far = isfinite(middle) && fabs(middle) > all.max[axis] - all.min[axis];
        center[axis] = far ? middle : 0;
    }
}

static struct range collect_items(const struct scene *scene, const double center[3],
                                  struct item *items)
{
    struct range range = range_empty(0);
    for (enum primitive_kind kind = 0; kind < PRIMITIVE_PLANE; kind++) {
        for (uint32_t index = 0; index < scene->primitives[kind].count; index++) {
            struct item *item = &items[range.count];
            item->id = primitive_id(kind, index);
            item->weight = weight_of(kind);
            struct bounds bounds = primitive_bounds(scene, item->id);
            for (unsigned axis = 0; axis < 3; axis++) {
                item->min[axis] = round_down(bounds.min[axis] - center[axis]);
                item->max[axis] = round_up(bounds.max[axis] - center[axis]);
            }
            range_add(&range, item);
        }
    }
    return range;
}

/* ---- nodes ---- */

/* A child of the node that is being built. */
struct child {
    struct range range;
    struct split split; /* of one that may be a leaf */
    double gain;        /* in cost, when it is divided; not positive: it is not to be */
};

static bool may_be_leaf(const struct range *range)
{
    return range->weight <= LEAF_WEIGHT_MAX;
}

static struct split find_split(const struct build *build, const struct range *range)
{
    struct split split = find_object_split(&build->whole, range);
    double least = larger(OVERLAP_OF_ROOT * build->area, OVERLAP * extent_area(&range->extent));
    if (range->room == 0 || !(split.overlap > least)) return split;
    return find_spatial_split(&build->whole, range, &split);
}

/* Dividing a child that has a node of its own saves the step to that; dividing a leaf saves tests,
 * for that there is room in the node. */
static struct child new_child(const struct build *build, const struct range *range)
{
    struct child child = {.range = *range, .gain = 0};
    double area = extent_area(&range->extent);
    if (!may_be_leaf(range)) {
        child.gain = STEP_COST * area;
    } else if (range->count > 1) {
        child.split = find_split(build, range);
        child.gain = cost_of(range->weight) * area - child.split.cost;
    }
    return child;
}

/* Levels of nodes that come to leaves by halving alone, even of the heaviest items. */
static unsigned halving_depth(uint32_t count)
{
    unsigned depth = 1;
    for (; count > LEAF_WEIGHT_MAX / PACK; depth++)
        count = (count - 1) / BVH_WIDTH + 1;
    return depth;
}

/* The child that is most worth dividing, of equal ones that with more items; -1: none is. */
static int choose_child(const struct child children[BVH_WIDTH], unsigned count, bool halving)
{
    int best = -1;
    double most = -1;
    uint32_t items = 0;
    for (unsigned i = 0; i < count; i++) {
        const struct child *child = &children[i];
        if (may_be_leaf(&child->range) && (halving || !(child->gain > 0))) continue;
        double worth = halving ? 0 : child->gain;
        if (worth < most || (worth == most && child->range.count <= items)) continue;
        most = worth;
        items = child->range.count;
        best = (int)i;
    }
    return best;
}

/* Divides range until there are BVH_WIDTH children, or leaves that are best left alone. */
static unsigned find_children(struct build *build, const struct range *range, unsigned depth,
                              struct child children[BVH_WIDTH])
{
    bool halving = depth + 1 + halving_depth(range->count) > BVH_MAX_DEPTH;
    unsigned count = 1;
    children[0] = new_child(build, range);
    while (count < BVH_WIDTH) {
        int chosen = choose_child(children, count, halving);
        if (chosen < 0) break;
        struct child *child = &children[chosen];
        struct range left, right;
        if (halving) {
            halve_range(&build->whole, &child->range, &left, &right);
        } else {
            if (!may_be_leaf(&child->range)) child->split = find_split(build, &child->range);
            split_range(&build->whole, &child->range, &child->split, &left, &right);
        }
        *child = new_child(build, &left);
        children[count++] = new_child(build, &right);
    }
    return count;
}

static float open_below(float min)
{
    return min > -FLT_MAX ? min : -INFINITY;
}

static float open_above(float max)
{
    return max < FLT_MAX ? max : INFINITY;
}

static void fill_slot(struct bvh_node *node, unsigned slot, const struct range *range)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        node->min[axis][slot] = open_below(range->extent.min[axis]);
        node->max[axis][slot] = open_above(range->extent.max[axis]);
    }
}

static void empty_slot(struct bvh_node *node, unsigned slot)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        node->min[axis][slot] = INFINITY;
        node->max[axis][slot] = -INFINITY;
    }
    node->child[slot] = node->count[slot] = 0;
}

/* Fills in a node and all below it; depth is that of the node, the root's is 0. */
static void build_node(struct build *build, uint32_t index, const struct range *range,
                       unsigned depth)
{
    struct child children[BVH_WIDTH];
    unsigned count = find_children(build, range, depth, children);
    struct bvh_node *node = &build->nodes[index];
    for (unsigned i = 0; i < BVH_WIDTH; i++)
        empty_slot(node, i);
    for (unsigned i = 0; i < count; i++) {
        const struct range *part = &children[i].range;
        bool leaf = may_be_leaf(part);
        fill_slot(node, i, part);
        node->child[i] = leaf ? part->first : build->node_count++;
        node->count[i] = leaf ? part->count : 0;
    }
    for (unsigned i = 0; i < count; i++)
        if (node->count[i] == 0) build_node(build, node->child[i], &children[i].range, depth + 1);
}

/* ---- leaves ---- */

static void sort_by_id(struct item *items, uint32_t count)
{
    for (uint32_t i = 1; i < count; i++) {
        struct item item = items[i];
        uint32_t place = i;
        for (; place > 0 && items[place - 1].id > item.id; place--)
            items[place] = items[place - 1];
        items[place] = item;
    }
}

/* Writes the entries of one leaf, in which pieces of the same triangle are one; returns how many it
 * has. */
static uint32_t write_leaf(const struct whole *whole, struct item *items, uint32_t count,
                           struct bvh_leaf *leaves)
{
    uint32_t written = 0;
    sort_by_id(items, count);
    for (uint32_t i = 0; i < count; i++)
        if (i == 0 || items[i].id != items[i - 1].id)
            leaves[written++] = bvh_leaf_of(whole->scene, items[i].id);
    return written;
}

/* Writes the leaves in order of their nodes; returns how much room they take, in entries. */
static uint64_t write_leaves(const struct build *build, struct bvh *bvh, struct bvh_leaf *leaves)
{
    uint64_t place = 0;
    for (uint32_t n = 0; n < build->node_count; n++) {
        struct bvh_node *node = &build->nodes[n];
        for (unsigned slot = 0; slot < BVH_WIDTH; slot++) {
            if (node->count[slot] == 0) continue;
            if (place > UINT32_MAX) fatal("the scene has more triangles than a tree can hold");
            struct item *items = build->whole.items + node->child[slot];
            struct bvh_leaf *leaf = leaves + place;
            uint32_t count = write_leaf(&build->whole, items, node->count[slot], leaf);
            node->child[slot] = (uint32_t)place;
            node->count[slot] = count;
            bvh->leaf_count += count;
            place += count + bvh_write_corners(build->whole.scene, bvh->center, leaf, count);
        }
    }
    return place;
}

/* ---- the tree ---- */

static void write_bounds(struct bvh *bvh, const struct extent *extent)
{
    double center = 0;
    for (unsigned axis = 0; axis < 3; axis++) {
        bvh->min[axis] = open_below(extent->min[axis]);
        bvh->max[axis] = open_above(extent->max[axis]);
        double far = larger(fabs((double)bvh->min[axis]), fabs((double)bvh->max[axis]));
        bvh->reach = larger(bvh->reach, far);
        center = larger(center, fabs(bvh->center[axis]));
    }
    bvh->size = bvh->reach + center;
}

struct bvh *bvh_build(const struct scene *scene, void *memory)
{
    struct bvh *bvh = memory;
    memset(memory, 0, align_up(sizeof *bvh));
    bvh->nodes_offset = bvh->leaves_offset = bvh->bytes = align_up(sizeof *bvh);
    bvh->transparent = (scene_features(scene) & FEATURE_REFRACTION) != 0;
    if (bounded_count(scene) == 0) return bvh;

    struct build build = {.whole = {scene, bvh->center, NULL},
                          .nodes = (void *)((char *)memory + bvh->nodes_offset),
                          .node_count = 1};
    build.whole.items = allocate((size_t)leaf_bound(scene), sizeof *build.whole.items);
    place_center(scene, bvh->center);
    struct range all = collect_items(scene, bvh->center, build.whole.items);
    all.room = (uint32_t)room_for_pieces(scene);
    build.area = extent_area(&all.extent);
    write_bounds(bvh, &all.extent);
    build_node(&build, 0, &all, 0);
    bvh->node_count = build.node_count;
    bvh->leaves_offset += build.node_count * sizeof(struct bvh_node);
    struct bvh_leaf *leaves = (void *)((char *)memory + bvh->leaves_offset);
    bvh->has_corners = 1;
    size_t leaf_bytes = (size_t)write_leaves(&build, bvh, leaves) * sizeof *leaves;
    bvh->bytes = bvh->leaves_offset + align_up(leaf_bytes + ROW_END);
    /* The same scene gives the same bytes, gaps too. */
    memset((char *)leaves + leaf_bytes, 0, bvh->bytes - bvh->leaves_offset - leaf_bytes);
    free(build.whole.items);
    return bvh;
}
