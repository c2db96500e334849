/* Tests of threads that run loops in parallel. */
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <time.h>

#include "common/clock.h"
#include "common/thread_pool.h"
#include "test/unit.h"

struct loop {
    uint32_t count;
    _Atomic uint32_t done, *times; /* of each iteration */
};

static void count_iteration(void *context, uint32_t iteration)
{
    struct loop *loop = context;
    assert_true(iteration < loop->count);
    atomic_fetch_add(&loop->times[iteration], 1);
    atomic_fetch_add(&loop->done, 1);
}

/* Checks that every iteration is done once, and that all are done when the loop returns. */
static void check_loop(struct thread_pool *pool, uint32_t count)
{
    struct loop loop = {.count = count, .times = calloc(count + 1, sizeof *loop.times)};
    assert_non_null(loop.times);
    thread_pool_for(pool, count, count_iteration, &loop);
    assert_int_equal(loop.done, count);
    for (uint32_t i = 0; i < count; i++)
        assert_int_equal(loop.times[i], 1);
    free(loop.times);
}

static void test_loops(void **state)
{
    const uint32_t counts[] = {0, 1, 2, 3, 100, 5000};
    for (unsigned threads = 1; threads <= 9; threads += 2) {
        struct thread_pool *pool = thread_pool_create(threads);
        for (unsigned i = 0; i < 200; i++)
            check_loop(pool, counts[i % 6]);
        thread_pool_destroy(pool);
    }
}

static void test_nobody(void **state)
{
    check_loop(NULL, 7);
    thread_pool_destroy(thread_pool_create(4)); /* before they have done anything */
}

static double burned(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* Two iterations that wait for each other, so that a thread other than the caller does one of them. Then each takes
 * 10 ms. */
static void burn(void *context, uint32_t iteration)
{
    struct loop *loop = context;
    (void)iteration;
    atomic_fetch_add(&loop->done, 1);
    while (atomic_load(&loop->done) < loop->count) {
    }
    for (double start = clock_thread_cpu(); clock_thread_cpu() - start < 0.01;) {
    }
}

static void test_cpu_time(void **state)
{
    struct thread_pool *pool = thread_pool_create(2);
    assert_true(thread_pool_cpu_s(pool) == 0);
    double before = burned();
    for (int i = 1; i <= 3; i++) {
        struct loop loop = {.count = 2};
        thread_pool_for(pool, loop.count, burn, &loop);
        double seconds = thread_pool_cpu_s(pool);
        assert_true(seconds >= 0.01 * i && seconds <= burned() - before - 0.01 * i);
    }
    thread_pool_destroy(pool);
    assert_true(thread_pool_cpu_s(NULL) == 0);
}

static int threads_left = INT32_MAX; /* how many more can be created */

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument);

int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument)
{
    if (threads_left-- <= 0) return EAGAIN;
    return __real_pthread_create(thread, attributes, start, argument);
}

/* Where no more threads can be created, those that there are do the work, if need be the caller alone. */
static void test_too_few_threads(void **state)
{
    for (int left = 0; left <= 2; left++) {
        threads_left = left;
        struct thread_pool *pool = thread_pool_create(8);
        assert_int_equal(thread_pool_size(pool), left + 1);
        check_loop(pool, 100);
        thread_pool_destroy(pool);
    }
    threads_left = INT32_MAX;
}

/* The caller is one of the threads. */
static void test_sizes(void **state)
{
    for (unsigned threads = 1; threads <= 5; threads++) {
        struct thread_pool *pool = thread_pool_create(threads);
        assert_int_equal(thread_pool_size(pool), threads);
        thread_pool_destroy(pool);
    }
    assert_int_equal(thread_pool_size(NULL), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_loops),           cmocka_unit_test(test_nobody),
        cmocka_unit_test(test_cpu_time),        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_too_few_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
