/* Tests the heap against a linear search through all keys. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "master/heap.h"
#include "test/random.h"

#define IDS 150

/* The id that must be on top: that of the highest key, of equal keys the lowest id. key < 0: the id is not in. */
static uint32_t top_of(const double *keys)
{
    uint32_t top = HEAP_ABSENT;
    for (uint32_t id = 0; id < IDS; id++)
        if (keys[id] >= 0 && (top == HEAP_ABSENT || keys[id] > keys[top])) top = id;
    return top;
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
    (void)state;
    struct heap heap = {0};
    double keys[IDS];
    uint64_t random = 1;
    heap_reserve(&heap, IDS);
    for (uint32_t id = 0; id < IDS; id++)
        keys[id] = -1;
    for (int i = 0; i < 20000; i++) {
        uint32_t id = random_below(&random, IDS);
        /* Few keys: many are equal. */
        keys[id] = (double)random_below(&random, 40) - 10;
        if (keys[id] >= 0)
            heap_put(&heap, id, keys[id]);
        else
            heap_remove(&heap, id);
        assert_int_equal(heap_has(&heap, id), keys[id] >= 0);
        assert_int_equal(heap_top(&heap), top_of(keys));
    }
    assert_empties(&heap, keys);
    heap_free(&heap);
}

static void test_cleared(void **state)
{
    (void)state;
    struct heap heap = {0};
    heap_reserve(&heap, IDS);
    for (uint32_t id = 0; id < IDS; id++)
        heap_put(&heap, id, id);
    heap_clear(&heap);
    assert_int_equal(heap_top(&heap), HEAP_ABSENT);
    heap_put(&heap, 7, 1);
    assert_false(heap_has(&heap, 8));
    assert_int_equal(heap_top(&heap), 7);
    heap_free(&heap);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_order),
        cmocka_unit_test(test_cleared),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
