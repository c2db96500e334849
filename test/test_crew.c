/* Threads that share out loops. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "common/crew.h"

struct loop {
    uint32_t count;
    _Atomic uint32_t done, *times; /* of each round */
};

static void round_of(void *context, uint32_t round)
{
    struct loop *loop = context;
    assert_true(round < loop->count);
    atomic_fetch_add(&loop->times[round], 1);
    atomic_fetch_add(&loop->done, 1);
}

/* Every round is done once, and all are when the loop returns. */
static void check_loop(struct crew *crew, uint32_t count)
{
    struct loop loop = {.count = count, .times = calloc(count + 1, sizeof *loop.times)};
    assert_non_null(loop.times);
    crew_share(crew, count, round_of, &loop);
    assert_int_equal(loop.done, count);
    for (uint32_t i = 0; i < count; i++)
        assert_int_equal(loop.times[i], 1);
    free(loop.times);
}

static void test_loops(void **state)
{
    (void)state;
    const uint32_t counts[] = {0, 1, 2, 3, 100, 5000};
    for (unsigned members = 1; members <= 9; members += 2) {
        struct crew *crew = crew_gather(members);
        for (unsigned i = 0; i < 200; i++)
            check_loop(crew, counts[i % 6]);
        crew_dismiss(crew);
    }
}

static void test_nobody(void **state)
{
    (void)state;
    check_loop(NULL, 7);
    crew_dismiss(crew_gather(4)); /* before they have done anything */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_loops),
        cmocka_unit_test(test_nobody),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
