/*
 * Disjoint sets of the numbers 0 .. n - 1 (union-find). parent[i] is a lower-numbered member of i's set, or i itself if
 * i is the lowest, which represents the set. So the result does not depend on the order of joining.
 */
#ifndef FARM_MASTER_UNION_FIND_H
#define FARM_MASTER_UNION_FIND_H

#include <stdint.h>

/* Each in a set of its own. */
static inline void union_find_init(uint32_t *parent, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        parent[i] = i;
}

/* The lowest member of i's set. Path halving makes the next search shorter (J. van Leeuwen and R. E. Tarjan). */
static inline uint32_t union_find_root(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

static inline void union_find_join(uint32_t *parent, uint32_t a, uint32_t b)
{
    a = union_find_root(parent, a), b = union_find_root(parent, b);
    if (a < b)
        parent[b] = a;
    else
        parent[a] = b;
}

#endif
