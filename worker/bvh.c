#include "worker/bvh.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/whole.h"
#include "worker/bvh_leaf.h"
#include "worker/bvh_nodes.h"
#include "worker/primitive.h"

/* At most one piece of a triangle is added for so many. */
#define PIECES_SHARE 4

#define ALIGNMENT 64

/* Behind the last leaf: who loads a row of places loads eight of them. */
#define ROW_END (BVH_WIDTH * sizeof(uint16_t))

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

static uint64_t weight_bound(const struct scene *scene)
{
    uint64_t weight = room_for_pieces(scene);
    for (enum primitive_kind kind = 0; kind < PRIMITIVE_PLANE; kind++)
        weight += scene->primitives[kind].count * weight_of(kind);
    return weight;
}

static uint64_t node_bound(const struct scene *scene)
{
    return bvh_nodes_bound(weight_bound(scene));
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
    return round_up_to(sizeof(struct bvh), ALIGNMENT) +
           (size_t)node_bound(scene) * sizeof(struct bvh_node) +
           round_up_to(leaf_bytes_bound(scene) + ROW_END, ALIGNMENT);
}

/* ---- primitives ---- */

/* Some primitives of one kind, in a row, which one thread looks at. */
struct part {
    enum primitive_kind kind;
    uint32_t begin, end; /* indices */
    uint32_t first;      /* item */
    struct bounds bounds;
    struct range range;
};

struct collection {
    const struct whole *whole;
    struct part *parts;
    uint32_t count;
};

static struct collection parts_of(const struct whole *whole)
{
    struct collection all = {.whole = whole};
    uint32_t first = 0;
    for (enum primitive_kind kind = 0; kind < PRIMITIVE_PLANE; kind++) {
        uint32_t end = (uint32_t)whole->scene->primitives[kind].count;
        for (uint32_t begin = 0, next; begin < end; begin = next) {
            next = end - begin < ROUND_ITEMS ? end : begin + ROUND_ITEMS;
            all.parts = grow(all.parts, all.count, sizeof *all.parts);
            all.parts[all.count++] =
                (struct part){.kind = kind, .begin = begin, .end = next, .first = first};
            first += next - begin;
        }
    }
    return all;
}

static void find_bounds(void *context, uint32_t round)
{
    const struct collection *all = context;
    struct part *part = &all->parts[round];
    part->bounds = BOUNDS_NONE;
    for (uint32_t index = part->begin; index < part->end; index++) {
        struct bounds bounds = primitive_bounds(all->whole->scene, primitive_id(part->kind, index));
        bounds_add(&part->bounds, &bounds);
    }
}

/* So many of the boxes tell where most of them are: what has half of all has 47 to 53 % of these (two standard
 * deviations). */
#define CENTER_BOXES 1024

/* Of all primitives in order of kind and index. */
static uint32_t bounded_id(const struct scene *scene, uint64_t index)
{
    enum primitive_kind kind = 0;
    for (; index >= scene->primitives[kind].count; kind++)
        index -= scene->primitives[kind].count;
    return primitive_id(kind, (uint32_t)index);
}

/* Of the boxes of up to CENTER_BOXES primitives, all or by multiples of the golden ratio, which keep clear of the rows
 * of a mesh; returns how many. */
