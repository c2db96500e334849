/* Tests of threads that run loops in parallel. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>

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

/* Checks that every round is done once, and that all are done when the loop returns. */
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

static double burned(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* Two rounds that wait for each other, so that a thread other than the caller does one of them. */
static void burn(void *context, uint32_t round)
{
    struct loop *loop = context;
    (void)round;
    atomic_fetch_add(&loop->done, 1);
    while (atomic_load(&loop->done) < loop->count) {
    }
}

static void test_cpu_time(void **state)
{
    (void)state;
    struct loop loop = {.count = 2};
    struct crew *crew = crew_gather(2);
    assert_true(crew_cpu_s(crew) == 0);
    double before = burned();
    crew_share(crew, loop.count, burn, &loop);
    double seconds = crew_cpu_s(crew);
    assert_true(seconds > 0 && seconds <= burned() - before);
    crew_dismiss(crew);
    assert_true(crew_cpu_s(NULL) == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_loops),
        cmocka_unit_test(test_nobody),
        cmocka_unit_test(test_cpu_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
