#include "worker/traverse.h"

#include "worker/several.h"

/* A child that is still to be visited. */
struct pending {
    double enter;
    uint32_t child, count; /* as in struct bvh_node */
};

/* Pushes the children of a set in order of distance, the nearest one last. */
static INLINED unsigned push_nearest_last(struct pending *stack, unsigned top,
                                          const struct bvh_node *node, lane_set set,
                                          struct lanes enter)
{
    double at[LANES];
    unsigned end = top + (unsigned)__builtin_popcount(set);
    lanes_store(at, enter);
    for (lane_set rest = set; rest; rest = without_lowest(rest)) {
        unsigned lane = lowest_lane(rest);
        struct lanes here = lanes_of(at[lane]);
        unsigned nearer =
            lanes_before(set, lane, lanes_less(enter, here), lanes_at_most(enter, here));
        stack[end - 1 - nearer] = (struct pending){at[lane], node->child[lane], node->count[lane]};
    }
    return end;
}

void traverse_in_double(const struct bvh *bvh, const struct ray *ray, double limit,
                        visit_leaf *visit, void *context)
{
    if (bvh->node_count == 0) return;
    const struct bvh_node *nodes = bvh_nodes(bvh);
    const struct bvh_leaf *leaves = bvh_leaves(bvh);
    struct slabs slabs = slabs_of(bvh, ray);
    struct pending stack[BVH_STACK + BVH_WIDTH], now = {0, 0, 0};
    unsigned top = 0;
    for (;;) {
        if (now.count > 0) {
            if (!visit(context, leaves + now.child, now.count, &limit)) return;
        } else {
            const struct bvh_node *node = &nodes[now.child];
            struct lanes enter;
            lane_set set = slabs_meet(&slabs, node, limit, &enter);
            top = push_nearest_last(stack, top, node, set, enter);
        }
        do {
            if (top == 0) return;
            now = stack[--top];
        } while (!(now.enter <= limit));
    }
}

void visit_tree(const struct bvh *tree, const struct ray *ray, double limit, bool ordered,
                visit_leaf *visit, void *context)
{
    traverse(tree, ray, limit, ordered, visit, context);
}

void visit_leaves(const struct bvh *bvh, const struct ray *ray, double limit, visit_leaf *visit,
                  void *context)
{
    for (lane_set trees = trees_of_ray(bvh, ray, limit); trees;)
        visit_tree(take_tree(bvh, &trees), ray, limit, false, visit, context);
}
