#include "worker/bvh.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "worker/primitive.h"

/* Bins per axis; a few items need, and are worth, fewer: 8 up to twice that many. */
#define BINS_MAX 16
#define BINS_FEW 8

/*
 * Costs of the surface area heuristic in units of one primitive test. A step tests two boxes (2 x 6
 * subtractions and multiplications, 2 x 8 comparisons), a triangle test needs 9 subtractions, 6
 * multiplications and subtractions to shear, and 6 products; most of either is waiting for memory.
 * On a mesh of 3e5 triangles, step costs of 0.5 and 2 both gave slower shadow rays than 1.
 */
#define STEP_COST      1.0
#define PRIMITIVE_COST 1.0

/* Larger leaves are always split, whatever the heuristic says. */
#define LEAF_MAX 8

#define ALIGNMENT 64

struct extent {
    float min[3], max[3];
};

/* A primitive while the tree is built; moved about instead of its index, to read memory in order.
 */
struct item {
    struct extent extent;
    uint32_t id;
    uint32_t unused;
};

struct build {
    struct bvh_node *nodes;
    uint32_t node_count;
    struct item *items;
};

struct split {
    unsigned axis;
    unsigned bins;
    unsigned last;     /* of the left side's bins */
    double low, scale; /* bin = (centre - low) * scale */
    double cost;       /* sum of area * primitives of both sides */
};

