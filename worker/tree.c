#include "worker/tree.h"

#include <assert.h>
#include <stdlib.h>

#include "common/message.h"
#include "common/whole.h"
#include "worker/exact.h"
#include "worker/lanes.h"

_Static_assert(TREE_BLOCK == 2 * LANES, "judge_block()");

void tree_free(struct tree *tree)
{
    free(tree->pending);
    free(tree->bounds);
    free(tree->keys);
    free(tree->blocks);
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
}

struct branch *tree_add(struct tree *tree, double bound, uint32_t depth)
{
    assert(bound >= 0);
    if (tree->count == tree->capacity) make_room(tree);
    tree->blocks[tree->count / TREE_BLOCK].known = false;
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
    if (tree->deepest_first && keys[a].depth != keys[b].depth) return keys[a].depth > keys[b].depth;
    if (tree->bounds[a] != tree->bounds[b]) return tree->bounds[a] > tree->bounds[b];
    return keys[a].order < keys[b].order;
}

/* An upper bound on a sum of n numbers >= 0: the computed sum is too small by less than (n - 1) u / (1 - n u)
 * of itself. */
static double sum_above(double sum, uint32_t n)
{
    return sum * (1 + 2 * n * UNIT_ROUNDOFF);
}

static uint32_t block_count(const struct tree *tree)
{
    return divide_up(tree->count, TREE_BLOCK);
}

/*
 * Up to this many branches are examined one by one, which is faster than finding the largest with eight
 * lanes. Most trees are that small in a scene that only transmits light.
 */
#define FEW 4

static struct tree_block few_judged(const struct tree *tree, uint32_t begin, uint32_t count)
{
    struct tree_block block = {.sum = tree->bounds[begin], .first = begin, .known = true};
    for (uint32_t i = begin + 1; i < begin + count; i++) {
        block.sum += tree->bounds[i];
        if (more_important(tree, i, block.first)) block.first = i;
    }
    return block;
}

static struct tree_block many_judged(const struct tree *tree, uint32_t begin, uint32_t count)
{
    struct lanes low = lanes_load(tree->bounds + begin);
    struct lanes high = lanes_load(tree->bounds + begin + LANES);
    struct lanes most = lanes_of(lanes_highest(lanes_larger(low, high)));
    uint32_t all = (1u << (count < TREE_BLOCK ? count : TREE_BLOCK)) - 1;
    uint32_t set = all & (lanes_at_most(most, low) | lanes_at_most(most, high) << LANES);
    if (tree->deepest_first) set = all;
    struct tree_block block = {
        .sum = lanes_sum(lanes_add(low, high)), .first = begin + lowest_lane(set), .known = true};
    while ((set = without_lowest(set)))
        if (more_important(tree, begin + lowest_lane(set), block.first))
            block.first = begin + lowest_lane(set);
    return block;
}

static void judge_block(const struct tree *tree, uint32_t b)
{
    uint32_t begin = b * TREE_BLOCK, count = tree->count - begin;
    tree->blocks[b] =
        count <= FEW ? few_judged(tree, begin, count) : many_judged(tree, begin, count);
}

/* Upper bound on what all pending rays can add; *first is the index of the next one. */
static double judge(struct tree *tree, uint32_t *first)
{
    bool deepest_first = tree->count > TREE_BEST_FIRST_MAX;
    bool changed = tree->deepest_first != deepest_first;
    double sum = 0;
    *first = 0;
    tree->deepest_first = deepest_first;
    for (uint32_t b = 0; b < block_count(tree); b++) {
        struct tree_block *block = &tree->blocks[b];
        if (changed || !block->known) judge_block(tree, b);
        sum += block->sum;
        if (more_important(tree, block->first, *first)) *first = block->first;
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
    return judge(tree, &next) <= cutoff ? NULL : &tree->pending[next];
}

static void forget_block(struct tree *tree, const struct branch *pending)
{
    tree->blocks[(size_t)(pending - tree->pending) / TREE_BLOCK].known = false;
}

void tree_rate(struct tree *tree, struct branch *pending, double bound)
{
    assert(bound >= 0);
    pending->bound = tree->bounds[pending - tree->pending] = bound;
    pending->rough = false;
    forget_block(tree, pending);
}

void tree_remove(struct tree *tree, const struct branch *pending, struct branch *branch)
{
    size_t place = (size_t)(pending - tree->pending), last = --tree->count;
    *branch = *pending;
    forget_block(tree, pending);
    forget_block(tree, &tree->pending[last]);
    if (place != last) {
        tree->pending[place] = tree->pending[last];
        tree->bounds[place] = tree->bounds[last];
        tree->keys[place] = tree->keys[last];
    }
    tree->bounds[last] = 0;
}
