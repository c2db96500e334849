/* Tests of signals: the first one is noted, a second one of any kind ends the program. */
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/clock.h"
#include "master/stop.h"
#include "test/unit.h"

/* The status, as from waitpid(), of a process that gets both signals while it renders, the second one after `pause`
 * microseconds. It exits with 7 if it has noted the first one alone. */
static int end_after(int first, int second, useconds_t pause)
{
    int status = 0;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        signal(first, SIG_DFL); /* nohup or UCX may have set what SIGHUP does */
        stop_ignore_file_limit();
        stop_install(0);
        stop_defer();
        raise(first);
        if (pause) usleep(pause);
        raise(second);
        _exit(*stop_signal() == first ? 7 : 8);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    return status;
}

static const int kinds[] = {SIGINT, SIGTERM, SIGUSR1};

/* As somebody knows them who sends them. */
static void test_names(void **state)
{
    assert_string_equal(signal_name(SIGINT), "Ctrl-C (SIGINT)");
    assert_string_equal(signal_name(SIGTERM), "SIGTERM");
    assert_string_equal(signal_name(SIGUSR1), "SIGUSR1");
}

static void test_second_ends(void **state)
{
    for (int i = 0; i < 9; i++) {
        int status = end_after(kinds[i / 3], kinds[i % 3], 200000);
        assert_true(WIFSIGNALED(status));
        assert_int_equal(WTERMSIG(status), kinds[i % 3]);
    }
}

/* A signal that is sent to the process and to its group counts once. */
static void test_same_twice(void **state)
{
    for (int i = 0; i < 3; i++) {
        int status = end_after(kinds[i], kinds[i], 0);
        assert_true(WIFEXITED(status));
        assert_int_equal(WEXITSTATUS(status), 7);
    }
}

/* If a terminal or a pipe is closed, or a file has reached its size limit, the run goes on, and stops for the next
 * signal. */
static void test_goes_on(void **state)
{
    const int others[] = {SIGHUP, SIGPIPE, SIGXFSZ};
    for (int i = 0; i < 3; i++) {
        int status = end_after(others[i], SIGTERM, 0);
        assert_true(WIFEXITED(status));
        assert_int_equal(WEXITSTATUS(status), 8);
    }
}

/* Signals that come while ranks leave do not change the status, as everything is done; nor does a second one after one
 * that came while the picture was rendered. */
static void test_too_late(void **state)
{
    for (int i = 0; i < 6; i++) {
        int status = 0;
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0) {
            stop_install(0);
            stop_defer();
            if (i >= 3) {
                raise(SIGTERM);
                usleep(150000);
            }
            stop_watch_the_end(STATUS_DONE);
            raise(kinds[i % 3]);
            _exit(9);
        }
        assert_int_equal(waitpid(child, &status, 0), child);
        assert_true(WIFEXITED(status));
        assert_int_equal(WEXITSTATUS(status), 9);
    }
}

/* A start that is over ends no run, however long that takes. An end that takes too long is left with the run's own
 * status. */
static void test_watches(void **state)
{
    int status = 0;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        stop_watch_the_start(60);
        stop_unwatch_the_start();
        if (alarm(0) > 0) _exit(8);
        stop_watch_the_end(7);
        if (alarm(0) == 0) _exit(9);
        raise(SIGALRM);
        _exit(10);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 7);
}

/* What came while MPI started is the first signal of a run. */
static void test_held(void **state)
{
    int status = 0;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        stop_hold_signal();
        raise(SIGUSR1);
        stop_defer();
        if (*stop_signal()) _exit(8);
        stop_install(0);
        _exit(*stop_signal() == SIGUSR1 ? 7 : 9);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 7);
}

/* Seconds that it takes to see this process off. */
static double see_off(pid_t process)
{
    double start = clock_wall();
    stop_wait_for_exits(&(int){(int)process}, 1);
    return clock_wall() - start;
}

/* Nobody waits for a rank that has exited, or for the one that waits. */
static void test_seen_off_at_once(void **state)
{
    siginfo_t info;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) _exit(0);
    assert_int_equal(waitid(P_PID, (id_t)child, &info, WEXITED | WNOWAIT), 0);
    assert_true(see_off(child) < 2);
    assert_int_equal(waitpid(child, NULL, 0), child);
    assert_true(see_off(child) < 2);
    assert_true(see_off(getpid()) < 2);
}

/* A rank that is stopped is continued, so that it can exit. A process of another program, which has got the id of a
 * rank that is gone, is left alone. */
static void test_see_off_stopped(void **state)
{
    for (int other = 0; other <= 1; other++) {
        int status;
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0) {
            if (other) execlp("sh", "sh", "-c", "kill -STOP $$", (char *)NULL);
            raise(SIGSTOP);
            _exit(7);
        }
        assert_int_equal(waitpid(child, &status, WUNTRACED), child);
        assert_true(WIFSTOPPED(status));
        assert_true(see_off(child) < 4);
        if (other) {
            assert_int_equal(waitpid(child, &status, WNOHANG | WCONTINUED), 0);
            kill(child, SIGKILL);
        }
        assert_int_equal(waitpid(child, &status, 0), child);
        assert_true(other ? WIFSIGNALED(status) : WEXITSTATUS(status) == 7);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_second_ends),
        cmocka_unit_test(test_same_twice),
        cmocka_unit_test(test_goes_on),
        cmocka_unit_test(test_too_late),
        cmocka_unit_test(test_watches),
        cmocka_unit_test(test_held),
        cmocka_unit_test(test_seen_off_at_once),
        cmocka_unit_test(test_see_off_stopped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
