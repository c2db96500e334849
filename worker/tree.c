#include "worker/tree.h"

#include <stdlib.h>

#include "common/message.h"
#include "worker/exact.h"

void tree_free(struct tree *tree)
{
    free(tree->pending);
    free(tree->keys);
    free(tree->blocks);
    *tree = (struct tree){0};
}

static void make_room(struct tree *tree)
{
    tree->capacity = tree->capacity ? 2 * tree->capacity : TREE_BLOCK;
    tree->pending = reallocate(tree->pending, tree->capacity, sizeof *tree->pending);
    tree->keys = reallocate(tree->keys, tree->capacity, sizeof *tree->keys);
    tree->blocks = reallocate(tree->blocks, tree->capacity / TREE_BLOCK, sizeof *tree->blocks);
}

struct branch *tree_add(struct tree *tree, double bound, uint32_t depth)
{
    if (tree->count == tree->capacity) make_room(tree);
    tree->blocks[tree->count / TREE_BLOCK].known = false;
    tree->keys[tree->count] = (struct tree_key){bound, depth, tree->added++};
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

static bool more_important(const struct tree_key *a, const struct tree_key *b, bool deepest_first)
{
    if (deepest_first && a->depth != b->depth) return a->depth > b->depth;
    if (a->bound != b->bound) return a->bound > b->bound;
    return a->order < b->order;
}

/* A sum of n numbers >= 0 is too small by less than (n - 1) u / (1 - n u) of itself. */
static double round_up(double sum, uint32_t n)
{
    return sum * (1 + 2 * n * UNIT_ROUNDOFF);
}

static uint32_t block_count(const struct tree *tree)
{
    return (tree->count + TREE_BLOCK - 1) / TREE_BLOCK;
}

static void judge_block(const struct tree *tree, uint32_t b)
{
    struct tree_block *block = &tree->blocks[b];
    uint32_t begin = b * TREE_BLOCK, end = begin + TREE_BLOCK;
    if (end > tree->count) end = tree->count;
    block->sum = 0;
    block->first = begin;
    block->known = true;
    for (uint32_t i = begin; i < end; i++) {
        const struct tree_key *key = &tree->keys[i];
        block->sum += key->bound;
        if (more_important(key, &tree->keys[block->first], tree->deepest_first)) block->first = i;
    }
}

/* What all pending rays can add; *first is the next one's place. */
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
        if (more_important(&tree->keys[block->first], &tree->keys[*first], deepest_first))
            *first = block->first;
    }
    return round_up(sum, tree->count);
}

double tree_sum(const struct tree *tree)
{
    double sum = 0;
    for (uint32_t i = 0; i < tree->count; i++)
        sum += tree->keys[i].bound;
    return round_up(sum, tree->count);
}

struct branch *tree_next(struct tree *tree, double cutoff)
{
    uint32_t next;
    if (tree->count == 0) return NULL;
    /* Every ray is traced anyway, and the last one first needs the least memory. */
    if (cutoff == 0) return &tree->pending[tree->count - 1];
    return judge(tree, &next) <= cutoff ? NULL : &tree->pending[next];
}

static void forget_block(struct tree *tree, const struct branch *pending)
{
    tree->blocks[(size_t)(pending - tree->pending) / TREE_BLOCK].known = false;
}

void tree_rate(struct tree *tree, struct branch *pending, double bound)
{
    pending->bound = tree->keys[pending - tree->pending].bound = bound;
    pending->rough = false;
    forget_block(tree, pending);
}

void tree_remove(struct tree *tree, const struct branch *pending, struct branch *branch)
{
    size_t place = (size_t)(pending - tree->pending), last = --tree->count;
    *branch = *pending;
    forget_block(tree, pending);
    forget_block(tree, &tree->pending[last]);
    if (place == last) return;
    tree->pending[place] = tree->pending[last];
    tree->keys[place] = tree->keys[last];
}
