/* Cores that are borrowed from other processes, and given back. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <unistd.h>

#include <cmocka.h>

#include "common/cores.h"

static cpu_set_t allowed(void)
{
    cpu_set_t cores;
    assert_int_equal(sched_getaffinity(0, sizeof cores, &cores), 0);
    return cores;
}

/* This process on one core, and the one that has started it, which has all that there are. */
static void test_borrow_and_return(void **state)
{
    (void)state;
    const int processes[] = {(int)getpid(), (int)getppid()};
    cpu_set_t all = allowed(), one, own;
    size_t first = 0;
    while (!CPU_ISSET(first, &all))
        first++;
    CPU_ZERO(&one);
    CPU_SET(first, &one);
    assert_int_equal(sched_setaffinity(0, sizeof one, &one), 0);
    assert_int_equal(cores_borrow(processes, 1, &own), 1);
    cores_return(&own);
    unsigned threads = cores_borrow(processes, 2, &own);
    cpu_set_t borrowed = allowed();
    assert_true(CPU_EQUAL(&borrowed, &all));
    assert_int_equal(threads, CPU_COUNT(&all) < 2 ? 1 : 2);
    assert_true(CPU_EQUAL(&own, &one));
    cores_return(&own);
    cpu_set_t now = allowed();
    assert_true(CPU_EQUAL(&now, &one));
    assert_int_equal(sched_setaffinity(0, sizeof all, &all), 0);
}

/* Of a process that is not there nothing is known. */
static void test_unknown_process(void **state)
{
    (void)state;
    const int processes[] = {(int)getpid(), -1};
    cpu_set_t before = allowed(), own;
    cores_borrow(processes, 2, &own);
    cores_return(&own);
    cpu_set_t after = allowed();
    assert_true(CPU_EQUAL(&before, &after));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_borrow_and_return),
        cmocka_unit_test(test_unknown_process),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
