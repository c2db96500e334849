/* Tests of bells: one wakes a sleeping thread, whichever thread or process rings it. */
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <pthread.h>

#include "common/bell.h"
#include "common/clock.h"
#include "test/unit.h"

/* Seconds: the most that a wait that must end at once may take on a busy machine; the limit of waits that are to be
 * ended by the bell. */
#define AT_ONCE   0.5
#define LONG_WAIT 20

static double time_of_wait(struct bell *bell, double seconds)
{
    double begin = clock_wall();
    bell_wait(bell, seconds);
    return clock_wall() - begin;
}

static void test_rung_before(void **state)
{
    struct bell bell;
    bell_init(&bell);
    bell_ring(&bell);
    bell_ring(&bell);
    assert_true(time_of_wait(&bell, LONG_WAIT) < AT_ONCE);
    /* Two rings before a wait count as one. */
    assert_true(time_of_wait(&bell, 0.02) >= 0.02);
    bell_ring(&bell);
    assert_true(time_of_wait(&bell, LONG_WAIT) < AT_ONCE);
    assert_true(time_of_wait(&bell, 0) < AT_ONCE);
    bell_free(&bell);
}

/* Two threads that ring for each other in turn. */
#define TURNS 1000

struct rally {
    struct bell here, there;
    unsigned turns; /* without a lock: the bells synchronise the threads */
};

/* false: a ring was lost. */

static bool ring_back(struct rally *rally)
{
    for (unsigned i = 0; i < TURNS; i++) {
        if (!bell_wait(&rally->there, LONG_WAIT)) return false;
        rally->turns++;
        bell_ring(&rally->here);
    }
    return true;
}

static void *ring_back_in_thread(void *rally)
{
    return ring_back(rally) ? rally : NULL;
}

static void play(struct rally *rally)
{
    for (unsigned i = 0; i < TURNS; i++) {
        rally->turns++;
        bell_ring(&rally->there);
        assert_true(bell_wait(&rally->here, LONG_WAIT));
        assert_int_equal(rally->turns, 2 * i + 2);
    }
}

static void test_threads(void **state)
{
    struct rally rally = {.turns = 0};
    pthread_t thread;
    bell_init(&rally.here);
    bell_init(&rally.there);
    assert_int_equal(pthread_create(&thread, NULL, ring_back_in_thread, &rally), 0);
    void *heard;
    play(&rally);
    pthread_join(thread, &heard);
    assert_non_null(heard);
    bell_free(&rally.here);
    bell_free(&rally.there);
}

static void test_processes(void **state)
{
    struct rally *rally =
        mmap(NULL, sizeof *rally, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    assert_true(rally != MAP_FAILED);
    bell_init(&rally->here);
    bell_init(&rally->there);
    pid_t child = fork();
    if (child == 0) {
        _exit(!ring_back(rally));
    }
    play(rally);
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
    munmap(rally, sizeof *rally);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rung_before),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_processes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
