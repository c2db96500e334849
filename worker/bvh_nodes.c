#include "worker/bvh_nodes.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "common/message.h"
#include "worker/bvh_split.h"

/* The cost of visiting a node, with its eight box tests; see LEAF_COST. */
#define STEP_COST 1.0

/*
 * A spatial split, which takes longer to find, is tried where the two sides of the best object split overlap in more
 * than OVERLAP of the range's length, as this is what it may take off them, and where the range has more than
 * RANGE_OF_ROOT of the root's area, so that it matters to rays. The area of the overlap, which Stich et al. compare, is
 * large even where two sides only touch, as in every mesh over a grid. With an OVERLAP of 1/64 the tree of a sculpted
 * figure costs rays 0.9 % more by the heuristic, with a RANGE_OF_ROOT of 3e-3 that of the lantern 0.4 %.
 */
#define OVERLAP       (1.0 / 128)
#define RANGE_OF_ROOT 1e-3

/*
 * A range of at most SUBTREE_ITEMS, or this share of all items if that is more, becomes a subtree that one thread
 * builds. This keeps many threads busy, as long as that is worth the effort: dealt out to 44 threads, the iterations of
 * the lantern's loops, timed one by one, take 7 % of what one thread takes with 64 and with 128, 8 % with 32. Of the
 * ranges above, few are larger than WIDE_SHARE of all items: these are divided one after the other, each by all
 * threads. The others, as many as the root has children and more, are divided by one thread each. None of this depends
 * on the number of threads, so that the same scene gives the same bytes.
 */
#define SUBTREE_SHARE 64
#define WIDE_SHARE    BVH_WIDTH

/* Its root is child `slot` of node `parent`, or the root of all; depth is that of its root, as in build_node(). */
struct subtree {
    struct range range;
    uint32_t parent;
    unsigned slot, depth;
    struct bvh_node *nodes; /* owned; numbered from 0 */
    uint32_t node_count;
    uint32_t first; /* index of its root in the whole tree */
};

/* The construction of the top of the tree, or of a subtree. */
struct build {
    struct bvh_input input;
    struct bvh_node *nodes;
    uint32_t node_count;
    double area; /* of the root of the whole tree */
};

/* ---- children ---- */

/* A child of the node that is being built. */
struct child {
    struct range range;
    struct split split; /* set if it may be a leaf of several items */
    /* cost saved by dividing it; not positive: it is left alone */
    double gain;
};

static bool may_be_leaf(const struct range *range)
{
    return range->weight <= LEAF_WEIGHT_MAX;
}

static bool is_cutting_worthwhile(const struct build *build, const struct range *range,
                                  const struct split *split)
{
    const struct extent *extent = &range->extent;
    double length = (double)extent->max[split->axis] - (double)extent->min[split->axis];
    return range->room > 0 && split->overlap > OVERLAP * length &&
           extent_half_area(extent) > RANGE_OF_ROOT * build->area;
}

static struct split find_split(const struct build *build, const struct range *range)
{
    struct split split = find_object_split(&build->input, range);
    if (!is_cutting_worthwhile(build, range, &split)) return split;
    return find_spatial_split(&build->input, range, &split);
}

/* Dividing a child that would be an inner node saves a visit of it. Dividing a possible leaf saves tests, as the
 * node has room for more children. */
static struct child new_child(const struct build *build, const struct range *range)
{
    struct child child = {.range = *range, .gain = 0};
    double area = extent_half_area(&range->extent);
    if (!may_be_leaf(range)) {
        child.gain = STEP_COST * area;
    } else if (range->count > 1) {
        child.split = find_split(build, range);
        child.gain = cost_of(range->weight) * area - child.split.cost;
    }
    return child;
}

/* Bound on the levels of nodes that halving leads to, even with the heaviest items. */
static unsigned halving_depth(uint32_t count)
{
    unsigned depth = 1;
    for (; count > LEAF_WEIGHT_MAX / PACK; depth++)
        count = (count - 1) / BVH_WIDTH + 1;
    return depth;
}

/* The child whose division gains most, of equal ones that with the most items; -1: none. halving: only children that
 * cannot be leaves are divided. */
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

