/* Visits to the leaves that a ray reaches. What is done for every ray has worker/traverse.h inlined instead. */
#ifndef FARM_WORKER_VISIT_H
#define FARM_WORKER_VISIT_H

#include <stdbool.h>
#include <stdint.h>

#include "worker/bvh.h"
#include "worker/ray.h"

/* Tests the primitives of a leaf; false ends the traversal of the tree. A search in the order of distance may lower
 * *limit. */
typedef bool visit_leaf(void *context, const struct bvh_leaf *leaves, uint32_t count,
                        double *limit);

/* Visits the leaves of one tree that the ray reaches at 0 <= t <= limit, near ones first if ordered. */
void visit_tree(const struct bvh *tree, const struct ray *ray, double limit, bool ordered,
                visit_leaf *visit, void *context);

/* Visits those of all trees, in any order; where visit() returns false, the next tree follows. */
void visit_leaves(const struct bvh *bvh, const struct ray *ray, double limit, visit_leaf *visit,
                  void *context);

#endif
