/* Tests of borrowing cores from other processes and returning them. */
#include <errno.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "common/cores.h"
#include "test/unit.h"

/* The number of cores that the machine may have. Like the system, the fake call fails if the set is smaller. */
static size_t possible;

int sched_getaffinity(pid_t process, size_t bytes, cpu_set_t *cores)
{
    if (bytes * 8 < possible) {
        errno = EINVAL;
        return -1;
    }
    memset(cores, 0, bytes);
    return syscall(SYS_sched_getaffinity, process, bytes, cores) < 0 ? -1 : 0;
}

static cpu_set_t allowed(void)
{
    cpu_set_t cores;
    assert_int_equal(sched_getaffinity(0, sizeof cores, &cores), 0);
    return cores;
}

/* Borrows for this process, which may use one core, from its parent, which may use all. */
static void check_borrow_and_return(size_t cores)
{
    const int processes[] = {(int)getpid(), (int)getppid()};
    cpu_set_t all = allowed(), one;
    struct core_set own;
    size_t first = 0;
    while (!CPU_ISSET(first, &all))
        first++;
    assert_int_equal(cores_borrow(processes, 1, &own), 1); /* however many cores there are */
    cores_return(&own);
    CPU_ZERO(&one);
    CPU_SET(first, &one);
    assert_int_equal(sched_setaffinity(0, sizeof one, &one), 0);
    possible = cores;
    assert_int_equal(cores_borrow(processes, 1, &own), 1);
    cores_return(&own);
    unsigned threads = cores_borrow(processes, 2, &own);
    possible = 0;
    cpu_set_t borrowed = allowed();
    assert_true(CPU_EQUAL(&borrowed, &all));
    assert_int_equal(threads, CPU_COUNT(&all) < 2 ? 1 : 2);
    assert_true(own.bytes * 8 >= cores && CPU_EQUAL_S(sizeof one, own.cores, &one));
    cores_return(&own);
    cpu_set_t now = allowed();
    assert_true(CPU_EQUAL(&now, &one));
    assert_int_equal(sched_setaffinity(0, sizeof all, &all), 0);
}

static void test_borrow_and_return(void **state)
{
    check_borrow_and_return(0);
}

static void test_many_cores(void **state)
{
    struct affinity small, large;
    check_borrow_and_return(3 * CPU_SETSIZE);
    affinity_find(&small);
    possible = 3 * CPU_SETSIZE;
    affinity_find(&large);
    possible = 0;
    assert_true(CPU_COUNT(&small.cores) > 0 && CPU_EQUAL(&small.cores, &large.cores));
}

/* The cores of a process that does not exist are unknown. */
static void test_unknown_process(void **state)
{
    const int processes[] = {(int)getpid(), -1};
    cpu_set_t before = allowed();
    struct core_set own;
    cores_borrow(processes, 2, &own);
    cores_return(&own);
    cpu_set_t after = allowed();
    assert_true(CPU_EQUAL(&before, &after));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_borrow_and_return),
        cmocka_unit_test(test_many_cores),
        cmocka_unit_test(test_unknown_process),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