/* Divides a range until there are BVH_WIDTH children, or only leaves that are best left alone; returns their number.
 * Ranges are only halved where the tree might otherwise exceed BVH_MAX_DEPTH. */
static unsigned find_children(const struct build *build, const struct range *range, unsigned depth,
                              struct child children[BVH_WIDTH])
{
    bool halving = depth + 1 + halving_depth(range->count + range->room) > BVH_MAX_DEPTH;
    unsigned count = 1;
    children[0] = new_child(build, range);
    while (count < BVH_WIDTH) {
        int chosen = choose_child(children, count, halving);
        if (chosen < 0) break;
        struct child *child = &children[chosen];
        struct range left, right;
        if (halving) {
            halve_range(&build->input, &child->range, &left, &right);
        } else {
            if (!may_be_leaf(&child->range)) child->split = find_split(build, &child->range);
            split_range(&build->input, &child->range, &child->split, &left, &right);
        }
        *child = new_child(build, &left);
        children[count++] = new_child(build, &right);
    }
    return count;
}

void bvh_fill_slot(struct bvh_node *node, unsigned slot, const struct extent *extent)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        node->min[axis][slot] = open_below(extent->min[axis]);
        node->max[axis][slot] = open_above(extent->max[axis]);
    }
}

void bvh_empty_node(struct bvh_node *node)
{
    for (unsigned slot = 0; slot < BVH_WIDTH; slot++) {
        for (unsigned axis = 0; axis < 3; axis++) {
            node->min[axis][slot] = INFINITY;
            node->max[axis][slot] = -INFINITY;
        }
        node->child[slot] = node->count[slot] = 0;
    }
}

/* ---- nodes ---- */

/* Fills in a node but for the numbers of its inner children. */
static void fill_node(struct bvh_node *node, const struct child *children, unsigned count)
{
    bvh_empty_node(node);
    for (unsigned i = 0; i < count; i++) {
        const struct range *part = &children[i].range;
        bvh_fill_slot(node, i, &part->extent);
        if (!may_be_leaf(part)) continue;
        node->child[i] = part->first;
        node->count[i] = part->count;
    }
}

/* Fills in a node and all nodes below it; depth is that of the node, 0 for the root. */
static void build_node(struct build *build, uint32_t index, const struct range *range,
                       unsigned depth)
{
    struct child children[BVH_WIDTH];
    unsigned count = find_children(build, range, depth, children);
    struct bvh_node *node = &build->nodes[index];
    fill_node(node, children, count);
    for (unsigned i = 0; i < count; i++)
        if (!may_be_leaf(&children[i].range)) node->child[i] = build->node_count++;
    for (unsigned i = 0; i < count; i++)
        if (!may_be_leaf(&children[i].range))
            build_node(build, node->child[i], &children[i].range, depth + 1);
}

/* ---- the top ---- */

/* A node whose children are not known yet. */
struct open_node {
    struct range range;
    uint32_t index; /* of the node */
    unsigned depth;
    unsigned count; /* of children, when they have been found */
    struct child children[BVH_WIDTH];
};

/* The top, which grows level by level: in each round all open nodes are divided. */
struct top {
    struct build build;
    uint32_t subtree_items, wide_items; /* SUBTREE_SHARE and WIDE_SHARE */
    struct open_node *open;             /* for the next round */
    uint32_t open_count;
    struct subtree *subtrees;
    uint32_t subtree_count;
};

/* The nodes of a round, and what one thread divides them with. */
struct round {
    struct build build;
    struct open_node *nodes;
    uint32_t wide_items;
};

static void leave_open(struct top *top, const struct range *range, unsigned depth)
{
    top->open = grow(top->open, top->open_count, sizeof *top->open);
    struct open_node *node = &top->open[top->open_count++];
    node->range = *range;
    node->index = top->build.node_count++;
    node->depth = depth;
}

static void leave_to_subtree(struct top *top, const struct range *range, uint32_t parent,
                             unsigned slot, unsigned depth)
{
    top->subtrees = grow(top->subtrees, top->subtree_count, sizeof *top->subtrees);
    top->subtrees[top->subtree_count++] =
        (struct subtree){.range = *range, .parent = parent, .slot = slot, .depth = depth};
}

