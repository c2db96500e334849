/* Tests of the pending rays of a sample: order, pruning, bounded memory. */
#include <math.h>

#include "test/random.h"
#include "test/unit.h"
#include "worker/tree.h"

static void push(struct tree *tree, double bound, uint32_t depth)
{
    (void)tree_add(tree, bound, depth);
}

/* Removes the next ray and copies it to *branch; false: there is none. */
static bool pop(struct tree *tree, double cutoff, struct branch *branch)
{
    struct branch *next = tree->count > 0 ? tree_next(tree, cutoff) : NULL;
    if (next) tree_remove(tree, next, branch);
    return next;
}

static void test_most_important_first(void **state)
{
    struct tree tree = {0};
    struct branch branch;
    const double bounds[] = {0.25, 1, 0.5, 1};
    for (uint32_t i = 0; i < 4; i++)
        push(&tree, bounds[i], i);
    const uint32_t order[] = {1, 3, 2, 0}; /* equal bounds: the earlier one */
    for (int i = 0; i < 4; i++) {
        assert_true(pop(&tree, 1e-9, &branch));
        assert_int_equal(branch.depth, order[i]);
    }
    assert_false(pop(&tree, 1e-9, &branch));
    assert_true(tree_sum(&tree) == 0);
    tree_free(&tree);
}

/* Rays are pruned if their sum is at most the cutoff, not each of them. */
static void test_prunes_by_the_sum(void **state)
{
    struct tree tree = {0};
    struct branch branch;
    for (int i = 0; i < 8; i++)
        push(&tree, 0.125, 1);
    for (int i = 0; i < 4; i++)
        assert_true(pop(&tree, 0.5 + 1e-12, &branch));
    /* The sum is never less than the true one, and hardly more. */
    assert_false(pop(&tree, 0.5 + 1e-12, &branch));
    assert_int_equal(tree.count, 4);
    double left = tree_sum(&tree);
    assert_true(left >= 0.5 && left < 0.5 + 1e-14);
    assert_null(tree_next(&tree, left));
    assert_non_null(tree_next(&tree, nextafter(left, 0)));
    tree_free(&tree);
}

/* A closer bound of the next ray changes what comes next, and whether anything does. */
static void test_closer_bounds(void **state)
{
    struct tree tree = {0};
    struct branch branch;
    for (uint32_t i = 0; i < 40; i++) {
        push(&tree, 1 + i, i);
        tree.pending[i].coarse = true;
    }
    struct branch *next = tree_next(&tree, 0.5);
    assert_int_equal(next->depth, 39);
    tree_rate(&tree, next, 0.5);
    assert_false(next->coarse);
    assert_int_equal(tree_next(&tree, 0.5)->depth, 38);
    tree_remove(&tree, tree_next(&tree, 0.5), &branch);
    assert_int_equal(branch.depth, 38);
    assert_int_equal(tree.count, 39);
    for (uint32_t i = 0; i < 38; i++) {
        next = tree_next(&tree, 0.5);
        assert_true(next->coarse);
        tree_rate(&tree, next, i < 37 ? 0x1p-10 : 0.25);
    }
    assert_null(tree_next(&tree, 0.8)); /* 0.5 + 0.25 + 37 / 1024 */
    next = tree_next(&tree, 0.75);
    assert_int_equal(next->depth, 39);
    tree_free(&tree);
}

/* Bounds whose sum rounds down: the reported sum is not below the true one. */
static void test_sums_are_upper_bounds(void **state)
{
    struct tree tree = {0};
    struct branch branch;
    push(&tree, 1, 1);
    for (int i = 0; i < 1000; i++)
        push(&tree, 0x1p-54, 1); /* each is lost beside 1 */
    assert_false(pop(&tree, 2, &branch));
    assert_true(tree_sum(&tree) >= 1 + 1000 * 0x1p-54);
    /* The comparison with the cutoff must not round the sum down, either. */
    assert_true(pop(&tree, 1, &branch));
    tree_free(&tree);
}

static void test_without_cutoff_depth_first(void **state)
{
    struct tree tree = {0};
    struct branch branch;
    push(&tree, 1, 1);
    push(&tree, 1, 3);
    push(&tree, 1e-300, 7);
    const uint32_t order[] = {7, 3, 1};
    for (int i = 0; i < 3; i++) {
        assert_true(pop(&tree, 0, &branch));
        assert_int_equal(branch.depth, order[i]);
    }
    assert_false(pop(&tree, 0, &branch));
    tree_free(&tree);
}

/* Above TREE_BEST_FIRST_MAX the deepest ray comes first, of equally deep ones the one with the largest bound, of
 * these the one added first. */
static void test_deepest_first(void **state)
{
    struct tree tree = {0};
    struct branch branch;
    enum { MANY = TREE_BEST_FIRST_MAX + 40 };
    for (uint32_t i = 0; i < MANY; i++) {
        struct branch *pending = tree_add(&tree, 1 + i % 3, i * 7 % 32);
        pending->media = i;
    }
    struct branch before = {.depth = UINT32_MAX};
    while (tree.count > TREE_BEST_FIRST_MAX) {
        assert_true(pop(&tree, 1e-3, &branch));
        bool deeper = before.depth > branch.depth;
        bool brighter = before.depth == branch.depth && before.bound > branch.bound;
        bool earlier = before.depth == branch.depth && before.bound == branch.bound &&
                       before.media < branch.media;
        assert_true(deeper || brighter || earlier);
        before = branch;
    }
    /* At or below TREE_BEST_FIRST_MAX the order of the remaining rays is that of their bounds again. */
    for (before.bound = HUGE_VAL; tree.count > 0; before = branch) {
        assert_true(pop(&tree, 1e-3, &branch));
        assert_true(before.bound > branch.bound ||
                    (before.bound == branch.bound && before.media < branch.media));
    }
    tree_free(&tree);
}