static size_t align_up(size_t bytes)
{
    return (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

static uint64_t bounded_count(const struct scene *scene)
{
    return scene_primitive_count(scene) - scene->primitives[PRIMITIVE_PLANE].count;
}

/* Node 1 stays empty, so that the two children of a node share a cache line. */
static size_t nodes_bound(uint64_t primitives)
{
    return align_up((size_t)(2 * primitives) * sizeof(struct bvh_node));
}

size_t bvh_bytes_bound(const struct scene *scene)
{
    uint64_t primitives = bounded_count(scene);
    return align_up(sizeof(struct bvh)) + nodes_bound(primitives) +
           align_up((size_t)primitives * sizeof(uint32_t));
}

/* One float further out than needed, which also covers the roundings of the bounds themselves. */
static float round_down(double x)
{
    if (x > (double)FLT_MAX) return FLT_MAX;
    if (x < -(double)FLT_MAX) return -INFINITY;
    return nextafterf((float)x, -INFINITY);
}

static float round_up(double x)
{
    return -round_down(-x);
}

static struct extent empty_extent(void)
{
    return (struct extent){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static inline void extend(struct extent *extent, const struct extent *more)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        if (more->min[axis] < extent->min[axis]) extent->min[axis] = more->min[axis];
        if (more->max[axis] > extent->max[axis]) extent->max[axis] = more->max[axis];
    }
}

/* Half the surface; of an empty extent NaN or infinite, which no comparison prefers. */
static double extent_area(const struct extent *extent)
{
    double x = (double)extent->max[0] - (double)extent->min[0];
    double y = (double)extent->max[1] - (double)extent->min[1];
    double z = (double)extent->max[2] - (double)extent->min[2];
    return x * y + y * z + z * x;
}

/* Twice the centre of an item. */
static inline double item_center(const struct item *item, unsigned axis)
{
    return (double)item->extent.min[axis] + (double)item->extent.max[axis];
}

static inline unsigned bin_of(double center, double low, double scale, unsigned bins)
{
    double bin = (center - low) * scale;
    if (!(bin > 0)) return 0; /* also NaN, from infinite bounds */
    return bin < bins ? (unsigned)bin : bins - 1;
}

struct bin {
    struct extent extent;
    uint32_t count;
};

struct binning {
    unsigned count; /* of bins in use */
    double low[3], scale[3];
    struct bin bins[3][BINS_MAX];
};

/* scale is 0, all go to bin 0, on an axis on which all centres are the same. */
static void place_bins(struct binning *binning, const struct item *items, uint32_t count)
{
    binning->count = count <= 2 * BINS_FEW ? BINS_FEW : BINS_MAX;
    double low[3] = {INFINITE, INFINITE, INFINITE}, high[3] = {-INFINITE, -INFINITE, -INFINITE};
    for (uint32_t i = 0; i < count; i++) {
        for (unsigned axis = 0; axis < 3; axis++) {
            double center = item_center(&items[i], axis);
            low[axis] = center < low[axis] ? center : low[axis];
            high[axis] = center > high[axis] ? center : high[axis];
        }
    }
    for (unsigned axis = 0; axis < 3; axis++) {
        double width = high[axis] - low[axis];
        double scale = binning->count / width;
        binning->low[axis] = low[axis];
        binning->scale[axis] = width > 0 && isfinite(scale) ? scale : 0;
        for (unsigned b = 0; b < binning->count; b++)
            binning->bins[axis][b] = (struct bin){empty_extent(), 0};
    }
}

static void fill_bins(struct binning *binning, const struct item *items, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        for (unsigned axis = 0; axis < 3; axis++) {
            unsigned b = bin_of(item_center(&items[i], axis), binning->low[axis],
                                binning->scale[axis], binning->count);
            extend(&binning->bins[axis][b].extent, &items[i].extent);
            binning->bins[axis][b].count++;
        }
    }
}

/* Sweeps the bins of one axis from the right, then from the left; keeps the cheapest split. */
static void sweep_bins(const struct binning *binning, unsigned axis, struct split *best)
{
    const struct bin *bins = binning->bins[axis];
    double right_cost[BINS_MAX];
    struct extent right = empty_extent(), left = empty_extent();
    uint32_t right_count = 0, left_count = 0;
    for (unsigned b = binning->count - 1; b > 0; b--) {
        extend(&right, &bins[b].extent);
        right_count += bins[b].count;
        right_cost[b] = right_count ? extent_area(&right) * right_count : INFINITE;
    }
    for (unsigned b = 0; b + 1 < binning->count; b++) {
        extend(&left, &bins[b].extent);
        left_count += bins[b].count;
        if (left_count == 0) continue;
        double cost = extent_area(&left) * left_count + right_cost[b + 1];
        if (cost < best->cost)
            *best = (struct split){
                axis, binning->count, b, binning->low[axis], binning->scale[axis], cost};
    }
}

/* cost stays infinite when there is no way to divide the items by their centres. */
static struct split find_split(const struct item *items, uint32_t count)
{
    struct binning binning;
    struct split best = {.cost = INFINITE};
    place_bins(&binning, items, count);
    fill_bins(&binning, items, count);
    for (unsigned axis = 0; axis < 3; axis++)
        sweep_bins(&binning, axis, &best);
    return best;
}

static uint32_t partition(struct item *items, uint32_t count, const struct split *split)
{
    uint32_t left = 0, right = count;
    while (left < right) {
        double center = item_center(&items[left], split->axis);
        if (bin_of(center, split->low, split->scale, split->bins) <= split->last) {
            left++;
        } else {
            struct item item = items[left];
            items[left] = items[--right];
            items[right] = item;
        }
    }
    return left;
}

/* Levels that halving needs to come down to leaves. */
static unsigned halving_depth(uint32_t count)
{
    unsigned depth = 0;
    while (count > LEAF_MAX) {
        count -= count / 2;
        depth++;
    }
    return depth;
}

/*
 * How many of the items go to the left child; 0: they become a leaf. Items that their centres do
 * not tell apart, and a branch that has only the levels left which halving needs, are halved by
 * position.
 */
static uint32_t divide(struct item *items, uint32_t count, unsigned depth, double area)
{
    if (count == 1) return 0;
    if (depth + halving_depth(count) >= BVH_MAX_DEPTH) return count > LEAF_MAX ? count / 2 : 0;
    struct split split = find_split(items, count);
    bool worth_it = STEP_COST * area + PRIMITIVE_COST * split.cost < PRIMITIVE_COST * area * count;
    if (count <= LEAF_MAX && !worth_it) return 0;
    return isinf(split.cost) ? count / 2 : partition(items, count, &split);
}

static struct extent items_extent(const struct item *items, uint32_t count)
{
    struct extent extent = empty_extent();
    for (uint32_t i = 0; i < count; i++)
        extend(&extent, &items[i].extent);
    return extent;
}

/* Fills in a node and all below it; at most BVH_MAX_DEPTH levels deep. */
static void build_node(struct build *build, uint32_t node, uint32_t first, uint32_t count,
                       unsigned depth)
{
    struct item *items = build->items + first;
    struct extent extent = items_extent(items, count);
    struct bvh_node *out = &build->nodes[node];
    memcpy(out->min, extent.min, sizeof out->min);
    memcpy(out->max, extent.max, sizeof out->max);
    uint32_t left = divide(items, count, depth, extent_area(&extent));
    if (left == 0) {
        out->first = first;
        out->count = count;
        return;
    }
    uint32_t children = build->node_count;
    build->node_count += 2;
    out->first = children;
    out->count = 0;
    build_node(build, children, first, left, depth + 1);
    build_node(build, children + 1, first + left, count - left, depth + 1);
}

/* The bounds of everything, in double. */
static struct bounds scene_bounds(const struct scene *scene)
{
    struct bounds all = {{INFINITE, INFINITE, INFINITE}, {-INFINITE, -INFINITE, -INFINITE}};
    for (enum primitive_kind kind = 0; kind < PRIMITIVE_PLANE; kind++) {
        for (uint32_t index = 0; index < scene->primitives[kind].count; index++) {
            struct bounds bounds = primitive_bounds(scene, primitive_id(kind, index));
            for (unsigned axis = 0; axis < 3; axis++) {
                all.min[axis] = fmin(all.min[axis], bounds.min[axis]);
                all.max[axis] = fmax(all.max[axis], bounds.max[axis]);
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

static void collect_items(const struct scene *scene, const double center[3], struct item *items)
{
    size_t i = 0;
    for (enum primitive_kind kind = 0; kind < PRIMITIVE_PLANE; kind++) {
        for (uint32_t index = 0; index < scene->primitives[kind].count; index++, i++) {
            struct bounds bounds = primitive_bounds(scene, primitive_id(kind, index));
            for (unsigned axis = 0; axis < 3; axis++) {
                items[i].extent.min[axis] = round_down(bounds.min[axis] - center[axis]);
                items[i].extent.max[axis] = round_up(bounds.max[axis] - center[axis]);
            }
            items[i].id = primitive_id(kind, index);
        }
    }
}

struct bvh *bvh_build(const struct scene *scene, void *memory)
{
    uint64_t primitives = bounded_count(scene);
    struct bvh *bvh = memory;
    memset(bvh, 0, align_up(sizeof *bvh));
    bvh->primitive_count = primitives;
    bvh->nodes_offset = align_up(sizeof *bvh);
    bvh->primitives_offset = bvh->nodes_offset;
    bvh->bytes = bvh->nodes_offset;
    if (primitives == 0) return bvh;

    struct build build = {.nodes = (void *)((char *)memory + bvh->nodes_offset), .node_count = 2};
    build.items = allocate((size_t)primitives, sizeof *build.items);
    place_center(scene, bvh->center);
    collect_items(scene, bvh->center, build.items);
    build_node(&build, 0, 0, (uint32_t)primitives, 0);
    memset(&build.nodes[1], 0, sizeof build.nodes[1]);
    bvh->node_count = build.node_count;
    bvh->primitives_offset += align_up(build.node_count * sizeof(struct bvh_node));
    bvh->bytes = bvh->primitives_offset + align_up((size_t)primitives * sizeof(uint32_t));
    uint32_t *ids = (void *)((char *)memory + bvh->primitives_offset);
    for (uint64_t i = 0; i < primitives; i++)
        ids[i] = build.items[i].id;
    /* Every byte in use has a value of its own, the gaps 0: the same scene gives the same bytes. */
    memset(ids + primitives, 0, bvh->bytes - bvh->primitives_offset - primitives * sizeof *ids);
    size_t nodes_end = bvh->nodes_offset + build.node_count * sizeof(struct bvh_node);
    memset((char *)memory + nodes_end, 0, bvh->primitives_offset - nodes_end);
    free(build.items);
    return bvh;
}
