/* Tests the heap against a linear search through all keys. */
#include <stdlib.h>

#include "master/heap.h"
#include "test/random.h"
#include "test/unit.h"

#define IDS 150

/* The id that must be on top: that of the highest key, of equal keys the lowest id. key < 0: the id is not in. */
static uint32_t top_of(const double *keys)
{
    uint32_t top = HEAP_ABSENT;
    for (uint32_t id = 0; id < IDS; id++)
        if (keys[id] >= 0 && (top == HEAP_ABSENT || keys[id] > keys[top])) top = id;
    return top;
}

/* One of a few keys: many are equal. */
static double draw_key(uint64_t *random)
{
    return (double)random_below(random, 30);
}

static void change_one(struct heap *heap, double *keys, uint64_t *random)
{
    uint32_t id = random_below(random, 3) ? random_below(random, IDS) : top_of(keys);
    if (id == HEAP_ABSENT) return;
    if (random_below(random, 2)) {
        heap_put(heap, id, keys[id] = draw_key(random));
    } else {
        heap_remove(heap, id);
        keys[id] = -1;
    }
    assert_int_equal(heap_has(heap, id), keys[id] >= 0);
}

static void change_many(struct heap *heap, double *keys, uint64_t *random)
{
    for (uint32_t id = 0; id < IDS; id++) {
        if (random_below(random, 8) == 0) {
            heap_remove(heap, id);
            keys[id] = -1;
        } else if (heap_has(heap, id) && random_below(random, 2)) {
            heap_change(heap, id, keys[id] = draw_key(random));
        }
    }
    heap_restore(heap);
}

static void assert_empties(struct heap *heap, double *keys)
{
    while (top_of(keys) != HEAP_ABSENT) {
        uint32_t top = heap_top(heap);
        assert_int_equal(top, top_of(keys));
        heap_remove(heap, top);
        keys[top] = -1;
    }
    assert_int_equal(heap->count, 0);
    assert_int_equal(heap_top(heap), HEAP_ABSENT);
}

static void test_any_order(void **state)
{
    struct heap heap = {0};
    double keys[IDS];
    uint64_t random = 1;
    heap_reserve(&heap, IDS / 2);
    heap_reserve(&heap, IDS);
    for (uint32_t id = 0; id < IDS; id++)
        keys[id] = -1;
    assert_int_equal(heap_top(&heap), HEAP_ABSENT);
    for (int i = 0; i < 20000; i++) {
        uint32_t count = 0;
        if (random_below(&random, 100) == 0)
            change_many(&heap, keys, &random);
        else
            change_one(&heap, keys, &random);
        for (uint32_t id = 0; id < IDS; id++)
            count += keys[id] >= 0;
        assert_int_equal(heap.count, count);
        assert_int_equal(heap_top(&heap), top_of(keys));
    }
    assert_empties(&heap, keys);
    heap_free(&heap);
}

/* -0 counts as 0, so that the lower id is on top. */
static void test_zeros(void **state)
{
    struct heap heap = {0};
    heap_reserve(&heap, 3);
    for (uint32_t id = 0; id < 3; id++)
        heap_put(&heap, id, 1);
    for (uint32_t id = 0; id < 3; id++)
        heap_change(&heap, id, id == 1 ? 0.0 : -0.0);
    heap_restore(&heap);
    for (uint32_t id = 0; id < 3; id++) {
        assert_int_equal(heap_top(&heap), id);
        heap_remove(&heap, id);
    }
    heap_free(&heap);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_order),
        cmocka_unit_test(test_zeros),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
