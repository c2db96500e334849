#include "worker/tree.h"

#include <stdlib.h>

#include "common/message.h"
#include "worker/exact.h"

void tree_free(struct tree *tree)
{
    free(tree->pending);
    free(tree->blocks);
    *tree = (struct tree){0};
}

struct branch *tree_add(struct tree *tree)
{
    if (tree->count == tree->capacity) {
        tree->capacity = tree->capacity ? 2 * tree->capacity : TREE_BLOCK;
        tree->pending = reallocate(tree->pending, tree->capacity, sizeof *tree->pending);
        tree->blocks = reallocate(tree->blocks, tree->capacity / TREE_BLOCK, sizeof *tree->blocks);
    }
    tree->blocks[tree->count / TREE_BLOCK].known = false;
    struct branch *branch = &tree->pending[tree->count++];
    branch->order = tree->added++;
    return branch;
}

static bool more_important(const struct branch *a, const struct branch *b, bool deepest_first)
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
        const struct branch *branch = &tree->pending[i];
        block->sum += branch->bound;
        if (more_important(branch, &tree->pending[block->first], tree->deepest_first))
            block->first = i;
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
        if (more_important(&tree->pending[block->first], &tree->pending[*first], deepest_first))
            *first = block->first;
    }
    return round_up(sum, tree->count);
}

double tree_sum(const struct tree *tree)
{
    double sum = 0;
    for (uint32_t i = 0; i < tree->count; i++)
        sum += tree->pending[i].bound;
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
    pending->bound = bound;
    pending->rough = false;
    forget_block(tree, pending);
}

void tree_remove(struct tree *tree, const struct branch *pending, struct branch *branch)
{
    struct branch *place = &tree->pending[pending - tree->pending];
    struct branch *last = &tree->pending[--tree->count];
    *branch = *place;
    forget_block(tree, place);
    forget_block(tree, last);
    if (place != last) *place = *last;
}
