#include "worker/tree.h"

#include <stdlib.h>

#include "common/message.h"
#include "worker/exact.h"

void tree_free(struct tree *tree)
{
    free(tree->pending);
    *tree = (struct tree){0};
}

void tree_push(struct tree *tree, const struct branch *branch)
{
    if (tree->count == tree->capacity) {
        tree->capacity = tree->capacity ? 2 * tree->capacity : 4;
        tree->pending = reallocate(tree->pending, tree->capacity, sizeof *tree->pending);
    }
    tree->pending[tree->count] = *branch;
    tree->pending[tree->count].order = tree->added++;
    tree->count++;
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

double tree_drop(struct tree *tree)
{
    double sum = 0;
    for (uint32_t i = 0; i < tree->count; i++)
        sum += tree->pending[i].bound;
    sum = round_up(sum, tree->count);
    tree->count = 0;
    return sum;
}

bool tree_pop(struct tree *tree, double cutoff, struct branch *branch, double *dropped)
{
    if (tree->count == 0) return false;
    if (cutoff == 0) {
        /* Every ray is traced anyway, and the last one first needs the least memory. */
        *branch = tree->pending[--tree->count];
        return true;
    }
    bool deepest_first = tree->count > TREE_BEST_FIRST_MAX;
    uint32_t next = 0;
    double sum = 0;
    for (uint32_t i = 0; i < tree->count; i++) {
        sum += tree->pending[i].bound;
        if (more_important(&tree->pending[i], &tree->pending[next], deepest_first)) next = i;
    }
    sum = round_up(sum, tree->count);
    if (sum <= cutoff) {
        *dropped = sum;
        tree->count = 0;
        return false;
    }
    *branch = tree->pending[next];
    tree->pending[next] = tree->pending[--tree->count];
    return true;
}
