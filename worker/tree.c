#include "worker/tree.h"

#include <assert.h>
#include <stdlib.h>

#include "common/message.h"
#include "common/whole.h"
#include "worker/exact.h"
#include "worker/lanes.h"

_Static_assert(TREE_BLOCK == 2 * LANES, "scan()");
_Static_assert(TREE_ROW == TREE_BLOCK * TREE_BLOCK, "a row is TREE_BLOCK blocks");

void tree_free(struct tree *tree)
{
    free(tree->pending);
    free(tree->bounds);
    free(tree->keys);
    free(tree->blocks);
    free(tree->rows);
    *tree = (struct tree){0};
}

static void make_room(struct tree *tree)
{
    tree->capacity = tree->capacity ? 2 * tree->capacity : TREE_BLOCK;
    tree->pending = reallocate(tree->pending, tree->capacity, sizeof *tree->pending);
    tree->bounds = reallocate(tree->bounds, tree->capacity, sizeof *tree->bounds);
    for (uint32_t i = tree->count; i < tree->capacity; i++)
        tree->bounds[i] = 0;
    tree->keys = reallocate(tree->keys, tree->capacity, sizeof *tree->keys);
    tree->blocks = reallocate(tree->blocks, tree->capacity / TREE_BLOCK, sizeof *tree->blocks);
    tree->rows = reallocate(tree->rows, divide_up(tree->capacity, TREE_ROW), sizeof *tree->rows);
}

/* Marks the summaries of the branch's block and row as out of date. */
static void forget(struct tree *tree, size_t place)
{
    tree->blocks[place / TREE_BLOCK].known = tree->rows[place / TREE_ROW].known = 0;
}

struct branch *tree_add(struct tree *tree, double bound, uint32_t depth)
{
    assert(bound >= 0);
    if (tree->count == tree->capacity) make_room(tree);
    forget(tree, tree->count);
    tree->bounds[tree->count] = bound;
    tree->keys[tree->count] = (struct tree_key){depth, tree->added++};
    struct branch *branch = &tree->pending[tree->count++];
    branch->bound = bound;
    branch->depth = depth;
    return branch;
}

void tree_take(struct tree *tree, struct tree *from)
{
    if (tree->count == 0) {
        struct tree empty = *tree;
        *tree = *from;
        *from = empty;
    }
    for (uint32_t i = 0; i < from->count; i++) {
        const struct branch *branch = &from->pending[i];
        *tree_add(tree, branch->bound, branch->depth) = *branch;
    }
    tree_clear(from);
}

/* Whether branch a comes before branch b. */
static inline bool more_important(const struct tree *tree, uint32_t a, uint32_t b)
{
    const struct tree_key *keys = tree->keys;
    if (tree->order == DEEPEST_FIRST && keys[a].depth != keys[b].depth)
        return keys[a].depth > keys[b].depth;
    if (tree->bounds[a] != tree->bounds[b]) return tree->bounds[a] > tree->bounds[b];
    return keys[a].order < keys[b].order;
}

/* An upper bound on a sum of n numbers >= 0: the computed sum is too small by less than (n - 1) u / (1 - n u)
 * of itself. */
static double sum_above(double sum, uint32_t n)
{
    return sum * (1 + 2 * n * UNIT_ROUNDOFF);
}

/* Returns the sum of `count` bounds from `begin` on; *first is what comes first in the present order. */
static double scan(const struct tree *tree, uint32_t begin, uint32_t count, uint32_t *first)
{
    struct lanes low = lanes_load(tree->bounds + begin);
    struct lanes high = lanes_load(tree->bounds + begin + LANES);
    struct lanes most = lanes_of(lanes_highest(lanes_larger(low, high)));
    uint32_t all = (1u << (count < TREE_BLOCK ? count : TREE_BLOCK)) - 1;
    uint32_t set = all & (lanes_at_most(most, low) | lanes_at_most(most, high) << LANES);
    if (tree->order == DEEPEST_FIRST) set = all;
    *first = begin + lowest_lane(set);
    while ((set = without_lowest(set)))
        if (more_important(tree, begin + lowest_lane(set), *first))
            *first = begin + lowest_lane(set);
    return lanes_sum(lanes_add(low, high));
}

static void summarize_block(const struct tree *tree, struct tree_block *block, uint32_t begin)
{
    block->sum = scan(tree, begin, tree->count - begin, &block->first[tree->order]);
    block->known |= 1u << tree->order;
}

static inline bool is_known(const struct tree *tree, const struct tree_block *block)
{
    return block->known >> tree->order & 1;
}

static void summarize_row(const struct tree *tree, struct tree_block *row, uint32_t begin)
{
    uint32_t end = begin + TREE_ROW < tree->count ? begin + TREE_ROW : tree->count, first = begin;
    double sum = 0;
    for (uint32_t place = begin; place < end; place += TREE_BLOCK) {
        struct tree_block *block = &tree->blocks[place / TREE_BLOCK];
        if (!is_known(tree, block)) summarize_block(tree, block, place);
        sum += block->sum;
        if (more_important(tree, block->first[tree->order], first))
            first = block->first[tree->order];
    }
    row->sum = sum;
    row->first[tree->order] = first;
    row->known |= 1u << tree->order;
}

/* Upper bound on what all pending rays can add; *first is the index of the next one. */
static double summarize(struct tree *tree, uint32_t *first)
{
    double sum = 0;
    *first = 0;
    tree->order = tree->count > TREE_BEST_FIRST_MAX ? DEEPEST_FIRST : BEST_FIRST;
    for (uint32_t begin = 0; begin < tree->count; begin += TREE_ROW) {
        struct tree_block *row = &tree->rows[begin / TREE_ROW];
        if (!is_known(tree, row)) summarize_row(tree, row, begin);
        sum += row->sum;
        if (more_important(tree, row->first[tree->order], *first)) *first = row->first[tree->order];
    }
    return sum_above(sum, tree->count);
}

double tree_sum(const struct tree *tree)
{
    double sum = 0;
    for (uint32_t i = 0; i < tree->count; i++)
        sum += tree->bounds[i];
    return sum_above(sum, tree->count);
}

struct branch *tree_next(struct tree *tree, double cutoff)
{
    uint32_t next;
    if (tree->count == 0) return NULL;
    /* All rays are traced anyway; taking the last one first needs the least memory. */
    if (cutoff == 0) return &tree->pending[tree->count - 1];
    return summarize(tree, &next) <= cutoff ? NULL : &tree->pending[next];
}

void tree_rate(struct tree *tree, struct branch *pending, double bound)
{
    assert(bound >= 0);
    pending->bound = tree->bounds[pending - tree->pending] = bound;
    pending->coarse = false;
    forget(tree, (size_t)(pending - tree->pending));
}

void tree_remove(struct tree *tree, const struct branch *pending, struct branch *branch)
{
    size_t place = (size_t)(pending - tree->pending), last = --tree->count;
    *branch = *pending;
    forget(tree, place);
    forget(tree, last);
    if (place != last) {
        tree->pending[place] = tree->pending[last];
        tree->bounds[place] = tree->bounds[last];
        tree->keys[place] = tree->keys[last];
    }
    tree->bounds[last] = 0;
}