/* Any number of branches, some with equal bounds, while others are added or get other bounds. */
static void test_order_of_many(void **state)
{
    struct tree tree = {0};
    struct branch branch;
    uint64_t random = 1;
    uint32_t added = 0, taken = 0;
    double left[64]; /* bounds in the order of insertion, which is the depth here; 0: removed */
    for (uint32_t step = 0; step < 2000; step++) {
        uint32_t kind = random_below(&random, 4);
        if (tree.count < 40 && kind < 2) {
            if (added == 64) {
                tree_clear(&tree);
                added = 0;
            }
            left[added] = 1 + random_below(&random, 8);
            push(&tree, left[added], added);
            added++;
        } else if (tree.count > 0) {
            uint32_t first = 0;
            double sum = 0;
            for (uint32_t i = 0; i < added; i++) {
                sum += left[i];
                if (left[i] > left[first]) first = i;
            }
            assert_null(tree_next(&tree, sum * (1 + 1e-12)));
            struct branch *next = tree_next(&tree, sum * (1 - 1e-12));
            assert_int_equal(next->depth, first);
            if (kind == 2 && left[first] > 2) {
                tree_rate(&tree, next, --left[first]);
            } else {
                tree_remove(&tree, next, &branch);
                assert_true(branch.depth == first && branch.bound == left[first]);
                left[first] = 0;
                taken++;
            }
        }
    }
    assert_true(taken > 500);
    tree_free(&tree);
}

/* The branch that should come next, found without summaries; the number of a branch is in its media. */
static const struct branch *expected_next(const struct tree *tree)
{
    bool deepest_first = tree->count > TREE_BEST_FIRST_MAX;
    const struct branch *first = &tree->pending[0];
    for (uint32_t i = 1; i < tree->count; i++) {
        const struct branch *b = &tree->pending[i];
        bool alike = !deepest_first || b->depth == first->depth;
        bool brighter =
            b->bound > first->bound || (b->bound == first->bound && b->media < first->media);
        if (alike ? brighter : b->depth > first->depth) first = b;
    }
    return first;
}

/* Around TREE_BEST_FIRST_MAX branches, so that the order changes again and again. */
static void test_order_at_the_limit(void **state)
{
    struct tree tree = {0};
    uint64_t random = 1;
    uint32_t added = 0;
    while (added < TREE_BEST_FIRST_MAX + 2000) {
        struct branch taken;
        if (tree.count < TREE_BEST_FIRST_MAX - 20 || random_below(&random, 2)) {
            double bound = 1 + random_below(&random, 64);
            struct branch *pending = tree_add(&tree, bound, random_below(&random, 8));
            pending->media = added++;
            continue;
        }
        const struct branch *expected = expected_next(&tree);
        struct branch *next = tree_next(&tree, 1e-3);
        assert_ptr_equal(next, expected);
        if (random_below(&random, 2) && next->bound > 1)
            tree_rate(&tree, next, next->bound / 2);
        else
            tree_remove(&tree, next, &taken);
    }
    tree_free(&tree);
}

/* Three panes of glass have some hundred pending rays that matter. None of them must be followed by a dive to the
 * greatest depth through rays that do not matter. */
static void test_no_dive(void **state)
{
    struct tree tree = {0};
    struct branch branch;
    uint32_t traced = 0;
    push(&tree, 1, 0);
    while (traced < 10000 && pop(&tree, 1.0 / 512, &branch)) {
        traced++;
        if (branch.depth == 20) continue;
        push(&tree, branch.bound * 0.5, branch.depth + 1);
        push(&tree, branch.bound * 0.1, branch.depth + 1);
    }
    assert_in_range(traced, 900, 1000);
    tree_free(&tree);
}

/* Surfaces that give two full rays each: a full tree of depth 16 without 65,536 pending rays. */
static void test_memory_stays_bounded(void **state)
{
    struct tree tree = {0};
    struct branch branch;
    uint32_t most = 0;
    uint64_t traced = 0;
    push(&tree, HUGE_VAL, 0);
    while (pop(&tree, 1e-3, &branch)) {
        traced++;
        if (branch.depth < 16) {
            push(&tree, HUGE_VAL, branch.depth + 1);
            push(&tree, HUGE_VAL, branch.depth + 1);
        }
        if (tree.count > most) most = tree.count;
    }
    assert_int_equal(traced, (1 << 17) - 1);
    assert_true(most <= TREE_BEST_FIRST_MAX + 2 + 16);
    tree_free(&tree);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_most_important_first),
        cmocka_unit_test(test_prunes_by_the_sum),
        cmocka_unit_test(test_closer_bounds),
        cmocka_unit_test(test_sums_are_upper_bounds),
        cmocka_unit_test(test_without_cutoff_depth_first),
        cmocka_unit_test(test_deepest_first),
        cmocka_unit_test(test_order_of_many),
        cmocka_unit_test(test_order_at_the_limit),
        cmocka_unit_test(test_no_dive),
        cmocka_unit_test(test_memory_stays_bounded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
