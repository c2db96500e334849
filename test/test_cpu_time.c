/* Tests of the CPU times of pieces of work, with fake clocks. */

#include <time.h>

#include "common/cpu_time.h"
#include "test/unit.h"

/* The times of the clocks, and how often the CPU clock, which is expensive, was read. */
static double wall, cpu;
static unsigned readings;

int __wrap_clock_gettime(clockid_t id, struct timespec *now);
int __wrap_clock_gettime(clockid_t id, struct timespec *now)
{
    double seconds = id == CLOCK_MONOTONIC ? wall : cpu;
    readings += id == CLOCK_THREAD_CPUTIME_ID;
    now->tv_sec = (time_t)seconds;
    now->tv_nsec = (long)(1e9 * (seconds - (double)now->tv_sec) + 0.5);
    return 0;
}

static void work_for(double seconds)
{
    wall += seconds;
    cpu += seconds;
}

/* Lets the thread sleep, or lose its core, for this time. */
static void be_away_for(double seconds)
{
    wall += seconds;
}

/* The reported CPU time of a piece of work of this length without interruptions. */
static double work_once(struct cpu_time *time, double seconds)
{
    double ended;
    cpu_time_begin(time);
    work_for(seconds);
    return cpu_time_end(time, &ended);
}

static int set_clocks(void **state)
{
    wall = 1000;
    cpu = 3;
    readings = 0;
    return 0;
}

#define assert_seconds(value, expected) assert_float_equal((value), (expected), 2e-9)

static void test_long(void **state)
{
    struct cpu_time time = {0};
    double ended;
    assert_seconds(cpu_time_begin(&time), 1000);
    work_for(0.002);
    be_away_for(0.004);
    work_for(0.001);
    assert_seconds(cpu_time_end(&time, &ended), 0.003);
    assert_seconds(ended, 1000.007);
    /* The next one owes nothing to it. */
    assert_seconds(work_once(&time, 0.001), 0.001);
    assert_int_equal(readings, 3);
}

/* In a row of many short pieces, the CPU clock is read for few of them. */
static void test_short(void **state)
{
    struct cpu_time time = {0};
    for (int i = 0; i < 1000; i++)
        assert_seconds(work_once(&time, CPU_TIME_SHORT / 20), CPU_TIME_SHORT / 20);
    assert_in_range(readings, 1000 / 21, 1000 / 20 + 1);
}

/* The end of a piece is returned whether the CPU clock was read or not. */
static void test_ended(void **state)
{
    static const double pieces[] = {CPU_TIME_SHORT / 20, 2 * CPU_TIME_SHORT, CPU_TIME_SHORT / 20};
    struct cpu_time time = {0};
    for (unsigned i = 0; i < sizeof pieces / sizeof *pieces; i++) {
        double ended;
        assert_seconds(cpu_time_begin(&time), wall);
        work_for(pieces[i]);
        cpu_time_end(&time, &ended);
        assert_seconds(ended, wall);
    }
}

/* A short piece that loses its core is long by the wall clock, so that its CPU time is read. */
static void test_lost(void **state)
{
    struct cpu_time time = {0};
    double ended;
    for (int i = 0; i < 10; i++)
        work_once(&time, CPU_TIME_SHORT / 20);
    cpu_time_begin(&time);
    work_for(CPU_TIME_SHORT / 20);
    be_away_for(0.004);
    assert_seconds(cpu_time_end(&time, &ended), CPU_TIME_SHORT / 20);
}

/* Waiting between two pieces is not subtracted from the next one, however long it is. */
static void test_waits(void **state)
{
    static const double waits[] = {CPU_TIME_SHORT / 2, 0.9 * CPU_TIME_SHORT, 0.01, 3};
    struct cpu_time time = {0};
    for (unsigned i = 0; i < sizeof waits / sizeof *waits; i++) {
        work_once(&time, CPU_TIME_SHORT / 4);
        be_away_for(waits[i]);
        assert_seconds(work_once(&time, 2 * CPU_TIME_SHORT), 2 * CPU_TIME_SHORT);
    }
}

/* Nor is one that was given up, or many that were. */
static void test_not_ended(void **state)
{
    struct cpu_time time = {0};
    double ended;
    cpu_time_begin(&time);
    be_away_for(0.5);
    assert_seconds(work_once(&time, 0.001), 0.001);
    for (int i = 0; i < 50; i++) {
        cpu_time_begin(&time);
        work_for(CPU_TIME_SHORT / 60);
    }
    cpu_time_begin(&time);
    work_for(2 * CPU_TIME_SHORT);
    be_away_for(0.006);
    double told = cpu_time_end(&time, &ended);
    assert_true(told >= CPU_TIME_SHORT && told <= 3 * CPU_TIME_SHORT);
}

/* Time that short pieces lost unnoticed is subtracted from the piece of the next reading, but that never becomes
 * negative. */
static void test_bounds(void **state)
{
    struct cpu_time time = {0};
    double ended;
    work_once(&time, 0.001);
    cpu_time_begin(&time);
    be_away_for(0.9 * CPU_TIME_SHORT);
    assert_seconds(cpu_time_end(&time, &ended), 0.9 * CPU_TIME_SHORT);
    cpu_time_begin(&time);
    be_away_for(1.1 * CPU_TIME_SHORT);
    assert_seconds(cpu_time_end(&time, &ended), 0);
    /* A clock that counts in steps may be ahead. */
    cpu_time_begin(&time);
    cpu += 0.005;
    wall += 0.001;
    assert_seconds(cpu_time_end(&time, &ended), 0.001);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_long, set_clocks),
        cmocka_unit_test_setup(test_short, set_clocks),
        cmocka_unit_test_setup(test_ended, set_clocks),
        cmocka_unit_test_setup(test_lost, set_clocks),
        cmocka_unit_test_setup(test_waits, set_clocks),
        cmocka_unit_test_setup(test_not_ended, set_clocks),
        cmocka_unit_test_setup(test_bounds, set_clocks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