static uint32_t take_middles(const struct scene *scene, double middles[3][CENTER_BOXES])
{
    uint64_t all = bounded_count(scene);
    uint32_t count = all < CENTER_BOXES ? (uint32_t)all : CENTER_BOXES;
    for (uint32_t i = 0; i < count; i++) {
        double turns = 0.6180339887 * i;
        uint64_t index = count == all ? i : (uint64_t)((turns - floor(turns)) * (double)all);
        struct bounds bounds = primitive_bounds(scene, bounded_id(scene, index));
        for (unsigned axis = 0; axis < 3; axis++)
            middles[axis][i] = bounds.min[axis] / 2 + bounds.max[axis] / 2;
    }
    return count;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Sorts them; the larger one of the two in the middle. */
static double median_of(double *values, uint32_t count)
{
    qsort(values, count, sizeof *values, by_size);
    return values[count / 2];
}

/*
 * On an axis where the median of the boxes' middles is further from the origin than CENTER_FAR times their median
 * distance from it, that median: a mesh on a ball as large as a planet has all but one of its boxes far from the
 * ball's centre, and float has bits for them or for the ball. Less than half of the boxes may be anywhere else.
 * Else the middle of everything where that is further from the origin than everything is wide. Else 0: what is
 * beside the origin keeps its coordinates, of which many are floats.
 */
#define CENTER_FAR 16

/* Overwrites the middles, of which there is one at least. */
static double center_on(const struct bounds *bounds, unsigned axis, double *middles, uint32_t count)
{
    double median = median_of(middles, count);
    for (uint32_t i = 0; i < count; i++)
        middles[i] = fabs(middles[i] - median);
    if (fabs(median) > CENTER_FAR * median_of(middles, count)) return median;
    double middle = bounds->min[axis] / 2 + bounds->max[axis] / 2;
    bool far = isfinite(middle) && fabs(middle) > bounds->max[axis] - bounds->min[axis];
    return far ? middle : 0;
}

static void place_center(struct collection *all, double center[3])
{
    double middles[3][CENTER_BOXES];
    struct bounds bounds = BOUNDS_NONE;
    crew_share(all->whole->crew, all->count, find_bounds, all);
    for (uint32_t i = 0; i < all->count; i++)
        bounds_add(&bounds, &all->parts[i].bounds);
    uint32_t count = take_middles(all->whole->scene, middles);
    for (unsigned axis = 0; axis < 3; axis++)
        center[axis] = center_on(&bounds, axis, middles[axis], count);
}

static void collect_part(void *context, uint32_t round)
{
    const struct collection *all = context;
    const struct whole *whole = all->whole;
    struct part *part = &all->parts[round];
    part->range = range_empty(part->first);
    for (uint32_t index = part->begin; index < part->end; index++) {
        struct item *item = &whole->items[part->first + (index - part->begin)];
        item->id = primitive_id(part->kind, index);
        item->weight = weight_of(part->kind);
        struct bounds bounds = primitive_bounds(whole->scene, item->id);
        for (unsigned axis = 0; axis < 3; axis++) {
            item->min[axis] = round_down(bounds.min[axis] - whole->center[axis]);
            item->max[axis] = round_up(bounds.max[axis] - whole->center[axis]);
        }
        range_add(&part->range, item);
    }
}

static struct range collect_items(struct collection *all)
{
    struct range range = range_empty(0);
    crew_share(all->whole->crew, all->count, collect_part, all);
    for (uint32_t i = 0; i < all->count; i++)
        range_append(&range, &all->parts[i].range);
    range.room = (uint32_t)room_for_pieces(all->whole->scene);
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

/* Where nothing is bounded, as at first, the tree is empty. */
static struct bvh *empty_tree(const struct scene *scene, void *memory)
{
    struct bvh *bvh = memory;
    memset(memory, 0, round_up_to(sizeof *bvh, ALIGNMENT));
    bvh->nodes_offset = bvh->leaves_offset = bvh->bytes = round_up_to(sizeof *bvh, ALIGNMENT);
    bvh->transparent = (scene_features(scene) & FEATURE_REFRACTION) != 0;
    return bvh;
}

static void build_tree(const struct whole *whole, struct bvh *bvh)
{
    struct collection primitives = parts_of(whole);
    place_center(&primitives, bvh->center);
    struct range all = collect_items(&primitives);
    free(primitives.parts);
    write_bounds(bvh, &all.extent);
    struct bvh_node *nodes = (void *)((char *)bvh + bvh->nodes_offset);
    uint32_t node_count = bvh_build_nodes(whole, &all, nodes);
    bvh->node_count = node_count;
    bvh->leaves_offset += node_count * sizeof *nodes;
    struct bvh_leaf *leaves = (void *)((char *)bvh + bvh->leaves_offset);
    struct leaf_room room = bvh_write_leaves(whole, nodes, node_count, leaves);
    size_t leaf_bytes = (size_t)room.room * sizeof *leaves;
    bvh->leaf_count = room.entries;
    bvh->bytes = bvh->leaves_offset + round_up_to(leaf_bytes + ROW_END, ALIGNMENT);
    /* The same scene gives the same bytes, gaps too. */
    memset((char *)leaves + leaf_bytes, 0, bvh->bytes - bvh->leaves_offset - leaf_bytes);
}

struct bvh *bvh_build(const struct scene *scene, void *memory, unsigned threads)
{
    struct bvh *bvh = empty_tree(scene, memory);
    if (bounded_count(scene) == 0) return bvh;
    if (weight_bound(scene) > UINT32_MAX) /* of a range: struct range */
        fatal("the scene has too many primitives for a tree");
    if (bounded_count(scene) <= SUBTREE_ITEMS) threads = 1; /* there is nothing to share out */
    struct whole whole = {scene, bvh->center,
                          allocate_large((size_t)leaf_bound(scene) * sizeof *whole.items),
                          threads > 1 ? crew_gather(threads) : NULL};
    build_tree(&whole, bvh);
    if (whole.crew) crew_dismiss(whole.crew);
    free(whole.items);
    return bvh;
}
