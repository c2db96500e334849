/* Traversal of the tree by a single ray. nearest() and occluded() differ in what they do at the leaves. */
#ifndef FARM_WORKER_TRAVERSE_H
#define FARM_WORKER_TRAVERSE_H

#include "worker/float_slabs.h"
#include "worker/visit.h"

/*
 * Visits all leaves that the ray reaches at t <= limit, near ones first. Leaves at exactly the limit are visited, too:
 * which of two equally near primitives wins must not depend on the tree. This is for the rays that float_slabs_of()
 * does not support.
 */
void traverse_in_double(const struct bvh *bvh, const struct ray *ray, double limit,
                        visit_leaf *visit, void *context);

/* A child that is still to be visited. */
struct float_pending {
    const void *at; /* struct bvh_node, or the entries of a leaf */
    uint32_t count; /* as in struct bvh_node */
    float enter;
};

/* The base addresses of nodes and leaves, and the log2 of the bytes per place; the index tells whether it is
 * a leaf. */
struct child_places {
    const char *base[2];
    unsigned shift[2];
};

static INLINED struct child_places child_places(const struct bvh *bvh)
{
    _Static_assert(sizeof(struct bvh_node) == 1 << 8 && sizeof(struct bvh_leaf) == 1 << 2,
                   "the shifts below");
    return (struct child_places){{(const void *)bvh_nodes(bvh), (const void *)bvh_leaves(bvh)},
                                 {8, 2}};
}

/* Without a branch, which would often be mispredicted. */
static INLINED struct float_pending float_pending_child(const struct child_places *places,
                                                        const struct bvh_node *node, unsigned slot,
                                                        float enter)
{
    uint32_t count = node->count[slot];
    unsigned leaf = count > 0;
    size_t offset = (size_t)node->child[slot] << places->shift[leaf];
    return (struct float_pending){places->base[leaf] + offset, count, enter};
}

/* Prefetches a node. The triangles of a leaf take as much or less, except in the few leaves of eleven and
 * more. */
static INLINED void prefetch_child(const void *child)
{
    for (unsigned i = 0; i < sizeof(struct bvh_node); i += 64)
        __builtin_prefetch((const char *)child + i);
}

/* Pushes the children of a set, which is not empty, on the stack in order of distance; the nearest one goes
 * to *now. */
static INLINED unsigned push_floats(struct float_pending *stack, unsigned top,
                                    const struct child_places *places, const struct bvh_node *node,
                                    lane_set set, struct floats enter, struct float_pending *now)
{
    float at[LANES];
    unsigned a = lowest_lane(set);
    lane_set rest = without_lowest(set);
    if (!rest) {
        *now = float_pending_child(places, node, a, 0);
        return top;
    }
    floats_store(at, enter);
    unsigned b = lowest_lane(rest);
    if (!without_lowest(rest)) {
        bool swapped = at[b] < at[a];
        unsigned near = swapped ? b : a, far = swapped ? a : b;
        stack[top] = float_pending_child(places, node, far, at[far]);
        prefetch_child(stack[top].at);
        *now = float_pending_child(places, node, near, at[near]);
        return top + 1;
    }
    unsigned end = top + (unsigned)__builtin_popcount(set);
    for (rest = set; rest; rest = without_lowest(rest)) {
        unsigned lane = lowest_lane(rest);
        struct floats here = floats_of(at[lane]);
        unsigned nearer =
            lanes_before(set, lane, floats_less(enter, here), floats_at_most(enter, here));
        struct float_pending child = float_pending_child(places, node, lane, at[lane]);
        prefetch_child(child.at);
        stack[end - 1 - nearer] = child;
    }
    *now = stack[end - 1];
    return end - 1;
}

/* Pushes the children without an order; the last one goes to *now. */
static INLINED unsigned push_floats_unordered(struct float_pending *stack, unsigned top,
                                              const struct child_places *places,
                                              const struct bvh_node *node, lane_set set,
                                              struct float_pending *now)
{
    *now = float_pending_child(places, node, lowest_lane(set), 0);
    while ((set = without_lowest(set))) {
        prefetch_child(now->at);
        stack[top++] = *now;
        *now = float_pending_child(places, node, lowest_lane(set), 0);
    }
    return top;
}

static INLINED void prefetch_children(const struct bvh *bvh, const struct bvh_node *node,
                                      lane_set set)
{
    struct child_places places = child_places(bvh);
    for (; set; set = without_lowest(set))
        prefetch_child(float_pending_child(&places, node, lowest_lane(set), 0).at);
}

/* traverse_in_double(), but in float if that suffices for the ray, and in any order unless `ordered`. */
static INLINED void traverse(const struct bvh *bvh, const struct ray *ray, double limit,
                             bool ordered, visit_leaf *visit, void *context)
{
    if (bvh->node_count == 0) return;
    struct float_slabs slabs;
    if (!float_slabs_of(bvh, ray, &slabs)) {
        traverse_in_double(bvh, ray, limit, visit, context);
        return;
    }
    const struct child_places places = child_places(bvh);
    struct float_pending stack[BVH_STACK + BVH_WIDTH], now = {bvh_nodes(bvh), 0, 0};
    unsigned top = 0;
    float float_limit = float_slab_limit(limit);
    for (;;) {
        if (now.count > 0) {
            if (!visit(context, now.at, now.count, &limit)) return;
            if (ordered) float_limit = float_slab_limit(limit);
        } else {
            const struct bvh_node *node = now.at;
            struct floats enter;
            lane_set set = float_slabs_meet(&slabs, node, float_limit, &enter);
            if (set) {
                top = ordered ? push_floats(stack, top, &places, node, set, enter, &now)
                              : push_floats_unordered(stack, top, &places, node, set, &now);
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
