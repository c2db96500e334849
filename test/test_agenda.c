/* Tests the agenda against a linear search through all keys. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "master/agenda.h"
#include "test/random.h"

#define IDS 150

/* The id that must be first: that of the highest key, of equal keys the lowest id. key < 0: the id is not in. */
static uint32_t first_of(const double *keys)
{
    uint32_t first = AGENDA_NONE;
    for (uint32_t id = 0; id < IDS; id++)
        if (keys[id] >= 0 && (first == AGENDA_NONE || keys[id] > keys[first])) first = id;
    return first;
}

/* One of a few keys, some of which are close together, so that many ids have equal keys. */
static double draw_key(uint64_t *random)
{
    return random_below(random, 2) ? random_below(random, 30) : 7 + 1e-3 * random_below(random, 30);
}

static void change_at_once(struct agenda *agenda, double *keys, uint64_t *random)
{
    agenda_unsort(agenda);
    for (uint32_t id = 0; id < IDS; id++) {
        if (random_below(random, 8) == 0) {
            agenda_remove(agenda, id);
            keys[id] = -1;
        } else if (agenda_has(agenda, id) && random_below(random, 2)) {
            agenda_change(agenda, id, keys[id] = draw_key(random));
        }
    }
    agenda_sort(agenda);
}

static void change_one(struct agenda *agenda, double *keys, uint64_t *random)
{
    uint32_t id = random_below(random, 3) ? random_below(random, IDS) : first_of(keys);
    if (id == AGENDA_NONE) return;
    if (random_below(random, 2)) {
        agenda_put(agenda, id, keys[id] = draw_key(random));
    } else {
        agenda_remove(agenda, id);
        keys[id] = -1;
    }
    assert_int_equal(agenda_has(agenda, id), keys[id] >= 0);
}

static void test_any_order(void **state)
{
    (void)state;
    struct agenda agenda = {0};
    double keys[IDS];
    uint64_t random = 1;
    agenda_reserve(&agenda, IDS / 2);
    agenda_reserve(&agenda, IDS);
    for (uint32_t id = 0; id < IDS; id++)
        keys[id] = -1;
    assert_int_equal(agenda_first(&agenda), AGENDA_NONE);
    for (int i = 0; i < 20000; i++) {
        uint32_t count = 0;
        if (random_below(&random, 100) == 0)
            change_at_once(&agenda, keys, &random);
        else
            change_one(&agenda, keys, &random);
        for (uint32_t id = 0; id < IDS; id++)
            count += keys[id] >= 0;
        assert_int_equal(agenda.count, count);
        assert_int_equal(agenda_first(&agenda), first_of(keys));
    }
    agenda_free(&agenda);
}

/* -0 counts as 0, not as a key below 0, so that the lower id is first. */
static void test_zeros(void **state)
{
    (void)state;
    struct agenda agenda = {0};
    agenda_reserve(&agenda, 3);
    for (uint32_t id = 0; id < 3; id++)
        agenda_put(&agenda, id, 1);
    agenda_unsort(&agenda);
    for (uint32_t id = 0; id < 3; id++)
        agenda_change(&agenda, id, id == 1 ? 0.0 : -0.0);
    agenda_sort(&agenda);
    for (uint32_t id = 0; id < 3; id++) {
        assert_int_equal(agenda_first(&agenda), id);
        agenda_remove(&agenda, id);
    }
    agenda_free(&agenda);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_order),
        cmocka_unit_test(test_zeros),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