static void divide(const struct build *build, struct open_node *node)
{
    node->count = find_children(build, &node->range, node->depth, node->children);
}

static void divide_alone(void *context, uint32_t iteration)
{
    const struct round *round = context;
    struct open_node *node = &round->nodes[iteration];
    if (node->range.count <= round->wide_items) divide(&round->build, node);
}

/* Fills in a node whose children have been found, and leaves these open or to subtrees. */
static void close_node(struct top *top, const struct open_node *open)
{
    struct bvh_node *node = &top->build.nodes[open->index];
    fill_node(node, open->children, open->count);
    for (unsigned i = 0; i < open->count; i++) {
        const struct range *part = &open->children[i].range;
        if (may_be_leaf(part)) continue;
        if (part->count <= top->subtree_items) {
            leave_to_subtree(top, part, open->index, i, open->depth + 1);
        } else {
            node->child[i] = top->build.node_count;
            leave_open(top, part, open->depth + 1);
        }
    }
}

static void divide_round(struct top *top)
{
    struct round round = {top->build, top->open, top->wide_items};
    uint32_t count = top->open_count;
    round.build.input.pool = NULL;
    top->open = NULL;
    top->open_count = 0;
    for (uint32_t i = 0; i < count; i++)
        if (round.nodes[i].range.count > top->wide_items) divide(&top->build, &round.nodes[i]);
    thread_pool_for(top->build.input.pool, count, divide_alone, &round);
    for (uint32_t i = 0; i < count; i++)
        close_node(top, &round.nodes[i]);
    free(round.nodes);
}

/* ---- subtrees ---- */

static void build_subtree(void *context, uint32_t iteration)
{
    const struct top *top = context;
    struct subtree *subtree = &top->subtrees[iteration];
    const struct range *range = &subtree->range;
    uint64_t bound = bvh_nodes_bound((uint64_t)range->weight + range->room);
    subtree->nodes = aligned_alloc(_Alignof(struct bvh_node), bound * sizeof *subtree->nodes);
    if (!subtree->nodes) fatal("out of memory: there is no room for a part of the tree");
    struct build build = top->build;
    build.nodes = subtree->nodes;
    build.node_count = 1;
    build.input.pool = NULL;
    build_node(&build, 0, range, subtree->depth);
    subtree->node_count = build.node_count;
}

/* Moves a subtree to its place in the whole tree. */
static void move_subtree(void *context, uint32_t iteration)
{
    const struct top *top = context;
    struct subtree *subtree = &top->subtrees[iteration];
    for (uint32_t n = 0; n < subtree->node_count; n++) {
        struct bvh_node *node = &top->build.nodes[subtree->first + n];
        *node = subtree->nodes[n];
        for (unsigned slot = 0; slot < BVH_WIDTH; slot++)
            if (node->count[slot] == 0 && node->child[slot] > 0)
                node->child[slot] += subtree->first;
    }
    free(subtree->nodes);
}

/* Places the subtrees after the nodes of the top. */
static void place_subtrees(struct top *top)
{
    struct build *build = &top->build;
    for (uint32_t i = 0; i < top->subtree_count; i++) {
        struct subtree *subtree = &top->subtrees[i];
        subtree->first = build->node_count;
        build->node_count += subtree->node_count;
        if (subtree->first > 0) build->nodes[subtree->parent].child[subtree->slot] = subtree->first;
    }
}

uint32_t bvh_build_nodes(const struct bvh_input *input, const struct range *all,
                         struct bvh_node *nodes)
{
    struct top top = {
        .build = {.input = *input, .nodes = nodes, .area = extent_half_area(&all->extent)},
        .subtree_items = larger(all->count / SUBTREE_SHARE, SUBTREE_ITEMS),
        .wide_items = all->count / WIDE_SHARE};
    if (all->count <= top.subtree_items)
        leave_to_subtree(&top, all, 0, 0, 0);
    else
        leave_open(&top, all, 0);
    while (top.open_count > 0)
        divide_round(&top);
    thread_pool_for(input->pool, top.subtree_count, build_subtree, &top);
    place_subtrees(&top);
    thread_pool_for(input->pool, top.subtree_count, move_subtree, &top);
    free(top.subtrees);
    return top.build.node_count;
}
