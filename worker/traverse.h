/* How a ray walks through the tree: nearest() and occluded() differ in what they do at the leaves.
 */
#ifndef FARM_WORKER_TRAVERSE_H
#define FARM_WORKER_TRAVERSE_H

#include "worker/float_slabs.h"

/* Looks at the primitives of a leaf; may lower *limit; false ends the walk. */
typedef bool visit_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                        double *limit);

/*
 * Visits all leaves that the ray reaches at t <= limit, near ones first if that is asked for. Equal
 * distances are visited, too: which of two equally near primitives wins must not depend on the
 * tree.
 *
 * This is for the rays that float_slabs_of() leaves out.
 */
void traverse_in_double(const struct bvh *bvh, const struct ray *ray, double limit, bool ordered,
                        visit_leaf *visit, void *context);

/* A child that the walk has left for later. */
struct float_pending {
    uint32_t child, count; /* as in struct bvh_node */
    float enter;
};

static inline struct float_pending float_pending_child(const struct bvh_node *node, unsigned lane,
                                                       float enter)
{
    return (struct float_pending){node->child[lane], node->count[lane], enter};
}

/* Puts the children of a set of at least two on the stack, the nearest last. */
static INLINED unsigned push_floats(struct float_pending *stack, unsigned top,
                                    const struct bvh_node *node, lane_set set, struct floats enter)
{
    float at[LANES];
    floats_store(at, enter);
    unsigned a = lowest_lane(set);
    lane_set rest = without_lowest(set);
    unsigned b = lowest_lane(rest);
    if (!without_lowest(rest)) {
        bool swapped = at[b] < at[a];
        unsigned near = swapped ? b : a, far = swapped ? a : b;
        stack[top] = float_pending_child(node, far, at[far]);
        stack[top + 1] = float_pending_child(node, near, at[near]);
        return top + 2;
    }
    unsigned end = top + (unsigned)__builtin_popcount(set);
    for (rest = set; rest; rest = without_lowest(rest)) {
        unsigned lane = lowest_lane(rest);
        struct floats here = floats_of(at[lane]);
        unsigned nearer =
            lanes_before(set, lane, floats_less(enter, here), floats_at_most(enter, here));
        stack[end - 1 - nearer] = float_pending_child(node, lane, at[lane]);
    }
    return end;
}

static INLINED unsigned push_floats_unordered(struct float_pending *stack, unsigned top,
                                              const struct bvh_node *node, lane_set set)
{
    for (; set; set = without_lowest(set))
        stack[top++] = float_pending_child(node, lowest_lane(set), 0);
    return top;
}

static INLINED void prefetch_children(const struct bvh *bvh, const struct bvh_node *node,
                                      lane_set set)
{
    for (; set; set = without_lowest(set)) {
        unsigned slot = lowest_lane(set);
        bool leaf = node->count[slot] > 0;
        const char *child = leaf ? (const void *)(bvh_leaves(bvh) + node->child[slot])
                                 : (const void *)(bvh_nodes(bvh) + node->child[slot]);
        __builtin_prefetch(child);
        __builtin_prefetch(child + 64);
        if (leaf) continue; /* most have no more */
        __builtin_prefetch(child + 128);
        __builtin_prefetch(child + 192);
    }
}

/* traverse_in_double() in float where that does. */
static INLINED void traverse(const struct bvh *bvh, const struct ray *ray, double limit,
                             bool ordered, visit_leaf *visit, void *context)
{
    if (bvh->node_count == 0) return;
    const struct bvh_node *nodes = bvh_nodes(bvh);
    const struct bvh_leaf *leaves = bvh_leaves(bvh);
    struct float_slabs slabs;
    if (!float_slabs_of(bvh, ray, &slabs)) {
        traverse_in_double(bvh, ray, limit, ordered, visit, context);
        return;
    }
    struct float_pending stack[BVH_STACK + BVH_WIDTH], now = {0, 0, 0};
    unsigned top = 0;
    float float_limit = float_slab_limit(limit);
    for (;;) {
        if (now.count > 0) {
            if (!visit(context, leaves + now.child, now.count, &limit)) return;
            if (ordered) float_limit = float_slab_limit(limit);
        } else {
            const struct bvh_node *node = &nodes[now.child];
            struct floats enter;
            lane_set set = float_slabs_meet(&slabs, node, float_limit, &enter);
            if (set && !without_lowest(set)) {
                now = float_pending_child(node, lowest_lane(set), 0);
                continue;
            }
            if (set) {
                prefetch_children(bvh, node, set);
                top = ordered ? push_floats(stack, top, node, set, enter)
                              : push_floats_unordered(stack, top, node, set);
                now = stack[--top];
                continue;
            }
        }
        do {
            if (top == 0) return;
            now = stack[--top];
        } while (ordered && !(now.enter <= float_limit));
    }
}

#endif
